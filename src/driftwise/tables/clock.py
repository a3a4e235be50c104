"""The clock of a table: seconds since the first stamp, the step, what is wrong, and midnights between times of day."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from driftwise.tables.cells import NAT, OF_DAY, PER_SECOND

DAY = 86_400.0  # seconds
GAP = 1.75  # a step longer than this many usual steps lost samples


@dataclass
class Clock:
    """Watches time go by, chunk by chunk.

    Numbers keep their own unit. Time stamps become seconds since the first one, `origin`. A missing stamp is
    filled in by adding one step to the stamp before. Duplicate and decreasing stamps are counted, and their
    first row is remembered: rows are used in the order of the file, one sample each, whatever they say.
    """

    name: str = ""
    origin: str | None = None
    dt: float | None = None
    missing: int = 0
    duplicates: int = 0
    decreases: int = 0
    gaps: int = 0
    first_duplicate: int | None = None
    first_decrease: int | None = None
    steps: int = 0
    longest_step: float = 0.0
    _zero: int | None = None
    _unit: Literal["ns", "s"] = "ns"  # of that
    _last: float | None = None

    @property
    def end(self) -> str | None:
        """The last time stamp so far, None where the clock has none."""
        if self._zero is None:
            return None
        return _text(self._zero + round(PER_SECOND[self._unit] * (self._last or 0.0)), self._unit)

    def stamps(self, counts, unit: Literal["ns", "s"] = "ns"):
        """Return seconds since the first valid stamp, NaN where it is missing; ``counts`` since 1970, in one unit."""
        import numpy as np

        valid = counts != NAT
        if self._zero is None and valid.any():
            self._zero, self._unit = int(counts[valid][0]), unit
            self.origin = _text(self._zero, unit)
        zero = (self._zero or 0) * round(PER_SECOND[unit] / PER_SECOND[self._unit])
        return np.where(valid, (counts - zero) / PER_SECOND[unit], np.nan)

    def moments(self, time):
        """Return the stamps, as NumPy has them, of seconds since the first one."""
        import numpy as np

        unit = PER_SECOND[self._unit]
        count = np.where(np.isfinite(time), np.rint(unit * np.nan_to_num(time)), 0).astype(np.int64) + (self._zero or 0)
        return np.where(np.isfinite(time), count, NAT).view(f"datetime64[{self._unit}]")

    def push(self, time, first_row: int):
        """Take the times of the next chunk; return them with gaps in the column filled."""
        import numpy as np

        time = np.asarray(time, float)
        if self.dt is None:
            self.dt = _step(time)
        holes = np.isnan(time)
        if holes.any():
            self.missing += int(holes.sum())
            time = self._fill(time, holes)
        joined = time if self._last is None else np.concatenate(([self._last], time))
        rows = first_row + (1 if self._last is None else 0)  # row of the second of each pair
        steps = np.diff(joined)
        if steps.size:
            self._judge(steps, rows)
        if time.size:
            self._last = float(time[-1])
        return time

    def _judge(self, steps, rows: int) -> None:
        import numpy as np

        low, high = float(steps.min()), float(steps.max())
        if low <= 0:
            same, back = np.flatnonzero(steps == 0), np.flatnonzero(steps < 0)
            if self.first_duplicate is None and same.size:
                self.first_duplicate = int(same[0]) + rows
            if self.first_decrease is None and back.size:
                self.first_decrease = int(back[0]) + rows
            self.duplicates += same.size
            self.decreases += back.size
        if self.dt and high > GAP * self.dt:
            self.gaps += int(np.count_nonzero(steps > GAP * self.dt))
        self.steps += steps.size
        self.longest_step = max(self.longest_step, high)

    def _fill(self, time, holes):
        import numpy as np

        step = self.dt or 1.0
        before = -step if self._last is None else self._last
        index = np.arange(time.size)
        last = np.maximum.accumulate(np.where(holes, -1, index))  # the last stamp seen, -1 for the chunk before
        base = np.where(last < 0, before, time[np.maximum(last, 0)])
        return np.where(holes, base + (index - last) * step, time)

    def notes(self) -> list[str]:
        """Return a sentence for each thing that is wrong with the time column."""
        found, name = [], repr(self.name)
        if self.first_decrease is not None:
            found.append(
                f"time goes backwards {self.decreases} times in {name}, first at row "
                f"{self.first_decrease + 1}: "
                "rows were used in the order of the file; sort it, or look for several recordings joined."
            )
        if self.first_duplicate is not None:
            found.append(
                f"{self.duplicates} time stamps of {name} repeat the one before, first at row "
                f"{self.first_duplicate + 1}: each row was used as one sample; is a row stored twice, or the "
                "clock coarse?"
            )
        if self.gaps > 0.02 * self.steps:
            found.append(
                f"sampling is irregular: {self.gaps} of {self.steps} steps of {name} are longer than {GAP:g} "
                f"usual steps of {self.dt:.6g} (longest {self.longest_step:.6g}). Samples are taken as "
                "equally "
                "spaced; resample the record first."
            )
        elif self.gaps:
            found.append(
                f"{self.gaps} gaps in {name} (usual step {self.dt:.6g}, longest {self.longest_step:.6g}): "
                "samples are taken as equally spaced; put empty rows where samples were lost."
            )
        if self.missing:
            found.append(f"{self.missing} time stamps of {name} are missing or unreadable and were filled in.")
        return found


def _text(count: int, unit: Literal["ns", "s"]) -> str:
    import numpy as np

    said = str(np.datetime64(count, unit))
    return said.rstrip("0").rstrip(".") if unit == "ns" else said


def _step(time):
    """Return the median of the positive steps between neighbours, or None."""
    import numpy as np

    steps = np.diff(time)
    steps = steps[steps > 0]  # NaN is not
    if not steps.size:
        return None
    return float(f"{np.median(steps):.9g}")


class TimeOfDay:
    """Times of day as seconds since the first midnight, chunk by chunk: a step of more than half a day changes the day.

    ``goes_back``: also upwards, as where rows of the day before come late. ``day``: s after which a clock begins anew.

    >>> [TimeOfDay(goes_back).push([86399.0, 1.0, 86398.0]).tolist() for goes_back in (False, True)]
    [[86399.0, 86401.0, 172798.0], [86399.0, 86401.0, 86398.0]]
    """

    def __init__(self, goes_back: bool = False, day: float = DAY):
        self.goes_back, self.day = goes_back, day
        self._days, self._last = 0, math.nan  # the last time of day, NaN before the first

    @classmethod
    def of(cls, kind: str) -> TimeOfDay | None:
        """Return that of a kind of cells, as `kind_of` calls it; None for one that does not begin anew."""
        return cls(day=OF_DAY[kind]) if kind in OF_DAY else None

    def push(self, seconds):
        """Take seconds since midnight (T,), NaN where unknown; return them counted on over midnights."""
        import numpy as np

        out = np.array(seconds, float)
        known = np.isfinite(out)
        found = out[known]
        if found.size:
            steps = np.diff(found, prepend=found[0] if self._last != self._last else self._last)
            changes = (steps < -self.day / 2).astype(int) - (self.goes_back & (steps > self.day / 2))
            days = self._days + np.cumsum(changes)
            self._days, self._last = int(days[-1]), float(found[-1])
            out[known] = found + self.day * days
        return out
