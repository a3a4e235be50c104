"""Times of day, 13:45:00, beside a column of dates or alone."""

from __future__ import annotations

__all__ = ["TimeOfDay", "of_day"]

DAY = 86_400.0
_CLOCK = r"^\d{1,2}:\d\d(:\d\d([.,]\d+)?)?$"


def of_day(column):
    """Return (seconds since midnight, NaN where missing or no time of day; how many cells are one)."""
    import numpy as np
    import pyarrow as pa
    import pyarrow.compute as pc

    from driftwise.tables.cells import is_text

    if pa.types.is_time(column.type):
        values = column.cast(pa.time64("ns")).cast(pa.int64()).cast(pa.float64(), safe=False)
        return values.to_numpy(zero_copy_only=False) / 1e9, len(column) - column.null_count
    if not is_text(column.type):
        return np.full(len(column), np.nan), 0
    cells = pc.utf8_trim_whitespace(column.cast(pa.string()))
    good = pc.fill_null(pc.match_substring_regex(cells, _CLOCK), False)
    cells = pc.if_else(good, pc.replace_substring(cells, ",", "."), pa.scalar(None, pa.string()))
    cells = pc.replace_substring_regex(cells, r"^(\d+:\d\d)$", r"\1:00")
    seconds = np.zeros(len(column))
    for part, unit in ((r"^(\d+):.*$", 3600.0), (r"^\d+:(\d+):.*$", 60.0), (r"^\d+:\d+:([\d.]+)$", 1.0)):
        number = pc.replace_substring_regex(cells, part, r"\1").cast(pa.float64())
        seconds += unit * number.to_numpy(zero_copy_only=False)
    return seconds, int(pc.sum(good).as_py() or 0)


class TimeOfDay:
    """Times of day as seconds since the first midnight: a clock that falls back by half a day has begun another."""

    def __init__(self):
        self._days, self._last = 0, None

    def push(self, seconds):
        """Take seconds since midnight (T,); return them counted on over midnights."""
        import numpy as np

        known = np.isfinite(seconds)
        found = seconds[known]
        if not found.size:
            return seconds
        steps = np.diff(found, prepend=found[0] if self._last is None else self._last)
        days = self._days + np.cumsum(steps < -DAY / 2)
        self._days, self._last = int(days[-1]), float(found[-1])
        out = seconds.copy()
        out[known] = found + DAY * days
        return out
