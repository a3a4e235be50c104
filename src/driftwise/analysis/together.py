"""Changes of the columns of a table, whichever is the output: by little each, at one date, beside noise that is learnt.

Each column is a level, one of many noises (`together_noise`), and perhaps a step, or a stretch that goes again, of a
size that nobody knows: what a column says of each date is the ratio of both likelihoods, over all noises. Of a change
that several have, each may take part or not. It is told where it is `SURE` against none, `SEVERAL` against one column
that changes by itself, and `ALIKE` by the sum of the columns alone, in which what they have in common and is slow
counts once. Else the surest change of one column is told, from `SOLE` on, as many columns as there are to choose from.
A column that changes `OFTEN` is one that is moved by somebody: nothing is told of it.

Bad at: sizes below the noise, changes within `SHORT` of a record, columns that only walk, noise that comes and goes.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from .together_noise import Shapes, noises, shapes_of

BLOCKS = 128, 64  # in which a record is looked at: the most that leave two rows each
SIZES = 0.3, 3.0  # variances of what a change does to a column, in those of the column about its mean
TAKES = math.log(0.5)  # log of the chance that a column takes part, and that it does not
SURE, SEVERAL, ALIKE, SOLE = math.log(1000.0), math.log(20.0), math.log(100.0), math.log(10_000.0)
OUTSIDE = np.array([0.025, 0.975])  # shares of dates below and above an interval
NAMED = 0.9  # from which chance on a column is said to take part
OFTEN, MOST, PASSES = 3, 3, 8  # changes of a column from which on they are how it is run; that are told; looked for
MOST_COLUMNS = 16  # that are looked at
KEEP = 9.0  # nats below the best noise, from which on one is left out
COARSE = 29  # of so many shapes one is looked at to know which noises may be left out
FEW, FAR = 15, 4.0  # rows of the median that single values are held against; deviations that one may be from it
LOST = 0.3  # of the values of a column that may be missing
RESTS = 0.98  # of the rows that a set point, or a switch, keeps its value
FINE = 1e-6  # of its size, that a column has to move by


@dataclass(frozen=True)
class Together:
    """A change that several columns have in common.

    since, interval : its first row, and rows between which that lies, 95 %
    until : the row from which on it is gone; None where it stays
    moves : the size in each column that takes part
    odds : against none, and against a change of one column
    time, times, end : ``since``, ``interval`` and ``until`` on a clock
    """

    since: int
    interval: tuple[int, int]
    until: int | None
    moves: dict[str, float]
    odds: float
    time: float = math.nan
    times: tuple[float, float] = (math.nan, math.nan)
    end: float | None = None

    def spans_any(self, times) -> bool:
        """Whether it may have begun at one of some times."""
        return any(self.times[0] <= time <= self.times[1] for time in times)


class Evidence(NamedTuple):
    """What a column (n,) says: log odds of a change by shape; places of the noises that may be its own; itself, scaled.

    ``size`` is what it was divided by.
    """

    odds: np.ndarray
    own: np.ndarray
    x: np.ndarray
    size: float


def together(columns: dict[str, np.ndarray]) -> list[Together]:
    """Return the changes that several columns (T,) have in common, in order of time; NaN where missing.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> moved = np.where(np.arange(600) < 350, 0.0, 1.0)
    >>> found = together({name: rng.normal(size=600) + 2 * moved for name in "abc"})
    >>> [sorted(one.moves) for one in found], abs(found[0].since - 350) < 10
    ([['a', 'b', 'c']], True)
    """
    T = max(map(len, columns.values()), default=0)
    n = next((n for n in BLOCKS if T >= 2 * n), 0)
    usable = {name: x for name, x in columns.items() if is_usable(x)} if n else {}
    x = {name: blocks(calm(filled(values)), n) for name, values in list(usable.items())[:MOST_COLUMNS]}
    found: list[Together] = []
    seen: dict[str, Evidence] = {}
    took = Counter[str]()
    for _ in range(PASSES):
        seen |= {name: evidence(column) for name, column in x.items() if name not in seen}
        one = likeliest(seen, T) if seen else None
        if one is None:
            break
        change, shape = one
        found.append(change)
        took.update(change.moves.keys())
        for name, size in change.moves.items():
            x[name] = x[name] - size * shape
            del seen[name]
            if took[name] == OFTEN:
                del x[name]
    rare = [one for one in found if all(took[name] < OFTEN for name in one.moves)]
    return sorted(sorted(rare, key=lambda one: -one.odds)[:MOST], key=lambda one: one.since)


def is_usable(x) -> bool:
    """Say whether a column is a signal of which enough is known, that moves by itself and does not only rest."""
    seen = x[np.isfinite(x)]
    if len(seen) < (1 - LOST) * len(x) or not np.ptp(seen) > FINE * abs(seen).max():
        return False
    return bool(np.mean(np.diff(seen) == 0) < RESTS)


def filled(x) -> np.ndarray:
    """Return a column with lines across what is missing."""
    seen = np.flatnonzero(np.isfinite(x))
    return np.interp(np.arange(len(x)), seen, x[seen])


def calm(x) -> np.ndarray:
    """Return a column whose single values are no further from the median about them than others mostly are."""
    middle = median_filter(x, FEW, mode="nearest")
    far = FAR * 1.4826 * float(np.median(abs(x - middle)))
    return x if far == 0.0 else middle + np.clip(x - middle, -far, far)


def blocks(x, n: int) -> np.ndarray:
    """Return the means of n blocks of rows."""
    edges = np.linspace(0, len(x), n + 1).astype(int)
    return np.add.reduceat(x, edges[:-1]) / np.diff(edges)


def evidence(x) -> Evidence:
    """Return what a column in blocks (n,) says of each shape: over noises, sizes, and variances as likely in logarithm.

    log p(x) = constant - log(1 + v s's) / 2 - (n - 1) / 2 log(x'x - (s'x)^2 / (s's + 1 / v)), all white, s the shape.
    """
    shapes, grid = shapes_of(len(x)), noises(len(x))
    size = max(float(x.std()), 1e-300)
    x = (x - x.mean()) / size
    whole = np.einsum("i,mij,j->m", x, grid.left, x, optimize=True)
    by = grid.steps @ x.astype(np.float32)
    none = grid.constant - 0.5 * (len(x) - 1) * np.log(whole)
    few = np.arange(0, len(shapes.begin), COARSE)
    m = len(shapes.dates)
    first, last = (shapes.ramp[few] * m + part[few] for part in (shapes.begin, shapes.end))
    along = by[:, first] - np.where(shapes.end[few] < 0, 0.0, by[:, last])
    some = likelihoods(grid.constant[:, None], whole[:, None], grid.free[:, few], along, SIZES[-1], len(x)).max(axis=1)
    own = np.flatnonzero((none > none.max() - KEEP) | (some > some.max() - KEEP))
    top, ratio = float(some.max()), np.zeros(len(shapes.begin))
    for i in own:
        along = shapes.of_steps(by[i])
        for v in SIZES:
            ratio += np.exp(likelihoods(grid.constant[i] - top, whole[i], grid.free[i], along, v, len(x)))
    odds = np.log(ratio / len(SIZES) + 1e-300) + top - float(np.logaddexp.reduce(none))
    return Evidence(odds, own, x, size)


def likelihoods(constant, whole, free, along, v: float, n: int):
    """Return log likelihoods of shapes of a size of variance v."""
    left = whole - along * along / (free + np.float32(1 / v))
    return constant - 0.5 * (n - 1) * np.log(left) - 0.5 * np.log1p(np.float32(v) * free)


def moved(seen: Evidence, k: int) -> tuple[float, float]:
    """Return mean and variance of the size of shape k, as scaled, over the noises of a column."""
    n, v = len(seen.x), SIZES[-1]
    shapes, grid = shapes_of(n), noises(n)
    m, own = len(shapes.dates), seen.own
    steps = grid.steps[own, shapes.ramp[k] * m + shapes.begin[k]].astype(float)
    if shapes.end[k] >= 0:
        steps = steps - grid.steps[own, shapes.ramp[k] * m + shapes.end[k]]
    along, free = steps @ seen.x, grid.free[own, k].astype(float)
    whole = np.einsum("i,mij,j->m", seen.x, grid.left[own], seen.x, optimize=True)
    weight = likelihoods(grid.constant[own], whole, free, along, v, n)
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    mean = along / (free + 1 / v)
    variance = (whole - along * mean) / (n - 2) / (free + 1 / v)
    middle = float(weight @ mean)
    return middle, float(weight @ (variance + (mean - middle) ** 2))


def likeliest(seen: dict[str, Evidence], T: int) -> tuple[Together, np.ndarray] | None:
    """Return the surest change of T rows, of several columns or of one, and its shape (n,); None for none."""
    odds, n = np.array([one.odds for one in seen.values()]), len(next(iter(seen.values())).x)
    shapes = shapes_of(n)
    each = np.logaddexp(TAKES, TAKES + odds)  # the column takes part, or it does not
    none = len(odds) * TAKES
    alone = none + np.logaddexp.reduce(odds, axis=0)
    several = _minus(each.sum(axis=0), np.logaddexp(none, alone)) + shapes.chance
    k = int(np.argmax(several))
    by_none, by_one = total(several) - max(none, 0.0), total(several) - total(alone + shapes.chance)
    if by_none > SURE and by_one > SEVERAL:
        takes = np.exp(TAKES + odds[:, k] - each[:, k])
        sizes = [moved(one, k) for one in seen.values()]
        alike = sum(share * mean / var * one.x for share, (mean, var), one in zip(takes, sizes, seen.values()))
        pairs = zip(seen.items(), takes, sizes)
        moves = {name: mean * one.size for (name, one), share, (mean, _) in pairs if share > NAMED}
        if len(moves) > 1 and total(evidence(alike).odds + shapes.chance) > ALIKE:
            return told(several, k, shapes, n, T / n, moves, min(by_none, by_one))
    return of_one(seen, shapes, n, T / n)


def of_one(seen: dict[str, Evidence], shapes: Shapes, n: int, rows: float) -> tuple[Together, np.ndarray] | None:
    """Return the surest change of one column, and its shape; None where none is sure."""
    sole = {name: total(one.odds + shapes.chance) - math.log(len(seen)) for name, one in seen.items()}
    name = max(sole, key=lambda one: sole[one])
    if sole[name] < SOLE:
        return None
    chance = seen[name].odds + shapes.chance
    k = int(np.argmax(chance))
    return told(chance, k, shapes, n, rows, {name: moved(seen[name], k)[0] * seen[name].size}, sole[name])


def told(chance, k: int, shapes: Shapes, n: int, rows: float, moves: dict[str, float], log_odds: float):
    """Return a change as it is told, and its shape."""
    odds = math.exp(min(log_odds, 700.0))
    return Together(*dated(chance, k, shapes, rows), moves, odds), shapes.shape(k, n)


def dated(log_chance, k: int, shapes: Shapes, rows: float) -> tuple[int, tuple[int, int], int | None]:
    """Return where shape k begins, between which rows that lies, and where it goes again; a block has some rows."""
    chance = np.exp(log_chance - total(log_chance))
    begins = np.cumsum(np.bincount(shapes.begin, chance, len(shapes.dates)))
    low, high = shapes.dates[np.searchsorted(begins, OUTSIDE)] + (-1, 1)
    stays = float(chance[shapes.end < 0].sum())
    until = round(rows * shapes.dates[shapes.end[k]]) if shapes.end[k] >= 0 and stays < OUTSIDE[0] else None
    return round(rows * shapes.dates[shapes.begin[k]]), (max(round(rows * low), 0), round(rows * high)), until


def total(log_odds) -> float:
    """Return the logarithm of a sum."""
    return float(np.logaddexp.reduce(log_odds))


def _minus(a, b):
    """Return log(exp(a) - exp(b))."""
    return a + np.log(np.maximum(-np.expm1(np.minimum(b - a, 0.0)), 1e-12))
