"""Tables that do not stand as they are read: years by months, recordings that share their stamps, weeks that rest."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.tables.autoread import read
from driftwise.tables.clock import DAY

MONTHS = "JAN FEB MAR APR MAY JUN JUL AUG SEP OCT NOV DEC".split()


def lines(tmp_path, *rows):
    file = tmp_path / "table.csv"
    file.write_text("\n".join(rows) + "\n")
    return file


def by_years(tmp_path, names=MONTHS, first="Year"):
    y = np.round(np.random.default_rng(3).normal(20, 3, (40, 12)), 2)
    rows = [f"{1960 + k},{','.join(map(str, row))},{row.mean():.2f}" for k, row in enumerate(y)]
    return lines(tmp_path, f"{first},{','.join(names)},Annual", *rows), y


@pytest.mark.parametrize(
    "names, first", [(MONTHS, "Year"), ("Janv Févr Mars Avr Mai Juin Juil Août Sept Oct Nov Déc".split(), "Année")]
)
def test_years_by_months_are_one_column(tmp_path, names, first):
    file, y = by_years(tmp_path, names, first)
    table, segments = read(file)
    time, value, _ = map(np.concatenate, zip(*segments))
    assert (table.output, table.time, table.inputs) == ("value", first, ())
    assert np.array_equal(value, y.ravel())
    assert np.all(np.diff(time) >= 28 * DAY) and np.all(np.diff(time) <= 31 * DAY)
    assert "the months of a year side by side" in table.notes[0] and "'Annual'" in table.notes[0]


def test_a_month_that_is_asked_for_stays_a_column_of_years(tmp_path):
    file, y = by_years(tmp_path)
    _, segments = read(file, output="JAN", inputs=())
    assert np.array_equal(np.concatenate([part[1] for part in segments]), y[:, 0])


def test_of_recordings_that_share_their_stamps_the_first_is_read(tmp_path):
    rng = np.random.default_rng(4)
    y = 100 * np.arange(5) + rng.normal(size=(60, 5)).cumsum(axis=0)
    rows = [f"{t},{one + 7},{y[t, one]:.3f}" for t in range(60) for one in range(5)]
    table, segments = read(lines(tmp_path, "time,pen,weight", *rows))
    assert table.output == "weight"
    assert np.concatenate([part[1] for part in segments]) == pytest.approx(y[:, 0], abs=1e-3)
    assert table.notes[0].startswith("'pen' names 5 recordings that share their stamps, and the first of them, 7, is")


def test_the_note_of_rows_turned_round_is_told(tmp_path):
    y = np.random.default_rng(5).normal(size=80).cumsum()
    rows = [f"{79 - k},{y[79 - k]:.3f}" for k in range(80)]
    found = dw.identify(str(lines(tmp_path, "time,level", *rows)))
    assert "the rows were turned round" in found.notes[0]


def test_year_and_quarter_are_a_clock(tmp_path):
    y = np.random.default_rng(6).normal(size=60)
    table, segments = read(
        lines(tmp_path, "year,quarter,rate", *(f"{1990 + k // 4},{k % 4 + 1},{v}" for k, v in enumerate(y)))
    )
    assert (table.time, table.output, segments.origin) == ("year", "rate", "1990-01-01T00:00:00")
    assert table.step == "every 91.3 d"


@pytest.mark.parametrize("form", ["%b-%d-%Y", "%B/%d/%Y", "%b %d, %Y"])
def test_months_by_name_before_the_day(tmp_path, form):
    from datetime import date, timedelta

    days = [date(2021, 1, 1) + timedelta(k) for k in range(60)]
    y = np.random.default_rng(7).normal(size=60)
    rows = [f'"{day.strftime(form)}",{v:.4f}' for day, v in zip(days, y)]
    table, segments = read(lines(tmp_path, "when,flow", *rows))
    assert (table.time, table.step, segments.origin) == ("when", "every 1 d", "2021-01-01T00:00:00")


def test_a_column_called_data_is_no_calendar(tmp_path):
    y = np.random.default_rng(8).normal(size=80)
    assert read(lines(tmp_path, "data,label", *(f"{v:.4f},0" for v in y)))[0].output == "data"


def test_data_of_dates_is_a_clock(tmp_path):
    y = np.random.default_rng(8).normal(size=28)
    table, _ = read(lines(tmp_path, "data,portata", *(f"{k + 1:02d}/02/2021,{v:.4f}" for k, v in enumerate(y))))
    assert (table.time, table.output) == ("data", "portata")


@pytest.mark.parametrize("rest", [(5, 6), (4, 5)])
def test_a_week_that_rests_has_no_gaps(tmp_path, rest):
    days = np.datetime64("2020-01-06") + np.arange(140)  # a Monday
    days = days[~np.isin(np.arange(140) % 7, rest)]
    holiday = 33
    days = np.delete(days, holiday)
    y = np.random.default_rng(9).normal(size=len(days))
    table, segments = read(lines(tmp_path, "date,price", *(f"{d},{v:.4f}" for d, v in zip(days, y))))
    time, value, _ = map(np.concatenate, zip(*segments))
    assert table.sampling.gaps == 1 and np.flatnonzero(np.isnan(value)).tolist() == [holiday]
    assert np.array_equal(time[~np.isnan(value)], (days - days[0]).astype(float) * DAY)
    assert "a sample is a working day" in table.notes[0]


def test_a_week_without_rest_is_as_it_was(tmp_path):
    days = np.datetime64("2020-01-06") + np.arange(140)
    days = np.delete(days, np.flatnonzero(np.arange(140) % 7 == 6))  # six days a week: one is missing
    table, _ = read(lines(tmp_path, "date,price", *(f"{d},{k % 9}.5" for k, d in enumerate(days))))
    assert table.sampling.rest is None and table.sampling.gaps == 20 - 1


def test_marks_of_months_are_no_values(tmp_path):
    rng = np.random.default_rng(10)
    rows = [
        f"{1990 + k // 12},{k % 12 + 1},{','.join('1' if k % 12 == j else '0' for j in range(12))},{v:.3f}"
        for k, v in enumerate(rng.normal(size=120).cumsum())
    ]
    table, _ = read(lines(tmp_path, f"year,month,{','.join(MONTHS)},sales", *rows))
    assert (table.output, table.time, table.step) == ("sales", "year", "every 30.4 d")


def test_a_panel_has_the_clock_of_its_years(tmp_path):
    y = np.random.default_rng(11).normal(size=(12, 9)).cumsum(axis=1)
    rows = [f"{c},{'ab'[s]},{1990 + t},{y[6 * s + c, t]:.4f}" for s in range(2) for c in range(6) for t in range(9)]
    table, segments = read(lines(tmp_path, "county,state,year,rate", *rows))
    time, value, _ = map(np.concatenate, zip(*segments))
    assert (table.time, table.output, table.sampling.restarts) == ("year", "rate", 11)
    assert np.array_equal(value[np.isfinite(value)], np.round(y.ravel(), 4))
    assert np.isnan(value).sum() == 11 * 20 and np.all(np.diff(time) > 0)
    assert "'county' and 'state' name 12 recordings, one below the other" in " ".join(table.notes)


def test_years_in_no_order_are_no_clock(tmp_path):
    rng = np.random.default_rng(12)
    rows = [f"{year},{v:.3f}" for year, v in zip(rng.permutation(np.arange(1900, 1980)), rng.normal(size=80))]
    table, _ = read(lines(tmp_path, "year,rate", *rows))
    assert table.time is None and table.output == "rate"


@pytest.mark.parametrize(
    "years, step", [(np.arange(1950, 2000), "every 365 d"), (np.arange(50), "clock 'time', unit unknown")]
)
def test_whole_numbers_of_this_age_are_years(years, step):
    y = np.random.default_rng(13).normal(size=50)
    assert read({"time": years.astype(float), "value": y})[0].step == step


@pytest.mark.parametrize(
    "name, values",
    [
        ("rownames", np.random.default_rng(14).permutation(60) + 1.0),
        ("column1", np.random.default_rng(17).integers(1, 6, 60).cumsum() * 1.0),
    ],
)
def test_the_index_of_rows_that_were_picked_is_no_signal(name, values):
    y = np.random.default_rng(15).normal(size=60).cumsum()
    table, _ = read({name: values, "rate": y})
    assert (table.output, table.inputs, table.time) == ("rate", (), None)


def test_a_class_that_is_measured_is_no_mark():
    a, b = 20 + np.random.default_rng(16).normal(size=(2, 90)).cumsum(axis=1)
    assert read({"First.Class": a, "label": np.round(b) % 3})[0].output == "First.Class"


def test_a_capital_t_before_a_word_is_no_time():
    from driftwise.tables.column_roles import parse

    assert [("time" in parse(name).kinds) for name in ("TVadverts", "TSup", "t", "Time")] == [False, False, True, True]


def test_a_table_of_one_row_is_refused_without_a_warning(recwarn):
    with pytest.raises(InputError, match="no column looks like an output"):
        read({"time": [1.0], "y": [2.0]})
    assert not recwarn.list


@pytest.mark.parametrize(
    "unit, step",
    [("Y", "every 365 d"), ("M", "every 30.4 d"), ("W", "every 7 d"), ("h", "every 60 min"), ("m", "every 60 s")],
)
def test_stamps_of_any_unit_are_a_clock(unit, step):
    stamps = np.datetime64("2001", unit) + np.arange(60)
    assert read({"time": stamps, "flow": np.random.default_rng(18).normal(size=60)})[0].step == step


@pytest.mark.parametrize("is_split", [False, True])
def test_rows_of_one_minute_are_no_recordings(is_split):
    """Rows that come more often than their stamps tell are one recording, whatever counts them."""
    rng = np.random.default_rng(8)
    minutes = np.sort(rng.integers(0, 300, 400))
    hours, left = 12 + minutes // 60, minutes % 60
    if is_split:
        clock = {"date": ["2006-09-21"] * 400, "clock time": [f"{h}:{m:02d}" for h, m in zip(hours, left)]}
    else:
        day = {name: np.full(400, part) for name, part in (("Year", 2006), ("Month", 9), ("Day", 21))}
        clock = day | {"Hour": hours, "Minute": left}
    y = 20 + 0.1 * np.cumsum(rng.standard_normal(400))
    table, segments = read(clock | {"temperature": y, "sample": np.arange(400) + 1})
    assert table.output == "temperature" and not table.otherwise
    assert sum(int(np.isfinite(y).sum()) for _, y, _ in segments) > 200
