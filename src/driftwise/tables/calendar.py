"""Dates that stand in several columns of numbers: year, month and day, or day of year, and hours and minutes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from .cells import NAT

ZONES = "utc gmt lst mst cst est pst cet mez"  # by which the hours of a day may be called
# What a part may be called, and the numbers that it may hold.
PARTS = {
    "year": ("year yr yyyy jahr annee ano anno jaar rok", 1500, 2200),
    "month": ("month mo mon mm monat mois mes mese maand miesiac manad", 1, 12),
    "quarter": ("quarter qtr quartal trimestre trimester kwartal kwartaal kvartal", 1, 4),
    "day": ("day dd tag jour dia giorno dag dzien mday dom dayofmonth", 1, 31),
    "day of year": ("doy jday yday julian juliandate julianday dayofyear yearday dyear", 1, 366),
    "hour": (f"hour hr hh stunde heure hora ora uur godzina timme {ZONES}", 0, 24),
    "minute": ("minute mi mn min minuto minuut minuta", 0, 59),
    "second": ("second sec ss sekunde seconde segundo secondo sekunda", 0, 60),
    "hours and minutes": (f"hhmm hourminute {ZONES}", 0, 2400),
}
# How the day of a year is told, the finest first; where only its month or quarter is, no hour is.
WAYS: tuple[tuple[str, ...], ...] = (("day of year",), ("month", "day"), ("month",), ("quarter",), ())
SHORTEST = 0.34  # recordings of three rows, one below the other
LATE = 0.02  # share of the rows that may go back


def calendar_of(columns: Mapping[str, Any]) -> dict[str, str]:
    """Return part -> name of the columns that make up a date between them, {} where none do.

    ``columns`` are first rows of numbers by name. A year alone is one where nothing else tells the time of its rows
    and no two rows have the same.

    >>> calendar_of({"Year": np.full(48, 2018.0), "DOY": np.repeat([1.0, 2], 24), "Hour": np.arange(48.0) % 24})
    {'year': 'Year', 'day of year': 'DOY', 'hour': 'Hour'}
    """
    found: dict[str, str] = {}
    for name, values in columns.items():
        word = _word(name)
        for part, (words, _, _) in PARTS.items():
            if word in words.split() and part not in found and _fits(part, values):
                found[part] = name
    if not found and list(columns)[:3] == ["column1", "column2", "column3"]:  # a logger that writes no header
        found = dict(zip(("year", "day of year", "hours and minutes"), columns))
        if not all(_fits(part, columns[name]) for part, name in found.items()):
            return {}
    if "year" not in found:
        return {}
    way = next(way for way in WAYS if found.keys() >= set(way))
    finer = ("hour", "minute", "second", "hours and minutes") if way in WAYS[:2] else ()
    found = {part: name for part, name in found.items() if part in ("year", *way, *finer)}
    if found.get("hours and minutes") == found.get("hour"):  # one column, of hours
        found.pop("hours and minutes", None)
    if "hours and minutes" in found:
        found = {part: name for part, name in found.items() if part not in ("hour", "minute")}
    stamps = joined({part: columns[name] for part, name in found.items()}).astype(float)
    steps = np.diff(stamps)
    if not steps.size or np.mean(steps > 0) < 0.5 or (np.mean(steps < 0) > LATE and not starts_over(stamps)):
        return {}
    return found


def starts_over(stamps) -> bool:
    """Whether stamps (T,) that go back begin anew each time, as those of short recordings one below the other.

    >>> starts_over(np.tile([1990.0, 1991, 1992, 1993], 5)), starts_over(np.array([3.0, 1, 4, 1, 5, 9, 2, 6]))
    (True, False)
    """
    stamps = stamps[np.isfinite(stamps)]
    again = stamps[1:][np.diff(stamps) < 0]
    if not again.size or again.size > SHORTEST * len(stamps):
        return False
    tenth, half = np.quantile(stamps, [0.1, 0.5])
    return bool(np.median(again) <= tenth and again.max() < half)


def _fits(part: str, values) -> bool:
    """Whether a column holds whole numbers that such a part of a date may be."""
    _, low, high = PARTS[part]
    fine = values[np.isfinite(values)]
    is_clock = part != "hours and minutes" or bool(np.all(fine % 100 < 60))
    return bool(fine.size and np.all(fine == np.round(fine)) and low <= fine.min() <= fine.max() <= high and is_clock)


def is_part(name: str) -> bool:
    """Whether a column is called like a part of a date, or is one of the first of a table without names."""
    return _word(name) in _CALLED or name in ("column1", "column2", "column3")


def is_beyond(name: str, values) -> bool:
    """Whether a column that is called like a part of a date holds numbers that are none, and go up and down.

    >>> is_beyond("hr", np.array([515.0, 514, 520, 511])), is_beyond("hr", np.arange(100.0))
    (True, False)
    """
    word = _word(name)
    ranges = [(low, high) for words, low, high in PARTS.values() if word in words.split()]
    fine = values[np.isfinite(values)]
    is_part = any(low <= fine.min(initial=high) and fine.max(initial=low) <= high for low, high in ranges)
    return bool(ranges) and not is_part and bool(np.mean(np.diff(fine) < 0) > LATE)


def _word(name: str) -> str:
    return re.sub(r"[^a-z]", "", name.lower().replace("é", "e").replace("ñ", "n").replace("å", "a"))


_CALLED = frozenset(" ".join(words for words, _, _ in PARTS.values()).split())


def joined(parts: Mapping[str, Any]):
    """Return int64 seconds since 1970 of rows whose parts are given as floats; NAT where one is missing."""
    year = np.asarray(parts["year"], float)
    ok = np.all([np.isfinite(values) for values in parts.values()], axis=0)

    def whole(part: str, default: float):
        return np.where(ok, np.asarray(parts.get(part, np.full(len(year), default)), float), default).astype(np.int64)

    first = (np.where(ok, year, 1970).astype(np.int64) - 1970).astype("datetime64[Y]")
    if "day of year" in parts:
        days = first.astype("datetime64[D]") + (whole("day of year", 1) - 1)
    else:
        month = 3 * whole("quarter", 1) - 2 if "quarter" in parts else whole("month", 1)
        days = (first.astype("datetime64[M]") + (month - 1)).astype("datetime64[D]") + (whole("day", 1) - 1)
    seconds = 3600 * whole("hour", 0) + 60 * whole("minute", 0) + whole("second", 0)
    if "hours and minutes" in parts:
        clock = whole("hours and minutes", 0)
        seconds = 3600 * (clock // 100) + 60 * (clock % 100)
    stamps = days.astype("datetime64[s]").astype(np.int64) + seconds
    return np.where(ok, stamps, NAT)
