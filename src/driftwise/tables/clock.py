"""The time column of a record: seconds since the first stamp, the sampling step, and what is wrong."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Clock"]

GAP = 1.75  # a step longer than this many usual steps lost samples
_NAT = -(2**63)


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
    _last: float | None = None

    @property
    def end(self) -> str | None:
        """The last time stamp so far, None where the clock has none."""
        return None if self._zero is None else _text(self._zero + round(1e9 * (self._last or 0.0)))

    def stamps(self, nanoseconds):
        """Return seconds since the first valid stamp; NaN where the stamp is missing."""
        import numpy as np

        valid = nanoseconds != _NAT
        if self._zero is None and valid.any():
            self._zero = int(nanoseconds[valid][0])
            self.origin = _text(self._zero)
        seconds = (nanoseconds - (self._zero or 0)) / 1e9
        return np.where(valid, seconds, np.nan)

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


def _text(nanoseconds: int) -> str:
    import numpy as np

    return str(np.datetime64(nanoseconds, "ns")).rstrip("0").rstrip(".")


def _step(time):
    """Return the median of the positive steps between neighbours, or None."""
    import numpy as np

    steps = np.diff(time)
    steps = steps[steps > 0]  # NaN is not
    if not steps.size:
        return None
    return float(f"{np.median(steps):.9g}")
