"""What the numbers of a clock count: a unit, and from which date where that is known."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from .clock import DAY
from .column_roles import SECONDS, Name

STEPS = (1, 2, 5, 10, 15, 20, 30, 60, 120, 300, 600, 900, 1200, 1800, 3600)  # seconds between rows of a spreadsheet
UNIX, SPREADSHEET, YEARS = "1970-01-01", "1899-12-30", "0000-01-01"  # where counts begin
PARTS = (1, 2, 4, 12, 52, 365.25)  # of a year, that rows of statistics packages stand apart


class Count(NamedTuple):
    """What a clock of numbers counts.

    seconds : in one of its numbers
    origin : the date of its zero, None where that is not known
    parts : rows a year of a clock that counts years; 0: it does not
    """

    seconds: float
    origin: str | None = None
    parts: float = 0.0

    def time(self, numbers):
        """Return seconds since the zero of the clock; months and quarters begin on their first days.

        >>> seconds = Count(SECONDS["years"], YEARS, 12).time([1957.0833])
        >>> np.datetime64(YEARS, "s") + seconds.astype(int)
        array(['1957-02-01T00:00:00'], dtype='datetime64[s]')
        """
        if not self.parts:
            return self.seconds * numbers
        numbers = np.asarray(numbers, float)
        fine = np.isfinite(numbers)
        filled = np.where(fine, numbers, 0.0)
        if self.parts <= 12:
            found = _start(np.rint(12 * filled), "M")
        else:
            year = np.floor(filled)
            found = _start(year, "Y")
            found = found + (filled - year) * (_start(year + 1, "Y") - found)
        return np.where(fine, found, np.nan)


def _start(count, unit: Literal["Y", "M"]):
    """Return seconds from the year 0 to the beginning of a year or month, counted from there."""
    zero = np.datetime64(YEARS, unit)
    return ((zero + np.asarray(count).astype(np.int64)) - zero.astype("datetime64[s]")) / np.timedelta64(1, "s")


def counted(numbers, name: Name) -> Count | None:
    """Return what a clock of numbers counts; None where its unit is not known."""
    unit = name.unit or next((word for word in name.words if len(word) > 1 and word in SECONDS), "")
    if unit in SECONDS:
        return Count(SECONDS[unit])
    middle = float(np.nanmedian(numbers))
    for digits in (1e9, 1e12, 1e15, 1e18):  # seconds, ms, us, ns since 1970, from 2001 to 2065
        if digits <= middle < 3 * digits:
            return Count(1e9 / digits, UNIX)
    if parts := _parts(numbers):
        return Count(SECONDS["years"], YEARS, parts)
    return Count(DAY, SPREADSHEET) if _counts_days(numbers) else None


def _parts(time) -> float:
    """Return in how many parts a clock counts years, 1990.0833, 0 if it does not; projections go to 2500."""
    time = time[np.isfinite(time)]
    if time.size < 3 or not (1500 <= time.min() and time.max() < 2500):
        return 0.0
    step = float(np.median(np.diff(time)))
    if step == 1.0 and not (np.all(time == np.round(time)) and 1700 <= time.min() and time.max() <= 2100):
        return 0.0  # seconds, perhaps
    return next((parts for parts in PARTS if abs(step * parts - 1.0) < 0.02), 0.0)


def _counts_days(time) -> bool:
    """Whether a clock is that of a spreadsheet: days since 1900, of the years 2000 to 2050, and a usual step."""
    time = time[np.isfinite(time)]
    if time.size < 3 or not (36526 <= time.min() and time.max() < 54789):
        return False
    step = DAY * float(np.median(np.diff(time)))
    return any(abs(step - usual) < 0.003 * usual for usual in STEPS)
