"""Samples of many series as columns: those of a series stand together, in the order they came."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .grouping import stable_order


class Samples(NamedTuple):
    """Rows of a table on their way into a fleet, one entry of each column per row.

    at : row of the fleet; time, ys, us, bad : as in a batch; source : row of the table
    gap : ticks without a row before this one
    """

    at: np.ndarray
    time: np.ndarray
    ys: np.ndarray
    us: np.ndarray
    bad: np.ndarray
    source: np.ndarray
    gap: np.ndarray

    def pick(self, where) -> Samples:
        """Return some of them, by index or mask; a mask that leaves none out costs nothing."""
        if where.dtype == bool:
            if where.all():
                return self
            where = np.flatnonzero(where)
        return Samples(*(_taken(column, where) for column in self))

    def grouped(self, series: int) -> Samples:
        """Return them ordered by row of the fleet (of so many), those of one as they stand."""
        if np.all(self.at[1:] >= self.at[:-1]):
            return self
        return self.pick(stable_order(self.at, series))


def _taken(column, where):
    """Return some rows of a column; NumPy is slow where a row has no entries."""
    return column.take(where, axis=0) if column.size else np.empty((len(where), *column.shape[1:]), column.dtype)


def joined(parts: list[Samples]) -> Samples:
    """Return samples one after the other."""
    return Samples(*map(np.concatenate, zip(*parts)))


def starts_of(at) -> np.ndarray:
    """Return where each group of equal entries begins, and the length at the end."""
    edges = np.append(True, at[1:] != at[:-1]) if len(at) else np.zeros(0, bool)
    return np.append(np.flatnonzero(edges), len(at))


def rank_of(starts) -> np.ndarray:
    """Return the number of each entry within its group, from 0."""
    return np.arange(starts[-1]) - np.repeat(starts[:-1], np.diff(starts))


def running_max(values, at) -> np.ndarray:
    """Return the largest of each entry and those before it in its group: by doubling, as long as a group reaches."""
    best, step = values.copy(), 1
    while step < len(at):
        is_same = at[step:] == at[:-step]
        if not is_same.any():
            break
        best[step:] = np.where(is_same, np.maximum(best[step:], best[:-step]), best[step:])
        step *= 2
    return best
