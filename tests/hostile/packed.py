"""Containers of tables that are not what they say: compressed, cut, wrapped twice, Parquet of odd types, workbooks."""

from __future__ import annotations

import bz2
import datetime as dt
import decimal
import gzip
import io
import lzma
import zipfile

import numpy as np


def wrapped(data: bytes, rng) -> tuple[str, bytes]:
    """Return an ending and the bytes of a table under it: mostly as they are."""
    which = int(rng.integers(30))
    cut = int(rng.integers(1, 40))
    return {
        0: (".csv.gz", gzip.compress(data, 1)),
        1: (".csv.gz", gzip.compress(data, 1)[:-cut]),
        2: (".csv.gz", gzip.compress(data, 1) + b"garbage"),
        3: (".gz", data),
        4: (".csv", gzip.compress(data, 1)),
        5: (".csv.gz", gzip.compress(gzip.compress(data, 1), 1)),
        6: (".csv.bz2", bz2.compress(data, 1)[: -cut if rng.random() < 0.5 else None]),
        7: (".xz", lzma.compress(data, preset=0)),
        8: (".parquet", data),
        9: (".xlsx", workbook(data)),
    }.get(which, (str(rng.choice([".csv", ".txt", ".tsv", ".dat", ".CSV", "", ".json"])), data))


def workbook(data: bytes) -> bytes:
    """Return a zip archive with a table in it, as a spreadsheet program would never write one."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as file:
        file.writestr("xl/worksheets/sheet1.xml", b"<worksheet>" + data)
    return held.getvalue()


def bomb(kind: str, size: int) -> bytes:
    """Return a small file that unpacks to ``size`` bytes of one line, of zeros, or of rows."""
    block = {"line": b"1,", "zeros": b"\0\0", "blank": b"\n\n", "quote": b'"\n', "comment": b"#\n"}[kind] * (1 << 20)
    held = io.BytesIO()
    with gzip.GzipFile(fileobj=held, mode="wb", compresslevel=1) as file:
        file.write(b"t,u,y\n1,2,3\n" if kind != "zeros" else b"")
        for _ in range(max(1, size // len(block))):
            file.write(block)
    return held.getvalue()


def parquet(rng) -> bytes:
    """Return a Parquet file of odd types, names and sizes; one of three damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = int(rng.choice([0, 1, 40, 200]))
    columns = {"t": pa.array(np.arange(rows, dtype=float)), "u": pa.array(rng.standard_normal(rows))}
    columns["y"] = pa.array(np.cumsum(rng.standard_normal(rows)))
    names, arrays = list(columns), list(columns.values())
    for at in rng.integers(0, 3, int(rng.integers(1, 3))):
        arrays[at] = ODD[int(rng.integers(len(ODD)))](rng, rows)
    if rng.random() < 0.2:
        names[int(rng.integers(3))] = str(
            rng.choice(["y", "", "\x1b[31m", "=1+1", "<script>pwn()</script>", "a.b", "t" * 9999])
        )
    held = io.BytesIO()
    how = str(rng.choice(["snappy", "gzip", "zstd", "none"]))
    pq.write_table(pa.Table.from_arrays(arrays, names=names), held, compression=how, row_group_size=max(1, rows // 3))
    data = bytearray(held.getvalue())
    if rng.random() < 0.33:
        for _ in range(int(rng.integers(1, 20))):
            data[int(rng.integers(4, len(data)))] = int(rng.integers(256))
    return bytes(data[: int(rng.integers(len(data)))] if rng.random() < 0.1 else data)


def _typed(kind, value):
    def make(rng, rows):
        import pyarrow as pa

        return pa.array([value(i) for i in range(rows)], kind(pa))

    return make


ODD = [
    _typed(lambda pa: pa.null(), lambda i: None),
    _typed(lambda pa: pa.bool_(), lambda i: i % 2 == 0),
    _typed(lambda pa: pa.uint64(), lambda i: 2**64 - 1 - i),
    _typed(lambda pa: pa.int64(), lambda i: -(2**63) + i),
    _typed(lambda pa: pa.float64(), lambda i: [float("nan"), float("inf"), 1e308, -0.0, 5e-324][i % 5]),
    _typed(lambda pa: pa.float32(), lambda i: float(i) if i % 3 else None),
    _typed(lambda pa: pa.float16(), lambda i: np.float16(i)),
    _typed(lambda pa: pa.decimal128(38, 10), lambda i: decimal.Decimal(i) * 10**20),
    _typed(lambda pa: pa.string(), lambda i: ["1,5", "x", "", "2024-01-01", "\x1b[2J"][i % 5]),
    _typed(lambda pa: pa.binary(), lambda i: bytes([i % 256, 0, 255])),
    _typed(lambda pa: pa.dictionary(pa.int8(), pa.string()), lambda i: f"level {i % 3}"),
    _typed(lambda pa: pa.list_(pa.float64()), lambda i: [1.0] * (i % 3)),
    _typed(lambda pa: pa.struct([("y", pa.float64())]), lambda i: {"y": 1.0 * i}),
    _typed(lambda pa: pa.map_(pa.string(), pa.float64()), lambda i: [("a", 1.0)]),
    _typed(lambda pa: pa.date32(), lambda i: dt.date(9999, 12, 31) if i == 3 else dt.date(2024, 1, 1)),
    _typed(
        lambda pa: pa.timestamp("us", "Europe/Paris"), lambda i: dt.datetime(9999 if i == 2 else 2024, 3, 31, 2, i % 60)
    ),
    _typed(lambda pa: pa.timestamp("s"), lambda i: 9 * 10**15 if i == 1 else i),
    _typed(lambda pa: pa.timestamp("ns"), lambda i: -(2**63) + 1 + i),
    _typed(lambda pa: pa.duration("us"), lambda i: 10**6 * i),
    _typed(lambda pa: pa.time64("us"), lambda i: i),
    _typed(lambda pa: pa.large_string(), lambda i: f"{i}.5"),
]
