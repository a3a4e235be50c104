"""Days and months below the thirteenth: the whole column decides which of them stands first, else it is told."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from driftwise.tables.autoread import read

ORDERS = "%d/%m/%Y %H:%M:%S", "%m/%d/%Y %H:%M:%S"


def read_back(folder, moments, form):
    """Return what is recognised of a table with these dates, and the stamp of its first row."""
    rng = np.random.default_rng(3)
    y, u = np.cumsum(rng.normal(size=len(moments))), rng.normal(size=len(moments))
    rows = [f"{m.strftime(form)},{a:.4f},{b:.4f}" for m, a, b in zip(moments, y, u)]
    (path := folder / "a.csv").write_text("\n".join(["time,level,valve", *rows]) + "\n")
    table, segments = read(path)
    return table, segments.origin


@pytest.mark.parametrize("form", ORDERS)
@pytest.mark.parametrize("dates", ["first of each month", "until the twelfth", "first days of a month"])
def test_of_dates_below_the_thirteenth_those_that_are_alike_are_right(tmp_path, form, dates):
    days = [datetime(2020, 1, 1) + timedelta(days=k) for k in range(800)]
    taken = {
        "first of each month": [day for day in days if day.day == 1],
        "until the twelfth": [day for day in days if day.day <= 12],
        "first days of a month": [datetime(2020, 2, 1) + timedelta(hours=k) for k in range(250)],
    }[dates]
    table, origin = read_back(tmp_path, taken, form)
    assert origin == taken[0].isoformat() and table.sampling.kind == "regular"
    assert not any("no date of the table" in note for note in table.notes)


@pytest.mark.parametrize("form", ORDERS)
def test_a_thirteenth_far_behind_the_head_of_a_file_decides(tmp_path, form):
    moments = [datetime(2020, 2, 8) + timedelta(seconds=20 * k) for k in range(27_000)]
    table, origin = read_back(tmp_path, moments, form)
    assert origin == "2020-02-08T00:00:00" and table.dt == 20.0 and table.sampling.restarts == 0


def test_where_no_date_decides_it_is_told(tmp_path):
    moments = [datetime(2020, 2, 8) + timedelta(minutes=k) for k in range(300)]
    table, _ = read_back(tmp_path, moments, "%d/%m/%Y %H:%M")
    assert "Dates are read with the day first: no date of the table tells days from months." in table.notes
    table, _ = read_back(tmp_path, moments, "%Y-%m-%d %H:%M")
    assert not any("no date of the table" in note for note in table.notes)


@pytest.mark.parametrize("form", ["%m.%d.%Y", "%d.%m.%Y", "%m.%d.%y %H:%M"])
def test_dates_with_dots_begin_with_the_day_unless_one_exceeds_twelve(tmp_path, form):
    days = [datetime(2020, 2, 8) + timedelta(days=k) for k in range(60)]
    table, origin = read_back(tmp_path, days, form)
    assert origin == "2020-02-08T00:00:00" and table.dt == 86_400.0
    table, origin = read_back(tmp_path, days[:4], "%d.%m.%Y")
    assert origin == "2020-02-08T00:00:00" and not any("no date of the table" in note for note in table.notes)
