"""Long tables: whatever they are written in and however they are cut, the same rows in the same order."""

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.csv
import pyarrow.dataset
import pyarrow.parquet as pq
import pytest

from driftwise.engine.errors import InputError
from driftwise.tables import parquetfile
from driftwise.tables.dataset import open_dataset

N = 500
RNG = np.random.default_rng(0)
ASSETS = RNG.integers(0, 7, N) * 10
T = 1.7e9 + np.arange(N)
TABLE = pa.table({
    "t": pa.array((T * 1e3).astype("M8[ms]")), "asset": ASSETS, "note": ["x"] * N, "u": RNG.standard_normal(N),
    "y": pa.array(np.where(RNG.random(N) < 0.1, np.nan, RNG.standard_normal(N)), from_pandas=True),
})  # fmt: skip
INTS = pa.dictionary(pa.int32(), pa.int64())
ROLES = dict(by="asset", output="y", inputs=["u"], time="t")


def read(source, rows=64, skip=0, **roles):
    """Return (keys, time, ys, us, bad) of all rows, and check what holds for every batch."""
    table = open_dataset(source, **(ROLES | roles))
    batches = list(table.batches(rows, skip))
    first = skip
    for batch in batches[:-1]:
        assert batch.first == first and len(batch.codes) == rows and batch.names is batches[0].names
        assert batch.codes.dtype == np.int64 and batch.ys.flags.c_contiguous and batch.us.flags.c_contiguous
        first += rows
    assert table.fraction == 1.0
    names = batches[0].names
    met = np.concatenate([batch.codes for batch in batches])
    order = met[met >= 0]
    assert order[np.sort(np.unique(order, return_index=True)[1])].tolist() == list(range(len(names)))  # of appearance
    time = None if table.time is None else np.concatenate([batch.time for batch in batches])
    rest = (np.concatenate([getattr(batch, name) for batch in batches]) for name in ("ys", "us", "bad"))
    return [names[code] if code >= 0 else None for code in met.tolist()], time, *rest


def check(found, table=TABLE, keys=None):
    keys_found, time, ys, us, bad = found
    assert keys_found == (table["asset"].to_pylist() if keys is None else keys)
    np.testing.assert_array_equal(time, table["t"].cast(pa.int64()).to_numpy() / 1e3)
    np.testing.assert_array_equal(ys[:, 0], table["y"].to_numpy())
    np.testing.assert_array_equal(us[:, 0], table["u"].to_numpy())
    assert not bad.any()


def text_of(table):
    return table.set_column(1, "asset", table["asset"].cast(pa.string()))


SOURCES = {
    "mapping": lambda at: {name: TABLE[name].to_numpy() for name in TABLE.column_names},
    "arrow": lambda at: TABLE,
    "pandas": lambda at: TABLE.to_pandas(),
    "polars": lambda at: pl.from_arrow(TABLE),
    "one file": lambda at: write(at / "one.parquet", TABLE),
    "row groups": lambda at: write(at / "one.parquet", TABLE, row_group_size=37),
    "list": lambda at: [write(at / name, part) for name, part in zip("bac", cut(100, 333))],
    "folder": lambda at: [write(at / f"part-{i}.parquet", part) for i, part in zip((2, 9, 10), cut(1, 300))] and at,
    "dataset": lambda at: pa.dataset.dataset(SOURCES["list"](at)),
    "in memory": lambda at: pa.dataset.dataset(TABLE),
}


def write(path, table, **options):
    pq.write_table(table, path, **options)
    return str(path)


def cut(*where):
    return [TABLE.slice(a, b - a) for a, b in zip((0, *where), (*where, N))]


@pytest.mark.parametrize("source", SOURCES)
def test_every_source_gives_the_same_rows(source, tmp_path, monkeypatch):
    monkeypatch.setattr(parquetfile, "BATCH", 50)
    check(read(SOURCES[source](tmp_path)))
    check(read(SOURCES[source](tmp_path), rows=333, skip=101), TABLE.slice(101))
    check(read(SOURCES[source](tmp_path), rows=9999, skip=333), TABLE.slice(333))


def test_rows_before_skip_are_not_read(tmp_path, monkeypatch):
    path = write(tmp_path / "a.parquet", TABLE, row_group_size=50)
    groups = []
    real = pq.ParquetFile.iter_batches

    def spy(self, *args, **options):
        groups.append(options["row_groups"])
        return real(self, *args, **options)

    table = open_dataset([path, path], **ROLES)
    assert table.rows == 2 * N
    monkeypatch.setattr(pq.ParquetFile, "iter_batches", spy)
    batches = list(table.batches(100, skip=N + 149))
    assert batches[0].first == N + 149 and groups == [list(range(2, 10))]


@pytest.mark.parametrize("kind", [
    pa.int8(), pa.uint16(), pa.float64(), pa.string(), pa.large_string(), pa.string_view(),
    pa.dictionary(pa.int8(), pa.string()), INTS,
])  # fmt: skip
def test_kinds_of_keys(kind, tmp_path):
    values = pa.array([10, None, 7, 10, 3, 7, None, 100])
    are_words = "string" in str(kind)
    keys = (
        values.dictionary_encode() if kind == INTS else (values.cast(pa.string()) if are_words else values).cast(kind)
    )
    table = pa.table({"asset": keys, "y": np.arange(8.0)})
    expected = [one if one is None else str(one) if are_words else one for one in values.to_pylist()]
    for source in (table, write(tmp_path / "a.parquet", table)):
        found = read(source, 3, inputs=[], time=None)
        assert found[0] == expected and [type(a) for a in found[0]] == [type(a) for a in expected]


def test_an_empty_cell_is_no_key(tmp_path):
    (tmp_path / "a.csv").write_text("asset,y\nb,1\n,2\nc,3\n,4\n")
    words = pa.table({"asset": pa.array(["b", "", "c", ""]).dictionary_encode(), "y": np.arange(4.0)})
    for source in (tmp_path / "a.csv", words):
        assert read(source, 3, inputs=[], time=None)[0] == ["b", None, "c", None]


def test_keys_may_change_their_kind_between_files(tmp_path):
    columns = [
        pa.array([1, 2], pa.int32()), pa.array([2.0, np.nan, 0.5]), pa.array(["2", "1"]),
        pd.Categorical(["b", "2"], categories=["never", "2", "b"]), [datetime(2024, 1, 1, tzinfo=UTC)],
    ]  # fmt: skip
    tables = [pa.table({"asset": keys, "y": [1.0] * len(keys)}) for keys in columns]
    whole = [write(tmp_path / f"{i}.parquet", table) for i, table in enumerate(tables)]
    keys = read(whole, 100, inputs=[], time=None)[0]
    assert keys == [1, 2, "2", None, "0.5", "2", "1", "b", "2", "2024-01-01 00:00:00.000000Z"]


def test_folders_that_tell_the_key(tmp_path):
    for asset in np.unique(ASSETS):
        part = TABLE.filter(pa.compute.equal(TABLE["asset"], int(asset))).drop_columns("asset")
        (tmp_path / f"asset={asset}").mkdir()
        write(tmp_path / f"asset={asset}" / "part-0.parquet", part)
    (tmp_path / "asset=__HIVE_DEFAULT_PARTITION__").mkdir()
    write(tmp_path / "asset=__HIVE_DEFAULT_PARTITION__" / "p.parquet", TABLE.slice(0, 3).drop_columns("asset"))
    (tmp_path / "_SUCCESS").write_text("")
    (tmp_path / "readme.md").write_text("hello")
    keys, time, *_ = read(tmp_path)
    order = np.argsort(ASSETS, kind="stable")
    assert keys == [*ASSETS[order].tolist(), None, None, None]
    np.testing.assert_array_equal(time[:N], T[order])
    assert [path.endswith("readme.md") for path in open_dataset(tmp_path, **ROLES).passed_over] == [True]
    (tmp_path / "asset=pump%201").mkdir()
    write(tmp_path / "asset=pump%201" / "p.parquet", TABLE.slice(0, 1).drop_columns("asset"))
    assert set(read(tmp_path)[0]) == {None, "pump 1", *np.unique(ASSETS).astype(str).tolist()}


def test_csv_in_any_dialect(tmp_path):
    plain = tmp_path / "a.csv"
    pa.csv.write_csv(TABLE, plain)
    check(read(plain), keys=[str(a) for a in ASSETS])
    check(read([plain, plain], skip=N + 20), TABLE.slice(20), keys=[str(a) for a in ASSETS[20:]])
    (tmp_path / "b.csv").write_text(
        "asset;y;u;t\n007;1,5;2;31.12.2023 23:00\n7;oops;3;31.12.2023 23:01\n a ;4;5;\n1;2\n;6;1e300;nonsense\n"
        "a;7;;31.12.2023 23:02\n"
    )
    keys, time, ys, us, bad = read(tmp_path / "b.csv", rows=4)
    assert keys == ["007", "7", "a", None, None, "a"]
    assert bad.tolist() == [False, True, False, True, True, False]
    np.testing.assert_array_equal(ys[:, 0], [1.5, np.nan, 4, np.nan, 6, 7])
    np.testing.assert_array_equal(us[:, 0], [2, 3, 5, np.nan, np.nan, np.nan])
    base = datetime(2023, 12, 31, 23, tzinfo=UTC).timestamp()
    np.testing.assert_array_equal(time, [base, base + 60, np.nan, np.nan, np.nan, base + 120])


def test_clocks(tmp_path):
    def clock(column):
        table = pa.table({"asset": [1] * len(column), "y": np.arange(len(column)) * 1.0, "t": column})
        return read(table, inputs=[])[1].tolist()

    far = pa.array([datetime(2024, 1, 1), datetime(9999, 12, 31), None], pa.timestamp("us"))
    assert clock(far)[:2] == [1704067200.0, 253402214400.0] and np.isnan(clock(far)[2])
    assert clock(pa.array([5, 6], pa.int32())) == [5.0, 6.0]
    assert clock(pa.array(["2024-01-01T01:00:00+01:00", "2024-01-01 00:00:01Z"])) == [1704067200.0, 1704067201.0]
    assert clock(pa.array([0, 1], pa.date32())) == [0.0, 86400.0]
    a = write(tmp_path / "a.parquet", pa.table({"asset": [1], "y": [1.0], "t": ["2024-01-01"]}))
    b = write(tmp_path / "b.parquet", pa.table({"asset": [1], "y": [1.0], "t": [17.0]}))
    _, time, _, _, bad = read([a, b], inputs=[])
    assert time[0] == 1704067200.0 and np.isnan(time[1]) and bad.tolist() == [False, True]


def test_files_of_different_schemas(tmp_path):
    a = write(tmp_path / "a.parquet", pa.table({"y": pa.array([1, 2], pa.int16()), "asset": [1, 2]}))
    b = write(tmp_path / "b.parquet", pa.table({"asset": [2], "more": ["x"], "y": [0.5]}))
    empty = write(
        tmp_path / "c.parquet", pa.table({"asset": pa.array([], pa.int64()), "y": pa.array([], pa.float64())})
    )
    d = write(tmp_path / "d.parquet", pa.table({"asset": [3], "y": ["4.5"]}))
    keys, _, ys, *_ = read([a, empty, b, d], inputs=[], time=None)
    assert keys == [1, 2, 2, 3] and ys[:, 0].tolist() == [1.0, 2.0, 0.5, 4.5]
    e = write(tmp_path / "e.parquet", pa.table({"asset": [3], "why": [4.5]}))
    with pytest.raises(InputError, match=r"e\.parquet: no column 'y' for the output\. Did you mean 'why'\?"):
        open_dataset([a, e], "asset", "y")
    f = write(tmp_path / "f.parquet", pa.table({"asset": [3], "y": [[1.0]]}))
    with pytest.raises(InputError, match=r"f\.parquet: column 'y': a column of type list"):
        list(open_dataset([a, f], "asset", "y").batches())
    with pytest.raises(InputError, match="columns but no rows"):
        open_dataset(empty, "asset", "y")


def test_what_cannot_be_read_is_refused_with_its_name(tmp_path):
    good = write(tmp_path / "good.parquet", TABLE)
    for roles, words in [
        (dict(by="aset"), "no column 'aset' for the key. Did you mean 'asset'"),
        (dict(inputs=["y"]), "column 'y' is given two parts"),
        (dict(output="note"), "500 of the first 500 cells are not numbers"),
        (dict(time="note"), "cells are neither numbers nor time stamps"),
    ]:
        with pytest.raises(InputError, match=words):
            open_dataset(good, **(ROLES | roles))
    (tmp_path / "cut.parquet").write_bytes((tmp_path / "good.parquet").read_bytes()[:3000])
    (tmp_path / "none.parquet").write_text("asset,y\n1,2\n")
    (tmp_path / "empty").mkdir()
    for source, words in [
        (tmp_path / "cut.parquet", "cut.parquet begins like a Parquet file but cannot be read"),
        (tmp_path / "none.parquet", "none.parquet: it is called Parquet but is none"),
        (tmp_path / "god.parquet", "no such file. Did you mean .*good.parquet"),
        (tmp_path / "empty", "holds no table: .*there is nothing"),
        ([], "list of files is empty"),
        ([TABLE], "holds file names"),
        ("-", "standard input"),
        (TABLE.slice(0, 0), "no rows"),
        (TABLE.set_column(1, "asset", pa.nulls(N, pa.string())), "column 'asset' has no key in its first 500 rows"),
    ]:
        with pytest.raises(InputError, match=words):
            open_dataset(source, **ROLES)
    with pytest.raises(InputError, match="at least 1 row"):
        list(open_dataset(good, **ROLES).batches(rows=0))


def test_a_file_damaged_further_on_says_so(tmp_path):
    path = tmp_path / "a.parquet"
    write(path, TABLE, row_group_size=100, compression="zstd")
    data, at = bytearray(path.read_bytes()), pq.read_metadata(path).row_group(3).column(1).data_page_offset
    data[at : at + 200] = b"\xff" * 200
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"a\.parquet: it cannot be read to its end"):
        list(open_dataset(path, **ROLES).batches(10))


def test_units_and_progress(tmp_path):
    schema = pa.schema([pa.field("asset", pa.int64()), pa.field("y", pa.float64(), metadata={"unit": "bar"})])
    paths = [write(tmp_path / f"{i}.parquet", pa.table({"asset": [1] * 50, "y": [1.0] * 50}, schema)) for i in range(4)]
    table = open_dataset(paths, "asset", "y")
    told = [table.fraction for _ in table.batches(40)]
    assert table.units == {"y": "bar"} and told == sorted(told) and told[0] <= 0.25 and told[-1] == 1.0


def test_codes_for_a_missing_value_are_missing_however_the_table_is_cut():
    columns = {"pump": [1, 2, 1, 2], "y": [1.0, -9999.0, 3.0, 4.0], "u": [5.0, 6.0, -99.0, -9999.0]}
    for rows in (1, 3, 10):
        batches = list(open_dataset(columns, "pump", "y", "u", missing=(-9999,)).batches(rows))
        for name, values in (("ys", [1, np.nan, 3, 4]), ("us", [5, 6, -99, np.nan])):
            np.testing.assert_array_equal(np.concatenate([getattr(b, name)[:, 0] for b in batches]), values)
