"""What a column in blocks says of a change: by itself, beside other columns, and by how loud it is.

Two things may be said of a column of which others tell something: it is itself, with a noise of its own; or it follows
the others by coefficients that nobody knows, and what is left has a noise of its own. Both are weighed by how likely
they make what was seen (`odds_of`), so that what mains, load or warming do to all columns hides a change of none.
What the others share is little (`shared`): to follow that costs fewer numbers than to follow each of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .together_loudness import Loudness, of_halves
from .together_loudness import loudness as loudness_of
from .together_noise import EACH_SLOW, NOTHING_SLOW, TINY, noises, shapes_of
from .together_white import EXACT, Seen, White, seen

SIZES = 0.3, 6.0, 120.0  # variances of what a change does to a column, in those of the column about its mean
STEADY = 0.95  # how likely the noise of a sensor is as loud throughout, or changes by chance alone
KEEP = 6.0  # nats below the best noise, from which on one is left out
COARSE = 29  # of so many shapes one is looked at to know which noises may be left out
AT_ONCE = 2**15  # shapes times noises that are weighed at a time: what a processor has at hand
FEW, FAR = 15, 4.0  # rows of the median that single values are held against; deviations that one may be from it
MOVING, STILL = 0.3, 12  # share of equal rows of a sensor that moves; so many of them in a row, and it is stuck


@dataclass(frozen=True)
class Evidence:
    """What column ``j`` of some says, perhaps beside others: log likelihoods without a change, and of each shape.

    ``seen`` is the column under the noises that may be its own, of whose loudness so many numbers (``freedom``) tell.
    """

    white: White
    j: int
    none: float
    shapes: np.ndarray
    seen: Seen
    freedom: int

    @property
    def size(self) -> float:
        """What the column was divided by."""
        return float(self.white.sizes[self.j])

    @property
    def odds(self) -> np.ndarray:
        """Log odds of a change, by shape."""
        return self.shapes - self.none


def evidence(white: White, j: int = 0, beside: Sequence[int] = (), steady=NOTHING_SLOW, halves=None) -> Evidence:
    """Return what column j says of each shape: over noises, sizes, and variances as likely in logarithm.

    log p(x) = constant - log(1 + v s's) / 2 - (n - 1) / 2 log(x'x - (s'x)^2 / (s's + 1 / v)), all white, s the shape,
    and without what others, those ``beside``, say of x and of s; ``steady`` is how likely beforehand nothing is slow.
    What ``halves`` of blocks differ by, (m,), no change does: x'x grows by their squares, white, and n by m.
    """
    n = len(white.X)
    by, freedom = seen(white, j, beside), n - 1
    if halves is not None:
        by, freedom = with_halves(by, halves / white.sizes[j], of_halves(n)), freedom + len(halves)
    prior = np.where(noises(n).is_slow, math.log((1 - steady) / EACH_SLOW), math.log(steady / NOTHING_SLOW))
    none = by.constant + prior - 0.5 * freedom * np.log(by.whole)

    shapes, top = len(shapes_of(n).begin), float(none.max())
    some = by_size(to_scale(by, prior - top, freedom), n, np.arange(0, shapes, COARSE), freedom)
    best = np.array([logs.max(axis=0) for logs in some])
    may = (none > top - KEEP) | (best > best.max() - KEEP)  # (sizes, noises)
    own, top = may.any(axis=0), top + float(best.max())
    by, may = by.under(own), may[:, own].astype(np.float32)
    step, ratio, relative = max(AT_ONCE // len(by.which), 1), np.zeros(shapes), to_scale(by, prior[own] - top, freedom)
    for part in (slice(k, k + step) for k in range(0, shapes, step)):
        for logs, its_noises in zip(by_size(relative, n, part, freedom), may):
            ratio[part] += np.exp(logs, out=logs) @ its_noises
    found = np.log(ratio / len(SIZES) + 1e-300) + top
    return Evidence(white, j, float(np.logaddexp.reduce(none)), found, by, freedom)


def with_halves(by: Seen, halves, loud) -> Seen:
    """Return a column by itself, of which halves of blocks differ, (m,), by variances ``loud`` under each noise."""
    constant = by.constant - 0.5 * len(halves) * np.log(loud)
    return by._replace(constant=constant, whole=by.whole + halves @ halves / loud)


def to_scale(by: Seen, more, freedom: int) -> Seen:
    """Return a column so scaled under each noise that its likelihood has no constant left, nor ``more``, (noises,)."""
    scale = np.exp(-(by.constant + more) / freedom)
    whole, along = (by.whole * scale**2).astype(np.float32), by.along * scale.astype(np.float32)
    return by._replace(constant=np.zeros(len(whole)), whole=whole, along=along)


def by_size(by: Seen, n: int, which, freedom: int) -> Iterator[np.ndarray]:
    """Yield log likelihoods of some shapes, (shapes, noises), but for constants, for each size."""
    along, free = white_shapes(by, n, which)
    squares = np.square(along, out=along)
    for v in SIZES:
        yield likelihoods(by.whole, free, squares, v, freedom)


def white_shapes(by: Seen, n: int, which) -> tuple[np.ndarray, np.ndarray]:
    """Return some shapes times a column, and their squares, (shapes, noises), without what others say of either."""
    shapes = shapes_of(n)
    along, free = shapes.of_steps(by.along, which), noises(n).free[which].take(by.which, axis=1)
    for other in by.others:
        told = shapes.of_steps(other, which)
        free -= np.square(told, out=told)
    return along, np.maximum(free, np.float32(TINY), out=free)


def likelihoods(whole, free, squares, v: float, freedom: int):
    """Return log likelihoods of shapes of a size of variance v, where so many numbers say how loud the noise is.

    ``whole`` is the square of the column, ``free`` are those of the shapes, ``squares`` those of shapes times column.
    """
    grown = free + np.float32(1 / v)
    left = squares / grown
    np.subtract(whole, left, out=left)
    if left.min() < EXACT * whole.max():
        np.maximum(left, np.float32(EXACT) * whole, out=left)
    np.log(left, out=left)
    left *= np.float32(-0.5 * freedom)
    np.log(grown, out=grown)
    grown *= np.float32(0.5)
    left -= grown
    left -= np.float32(0.5 * math.log(v))
    return left


def moved(one: Evidence, k: int) -> tuple[float, float]:
    """Return mean and variance of the size of shape k, as scaled, over the noises of a column."""
    by, v = one.seen, SIZES[-1]
    along, free = (part[0].astype(float) for part in white_shapes(by, len(one.white.X), [k]))
    weight = by.constant + likelihoods(by.whole, free, along * along, v, one.freedom)
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    mean = along / (free + 1 / v)
    variance = (by.whole - along * mean) / (one.freedom - 1) / (free + 1 / v)
    middle = float(weight @ mean)
    return middle, float(weight @ (variance + (mean - middle) ** 2))


def odds_of(*ways: Evidence | None) -> np.ndarray:
    """Return log odds of a change of a column that may be seen in several ways, each as likely beforehand."""
    there = [way for way in ways if way is not None]
    none = np.logaddexp.reduce([way.none for way in there])
    return np.logaddexp.reduce([way.shapes for way in there], axis=0) - none


def filled(x) -> np.ndarray:
    """Return a column with lines across what is missing."""
    there = np.flatnonzero(np.isfinite(x))
    return np.interp(np.arange(len(x)), there, x[there])


def calm(x) -> np.ndarray:
    """Return a column whose single values are no further from the median about them than others mostly are."""
    middle = np.median(sliding_window_view(np.pad(x, FEW // 2, mode="edge"), FEW), axis=1)
    far = FAR * 1.4826 * float(np.median(abs(x - middle)))
    return x if far == 0.0 else middle + np.clip(x - middle, -far, far)


def blocks(x, n: int) -> np.ndarray:
    """Return the means of n blocks of rows (T,), on a line where all are missing; lone values far from others cut."""
    there = np.isfinite(x)
    edges = np.linspace(0, len(x), n + 1).astype(int)[:-1]
    counts = np.add.reduceat(there.astype(int), edges)
    sums = np.add.reduceat(np.where(there, calm(filled(x)), 0.0), edges)
    known = np.flatnonzero(counts)
    return np.interp(np.arange(n), known, sums[known] / counts[known])


def loudness(x, n: int) -> Loudness | None:
    """Return how loud a column is in n blocks: logarithms of mean squares of errors; None where it is not heard.

    >>> x = np.random.default_rng(0).normal(size=640) * np.repeat([1.0, 3.0], 320)
    >>> np.exp(np.diff(loudness(x, 64).blocks.reshape(2, 32).mean(axis=1)) / 2).round(1)
    array([2.7])
    """
    return loudness_of(x, calm(filled(x)), n)


def unstuck(x) -> np.ndarray:
    """Return a column (T,) whose sensor mostly moves without the rows in which it is stuck: NaN."""
    same = np.diff(x) == 0
    if not same.any() or np.mean(same) > MOVING:
        return x
    edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False]))))
    x = x.copy()
    for first, last in edges.reshape(-1, 2):
        if last - first >= STILL:
            x[first : last + 1] = np.nan
    return x
