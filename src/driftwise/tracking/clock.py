"""The times of plots: Unix times in any unit, time stamps, times of day that begin anew at midnight."""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError
from ..tables.cells import NAT, numbers, of_day, seconds
from ..tables.clock import DAY, TimeOfDay
from ..tables.column_roles import SECONDS
from .columns import Column, meaning

DATED = ("Unix s", "Unix ms", "Unix us", "Unix ns", "time stamp")


def times(array, column: Column, decimal=".", day_first=True):
    """Return (s, unit taken, bad) of a pyarrow column of times; NaN where missing or bad."""
    day, count = of_day(array)
    if 2 * count > len(array) - array.null_count > 0:
        bad = np.isnan(day) & array.is_valid().to_numpy(zero_copy_only=False)
        return TimeOfDay(goes_back=True).push(day), "time of day", bad
    try:
        values, bad, is_stamp = seconds(array, decimal, day_first)
    except InputError as error:
        raise InputError(f"time column {column.name!r}: {error}") from None
    if is_stamp:
        if found := _counted(array, column, decimal):
            return found
        missing = values == NAT
        out = np.where(missing, np.nan, values / 1e9)
        return out, "time stamp", bad | (missing & array.is_valid().to_numpy(zero_copy_only=False))
    return *_scaled(values, column), bad


def _counted(array, column, decimal):
    """Return (s, unit, bad) of numbers that count from 1970, with their unit; None of other dates."""
    try:
        values, bad = numbers(array, decimal)
    except InputError:  # dates by their type
        return None
    values, unit = _scaled(values, column)
    return (values, unit, bad) if unit in DATED else None


def _scaled(values, column):
    """Return (s, unit) of numbers: the size tells Unix s, ms, us and ns apart."""
    good = values[np.isfinite(values)]
    size = np.median(np.abs(good)) if good.size else 0.0
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)):
        if 3e8 <= size * scale < 1e10 and column.unit in ("", unit):  # 1979 to 2286
            return values * scale, f"Unix {unit}"
    values = values * SECONDS.get(column.unit, 1.0)
    word = meaning(column.name)[0]
    good = values[np.isfinite(values)]
    if good.size and good.min() >= 0 and good.max() <= DAY:
        if word in ("timeofday", "tod", "daytime") or good.max() > 0.98 * DAY:
            return TimeOfDay(goes_back=True).push(values), "s of day"
    return values, "s"


def clock(get, taken, decimal=".", day_first=True):
    """Return (s, bad, dict from part to `Column`) of a table: a time with a day before one without.

    Parameters
    ----------
    get : function from a name to its pyarrow column
    taken : dict from part to columns that may play it, as `recognise` returns
    """
    used: dict[str, Column] = {}
    read = [(column, *times(get(column.name), column, decimal, day_first)) for column in taken["time"] + taken["date"]]
    read = [one for one in read if np.isfinite(one[1]).any()]
    dated = [one for one in read if one[2] in DATED]
    days = [one for one in dated if not np.any(one[1][np.isfinite(one[1])] % DAY)]
    hours = [one for one in read if one[2] in ("time of day", "s of day")]
    whole = [one for one in dated if all(one is not day for day in days)]
    if not read:
        value, bad = None, None
    elif not whole and days and hours:  # a column of dates beside one of times of day
        (date, start, _, bad_date), (column, _, unit, bad) = days[0], hours[0]
        value, bad = start + hours[0][1] % DAY, bad | bad_date
        used = {"date": Column(date.name, "date"), "time": Column(column.name, unit)}
    else:
        column, value, unit, bad = (whole or dated or read)[0]
        used = {"time": Column(column.name, unit)}
    for column in taken["position_time"]:
        update, unit, _ = times(get(column.name), column, decimal, day_first)
        if unit in DATED:
            used["position_time"] = Column(column.name, unit)
            value = update if value is None else np.where(np.isfinite(update), update, value)
            bad = np.zeros(len(update), bool) if bad is None else bad & ~np.isfinite(update)
            break
    if value is None:
        named = [column.name for column in taken["time"]]
        raise InputError(
            f"no cell of {' or '.join(map(repr, named))} can be read as a time"
            if named
            else "no column of time is recognised (time, timestamp, utc ...)"
        )
    return value, bad, used
