"""Which column is what: whole words, units, copies and sums, calendars; dates of every kind."""

from __future__ import annotations

import sys
from datetime import datetime, timedelta
from pathlib import Path
from subprocess import run

import numpy as np
import pyarrow as pa
import pytest

from driftwise.tables.autoread import read
from driftwise.tables.cells import kind_of, seconds
from driftwise.tables.column_roles import _kinds, parse
from driftwise.tables.derived import derived, is_part
from driftwise.tables.recognise import recognise
from driftwise.tables.sampling import LATE
from driftwise.tables.vocabulary import WORDS

rng = np.random.default_rng(4)


def plant(samples=400, inputs=1):
    """Return the output of a plant of order one, and its inputs (T, k)."""
    draw = np.random.default_rng(2)
    u = np.repeat(draw.normal(size=(samples // 4 + 1, inputs)), 4, axis=0)[:samples]
    y = np.zeros(samples)
    for k in range(1, samples):
        y[k] = 0.8 * y[k - 1] + u[k - 1].sum()
    return y + 0.02 * draw.normal(size=samples), u


@pytest.mark.parametrize(
    "name, sign",
    [
        ("drivers", 0), ("DriversKilled", 0), ("petition", 0), ("ch4", 0), ("tag104", 0), ("inner", 0),
        ("Heizleistung [W]", -1), ("Außentemperatur [°C]", -1), ("température extérieure", -1),
        ("tension moteur [V]", -1), ("fan speed", -1), ("outdoor temp", -1), ("zawór", -1), ("motor voltage [V]", -1),
        ("discharge current [A]", -1),
        ("pump pressure", 1), ("Raumtemperatur", 1), ("débit sortie", 1), ("strip tension [N]", 1), ("temperatures", 1),
        ("T_supply [degC]", 1), ("pH", 1), ("waterstand", 1), ("Füllstand", 1),
    ],
)  # fmt: skip
def test_words_count_as_a_whole_in_nine_languages(name, sign):
    assert np.sign(parse(name).score) == sign, parse(name)


def test_a_unit_speaks_where_the_words_are_silent():
    assert parse("S1 [rpm]").score > 0 > parse("X1 [Nm]").score
    assert parse("Q1", "W").score < 0 < parse("T1", "°C").score


def test_every_word_of_the_vocabulary_is_plain():
    for kind, words in WORDS.items():
        for word in words.split():
            bare = word.strip("~")
            assert bare.isascii() and bare == bare.lower() and kind in _kinds(bare), word


def test_copies_scaled_shifted_and_summed():
    a, b, c = rng.normal(size=(3, 300))
    total = np.round(a + 100 * b, 6)
    found = derived(
        {
            "a": a,
            "b": 100 * b,
            "c": c,
            "a in F": 32 + 1.8 * a,
            "again": a.copy(),
            "total": total,
            "late": np.roll(c, 1),
        },
        {"total": -5.0},
    )
    assert found == {
        "a in F": "'a' in another unit",
        "again": "the same as 'a'",
        "total": "the sum of 'a' and 'b'",
        "late": "'c' 1 row later",
    }
    assert not derived({"a": a, "b": a + 0.01 * b, "c": c}, {})


@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e200])
def test_copies_of_any_size(size):
    a, b = np.round(1000 * rng.normal(size=(2, 300)))
    assert not derived({"a": size * a, "b": b}, {})
    assert derived({"a": a, "b": size * a}, {}) == {"b": "'a' in another unit"}


def test_of_a_column_and_what_it_was_a_row_before_the_first_is_the_signal():
    a = rng.normal(size=300)
    assert list(derived({"previous": np.concatenate((a[:1], a[:-1])), "now": a}, {})) == ["previous"]


def test_a_copy_is_neither_the_output_nor_its_input():
    y, u = plant(inputs=2)
    columns = {"level copy": y, "level previous": np.concatenate((y[:1], y[:-1])), "valve": u[:, 0], "pump": u[:, 1]}
    table = recognise({**columns, "level": y, "total": u.sum(axis=1), "level [mm]": 1000 * y})
    assert (table.output, set(table.inputs)) == ("level", {"valve", "pump"})
    assert table["total"].why == "the sum of 'valve' and 'pump'"


def test_a_pulse_that_is_part_of_the_voltage_is_no_second_input():
    draw = np.random.default_rng(5)
    pulse = np.repeat(draw.integers(0, 2, 40) * 5.0, 25)
    voltage = np.convolve(draw.normal(size=1000), np.ones(50) / 5, "same") + pulse
    y = np.zeros(1000)
    for k in range(1, 1000):
        y[k] = 0.9 * y[k - 1] + voltage[k - 1]
    assert is_part(pulse, voltage) and not is_part(voltage, pulse)
    table = recognise({"pulse command [V]": pulse, "motor command [V]": voltage, "position": y})
    assert table.inputs == ("motor command [V]",) and "contained in" in table["pulse command [V]"].why


def test_two_values_are_an_input_and_not_the_output():
    y, _ = plant()
    switch = (np.arange(400) // 20 % 2) * 1.0
    for k in range(1, 400):
        y[k] = 0.8 * y[k - 1] + switch[k - 1]
    assert recognise({"a": y, "b": switch}).output == "a"


def test_an_output_like_the_output_is_no_input():
    y, u = plant()
    other = np.concatenate((y[3:], y[:3])) + 0.1 * rng.normal(size=400)
    assert recognise({"pos1": y, "pos2": other, "ref1": u[:, 0]}).inputs == ("ref1",)


def test_a_minute_counter_is_neither_clock_nor_sensor(tmp_path):
    y, u = plant()
    k = np.arange(400)
    columns = {"minute": k % 60, "year": 2018 + k // 300, "valve": u[:, 0], "level": y}
    table = recognise({name: np.asarray(values, float) for name, values in columns.items()})
    assert table.time is None and table.inputs == ("valve",)
    assert table["minute"].role == table["year"].role == "counter"
    assert recognise({"hours": k / 4.0, "valve": u[:, 0], "level": y}).dt == 900.0


def test_an_index_is_no_clock_and_a_clock_without_a_name_is_one():
    y, u = plant()
    assert recognise({"column1": np.arange(400.0), "valve": u[:, 0], "level": y}).time is None
    assert recognise({"column1": 0.5 * np.arange(400.0), "valve": u[:, 0], "level": y}).time == "column1"


STAMPS = {
    "01 02 2018 00:00": "2018-02-01T00:00", "2018-02": "2018-02-01", "02/2018": "2018-02-01", "2018m2": "2018-02-01",
    "2018Q2": "2018-04-01", "2018 Q2": "2018-04-01", "Q2 2018": "2018-04-01", "Feb 2018": "2018-02-01",
    "01-Feb-2018 13:45:10": "2018-02-01T13:45:10", "01FEB2018:13:45:10": "2018-02-01T13:45:10",
    "1 Feb 2018 13:45": "2018-02-01T13:45", "Feb 1, 2018": "2018-02-01", "20180201 1345": "2018-02-01T13:45",
    "201802011345": "2018-02-01T13:45", "20180201": "2018-02-01", "20180201T134510Z": "2018-02-01T13:45:10",
    "01.02.18 13:45": "2018-02-01T13:45", "13.02.2018 9:45": "2018-02-13T09:45", "2018.02.01": "2018-02-01",
    "13/02/18 13:45": "2018-02-13T13:45", "13/02/2018 1:45:10 PM": "2018-02-13T13:45:10", "2018/2/1": "2018-02-01",
    "2018-02-01 12:05 a.m.": "2018-02-01T00:05", "2018-02-01 13:45 UTC": "2018-02-01T13:45", "2018M02": "2018-02-01",
}  # fmt: skip


@pytest.mark.parametrize("cell", STAMPS)
def test_dates_as_spreadsheets_loggers_and_packages_write_them(cell):
    other = cell.replace("2018", "2019") if "18 " not in cell else cell.replace("18 ", "19 ")
    column = pa.array([cell, other, None])
    assert kind_of(column) == "stamp"
    stamps, bad, is_stamp = seconds(column)
    assert is_stamp and not bad.any() and np.datetime64(int(stamps[0]), "ns") == np.datetime64(STAMPS[cell])


@pytest.mark.parametrize(
    ("cell", "kind"), [("Wartung", "text"), ("2018-02-01 12:05", "stamp"), ("13:45", "time of day")]
)
def test_blank_cells_settle_nothing(cell, kind):
    assert kind_of(pa.array([""] * 300 + [cell])) == kind_of(pa.array([None] * 300 + [cell])) == kind


@pytest.mark.parametrize("cells", [["1 2 3", "4 5 6"], ["12345678", "12345679"], ["mayor", "marble"], ["20181301"] * 3])
def test_what_is_no_date(cells):
    assert kind_of(pa.array(cells)) != "stamp"


def written(path, header, rows):
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_year_day_of_year_and_hour_are_one_clock(tmp_path):
    y, u = plant()
    moments = [datetime(2018, 12, 28) + timedelta(hours=k) for k in range(400)]
    rows = [f"{m.year},{m:%j},{m.hour},{a:.4f},{b:.4f}" for m, a, b in zip(moments, y, u[:, 0])]
    for header in ("year,doy,hour,level,valve", "Jahr,DOY,Stunde,level,valve"):
        table, segments = read(written(tmp_path / "t.csv", header, rows), chunk_rows=37)
        assert (table.dt, table.timed, table.output, table.inputs) == (3600.0, True, "level", ("valve",))
        time = np.concatenate([part[0] for part in segments])
        np.testing.assert_array_equal(time, 3600.0 * np.arange(400))
        assert segments.table.origin(table.time) == "2018-12-28T00:00:00"


def test_a_campbell_table_with_and_without_a_header(tmp_path):
    y, u = plant()
    moments = [datetime(1995, 1, 30) + timedelta(minutes=30 * k) for k in range(400)]
    rows = [f"{m.year},{int(f'{m:%j}')},{int(f'{m:%H%M}')},{a:.4f},{b:.4f}" for m, a, b in zip(moments, y, u[:, 0])]
    assert read(written(tmp_path / "a.csv", "Year,JDay,HHMM,level,valve", rows))[0].dt == 1800.0
    assert read(written(tmp_path / "b.csv", rows[0], rows[1:]), output="column4")[0].dt == 1800.0


def test_the_header_of_toa5_and_of_write_table(tmp_path):
    y, u = plant()
    moments = [datetime(2016, 7, 19) + timedelta(minutes=k) for k in range(400)]
    rows = [f'"{m}",{k},{a:.4f},{b:.4f},1' for k, (m, a, b) in enumerate(zip(moments, y, u[:, 0]))]
    head = '"TOA5","North","CR1000","4711","Std"\n"TIMESTAMP","RECORD","level","valve","spare"\n"TS","RN","cm","%",""'
    table = read(written(tmp_path / "a.dat", head + '\n"","","Avg","Smp","Avg"', rows))[0]
    assert (table.time, table.output, table.inputs, table["level"].unit) == ("TIMESTAMP", "level", ("valve",), "cm")
    rows = [f'"{k + 1}" "{m}" {a:.4f} {b:.4f} "ok"' for k, (m, a, b) in enumerate(zip(moments, y, u[:, 0]))]
    table = read(written(tmp_path / "b.txt", '"date" "level" "valve" "remark"', rows))[0]
    assert (table.time, table.output, table.inputs, table.dt) == ("date", "level", ("valve",), 60.0)


def test_decimal_years_and_months_are_a_clock(tmp_path):
    y, u = plant()
    rows = [f"{1960 + k / 12:.4f},{a:.4f},{b:.4f}" for k, (a, b) in enumerate(zip(y, u[:, 0]))]
    table = read(written(tmp_path / "a.csv", "time,level,valve", rows))[0]
    assert table.timed and table.dt == pytest.approx(365.25 * 86400 / 12, rel=0.01)
    rows = [f"{2100 + k / 4:.2f},{a:.4f},{b:.4f}" for k, (a, b) in enumerate(zip(y, u[:, 0]))]  # a projection
    table = read(written(tmp_path / "c.csv", "time,level,valve", rows))[0]
    assert table.dt == pytest.approx(365.2425 * 86400 / 4, rel=1e-3)
    rows = [f"{1960 + k // 12}-{k % 12 + 1:02d},{a:.4f},{b:.4f}" for k, (a, b) in enumerate(zip(y, u[:, 0]))]
    assert read(written(tmp_path / "b.csv", "month,level,valve", rows))[0].sampling.kind == "regular"


@pytest.mark.parametrize("back, rows", [(300.0, 300), (3600.0, 6)])
def test_a_clock_that_is_put_back_shifts_no_later_date(back, rows):
    step = back / rows
    time = step * np.arange(2000.0)
    time[1200:] -= back
    y, u = plant(2000)
    goes_on = rows > LATE + 1  # else rows that come late
    for chunk in (2000, 170):
        table, segments = read({"time_s": time, "valve": u[:, 0], "level": y}, chunk_rows=chunk)
        parts = list(segments)
        clock, values = (np.concatenate([part[j] for part in parts]) for j in (0, 1))
        for begin, shift in segments.clock.breaks:
            clock[clock >= begin] -= shift
        keep = np.arange(2000) if goes_on else np.r_[:1200, 1200 + rows : 2000]
        np.testing.assert_allclose(clock, time[keep])
        np.testing.assert_array_equal(values, y[keep])
        assert (table.sampling.late, table.sampling.set_back) == ((0, 1) if goes_on else (rows - 1, 0))
        assert table.sampling.restarts == 0


def test_a_clock_that_starts_again_goes_on():
    y, u = plant(600)
    table, segments = read({"time_s": np.tile(np.arange(200.0), 3), "valve": u[:, 0], "level": y})
    time = np.concatenate([part[0] for part in segments])
    assert table.sampling.restarts == 2 and np.all(np.diff(time) > 0)


def test_of_two_columns_of_dates_the_one_that_never_goes_back_is_the_clock():
    y, u = plant()
    utc = 1800.0 * np.arange(400)
    local = utc + 7200.0 - 3600.0 * (utc > 300_000)
    columns = {"local": local, "utc": utc, "valve": u[:, 0], "level": y}
    assert recognise(columns, stamps=("local", "utc")).time == "utc"


def test_a_day_above_twelve_far_down_tells_days_from_months(tmp_path):
    y, u = plant(900)
    moments = [datetime(2011, 4, 12, 17) + timedelta(minutes=2 * k) for k in range(900)]
    rows = [f"{m:%m/%d/%y %H:%M},{a:.4f},{b:.4f}" for m, a, b in zip(moments, y, u[:, 0])]
    table = read(written(tmp_path / "a.csv", "time,level,valve", rows))[0]
    assert (table.time, table.dt, table.rows) == ("time", 120.0, 900)
    rows = [f"{m:%m/%d/%Y %I:%M %p},{a:.4f},{b:.4f}" for m, a, b in zip(moments, y, u[:, 0])][:200]
    segments = read(written(tmp_path / "b.csv", "time,level,valve", rows))[1]
    assert segments.table.origin("time") == "2011-04-12T17:00:00"


def test_the_page_lists_the_vocabulary():
    root = Path(__file__).resolve().parents[2]
    run([sys.executable, root / "scripts/vocabulary.py", "--check"], check=True)


def test_an_anomaly_that_takes_many_values_is_a_deviation_and_no_mark():
    y, _ = plant()
    table = recognise({"temp_anomaly": y - y.mean(), "anomaly": (np.arange(400) % 50 == 0) * 1.0})
    assert table.output == "temp_anomaly" and table["anomaly"].role == "label"
