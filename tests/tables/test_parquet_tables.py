"""Parquet and Arrow: types, columns, row groups, names, memory, missing numbers."""

import math
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest
from small_tables import NaN, parquet, put, read

from driftwise.engine.errors import InputError
from driftwise.tables.cells import plain
from driftwise.tables.parquetfile import MemorySource
from driftwise.tables.record import open_record

# --- Parquet -----------------------------------------------------------------------------------------------


def test_parquet_types_and_column_selection(tmp_path):
    import pyarrow as pa

    columns = {
        "f": pa.array([1.0, None, NaN, math.inf]),
        "i": pa.array([1, 2, None, 4], pa.int16()),
        "b": pa.array([True, False, None, True]),
        "s": pa.array(["1.5", "x", None, "2"]),
        "d": pa.array(["1", "2", "1", None]).dictionary_encode(),
        "g": pa.array([1, 2, 3, 4], pa.float32()),
        "other": pa.array([{"a": 1}] * 4),
    }
    path = parquet(tmp_path, columns)
    record, found, bad = read(path, "g", ["f", "i", "b", "s", "d"])
    np.testing.assert_array_equal(found["f"], [1, NaN, NaN, NaN])
    np.testing.assert_array_equal(found["i"], [1, 2, NaN, 4])
    np.testing.assert_array_equal(found["b"], [1, 0, NaN, 1])
    np.testing.assert_array_equal(found["s"], [1.5, NaN, NaN, 2])
    np.testing.assert_array_equal(found["d"], [1, 2, 1, NaN])
    assert bad["f"].tolist() == [False, False, False, True]
    assert bad["s"].tolist() == [False, True, False, False]
    assert (record.source.rows, record.bad) == (4, 2)
    with pytest.raises(InputError, match=r"column .other.: a column of type struct"):
        read(path, "other")


def test_parquet_row_groups_do_not_show(tmp_path):
    y = np.arange(1000.0)
    _, found, _ = read(parquet(tmp_path, {"y": y}, row_group_size=37), chunk_rows=100)
    np.testing.assert_array_equal(found["y"], y)


def test_memory_does_not_grow_with_the_file(tmp_path):
    import pyarrow as pa

    path = parquet(tmp_path, {"y": np.random.default_rng(0).standard_normal(2_000_000)}, row_group_size=2_000_000)
    before, peak = pa.total_allocated_bytes(), 0
    for _ in open_record(path, "y"):
        peak = max(peak, pa.total_allocated_bytes() - before)
    assert peak < 6e6, "a row group of 16 MB must not be held as a whole"


def test_broken_parquet_says_so(tmp_path):
    with pytest.raises(InputError, match="cut short"):
        open_record(put(tmp_path, b"PAR1" + bytes(100), "x.parquet"), "y")


# --- refusals ----------------------------------------------------------------------------------------------


def test_columns_of_one_name_are_told_apart_in_parquet_as_in_text(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [
        pa.array([0.0, 1.0, 2.0]),
        pa.array([1.0, -1.0, 1.0]),
        pa.array([5.0, 6.0, 8.0]),
        pa.array([9.0, 7.0, 3.0]),
    ]
    table = pa.table(arrays, names=["t", "y", "u", "y"])
    pq.write_table(table, tmp_path / "twice.parquet")
    text = "t,y,u,y\n0,1,5,9\n1,-1,6,7\n2,1,8,3\n"
    for data in (str(tmp_path / "twice.parquet"), put(tmp_path, text)):
        for output, values in (("y", [1, -1, 1]), ("y.2", [9, 7, 3]), ("4", [9, 7, 3])):
            _, columns, _ = read(data, output, ["u"], "t")
            assert columns[output if output != "4" else "y.2"].tolist() == values
            assert columns["u"].tolist() == [5, 6, 8]
    source = MemorySource(table)
    assert source.names == ("t", "y", "u", "y.2")
    assert next(source.batches(["y.2"]))[0][0].to_pylist() == [9, 7, 3]
    pandas = pytest.importorskip("pandas")
    with pytest.raises(InputError, match="different names"):
        MemorySource(pandas.DataFrame([[0.0, 1.0], [1.0, 2.0]], columns=["y", "y"]))


def test_a_table_of_numbers_is_read_without_pandas(tmp_path):
    """Which pyarrow loads on its own, where it is installed: half a second, and a Ctrl-C meanwhile is lost."""
    path = put(tmp_path, "t,y\n0,1.5\n1,\n3,4\n")
    program = (
        "import sys\nfrom driftwise.tables.record import open_record\n"
        f"chunks = list(open_record({path!r}, 'y', time='t'))\n"
        "print(chunks[0].columns['y'].tolist(), 'pandas' in sys.modules)"
    )
    out = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[1.5, nan, 4.0] False"


@pytest.mark.parametrize("kind", [pa.float64(), pa.int64(), pa.bool_()])
@pytest.mark.parametrize("cut", [slice(0, 9), slice(3, 8), slice(2, 2)])
@pytest.mark.parametrize("is_chunked", [False, True])
def test_plain_is_what_to_numpy_is(kind, cut, is_chunked):
    column = pa.array([0, 1, 1, 0, 1, 1, 0, 0, 1]).cast(kind)[cut.start : cut.stop]
    column = pa.chunked_array([column, column]) if is_chunked else column
    found = plain(column)
    np.testing.assert_array_equal(found, column.to_numpy(zero_copy_only=False), strict=True)


def test_plain_has_nan_where_a_number_is_missing():
    np.testing.assert_array_equal(plain(pa.array([None, 1.0, None, 2.0])[1:]), [1.0, NaN, 2.0], strict=True)
