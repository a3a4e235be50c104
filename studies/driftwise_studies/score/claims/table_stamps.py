"""How loggers, spreadsheets and statistics packages write the time of a row: one function a way."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import NamedTuple
from zoneinfo import ZoneInfo

import numpy as np

MINUTE, HOUR, DAY, MONTH = 60.0, 3600.0, 86_400.0, 86_400.0 * 365.25 / 12
FAST = (0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 60.0)
SECONDS = (1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0, 600.0, 900.0, 3600.0)
MINUTES = (60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0)

Columns = list[tuple[str, list[str]]]


class Way(NamedTuple):
    """A way of writing time.

    write : (seconds since the first row (T,), start, the word for a clock) -> columns of cells, the clock's first
    steps : seconds between rows that it is used for, () where any step will do
    unit : multiples of which it can write, 0 for any
    clocks : how many of the first columns are the clock; the rest are none, or say the same once more
    """

    write: Callable[[np.ndarray, datetime, str], Columns]
    steps: tuple[float, ...]
    unit: float = 0.0
    clocks: int = 1


def _moments(time, start: datetime) -> list[datetime]:
    return [start + timedelta(microseconds=round(1e6 * float(t))) for t in time]


def _as(form: str):
    return lambda time, start, word: [(word, [moment.strftime(form) for moment in _moments(time, start)])]


def _upper(form: str):
    return lambda time, start, word: [(word, [moment.strftime(form).upper() for moment in _moments(time, start)])]


def _number(name: str, unit: float, start_at: float = 0.0):
    return lambda time, start, word: [(name, [f"{start_at + t / unit:.10g}" for t in time])]


def _since_1970(digits: int):
    def write(time, start, word):
        first = start.replace(tzinfo=UTC).timestamp()
        return [("epoch", [str(round(10**digits * (first + float(t)))) for t in time])]

    return write


def _days_of_excel(time, start, word):
    first = (start - datetime(1899, 12, 30)).total_seconds() / DAY
    return [(word, [f"{first + float(t) / DAY:.10f}".rstrip("0") for t in time])]


def _two_columns(date: str, hour: str):
    def write(time, start, word):
        moments = _moments(time, start)
        return [("date", [m.strftime(date) for m in moments]), ("time", [m.strftime(hour) for m in moments])]

    return write


def _parts(*parts: tuple[str, str]):
    def write(time, start, word):
        moments = _moments(time, start)
        return [(name, [str(int(m.strftime(form))) for m in moments]) for name, form in parts]

    return write


def _campbell(time, start, word):
    """Return year, day of year, and hours and minutes as one number, 130 for half past one."""
    return _parts(("Year", "%Y"), ("JDay", "%j"), ("HHMM", "%H%M"))(time, start, word)


def _months(form: str):
    def write(time, start, word):
        count = np.round(np.asarray(time) / MONTH).astype(int) + start.month - 1
        return [(word, [datetime(start.year + k // 12, k % 12 + 1, 1).strftime(form) for k in count.tolist()])]

    return write


def _year_and_month(time, start, word):
    [(_, cells)] = _months("%Y-%m")(time, start, word)
    return [("year", [cell[:4] for cell in cells]), ("month", [str(int(cell[5:])) for cell in cells])]


def _months_of_stata(time, start, word):
    count = np.round(np.asarray(time) / MONTH).astype(int) + start.month - 1
    return [(word, [f"{start.year + k // 12}m{k % 12 + 1}" for k in count.tolist()])]


def _quarters(form: str):
    def write(time, start, word):
        count = np.round(np.asarray(time) / (3 * MONTH)).astype(int)
        return [(word, [form.format(start.year + k // 4, k % 4 + 1) for k in count.tolist()])]

    return write


def _years(time, start, word):
    return [("year", [str(start.year + round(float(t) / (12 * MONTH))) for t in time])]


def _decimal_years(time, start, word):
    return [(word, [f"{start.year + float(t) / (12 * MONTH):.6f}" for t in time])]


def _local(time, start, zone) -> list[datetime]:
    return [moment.replace(tzinfo=UTC).astimezone(ZoneInfo(zone)) for moment in _moments(time, start)]


def _two_zones(time, start, word):
    """Return universal time and that of the place, which jumps twice a year."""
    cells = [m.strftime("%Y-%m-%d %H:%M:%S") for m in _moments(time, start)]
    local = [m.strftime("%Y-%m-%d %H:%M:%S") for m in _local(time, start, "Europe/Berlin")]
    return [("time_utc", cells), ("time_local", local)]


def _summer_time(time, start, word):
    """Return the time of the place without its zone: an hour of a day in autumn comes twice."""
    autumn = datetime(start.year, 10, 28)  # a few days before the clocks go back, whatever the year
    return [(word, [m.strftime("%Y-%m-%d %H:%M:%S") for m in _local(time, autumn, "America/New_York")])]


def _set_back(time, start, word):
    """Return a clock that was put right once, by five minutes backwards."""
    moments = _moments(time, start)
    half = 2 * len(moments) // 3
    moments = [m - timedelta(minutes=5) * (i >= half) for i, m in enumerate(moments)]
    return [(word, [m.strftime("%d/%m/%Y %H:%M:%S") for m in moments])]


def _with_year(time, start, word):
    moments = _moments(time, start)
    iso = [m.strftime("%Y-%m-%d %H:%M:%S") for m in moments]
    parts = [(name, [str(int(m.strftime(form))) for m in moments]) for name, form in (("year", "%Y"), ("hour", "%H"))]
    return [(word, iso), *parts]


WAYS: dict[str, Way] = {
    "seconds": Way(_number("time [s]", 1.0), FAST),
    "plain t": Way(_number("t", 1.0), FAST),
    "milliseconds": Way(_number("Time (ms)", 1e-3), FAST),
    "minutes": Way(_number("t_min", 60.0), (30.0, 60.0, 300.0)),
    "hours": Way(_number("elapsed_h", HOUR), (360.0, HOUR)),
    "iso": Way(_as("%Y-%m-%d %H:%M:%S"), SECONDS, 1.0),
    "iso T Z": Way(_as("%Y-%m-%dT%H:%M:%S.%fZ"), FAST, 1e-6),
    "iso minutes": Way(_as("%Y-%m-%d %H:%M"), MINUTES, 60.0),
    "iso days": Way(_as("%Y-%m-%d"), (DAY, 7 * DAY), DAY),
    "German": Way(_as("%d.%m.%Y %H:%M:%S"), SECONDS, 1.0),
    "German, short": Way(_as("%d.%m.%y %H:%M"), MINUTES, 60.0),
    "British": Way(_as("%d/%m/%Y %H:%M"), MINUTES, 60.0),
    "American": Way(_as("%m/%d/%Y %I:%M:%S %p"), SECONDS, 1.0),
    "American, short": Way(_as("%m/%d/%y %H:%M"), MINUTES, 60.0),
    "spaces": Way(_as("%d %m %Y %H:%M"), MINUTES, 60.0),
    "compact": Way(_as("%Y%m%d %H%M"), MINUTES, 60.0),
    "compact number": Way(_as("%Y%m%d%H%M"), MINUTES, 60.0),
    "compact day": Way(_as("%Y%m%d"), (DAY,), DAY),
    "Matlab": Way(_as("%d-%b-%Y %H:%M:%S"), SECONDS, 1.0),
    "Stata": Way(lambda *a: [(n, [c.lower() for c in cells]) for n, cells in _as("%d%b%Y %H:%M:%S")(*a)], SECONDS, 1.0),
    "SAS": Way(_upper("%d%b%Y:%H:%M:%S"), SECONDS, 1.0),
    "months": Way(_months("%Y-%m"), (MONTH,), MONTH),
    "months by name": Way(_months("%b %Y"), (MONTH,), MONTH),
    "months of Stata": Way(_months_of_stata, (MONTH,), MONTH),
    "months before years": Way(_months("%m/%Y"), (MONTH,), MONTH),
    "quarters": Way(_quarters("{}Q{}"), (3 * MONTH,), 3 * MONTH),
    "quarters of R": Way(_quarters("{} Q{}"), (3 * MONTH,), 3 * MONTH),
    "years": Way(_years, (12 * MONTH,), 12 * MONTH),
    "decimal years": Way(_decimal_years, (MONTH, 3 * MONTH), MONTH),
    "day of year and hour": Way(_parts(("year", "%Y"), ("doy", "%j"), ("hour", "%H")), (HOUR,), HOUR, 3),
    "day of year": Way(_parts(("year", "%Y"), ("doy", "%j")), (DAY,), DAY, 2),
    "Campbell": Way(_campbell, MINUTES, 60.0, 3),
    "date in parts": Way(
        _parts(("Year", "%Y"), ("Month", "%m"), ("Day", "%d"), ("Hour", "%H"), ("Minute", "%M")), MINUTES, 60.0, 5
    ),
    "year and month": Way(_year_and_month, (MONTH,), MONTH, 2),
    "two columns": Way(_two_columns("%Y-%m-%d", "%H:%M:%S"), SECONDS, 1.0),
    "two columns, British": Way(_two_columns("%d/%m/%Y", "%H:%M"), MINUTES, 60.0),
    "two zones": Way(_two_zones, (900.0, 1800.0, HOUR, 3 * HOUR), 1.0),
    "summer time": Way(_summer_time, (600.0, 900.0, 1800.0), 1.0),
    "set back": Way(_set_back, (1.0, 2.0, 10.0, 30.0, 60.0), 1.0),
    "year and hour beside": Way(_with_year, (60.0, 600.0, 900.0, HOUR), 1.0),
    "since 1970": Way(_since_1970(0), SECONDS, 1.0),
    "since 1970, ms": Way(_since_1970(3), FAST, 1e-3),
    "days of Excel": Way(_days_of_excel, MINUTES, 60.0),
    "none": Way(lambda time, start, word: [], (1.0,)),
}


def fitting(dt: float | None) -> list[str]:
    """Return the ways that can write rows ``dt`` seconds apart; all of them for None.

    >>> "months" in fitting(0.1), "seconds" in fitting(0.1)
    (False, True)
    """
    if dt is None:
        return list(WAYS)

    def fits(name: str, way: Way) -> bool:
        if way.unit in (MONTH, 3 * MONTH, 12 * MONTH, DAY, HOUR) or name == "set back":
            return any(abs(dt - step) < 1e-3 * step for step in way.steps)
        is_whole = way.unit == 0.0 or abs(dt / way.unit - round(dt / way.unit)) < 1e-6
        return is_whole and dt <= 10 * max(way.steps) and dt >= 0.1 * min(way.steps)

    return [name for name, way in WAYS.items() if name == "none" or fits(name, way)]
