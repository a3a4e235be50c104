"""Samples of many series in order of time, into estimates: what a worker does, whoever calls it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...results.trace import width
from ..fleet import Fleet
from .parcel import COUNTS, Parcel
from .shipped import Shipped, unship

SAMPLES, MEASURED, LATE, DUPLICATE, BAD, TIMELESS = range(len(COUNTS))


class Samples(NamedTuple):
    """Samples of series, those of each in order of time; ``at`` are the numbers of their rows."""

    at: np.ndarray  # (n,)
    seconds: np.ndarray  # (n,) NaN where there is none
    bad: np.ndarray  # (n,) whether a cell was no number
    ys: np.ndarray  # (n, p)
    us: np.ndarray  # (n, k)

    def part(self, chosen) -> Samples:
        """Return some of them."""
        return Samples(*(np.ascontiguousarray(values[chosen]) for values in self))


class Many:
    """Series on one worker: a fleet, the time each was last heard of, and what was counted of each."""

    def __init__(self, shipped: Shipped, keep: str = "innovations", every: int = 1):
        self.estimator = unship(shipped)
        self.fleet = Fleet(self.estimator, threads=1)  # Spark has one worker for each core
        model, p = self.estimator.model, self.fleet.crew.outputs
        self.head, self.n, self.N = self.estimator.n_columns, model.n, model.N
        self.columns = 4 * p if keep == "innovations" else width(keep, model.N, self.head)
        self.keep, self.every = keep, every
        self.last, self.counts = np.empty(0), np.empty((0, len(COUNTS)))
        self.fleet.crew.loop(self.columns)

    def rows_of(self, keys) -> np.ndarray:
        """Return the row of each key, (n,); new ones begin afresh."""
        new = [key for key in keys if key not in self.fleet]
        if new:
            self.fleet.add(new)
            missing = len(self.fleet) - len(self.last)
            self.last = np.append(self.last, np.full(missing, -np.inf))
            self.counts = np.append(self.counts, np.zeros((missing, len(COUNTS))), axis=0)
        return self.fleet.rows_of(keys)

    def put(self, i: int, parcel: Parcel) -> None:
        """Let series ``i`` go on from a parcel."""
        self.fleet._rows[i], self.last[i], self.counts[i] = parcel.row, parcel.last, parcel.counts

    def get(self, i: int, waiting=np.empty((0, 0))) -> Parcel:
        """Return series ``i``."""
        return Parcel(self.fleet._rows[i].copy(), float(self.last[i]), self.counts[i].copy(), waiting)

    def take(self, samples: Samples) -> tuple[Samples, np.ndarray]:
        """Take samples; return those to be shown, and the columns of each.

        A sample is late if its time lies before the last one taken of its series, a duplicate if it is that one's;
        either is counted and not taken, and so is one without a time.
        """
        at, seconds = samples.at, samples.seconds
        last, before = self.last[at], np.append(-np.inf, seconds[:-1])
        before[np.append(True, at[1:] != at[:-1])] = -np.inf
        timeless, late = np.isnan(seconds), seconds < last
        duplicate = (seconds == last) | (~late & (seconds == before))
        taken = samples.part(~(timeless | late | duplicate))
        for column, which in ((TIMELESS, timeless), (LATE, late), (DUPLICATE, duplicate)):
            self._count(column, at[which])
        number = self.counts[taken.at, SAMPLES] + 1 + _place(taken.at)
        self._count(SAMPLES, taken.at)
        self._count(MEASURED, taken.at[np.isfinite(taken.ys).any(axis=1)])
        self._count(BAD, taken.at[taken.bad])
        np.maximum.at(self.last, taken.at, taken.seconds)
        outs = self.fleet.advance(taken.at, taken.ys, taken.us, self.columns)
        if self.every == 1:
            return taken, outs
        shown = number % self.every == 0
        return taken.part(shown), outs[shown]

    def _count(self, column, at) -> None:
        if len(at):
            self.counts[:, column] += np.bincount(at, minlength=len(self.counts))


def _place(at) -> np.ndarray:
    """Return how many samples of its own row stand before each, rows being together."""
    first = np.flatnonzero(np.append(True, at[1:] != at[:-1])) if len(at) else np.empty(0, int)
    return np.arange(len(at)) - np.repeat(first, np.diff(np.append(first, len(at))))
