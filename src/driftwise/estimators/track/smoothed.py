"""Smoothing of a track: the filter goes both ways over a record, wild plots are set aside, the two ways are joined."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...engine import compile
from ...engine.dispatch import flatten
from ...engine.status import Status
from . import bank, both_ways, linear, remembered, step

STAY = 2.0  # log odds of the same member before and after an instant
WILD = 5.0  # deviations off what either side expects: a wild plot
ROUNDS = 8  # of looking for wild plots
BESIDE = 2  # plots on each side: the wildest of its neighbours is set aside, then all are looked at again
LEAST = 3  # plots without which there is nothing to smooth


class Way(NamedTuple):
    """One way over a record: the table of a trace with every member's state behind it, and the state at its end."""

    table: np.ndarray
    row: np.ndarray


def smooth(est, time, position, R) -> np.ndarray:
    """Return the columns of a trace, state and turn given all plots; wild plots are marked as outliers.

    Forecasts, densities and what is said of manoeuvres stay the filter's.

    Parameters
    ----------
    est : TrackEstimator
    time, position, R : (T,), (T, C), (T, C), as `TrackEstimator` checked them
    """
    table = est.run(_fresh(est), time, position, R)
    if not len(time):
        return table
    front, back, y = _both(est, _fresh(est), time, position, R)
    _join(est, table, front, back, y)
    _mark(est, table, position, y)
    return table


def smooth_behind(est, time, position, R, lag: int) -> np.ndarray:
    """Return what `smooth` does, each plot given those before it and the next ``lag`` alone (fixed lag)."""
    table, settled = est.run(_fresh(est), time, position, R), _fresh(est)
    for k in range(len(time)):
        window, this = slice(k, k + lag + 1), slice(k, k + 1)
        front, back, y = _both(est, settled, time[window], position[window], R[window])
        front, back = (Way(way.table[part], way.row) for way, part in ((front, slice(1)), (back, slice(-1, None))))
        _join(est, table[this], front, back, y[:1])
        _mark(est, table[this], position[this], y[:1])
        est.run(settled, time[this], y[:1], R[this])
    return table


def _fresh(est) -> np.ndarray:
    return est.start().reshape(-1).view(float)


def _both(est, start, time, position, R) -> tuple[Way, Way, np.ndarray]:
    """Return both ways, forwards from a state, and the plots without the wild ones."""
    y, is_new = position.copy(), start[bank.SEEN] == 0.0
    front = _way(est, start, time, y, R)
    for _ in range(ROUNDS):
        back = _way(est, _fresh(est), -time[::-1], y[::-1], _noise(est, front.row, R)[::-1], ahead=True)
        front = _way(est, start, time, y, _noise(est, back.row, R) if is_new else R)
        found = _strange(est, y, front.table, back.table[::-1])
        if not found.any():
            break
        y[found] = np.nan
    return front, back, y


def _turns(est) -> list[int]:
    return [est.columns["turn"].start, est.columns["turn_sd"].start]


def _way(est, start, time, position, R, ahead: bool = False) -> Way:
    """Go over a record from a state; ``ahead``: the members' states are those before each plot, not after it."""
    C, row = est.coordinates, start.copy()
    outs = np.empty((len(time), est.n_columns + remembered.told(C) * remembered.each(C)))
    height, width = step.room(C)
    task = remembered.Remembering(*est.task, float(ahead))  # type: ignore[call-arg]  # fields of two
    rows, room, R = np.column_stack([time, position]), np.empty((height + 1, width)), np.array(R, order="C")
    compile.passage(remembered.Remembering)(rows, R, room, outs, row, flatten([task]))
    return Way(outs, row)


def _noise(est, row, R) -> np.ndarray:
    """Return what is stated of the variance of plots; where nothing is, as the members of a state see it."""
    if np.isfinite(R).any() or row[bank.SEEN] < LEAST:
        return R
    C, at = est.coordinates, bank.row_at(est.coordinates)
    w = np.exp(row[at.weights : at.weights + bank.KALMAN] - row[at.weights : at.weights + bank.KALMAN].max())
    scale = np.array([[row[bank.at_linear(C, i, c) + linear.SCALE] for c in range(C)] for i in range(bank.KALMAN)])
    unit = np.exp(row[[bank.of_coordinate(C, bank.LOG, c) for c in range(C)]])
    return np.broadcast_to(unit * (w @ scale) / w.sum(), R.shape)


def _strange(est, y, front, back) -> np.ndarray:
    """Return which plots lie farther off than the plots on either side let expect: the worst of its neighbours."""
    mean, base = est.columns["prediction"], est.columns["base"]
    z2 = np.minimum((y - front[:, mean]) ** 2 / front[:, base], (y - back[:, mean]) ** 2 / back[:, base])
    z2 = np.where(np.isfinite(z2), z2, 0.0).max(axis=1)
    padded = np.pad(z2, BESIDE)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * BESIDE + 1).max(axis=1)
    return (z2 > WILD**2) & (z2 == around)


@lru_cache(2)
def _reversed(C) -> np.ndarray:
    """Return the signs of state and covariance when time runs the other way: velocities are turned round."""
    x = np.where(np.arange(3 * C) % 3 == 1, -1.0, 1.0)
    i, j = np.triu_indices(3 * C)
    return np.concatenate([x, x[i] * x[j]])


def _join(est, table, front: Way, back: Way, y) -> None:
    """Write state, covariance and turn of both ways into a table."""
    C, width, size = est.coordinates, est.n_columns, remembered.each(est.coordinates)
    at = bank.sample_at(C)
    own = slice(at.state, at.covariance + bank.triangle(3 * C))
    future = back.table[::-1]
    table[:, own], table[:, _turns(est)] = front.table[:, own], front.table[:, _turns(est)]
    seen = np.flatnonzero(np.isfinite(y).all(axis=1))
    if len(seen) and not np.isfinite(front.table[seen[0], width::size]).any() and back.row[bank.SEEN] >= LEAST:
        first = seen[0]  # of the first plot the past says nothing: all that is known comes from behind
        table[first, own] = future[first, own] * _reversed(C)
        table[first, _turns(est)] = future[first, _turns(est)] * (-1, 1)
    members = future[:, width:] * np.tile(np.concatenate([[1.0], _reversed(C)]), remembered.told(C))
    places = [bank.of_coordinate(C, bank.FIRST, c) for c in range(C)]
    for c, place in enumerate(places):  # both count from their own first plot
        members[:, 1 + 3 * c :: size] += back.row[place] - front.row[place]
    spec = flatten([both_ways.BothWays(C, est.task.rate, STAY)])
    past, origin = np.ascontiguousarray(front.table[:, width:]), np.ascontiguousarray(front.row[places])
    compile.passage(both_ways.BothWays)(past, members, np.empty(both_ways.room(C)), table, origin, spec)
    _widen_cells(C, table, front, y)


def _widen_cells(C, table, front: Way, y) -> None:
    """Give a place that plots repeat at least the variance of a place within a cell of its lattice: one error."""
    again = y[1:] == y[:-1]
    is_still = np.vstack([again, np.zeros((1, C), bool)]) | np.vstack([np.zeros((1, C), bool), again])
    j, k = np.triu_indices(3 * C)
    for c in range(C):
        at = bank.sample_at(C).covariance + int(np.flatnonzero((j == 3 * c) & (k == 3 * c))[0])
        step = front.row[bank.of_coordinate(C, bank.GRAIN, c)]
        table[:, at] = np.where(is_still[:, c], np.maximum(table[:, at], step**2 / 12.0), table[:, at])


def _mark(est, table, position, y) -> None:
    """Say which plots were set aside, in place of those that the filter took for outliers."""
    at, bit = bank.sample_at(est.coordinates).reported + bank.STATUS, int(Status.OUTLIER)
    wild = np.isfinite(position).all(axis=1) & ~np.isfinite(y).all(axis=1)
    table[:, at] = (table[:, at].astype(int) & ~bit) | np.where(wild, bit, 0)
