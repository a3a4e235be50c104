"""However a table is written, the same is read: delimiters, decimals, headers, units, labels."""

import gzip
import math
import time

import numpy as np
import pytest
from small_tables import NaN, put, read

from driftwise.engine.errors import InputError
from driftwise.tables.dialect import kind, sniff
from driftwise.tables.table import open_table

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


# --- refusals ----------------------------------------------------------------------------------------------


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


def test_a_header_longer_than_the_first_look_is_read_whole(tmp_path):
    names = [f"a_long_name_of_column_{j}" for j in range(12_000)]
    rows = "\n".join(f"{k},{(-1) ** k}," + ",".join("1" * len(names)) for k in range(3))
    record, columns, _ = read(put(tmp_path, ",".join(["y", "u", *names]) + "\n" + rows + "\n"), "y", ["u"])
    assert columns["y"].tolist() == [0, 1, 2] and len(record.source.names) == 12_002
    with pytest.raises(InputError, match=r"more than 4096 columns .* there are 12002: name the output"):
        open_table(str(tmp_path / "table.csv"))


def test_names_of_many_columns_are_made_different_in_linear_time():
    def many(columns):
        begun = time.process_time()
        found = sniff([",".join(["y"] * columns), ",".join("1" * columns)]).names
        return found, time.process_time() - begun

    (names, much), (_, little) = many(50_000), many(5_000)
    assert much < 30 * little  # a list of the columns of numbers, looked through for each, takes seventy times as long
    assert names[:3] == ("y", "y.2", "y.3") and names[-1] == "y.50000" and len(set(names)) == 50_000
    assert sniff(["y,y.2,y,y", "1,2,3,4", "1,2,3,4"]).names == ("y", "y.2", "y.3", "y.4")


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
