"""What a column in blocks says of a change: by itself, beside other columns, and by how loud it is.

Two things may be said of a column of which others tell something: it is itself, with a noise of its own; or it follows
the others by coefficients that nobody knows, and what is left has a noise of its own. Both are weighed by how likely
they make what was seen (`odds_of`), so that what mains, load or warming do to all columns hides a change of none.
What the others share is little (`shared`): to follow that costs fewer numbers than to follow each of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .together_loudness import Loudness, of_halves
from .together_loudness import loudness as loudness_of
from .together_noise import EACH_SLOW, NOTHING_SLOW, TINY, noises, shapes_of

SIZES = 0.3, 6.0, 120.0  # variances of what a change does to a column, in those of the column about its mean
STEADY = 0.95  # how likely the noise of a sensor is as loud throughout, or changes by chance alone
FOLLOWS = 30.0  # variance of what a column follows another by, both scaled, in that of the noise
EXACT = 1e-6  # of its squares, that others are never said to know of a column
KEEP = 6.0  # nats below the best noise, from which on one is left out
COARSE = 29  # of so many shapes one is looked at to know which noises may be left out
FEW, FAR = 15, 4.0  # rows of the median that single values are held against; deviations that one may be from it
MOVING, STILL = 0.3, 12  # share of equal rows of a sensor that moves; so many of them in a row, and it is stuck


@dataclass(frozen=True)
class Evidence:
    """What a column (n,) says, beside others (n, q): log likelihoods without a change, and of each shape of one.

    ``own`` are the places of the noises that may be its own; ``size`` is what the column was divided by; ``halves`` is
    half of what those of each block differ by.
    """

    none: float
    shapes: np.ndarray
    own: np.ndarray
    x: np.ndarray
    beside: np.ndarray | None
    size: float
    halves: np.ndarray | None = None

    @property
    def freedom(self) -> int:
        """How many numbers say how loud its noise is."""
        return len(self.x) - 1 + _count(self.halves)

    @property
    def odds(self) -> np.ndarray:
        """Log odds of a change, by shape."""
        return self.shapes - self.none


class Seen(NamedTuple):
    """A column under some noises, white, the others taken out: log likelihood but for what is left; squares; steps.

    along : (noises, steps), the white shape of each step times z
    others : (noises, q, steps), the same times what the others say, of length one; None without any
    """

    constant: np.ndarray
    whole: np.ndarray
    along: np.ndarray
    others: np.ndarray | None


def seen(x, beside, which, halves=None) -> Seen:
    """Return a column (n,) beside others (n, q), or with its ``halves`` and no other, under some noises."""
    grid = noises(len(x))
    left, steps, constant = grid.left[which], grid.steps[which], grid.constant[which]
    white = left @ x
    along = steps @ x.astype(np.float32)
    if beside is None and halves is not None:
        loud = of_halves(len(x))[which]
        return Seen(constant - 0.5 * len(halves) * np.log(loud), white @ x + halves @ halves / loud, along, None)
    if beside is None:
        return Seen(constant, white @ x, along, None)
    gram = np.einsum("ib,mij,jc->mbc", beside, left, beside, optimize=True) + np.eye(beside.shape[1]) / FOLLOWS
    root = np.linalg.cholesky(gram)
    told = np.linalg.solve(root, (white @ beside)[..., None])[..., 0]
    others = (np.linalg.inv(root) @ (steps @ beside.astype(np.float32)).transpose(0, 2, 1)).astype(np.float32)
    constant = constant - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
    constant = constant - 0.5 * beside.shape[1] * math.log(FOLLOWS)
    along = along - np.einsum("mq,mqd->md", told.astype(np.float32), others)
    whole = np.maximum(white @ x - (told**2).sum(axis=1), 0.0) + EXACT * (white @ x)
    return Seen(constant, whole, along, others)


def scaled(x) -> tuple[np.ndarray, float]:
    """Return a column about its mean, of deviation one, and what it was divided by."""
    size = max(float(x.std()), 1e-300)
    return (x - x.mean()) / size, size


def evidence(x, beside=None, steady: float = NOTHING_SLOW, halves=None) -> Evidence:
    """Return what a column in blocks (n,) says of each shape: over noises, sizes, and variances as likely in logarithm.

    log p(x) = constant - log(1 + v s's) / 2 - (n - 1) / 2 log(x'x - (s'x)^2 / (s's + 1 / v)), all white, s the shape,
    and without what others (n, q), scaled, say of x and of s; ``steady`` is how likely beforehand nothing is slow. What
    ``halves`` of blocks differ by, (m,), no change does: x'x grows by their squares, white, and n by m.
    """
    n = len(x)
    shapes, grid = shapes_of(n), noises(n)
    x, size = scaled(x)
    halves = None if halves is None else halves / size
    freedom = n - 1 + _count(halves)
    by = seen(x, beside, slice(None), halves)
    slow = math.log((1 - steady) / EACH_SLOW)
    by = by._replace(constant=by.constant + np.where(grid.is_slow, slow, math.log(steady / NOTHING_SLOW)))
    none = by.constant - 0.5 * freedom * np.log(by.whole)
    few = np.arange(0, len(shapes.begin), COARSE)

    free = _free(grid.free[:, few], None if by.others is None else shapes.of_steps(by.others, few))
    along = shapes.of_steps(by.along, few)
    some = np.array(
        [likelihoods(by.constant[:, None], by.whole[:, None], free, along, v, freedom).max(axis=1) for v in SIZES]
    )
    may = (none > none.max() - KEEP) | (some > some.max() - KEEP)  # (sizes, noises)
    own, may = np.flatnonzero(may.any(axis=0)), may[:, may.any(axis=0)]
    top, ratio = float(some.max()), np.zeros(len(shapes.begin))
    for i, sizes in zip(own, may.T):
        along = shapes.of_steps(by.along[i])
        free = _free(grid.free[i], None if by.others is None else shapes.of_steps(by.others[i]))
        for v in np.array(SIZES)[sizes]:
            constant, whole = float(by.constant[i] - top), float(by.whole[i])
            ratio += np.exp(likelihoods(constant, whole, free, along, float(v), freedom))
    found = np.log(ratio / len(SIZES) + 1e-300) + top
    return Evidence(float(np.logaddexp.reduce(none)), found, own, x, beside, size, halves)


def shared(X, q: int) -> np.ndarray:
    """Return what columns (n, p) share, the most of it first: q principal components, each of deviation one."""
    U = np.linalg.svd(X, full_matrices=False)[0][:, :q]
    return U * math.sqrt(len(X))


def _count(halves) -> int:
    return 0 if halves is None else len(halves)


def _free(free, others):
    """Return squares of white shapes, without what others (.., q, shapes) say of them."""
    if others is None:
        return free
    return np.maximum(free - np.einsum("...qk,...qk->...k", others, others), np.float32(TINY))


def likelihoods(constant, whole, free, along, v: float, freedom: int):
    """Return log likelihoods of shapes of a size of variance v, where so many numbers say how loud the noise is."""
    left = np.maximum(whole - along * along / (free + np.float32(1 / v)), EXACT * whole)
    return constant - 0.5 * freedom * np.log(left) - 0.5 * np.log1p(np.float32(v) * free)


def moved(one: Evidence, k: int) -> tuple[float, float]:
    """Return mean and variance of the size of shape k, as scaled, over the noises of a column."""
    n, v = len(one.x), SIZES[-1]
    shapes, grid = shapes_of(n), noises(n)
    by = seen(one.x, one.beside, one.own, one.halves)
    free = _free(grid.free[one.own][:, [k]], None if by.others is None else shapes.of_steps(by.others, [k]))[:, 0]
    along = shapes.of_steps(by.along, [k])[:, 0].astype(float)
    weight = likelihoods(by.constant, by.whole, free.astype(float), along, v, one.freedom)
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
