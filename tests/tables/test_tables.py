"""Tables: what is read, what is counted, what is refused, and that nothing depends on how a file is cut."""

import bz2
import gzip
import io
import math
import os
import subprocess
import sys
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from driftwise.engine.errors import InputError
from driftwise.tables import autoread, checks, csvfile, growing
from driftwise.tables.cells import NAT, plain, seconds
from driftwise.tables.dataset import open_dataset
from driftwise.tables.dialect import kind, sniff
from driftwise.tables.parquetfile import MemorySource
from driftwise.tables.parts import parts_of
from driftwise.tables.record import open_record
from driftwise.tables.table import open_table

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


# --- dialects ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "t,u,y\n0,1,2.5\n1,-1,3.5\n2,0,4.5\n",
        "t;u;y\n0;1;2.5\n1;-1;3.5\n2;0;4.5\n",
        "t;u;y\n0;1;2,5\n1;-1;3,5\n2;0;4,5\n",
        "t\tu\ty\n0\t1\t2.5\n1\t-1\t3.5\n2\t0\t4.5\n",
        "t\tu\ty\n0\t1\t2,5\n1\t-1\t3,5\n2\t0\t4,5\n",
        "t|u|y\n0|1|2.5\n1|-1|3.5\n2|0|4.5\n",
        "  t   u    y\n  0   1  2.5\n  1  -1  3.5\n  2   0  4.5\n",
        "# t u y\n0 1 2.5\n1 -1 3.5\n2 0 4.5\n",
        "\ufefft,u,y\r\n0,1,2.5\r\n1,-1,3.5\r\n2,0,4.5\r\n",
        "# made by a logger\n# on a Monday\n\nt,u,y\n\n0,1,2.5\n\n1,-1,3.5\n# a pause\n2,0,4.5\n\n\n",
        '"t","u","y"\n"0","1","2.5"\n"1","-1","3.5"\n"2","0","4.5"\n',
        '"t","u","y"\n"0","1","2,5"\n"1","-1","3,5"\n"2","0","4,5"\n',
        "t , u , y\n 0 , +1 , 2.5\n1, -1.0 , 35e-1 \n2,0.,4.5",
        "sep=;\nt;u;y\n0;1;2,5\n1;-1;3,5\n2;0;4,5\n",
        "t,u,y\ns,V,degC\n0,1,2.5\n1,-1,3.5\n2,0,4.5\n",
        "Logger 7\nserial: 1234\nt,u,y\n0,1,2.5\n1,-1,3.5\n2,0,4.5\n",
        "t,u,y,\n0,1,2.5,\n1,-1,3.5,\n2,0,4.5,\n",
        "t,u,y\n0,1,2.5,,\n1,-1,3.5,,\n2,0,4.5,,\n",
        "t,u,y\r0,1,2.5\r1,-1,3.5\r2,0,4.5\r",
        "t,u,y\n0,1,2.5D0\n1,-1,3.5d+00\n2,0,0.45D1\n",
        'note,t,u,y\nok,0,1,2.5\n"a, b",1,-1,3.5\nok,2,0,4.5\n',
    ],
)
def test_one_table_in_many_dialects(tmp_path, text):
    record, columns, bad = read(put(tmp_path, text), "y", ["u"], "t")
    assert columns["t"].tolist() == [0, 1, 2]
    assert columns["u"].tolist() == [1, -1, 0]
    assert columns["y"].tolist() == [2.5, 3.5, 4.5]
    assert record.bad == record.source.ragged == 0
    assert not any(flags.any() for flags in bad.values())


def test_units_line_becomes_units(tmp_path):
    record, _, _ = read(put(tmp_path, "t,u,y\n[s],[V],[degC]\n0,1,2.5\n1,-1,3.5\n"), "y", ["u"], "t")
    assert record.source.units == {"t": "s", "u": "V", "y": "degC"}


def test_no_header_and_columns_by_number(tmp_path):
    _, columns, _ = read(put(tmp_path, "0,1,2.5\n1,-1,3.5\n"), "3", ["2"])
    assert list(columns) == ["column3", "column2"]
    assert columns["column3"].tolist() == [2.5, 3.5]


def test_header_shorter_than_the_rows_and_repeated_names():
    dialect = sniff(["Time,a,a,", "2024-01-01T00:00:00,1,2,3,4,", "2024-01-01T00:00:01,1,2,3,5,"])
    assert dialect.names == ("Time", "a", "a.2", "column4", "column5", "column6")
    assert dialect.stamps == {"Time"}


def test_numeric_column_names_are_a_header_beside_words():
    assert sniff(["time,101,102", "0,1,2", "1,3,4"]).names == ("time", "101", "102")


@pytest.mark.parametrize(
    "rows, values, unit",
    [
        (['1,"60,123.4"', '2,"1,060,123"', "3,999.5", '4,"-1,000.0"'], [60123.4, 1060123, 999.5, -1000], ""),
        (["1,60.0 %", "2,-61%", "3,", "4,6e1 %"], [60, -61, math.nan, 60], "%"),
        (['1,"1,060.5 kg"', '2,"2,060.5 kg"', '3,"3,060 kg"', '4,"4,060 lb"'], [1060.5, 2060.5, 3060, math.nan], ""),
        (['1,"1,060.5 kg"', '2,"2,060.5 kg"', '3,"3,060 kg"', "4,60 kg"], [1060.5, 2060.5, 3060, 60], "kg"),
        (["1,60.0 °C", "2,61.5 °C", "3,62.0 °C", "4,63.5 °C"], [60, 61.5, 62, 63.5], "°C"),
    ],
)
def test_marks_of_a_spreadsheet_are_no_words(tmp_path, rows, values, unit):
    path = put(tmp_path, "\n".join(["u,y", *rows]) + "\n")
    if not unit and "kg" in rows[0]:  # not the same in all cells: words
        with pytest.raises(InputError, match="units in the cells"):
            read(path)
        return
    record, columns, _ = read(path)
    np.testing.assert_array_equal(columns["y"], values)
    assert record.source.units == ({"y": unit} if unit else {})


def test_decimal_comma_only_where_no_point_was_seen():
    assert sniff(["a;b", "1,5;2,5", "3;4"]).decimal == ","
    assert sniff(["a;b", "1,500.5;2.5", "3;4"]).decimal == "."


@pytest.mark.parametrize("cell", ["", "NA", "nan", "-", "---", "null", "#N/A", " ? "])
def test_markers_of_a_missing_value(cell, tmp_path):
    assert kind(cell) == "missing"
    record, columns, _ = read(put(tmp_path, f"u,y\n1,2\n2,{cell}\n3,4\n"))
    np.testing.assert_array_equal(columns["y"], [2, NaN, 4])
    assert record.bad == 0


def test_one_column_keeps_blank_lines_as_missing(tmp_path):
    _, columns, _ = read(put(tmp_path, "y\n1\n\n3\n4\n\n\n"))
    np.testing.assert_array_equal(columns["y"], [1, NaN, 3, 4])


def test_latin1_text_and_compression(tmp_path):
    raw = "t;Temp °C;Zustand\n0;1,5;läuft\n1;2,5;läuft\n2;x;läuft\n".encode("latin-1")
    for path in (put(tmp_path, raw), put(tmp_path, gzip.compress(raw), "table.csv.gz")):
        record, columns, _ = read(path, "Temp °C", (), "t")
        np.testing.assert_array_equal(columns["Temp °C"], [1.5, 2.5, NaN])
        assert record.bad == 1


# --- bad cells and rows ------------------------------------------------------------------------------------


def test_bad_rows_are_counted_flagged_and_keep_their_place(tmp_path):
    rows = [f"{k},{k * k}" for k in range(20)]
    rows[5] = "5,broken"
    rows[8] = "8"
    rows[11] = "11,inf"
    rows[13] = "13,169,7,8"
    rows[15] = "u,y"  # a header again, where two recordings were joined
    record, columns, bad = read(put(tmp_path, "u,y\n" + "\n".join(rows) + "\n"), "y", ["u"])
    lost = [5, 8, 11, 13, 15]
    assert np.flatnonzero(bad["y"]).tolist() == lost
    assert np.flatnonzero(np.isnan(columns["y"])).tolist() == lost
    good = np.setdiff1d(np.arange(20), lost)
    assert columns["y"][good].tolist() == (good**2).tolist()
    assert np.flatnonzero(bad["u"]).tolist() == [8, 13, 15]
    assert (record.source.ragged, record.bad) == (2, 8)
    assert record.first_bad == "row 6, column 'y'"


def test_a_stray_quote_costs_one_row_at_most(tmp_path):
    rows = [f"{k},{k},ok" for k in range(200)]
    rows[50] = '50,50,5" pipe'
    rows[70] = '70,"70,ok'
    rows[90] = '90,90,"an open end'
    record, columns, _ = read(put(tmp_path, "u,y,note\n" + "\n".join(rows)))
    assert len(columns["y"]) == 200
    assert np.isnan(columns["y"]).sum() <= 1
    assert columns["y"][-1] == 199
    assert record.source.ragged <= 1


def test_a_column_of_mostly_text_is_refused(tmp_path):
    path = put(tmp_path, "u,y\n" + "".join(f"{k},state{k}\n" for k in range(9)))
    with pytest.raises(InputError, match="column 'y': 9 of the first 9 cells are not numbers"):
        list(open_record(path, "y"))


def test_numbers_beyond_all_bounds_are_called_so(tmp_path):
    path = put(tmp_path, "t,y,u\n" + "".join(f"{k},{k % 7}.5e{120 - 400 * (k % 5 == 4)},{k % 3}\n" for k in range(90)))
    said = "column 'y': most of its first 90 cells are numbers beyond 1e100"
    with pytest.raises(InputError, match=said):
        list(open_record(path, "y"))
    with pytest.raises(InputError, match=said):
        open_dataset(path, "t", "y")
    with pytest.raises(InputError, match="column 'y' has numbers beyond 1e100"):
        autoread.read(path, output="y")
    table, _ = autoread.read(path, output="u")
    assert table["y"].why == "numbers beyond 1e100"
    few = put(tmp_path, "t,y\n" + "".join(f"{k},{k % 7}.5{'e120' * (k == 3)}\n" for k in range(90)))
    record = open_record(few, "y")
    assert sum(chunk.bad for chunk in record) == 1 and not record.beyond


@settings(max_examples=60, deadline=None)
@given(
    cells=st.lists(
        st.tuples(
            st.one_of(st.floats(-1e6, 1e6), st.just(None)),
            st.one_of(st.floats(-1e6, 1e6), st.just(None), st.sampled_from(["text", "1.2.3", "inf", "1e999", "--5"])),
        ),
        min_size=3,
        max_size=60,
    ),
    delimiter=st.sampled_from([",", ";", "\t", "|"]),
    comma=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
    chunk=st.integers(1, 50),
    block=st.integers(8, 400),
)
def test_what_is_written_is_read_however_it_is_cut(tmp_path_factory, cells, delimiter, comma, newline, chunk, block):
    comma = comma and delimiter != ","
    bad = [isinstance(y, str) for _, y in cells]
    values = [NaN if y is None or isinstance(y, str) else y for _, y in cells]

    def write(value):
        text = "" if value is None else value if isinstance(value, str) else repr(value)
        return text.replace(".", ",") if comma and not isinstance(value, str) else text

    lines = [delimiter.join(["k", "u", "y"])]
    lines += [delimiter.join([str(k), write(u), write(y)]) for k, (u, y) in enumerate(cells)]
    seen = [v for v in values if v == v]
    if not seen or min(seen) == max(seen) or sum(bad) > len(seen) or all(u is None for u, _ in cells):
        return
    path = put(tmp_path_factory.mktemp("t"), newline.join(lines) + newline)
    before, csvfile.BLOCK = csvfile.BLOCK, block
    try:
        record, columns, flags = read(path, "y", ["u"], "k", chunk_rows=len(cells), raw=True)
        again, cut, _ = (
            read(path, "y", ["u"], "k", chunk_rows=chunk, raw=True) if not any(bad) else (record, columns, flags)
        )
    finally:
        csvfile.BLOCK = before
    np.testing.assert_array_equal(columns["y"], values)
    np.testing.assert_array_equal(columns["u"], [NaN if u is None else u for u, _ in cells])
    np.testing.assert_array_equal(flags["y"], bad)
    np.testing.assert_array_equal(columns["k"], np.arange(len(cells)))
    assert record.bad == sum(bad)
    np.testing.assert_array_equal(cut["y"], columns["y"])
    np.testing.assert_array_equal(cut["u"], columns["u"])
    assert again.bad == record.bad


def test_small_blocks_with_comments_quotes_and_ragged_rows(tmp_path, monkeypatch):
    rng = np.random.default_rng(3)
    lines, expected = ["k,note,y"], []
    for k in range(3000):
        draw = rng.random()
        if draw < 0.02:
            lines.append("# a remark, with commas")
        if draw > 0.98:
            lines.append("")
        if 0.4 < draw < 0.41:
            lines.append(f"{k},{k}")
            expected.append(NaN)
        else:
            note = '"two\nlines, quoted"' if 0.5 < draw < 0.52 else "x"
            lines.append(f"{k},{note},{k / 8}")
            expected.append(k / 8)
    path = put(tmp_path, "\n".join(lines))
    monkeypatch.setattr(csvfile, "HEAD", 500)
    for block in (200, 1000, 10**6):
        monkeypatch.setattr(csvfile, "BLOCK", block)
        record, columns, _ = read(path)
        np.testing.assert_array_equal(columns["y"], expected)
        assert record.source.ragged == np.isnan(expected).sum()


def test_chunks_have_exactly_the_rows_asked_for(tmp_path):
    path = put(tmp_path, "y\n" + "\n".join(map(str, range(1003))))
    chunks = list(open_record(path, "y", chunk_rows=100))
    assert [c.rows for c in chunks] == [100] * 10 + [3]
    assert [c.first_row for c in chunks] == list(range(0, 1003, 100))


# --- Parquet -----------------------------------------------------------------------------------------------


def parquet(tmp_path, columns, **options):
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = str(tmp_path / "table.parquet")
    pq.write_table(pa.table(columns), path, **options)
    return path


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


# --- time --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "stamps",
    [
        ["2024-03-01T12:00:00", "2024-03-01T12:00:00.5", "2024-03-01T12:00:01"],
        ["2024-03-01 12:00:00", "2024-03-01 12:00:00.5", "2024-03-01 12:00:01"],
        ["2024-03-01T12:00:00Z", "2024-03-01T12:00:00.5Z", "2024-03-01T12:00:01Z"],
        ["2024-03-01T12:00:00+02:00", "2024-03-01T12:00:00.5+02:00", "2024-03-01T11:00:01+01:00"],
        ["10", "10.5", "11"],
    ],
)
def test_time_as_stamps_or_numbers(tmp_path, stamps):
    record, columns, _ = read(
        put(tmp_path, "t,y\n" + "".join(f"{s},{k}\n" for k, s in enumerate(stamps))), "y", (), "t"
    )
    first = 10 if stamps[0] == "10" else 0
    np.testing.assert_allclose(columns["t"], [first, first + 0.5, first + 1], atol=1e-9)
    assert record.clock.dt == 0.5
    assert record.clock.notes() == []


def test_parquet_time_stamps(tmp_path):
    stamps = np.datetime64("2024-01-01T00:00:00", "us") + np.arange(5) * np.timedelta64(250, "ms")
    record, columns, _ = read(parquet(tmp_path, {"t": stamps, "y": np.arange(5.0)}), "y", (), "t", chunk_rows=2)
    np.testing.assert_allclose(columns["t"], np.arange(5) * 0.25, atol=1e-12)
    assert record.clock.origin == "2024-01-01T00:00:00"


def test_duplicate_and_decreasing_stamps_are_counted_across_chunks(tmp_path):
    times = [0, 1, 2, 2, 3, 4, 3, 4, 5, 9, 10]
    path = put(tmp_path, "t,y\n" + "".join(f"{t},{k}\n" for k, t in enumerate(times)))
    for chunk_rows in (2, 3, 100):
        record, columns, _ = read(path, "y", (), "t", chunk_rows=chunk_rows)
        clock = record.clock
        assert (clock.duplicates, clock.first_duplicate) == (1, 3)
        assert (clock.decreases, clock.first_decrease) == (1, 6)
        assert clock.gaps == 1
        assert columns["t"].tolist() == times
        assert "first at row 7" in clock.notes()[0]
        assert "first at row 4" in clock.notes()[1]


@pytest.mark.parametrize("chunk", [50, 1000])
def test_codes_for_a_missing_value_are_missing_unless_asked_for(tmp_path, chunk):
    y = 20 + np.round(np.random.default_rng(0).standard_normal(200), 3)
    y[[7, 120]] = -9999
    path = put(tmp_path, "y\n" + "\n".join(map(str, y)) + "\n")
    record, columns, _ = read(path, chunk_rows=chunk)
    assert np.flatnonzero(np.isnan(columns["y"])).tolist() == [7, 120]
    assert "2 values of 'y' are -9999" in record.code_notes()[0]
    record, columns, _ = read(path, raw=True)
    assert columns["y"].tolist() == y.tolist() and not record.code_notes()


def test_missing_stamps_are_filled(tmp_path):
    text = "t,y\n,0\n1,1\n2,2\n,3\n,4\n5,5\nrubbish,6\n"
    for chunk_rows in (100, 3):
        record, columns, _ = read(put(tmp_path, text), "y", (), "t", chunk_rows=chunk_rows)
        assert columns["t"].tolist() == [0, 1, 2, 3, 4, 5, 6]
        assert record.clock.missing == 4


def test_a_batch_of_empty_stamps_is_missing(tmp_path, monkeypatch):
    monkeypatch.setattr(csvfile, "BLOCK", 40)
    monkeypatch.setattr(csvfile, "HEAD", 60)
    rows = [f"2024-01-01T00:00:{k:02d},{k}" if not 20 <= k < 40 else f",{k}" for k in range(60)]
    record, columns, _ = read(put(tmp_path, "t,y\n" + "\n".join(rows)), "y", (), "t")
    assert columns["t"].tolist() == list(range(60))
    assert record.clock.missing == 20


# --- refusals ----------------------------------------------------------------------------------------------


def test_unknown_column_suggests_and_lists(tmp_path):
    path = put(tmp_path, "time,heater_V,temp_degC\n0,1,2\n1,2,3\n")
    with pytest.raises(InputError) as caught:
        open_record(path, "temp_degc", ["heater"])
    assert "no column 'temp_degc' for the output. Did you mean 'temp_degC'" in str(caught.value)
    assert "time, heater_V, temp_degC" in str(caught.value)
    with pytest.raises(InputError, match="two parts to play"):
        open_record(path, "temp_degC", ["temp_degC"])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\n \n\r\n", "is empty"),
        (b"u,y\n", "a header but no rows"),
        (b"# nothing\n# at all\n", "every line is blank or a comment"),
        (b"u,y\n1,\n2,NA\n3,-\n", "column 'y' is empty in all 3 rows"),
        (b"u,y\n1,5\n2,5\n3,5\n", "output column 'y' is 5 in all 3 rows: a constant"),
        (b"u,y\n1,5\n", "in its only row"),
        ("u,y\n1,2\n".encode("utf-16"), "UTF-16"),
        (b"PK\x03\x04\x00\x00", "Excel workbook"),
        (b"\x00\x01\x02" * 50, "zero bytes"),
    ],
)
def test_useless_files_say_why(tmp_path, content, words):
    path = put(tmp_path, content)
    with pytest.raises(InputError, match=words) as caught:
        list(open_record(path, "y"))
    assert str(caught.value).startswith(path), "the message names the file"
    assert "\n" not in str(caught.value), "one paragraph"


def test_an_input_that_is_empty_is_refused_and_a_constant_one_is_not(tmp_path):
    with pytest.raises(InputError, match="column 'u' is empty"):
        read(put(tmp_path, "u,y\n,1\n,2\n"), "y", ["u"])
    read(put(tmp_path, "u,y\n3,1\n3,2\n"), "y", ["u"])


def test_missing_file_and_folder(tmp_path):
    put(tmp_path, "y\n1\n2\n", "plant.csv")
    with pytest.raises(InputError, match=r"no such file. Did you mean .*plant\.csv"):
        open_record(str(tmp_path / "plan.csv"), "y")
    with pytest.raises(InputError, match="is a folder"):
        open_record(str(tmp_path), "y")
    with pytest.raises(InputError, match="no folder"):
        open_record(str(tmp_path / "away" / "x.csv"), "y")


def test_an_output_that_starts_late_is_waited_for(tmp_path, monkeypatch):
    path = put(tmp_path, "u,y\n" + "".join(f"{k},{'' if k < 500 else k}\n" for k in range(1000)))
    chunks = list(open_record(path, "y", chunk_rows=64))
    assert sum(c.rows for c in chunks) == 1000
    monkeypatch.setattr(checks, "PATIENCE", 256)
    with pytest.raises(InputError, match="empty in its first 256 rows"):
        list(open_record(path, "y", chunk_rows=64))


def test_standard_input(monkeypatch):
    class Trickle(io.RawIOBase):
        """A pipe that hands over a few bytes at a time."""

        def __init__(self, data):
            self.data = data

        def readable(self):
            return True

        def read(self, size=-1):
            part, self.data = self.data[: min(7, size)], self.data[min(7, size) :]
            return part

    class Stdin:
        buffer = Trickle(b"u,y\n" + b"".join(b"%d,%d\n" % (k, k * k) for k in range(50)))

    monkeypatch.setattr(sys, "stdin", Stdin)
    record, columns, _ = read("-")
    assert columns["y"].tolist() == [k * k for k in range(50)]
    assert record.source.fraction is None


@pytest.mark.parametrize(
    "text",
    [
        '"time" "u" "y"\n"1" 0 1 2.5\n"2" 1 -1 3.5\n"3" 2 1 4.5\n',  # R: write.table(d)
        "time u y\n1 0 1 2.5\n2 1 -1 3.5\n3 2 1 4.5\n",  # R: write.table(d, quote = FALSE)
        '"time","u","y"\n"1",0,1,2.5\n"2",1,-1,3.5\n"3",2,1,4.5\n',  # R: write.table(d, sep = ",")
        "time,u,y\na,0,1,2.5\nb,1,-1,3.5\nc,2,1,4.5\n",  # rows with names
    ],
)
def test_rows_with_labels_that_the_header_does_not_name(tmp_path, text):
    _, columns, _ = read(put(tmp_path, text), "y", ["u"], "time")
    assert columns["y"].tolist() == [2.5, 3.5, 4.5]
    assert columns["u"].tolist() == [1, -1, 1]
    assert columns["time"].tolist() == [0, 1, 2]


def test_labels_are_known_from_their_first_column_on_however_few_the_names(tmp_path):
    assert sniff(["u,y,", "1,2.5,", "2,3.5,"]).names == ("u", "y", "column3")  # nothing stands to the right
    assert sniff(["u,y", "0.5,2.5,calm", "0.7,3.5,storm"]).names == ("u", "y", "column3")
    assert sniff(["u,y", '"1",2.5,3.5']).names == ("column1", "u", "y")  # one row is enough


@pytest.mark.parametrize(
    "text, words",
    [
        (
            "time,u,y\n0,1,5,2,25\n1,1,5,3,25\n3,1,7,4,75\n",
            r"names 3 columns \(time, u, y\), .*5 cells.*Decimal commas",
        ),
        ("time,u,y\n0,5.5,2,25\n1,1.5,3,25\n2,0.7,4,75\n", "names 3 columns.*a cell for each column"),
        ("u,y\n0.5,2.5,7.5\n0.4,3.5,8.5\n0.7,4.5,8\n", "names 2 columns.*a cell for each column"),
    ],
)
def test_a_header_that_fits_no_column_for_certain_is_refused(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read(put(tmp_path, text), "y", ["u"])


@pytest.mark.parametrize("year", ["9999-12-31", "0001-01-01", "1677-01-01", "2262-12-31"])
def test_a_date_beyond_what_nanoseconds_count_is_no_time_stamp(tmp_path, year):
    """Many a data base writes 9999-12-31 for no date."""
    import pyarrow as pa

    days = ["2024-01-01", "2024-01-02", year, "2024-01-04"]
    for unit in ("s", "ms", "us"):
        told = pa.array(np.array(days, f"datetime64[{unit}]"), pa.timestamp(unit))
        values, bad, is_stamp = seconds(told)
        assert is_stamp and bad.tolist() == [False, False, True, False] and values[2] == NAT
        assert np.diff(values[[0, 1, 3]]).tolist() == [86_400 * 10**9, 2 * 86_400 * 10**9]
    whole = seconds(pa.array(np.array(days, "datetime64[D]"), pa.date32()))
    assert whole[1].tolist() == [False, False, True, False]
    text = "time,u,y\n" + "".join(f"{day} 00:00:00,{(-1) ** k},{k}\n" for k, day in enumerate(days))
    record, columns, _ = read(put(tmp_path, text), "y", ["u"], "time")
    assert columns["time"].tolist() == [k * 86_400.0 for k in range(4)]  # filled in, as any that is missing
    assert record.bad == 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("content, y", [(b"u,y\n1,2.5\n-1,3.5\n", [2.5, 3.5]), (b"PAR1" + bytes(60), None)])
def test_a_named_pipe_is_read_once_from_its_beginning(tmp_path, content, y):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=lambda: path.write_bytes(content))
    writer.start()
    if y is None:
        with pytest.raises(InputError, match="give the file itself"):
            read(str(path), "y", ["u"])
    else:
        record, columns, _ = read(str(path), "y", ["u"])
        assert columns["y"].tolist() == y and record.source.fraction is None
    writer.join(10.0)
    assert not writer.is_alive()
    with pytest.raises(InputError, match=r"pipe will not do, give a file"):
        parts_of(str(path))


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


@pytest.mark.parametrize("ragged", ["3,é", "3,1,2.5,4,é", "3,1,2.5,é"])
def test_a_ragged_row_of_latin_letters_is_counted_without_a_traceback(tmp_path, monkeypatch, ragged):
    raised = []
    monkeypatch.setattr(sys, "unraisablehook", raised.append)
    rows = [f"{k},{(-1) ** k},{k / 2}" for k in range(6)]
    text = "\n".join(["time,u,y", *rows[:3], ragged, *rows[4:]]) + "\n"
    record, columns, _ = read(put(tmp_path, text.encode("latin-1")), "y", ["u"])
    assert not raised
    assert np.isnan(columns["y"][3]) and columns["y"][4] == 2.0 and len(columns["y"]) == 6
    assert record.source.ragged == 1


def test_a_header_longer_than_the_first_look_is_read_whole(tmp_path):
    names = [f"a_long_name_of_column_{j}" for j in range(12_000)]
    rows = "\n".join(f"{k},{(-1) ** k}," + ",".join("1" * len(names)) for k in range(3))
    record, columns, _ = read(put(tmp_path, ",".join(["y", "u", *names]) + "\n" + rows + "\n"), "y", ["u"], look=100)
    assert columns["y"].tolist() == [0, 1, 2] and len(record.source.names) == 12_002
    with pytest.raises(InputError, match=r"more than 4096 columns .* there are 12002: name the output"):
        open_table(str(tmp_path / "table.csv"))


def test_names_of_many_columns_are_made_different_in_linear_time():
    names = sniff([",".join(["y"] * 50_000), ",".join("1" * 50_000)]).names
    assert names[:3] == ("y", "y.2", "y.3") and names[-1] == "y.50000" and len(set(names)) == 50_000
    assert sniff(["y,y.2,y,y", "1,2,3,4", "1,2,3,4"]).names == ("y", "y.2", "y.3", "y.4")


def test_a_line_without_an_end_is_refused_and_not_held_in_memory(monkeypatch):
    monkeypatch.setattr(growing, "LONGEST_LINE", 1 << 20)

    class Endless:
        taken = 0

        def __init__(self, head):
            self.head = head

        def read(self, size):
            head, self.head = self.head[:size], self.head[size:]
            self.taken += size
            return head + b"1" * (size - len(head))

    for head in (b"1", b"u,y\n" + b"1,2\n" * 100_000 + b"1"):
        stream = Endless(head)
        with pytest.raises(InputError, match="line is longer than 1 MiB"):
            list(csvfile.CsvSource(stream).batches(["y"] if b"y" in head else ["column1"]))
        assert stream.taken < 1 << 24


@pytest.mark.parametrize("cells, decimal", [
    (["\u22121.5", "2.5", "\u22121e\u22123", "-4"], "."),
    (["(1.5)", "2.5", "(.001)", "( 4 )"], "."),
    (["1.5-", "2.5", ".001-", "4-"], "."),
    (["1,5-", "2,5", "(0,001)", "\u22124"], ","),
])  # fmt: skip
def test_minus_however_it_is_written(tmp_path, cells, decimal):
    delimiter = ";" if decimal == "," else ","
    text = delimiter.join("uy") + "\n" + "".join(f"{k}{delimiter}{cell}\n" for k, cell in enumerate(cells))
    record, columns, _ = read(put(tmp_path, text), "y", ["u"])
    assert columns["y"].tolist() == [-1.5, 2.5, -0.001, -4.0] and record.bad == 0


def test_what_looks_like_minus_and_is_none():
    assert [kind(cell) for cell in ("(a)", "1-2", "()", "(-)", "--1", "1--", "-", "\u2212")] == ["text"] * 6 + [
        "missing"
    ] * 2
    assert [kind(cell) for cell in ("2024-01-01", "(1.5)", "1.5-", "\u22121,5")] == [
        "stamp",
        "number",
        "number",
        "comma",
    ]


@pytest.mark.parametrize("kind", ["gz", "bz2", "parquet"])
def test_a_table_that_breaks_off_on_the_way_is_told_by_its_name(tmp_path, kind):
    rng = np.random.default_rng(1)
    path, values = tmp_path / f"t.csv.{kind}", rng.standard_normal(4000)
    text = "y\n" + "".join(f"{v}\n" for v in values)
    if kind == "parquet":
        pq.write_table(pa.table({"y": values}), path, compression="none")
        content = bytearray(path.read_bytes())
        content[4:40] = b"\xff" * 36
    else:
        content = {"gz": gzip, "bz2": bz2}[kind].compress(text.encode())[:-30]
    path.write_bytes(content)
    with pytest.raises(InputError, match=f"t.csv.{kind}: it cannot be read to its end"):
        for _ in open_record(str(path), "y"):
            pass


def test_what_unpacks_to_one_endless_line_is_told_by_its_name(tmp_path):
    path = put(tmp_path, gzip.compress(b"t,y\n1,2\n" + b"\n" * (70 << 20), 1), "t.csv.gz")
    with pytest.raises(InputError, match=r"t\.csv\.gz: a line is longer"):
        for _ in open_record(path, "y"):
            pass


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
