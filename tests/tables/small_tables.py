"""Tables written into a folder and read back whole, for tests."""

import math

import numpy as np

from driftwise.tables.record import open_record

NaN = math.nan


def put(tmp_path, content, name="table.csv"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return str(path)


def read(path, output="y", inputs=(), time=None, **options):
    record = open_record(path, output, inputs, time, **options)
    chunks = list(record)
    columns = {name: np.concatenate([c.columns[name] for c in chunks]) for name in record.columns}
    bad = {name: np.concatenate([c.bad_cells[name] for c in chunks]) for name in record.columns}
    return record, columns, bad


def parquet(tmp_path, columns, **options):
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = str(tmp_path / "table.parquet")
    pq.write_table(pa.table(columns), path, **options)
    return path
