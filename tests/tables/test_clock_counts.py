"""Clocks of numbers: what they count, from when, and the dates that are told by them."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.tables.autoread import read
from driftwise.tables.column_roles import parse
from driftwise.tables.counts import SPREADSHEET, UNIX, YEARS, counted


def stepped(samples=240, at=150, seed=1):
    """Return a plant of which the level jumps by ten deviations at a sample, and its input."""
    y, u = dw.simulate([-0.8], [1.0], samples=samples, noise_std=0.3, seed=seed)
    y[at:] += 20.0
    return y, u


@pytest.mark.parametrize(
    "numbers, name, origin",
    [
        (1.7e9 + 60.0 * np.arange(9), "t", UNIX),
        (1.7e12 + 6e4 * np.arange(9), "t", UNIX),
        (45000 + np.arange(9) / 24, "date", SPREADSHEET),
        (1749 + np.arange(9) / 12, "time", YEARS),
        (-155.0 + np.arange(9), "day", None),
    ],
)
def test_a_count_begins_where_its_kind_does(numbers, name, origin):
    assert (counted(numbers, parse(name)) or (0, None))[1] == origin


@pytest.mark.parametrize("parts, unit", [(12, "M"), (4, "M"), (365.25, "D"), (52, "D")])
def test_decimal_years_are_dates(parts, unit):
    numbers = 1949 + np.arange(60) / parts
    found = counted(numbers.round(6), parse("time")).time(numbers.round(6))
    dates = np.datetime64(YEARS, "s") + np.rint(found).astype(np.int64)
    if unit == "M":
        assert (dates == np.datetime64("1949-01", "M") + np.arange(0, 60 * 12 // parts, 12 // parts)).all()
    else:
        days = (dates - np.datetime64("1949-01-01", "s")) / np.timedelta64(86400, "s")
        assert np.abs(days - np.arange(60) * 365.25 / parts).max() < 1


def test_a_change_of_a_series_in_decimal_years_has_a_date(tmp_path):
    y, u = stepped()
    rows = [f"{1949 + k / 12:.4f},{a:.4f},{b:.4f}" for k, (a, b) in enumerate(zip(y, u))]
    (tmp_path / "a.csv").write_text("\n".join(["time,level,valve", *rows]))
    found = dw.identify(tmp_path / "a.csv")
    assert any("at 1961-07-01" in found.phrase(change) for change in found.changes)


@pytest.mark.parametrize("code, days", [("M", 365.2425 / 12), ("Y", 365.2425)])
def test_months_and_years_are_as_long_as_they_are_on_average(code, days):
    y, u = stepped()
    stamps = (np.datetime64("1960-01", code) + np.arange(240)).astype("datetime64[D]")
    table = read({"date": [str(stamp) for stamp in stamps], "valve": u, "level": y})[0]
    assert table.sampling.kind == "regular" and table.dt == pytest.approx(86400 * days, rel=1e-3)


def test_years_before_the_nanoseconds_begin_are_years():
    y, u = stepped()
    segments = read({"Year": 1500.0 + np.arange(240), "valve": u, "level": y})[1]
    time = np.concatenate([part[0] for part in segments])
    assert segments.origin == "1500-01-01T00:00:00" and np.all(np.abs(np.diff(time) / 86400 - 365.5) < 1)


def test_a_clock_that_starts_again_tells_the_stamps_of_the_table():
    y, u = stepped(600, 450)
    stamps = [str(day) for day in np.datetime64("2020-01-01") + np.arange(300)]
    found = dw.identify({"date": stamps + stamps, "valve": u, "level": y})
    assert any("at 2020-05-30 of the second run of the clock" in found.phrase(change) for change in found.changes)
    assert "2021" not in found.words


@pytest.mark.parametrize("names, told", [(["north"] * 300 + ["south"] * 300, True), (["north", "south"] * 300, False)])
def test_a_column_that_names_recordings_one_below_the_other_is_told(names, told):
    y, u = stepped(600, 450)
    stamps = [str(day) for day in np.datetime64("2020-01-01") + np.arange(300)]
    table = read({"roof": names, "date": stamps + stamps, "valve": u, "level": y})[0]
    assert table.stacked == (("roof",) if told else ())
    assert any("'roof' names 2 recordings, one below the other" in note for note in table.notes) == told
