"""Write a trace piece by piece, to Parquet or CSV."""

from __future__ import annotations

from typing import Any

__all__ = ["Saver", "smoothed_columns", "widen"]

BLOCK = 1 << 24  # bytes of a CSV read at a time


class Saver:
    """An open Parquet or CSV file that takes tables of the same columns one after another.

    What was saved is readable after every chunk as CSV, and once closed as Parquet.
    """

    def __init__(self, path: str):
        self.path = path
        self.rows = 0
        self._writer: Any = None

    def add(self, table) -> None:
        """Append a pyarrow Table."""
        if self._writer is None:
            if self.path.lower().endswith(".csv"):
                from pyarrow import csv

                self._writer = csv.CSVWriter(self.path, table.schema)
            else:
                import pyarrow.parquet as pq

                self._writer = pq.ParquetWriter(self.path, table.schema)
        self._writer.write_table(table)
        self.rows += table.num_rows

    def close(self) -> None:
        if self._writer is not None:
            self._writer.close()


def smoothed_columns(smoothed) -> dict:
    """Return the columns that smoothing adds to a saved table."""
    n = smoothed.estimator.model.n  # none for recursive models: they have no state but the parameters
    names = [*(f"x{n - i}" for i in range(n)), *smoothed.names]
    values = [*(smoothed.x.T if n else []), *smoothed.parameters.T]
    stds = [*(smoothed.x_std.T if n else []), *smoothed.parameters_std.T]
    columns = {f"{name}_smoothed": column for name, column in zip(names, values)}
    return columns | {f"{name}_smoothed_std": column for name, column in zip(names, stds)}


def widen(path: str, columns: dict) -> None:
    """Add columns to a saved table, piece by piece, by way of a file beside it."""
    import os

    import pyarrow as pa

    beside = f"{path}.part{os.path.splitext(path)[1].lower()}"
    saver, first = Saver(beside), 0
    try:
        for piece in _pieces(path):
            table = pa.Table.from_batches([piece])
            part = slice(first, first + table.num_rows)
            for name, values in columns.items():
                table = table.append_column(name, pa.array(values[part]))
            saver.add(table)
            first = part.stop
        saver.close()
        os.replace(beside, path)
    finally:
        if os.path.exists(beside):
            os.remove(beside)


def _pieces(path):
    """Yield record batches of a saved table; NaN stays NaN."""
    if not path.lower().endswith(".csv"):
        import pyarrow.parquet as pq

        with pq.ParquetFile(path) as file:
            yield from file.iter_batches()
        return
    from pyarrow import csv

    names = csv.open_csv(path).schema.names
    types = {name: "int64" if name == "status" else "float64" for name in names}
    convert = csv.ConvertOptions(column_types=types, null_values=[""], strings_can_be_null=False)
    with csv.open_csv(path, csv.ReadOptions(block_size=BLOCK), convert_options=convert) as reader:
        yield from reader
