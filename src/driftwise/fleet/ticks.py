"""Time in a fleet: what of each series comes after what was taken already, and which ticks were missed between."""

from __future__ import annotations

import numpy as np

from ..engine import validation
from .samples import Samples, rank_of, running_max, starts_of

LONGEST = 10_000  # missing ticks in a row that are taken as samples


class Ticks:
    """The ticks of each series, in columns: ``number`` of samples, ``origin``, ``last`` tick (or time, without dt)."""

    def __init__(self, columns, tally, dt: float | None, longest: int = LONGEST):
        self.columns, self.tally = columns, tally
        self.dt = None if dt is None else validation.size("dt", dt)
        self.longest = validation.count("longest", longest)

    def in_order(self, samples: Samples) -> Samples:
        """Return samples without a clock with their numbers as time."""
        starts = starts_of(samples.at)
        series, number = samples.at[starts[:-1]], self.columns["number"]
        time = (number[samples.at] + rank_of(starts)) * (self.dt or 1.0)
        number[series] += np.diff(starts)
        return samples._replace(time=time)

    def in_time(self, samples: Samples) -> Samples:
        """Return the samples that are later than all before them of their series, with the ticks missed before each."""
        if not len(samples.at):
            return samples
        starts = starts_of(samples.at)
        series, begins = samples.at[starts[:-1]], starts[:-1]
        origin, last = self.columns["origin"], self.columns["last"]
        origin[series] = np.where(np.isnan(origin[series]), samples.time[begins], origin[series])
        tick = self._ticks(samples.time, samples.at)
        before = _shifted(tick, begins, last[series])
        if not (tick > before).all():
            so_far = _shifted(np.full(len(tick), -np.inf), begins, last[series])
            best = running_max(np.maximum(tick, so_far), samples.at)
            before = _shifted(best, begins, last[series])
            self.tally.count("late", samples.at[tick < before])
            self.tally.count("duplicate", samples.at[tick == before])
            is_next = tick > before
            samples, tick, before = samples.pick(is_next), tick[is_next], before[is_next]
            starts = starts_of(samples.at)
            series = samples.at[starts[:-1]]
        if self.dt is not None:
            samples = samples._replace(gap=self._gaps(samples.at, tick - before - 1))
        last[series] = tick[starts[1:] - 1]
        self.columns["number"][series] += np.diff(starts)
        return samples

    def _ticks(self, time, at):
        """Return the tick nearest to each time; without dt, time itself."""
        return time if self.dt is None else np.rint((time - self.columns["origin"][at]) / self.dt)

    def _gaps(self, at, missed):
        """Return how many of the missed ticks become samples; count those that do not."""
        missed = np.where(np.isfinite(missed), missed, 0.0)  # before the first sample none is missed
        beyond = missed > self.longest
        if beyond.any():
            self.tally.count("jumped", at[beyond], missed[beyond] - self.longest)
        return np.minimum(missed, self.longest).astype(np.int32)

    def earlier(self, time, at, back):
        """Return the instants of so many ticks before those nearest to each time."""
        return self.columns["origin"][at] + (self._ticks(time, at) - back) * self.dt


def _shifted(values, begins, first):
    """Return the entry before each, ``first`` at the beginning of each group."""
    before = np.empty(len(values))
    before[1:] = values[:-1]
    before[begins] = first
    return before
