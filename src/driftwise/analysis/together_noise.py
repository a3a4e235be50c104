"""Noises that a column may have, and what a change that lasts, or goes again, looks like beside each of them.

A record is looked at in blocks, so that its noises and shapes are the same whatever its length: K is the covariance of
a noise in blocks, L its Cholesky factor, and L^-1 what turns the noise white. The level is nobody's, and taken out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import solve_triangular, toeplitz

FAST = ((0.0, 0.5), (0.5, 0.3), (0.8, 0.2))  # what a block keeps of the one before, and how likely that is
NOTHING_SLOW, EACH_SLOW = 0.25, 0.75  # how likely a column has nothing slow, or something
POWERS = 0.1, 0.5, 2.5, 12.0, 60.0, 300.0  # variance of what is slow, that of what is fast being one
WALKS = (*POWERS, 1500.0)  # the same of a walk, over the record
BENDS = (*POWERS, 1500.0, 7500.0, 40000.0)  # and of what has no kinks
FORGETS = 0.03, 0.1, 0.3  # of the record: the time in which something slow forgets
SMOOTH = 0.1, 0.3, 1.0  # the same of something that has no kinks
LINES = POWERS[2:]  # the same of a line over the record
CYCLES = 1.5, 3.0, 6.0, 12.0, 24.0  # in a record, of something that swings
LASTS = 3.0  # cycles after which a swing is forgotten
LARGE = 2.5  # power from which on a larger one is less likely, by its root
RAMPS = 1 / 64, 3 / 64, 8 / 64  # of the record, within which a change comes
EDGE, SHORT = 1 / 24, 1 / 16  # of the record: no change begins nearer to an end, or goes again sooner
TINY = 1e-9  # added to the diagonal of K


class Shapes(NamedTuple):
    """What a change may look like: the block it begins and ends with (-1: it stays), by ramp; log of how likely.

    It comes, and goes, within a ramp, or grows from its beginning on and stops at once. All are linear in steps, of
    which `edges` has columns: scale (one of them less another) less a third.
    """

    dates: np.ndarray  # blocks at which one may begin, or end
    begin: np.ndarray  # of each shape, as a place among the dates
    end: np.ndarray
    ramp: np.ndarray  # the place among `RAMPS`; behind them: it grows
    chance: np.ndarray
    first: np.ndarray  # places among the steps
    last: np.ndarray
    third: np.ndarray
    scale: np.ndarray

    def lasts(self, k: int, n: int) -> int:
        """Return in how many of n blocks shape k comes; 0 where it grows from its beginning to its end."""
        return round(RAMPS[self.ramp[k]] * n) if self.ramp[k] < len(RAMPS) else 0

    def shape(self, k: int, n: int) -> np.ndarray:
        """Return shape k in n blocks, (n,)."""
        return self.of_steps(edges(n, self.dates).T, [k])[0]

    def of_steps(self, by, which: Any = slice(None)) -> np.ndarray:
        """Return (shapes, ..) of what is linear in a shape, from that of the steps (steps, ..), in order."""
        found = by.take(self.first[which], axis=0)
        found -= by.take(self.last[which], axis=0)
        grows = np.searchsorted(self.ramp[which], len(RAMPS))  # the last ones
        found[grows:] *= self.scale[which][grows:].reshape(-1, *[1] * (by.ndim - 1))
        found[grows:] -= by.take(self.third[which][grows:], axis=0)
        return found

    def expected(self, done) -> np.ndarray:
        """Return the log of how likely each shape is where something was done at some blocks, nearly.

        That one of these began something is as likely as that something began at any block.
        """
        found = self.chance
        for block in done:
            own = self.begin == int(np.argmin(abs(self.dates - block)))
            more = self.chance - np.logaddexp.reduce(self.chance[own]) - math.log(len(done))
            found = np.where(own, np.logaddexp(found, more), found)
        return found

    def squares(self, gram) -> np.ndarray:
        """Return the square of each shape, from the products of the steps (steps, steps)."""
        own, (a, b, c) = np.diagonal(gram), (self.first, self.last, self.third)
        edge = own[a] + own[b] - 2.0 * gram[a, b]
        return self.scale**2 * edge + own[c] - 2.0 * self.scale * (gram[a, c] - gram[b, c])


class Noises(NamedTuple):
    """Noises that a column of n blocks may have: white z = L^-1 x beside a level that nobody knows.

    constant : (noises,), the log likelihood, but for what is left of z
    left : (noises, n, n), x @ left @ x = z @ z
    steps : (n, steps, noises), x @ steps is what the white shape of each step is times z
    free : (shapes, noises), the square of each shape, white
    is_slow : (noises,), whether there is something slow
    """

    constant: np.ndarray
    left: np.ndarray
    steps: np.ndarray
    free: np.ndarray
    is_slow: np.ndarray


@lru_cache(2)
def shapes_of(n: int) -> Shapes:
    """Return the shapes of changes in n blocks: half of them stay, half go again, each as likely as another."""
    margin, short = math.ceil(EDGE * n), math.ceil(SHORT * n)
    dates = np.arange(margin, n - margin + 1)
    m, r = len(dates), len(RAMPS)
    a, b = np.triu_indices(m, short)
    goes = len(a)
    begin = np.concatenate([np.tile(np.concatenate([np.arange(m), a]), r), a])
    end = np.concatenate([np.tile(np.concatenate([np.full(m, -1), b]), r), b])
    each = np.full(m, -math.log(2 * r * m)), np.full(goes, -math.log(2 * (r + 1) * goes))
    chance = np.concatenate([*each] * r + [each[1]])
    ramp = np.repeat(np.arange(r + 1), [m + goes] * r + [goes])
    none = (r + 1) * m
    last = np.where(end < 0, none, ramp * m + end)
    third = np.where(ramp == r, end, none)
    scale = np.where(ramp == r, n / np.maximum(end - begin, 1), 1.0).astype(np.float32)
    return Shapes(dates, begin, end, ramp, chance, ramp * m + begin, last, third, scale)


def step(n: int, dates, ramp: float) -> np.ndarray:
    """Return steps (n, dates) that come within a share of the record."""
    return np.clip((np.arange(n)[:, None] - dates + 0.5) / max(round(ramp * n), 1), 0.0, 1.0)


def edges(n: int, dates) -> np.ndarray:
    """Return what shapes are made of, (n, steps): steps by ramp, what grows from each date on, and nothing."""
    grows = np.maximum(np.arange(n)[:, None] - dates + 0.5, 0.0) / n
    return np.column_stack([*(step(n, dates, ramp) for ramp in RAMPS), grows, np.zeros(n)])


@lru_cache(2)
def noises(n: int) -> Noises:
    """Return the noises that a column of n blocks may have."""
    shapes = shapes_of(n)
    beside = np.column_stack([np.ones(n), edges(n, shapes.dates), np.eye(n)])
    found = [_noise(K, math.log(chance), beside, shapes) for K, chance in covariances(n)]
    constant, left, steps, free = (np.array(part) for part in zip(*found))
    is_slow = np.arange(len(found)) % (len(found) // len(FAST)) > 0
    return Noises(constant, left, np.ascontiguousarray(steps.T), np.ascontiguousarray(free.T), is_slow)


def _noise(K, log_chance: float, beside, shapes: Shapes):
    n = len(K)
    L = np.linalg.cholesky(K / (np.trace(K) / n - K.mean()) + TINY * np.eye(n))  # of variance one about its mean
    white = solve_triangular(L, beside, lower=True, check_finite=False)
    level = np.linalg.norm(white[:, 0])
    own = white[:, 0] / level
    white = white[:, 1:] - np.outer(own, own @ white[:, 1:])
    D, R = white[:, :-n], white[:, -n:]
    constant = log_chance - float(np.log(np.diag(L)).sum()) - math.log(level)
    squares = np.maximum(shapes.squares(D.T @ D), TINY)
    return constant, R.T @ R, (D.T @ R).astype(np.float32), squares.astype(np.float32)


def covariances(n: int) -> Iterator[tuple[np.ndarray, float]]:
    """Yield the covariance of each noise in blocks, (n, n), and how likely it is: each kind of what is slow as others.

    Of a kind those of little power are likelier: what is hundreds of times what is quick is rare, and a step looks so.
    """
    lag, kinds = np.arange(n), slow_ones(n)
    for keeps, share in FAST:
        fast = toeplitz(keeps**lag)
        yield fast, NOTHING_SLOW * share
        for kind in kinds:
            weights = np.array([max(power / LARGE, 1.0) ** -0.5 for power, _ in kind])
            for (power, K), weight in zip(kind, weights / weights.sum()):
                yield fast + power * K, EACH_SLOW * share * weight / len(kinds)


def slow_ones(n: int) -> list[list[tuple[float, Any]]]:
    """Return powers and covariances of what is slow, by kind: it forgets, swings, bends, walks, or is a line."""
    lag, since = np.arange(n), np.arange(1, n + 1)
    turns = [2 * math.pi * cycles * lag / n for cycles in CYCLES]
    far = [math.sqrt(3.0) * lag / (wait * n) for wait in SMOOTH]
    line = (lag - lag.mean()) / lag.std()
    return [
        [(power, toeplitz(np.exp(-lag / (wait * n)))) for power in POWERS for wait in FORGETS],
        [(power, toeplitz(np.cos(x) * np.exp(-x / (2 * math.pi * LASTS)))) for power in POWERS for x in turns],
        [(power, toeplitz((1 + x) * np.exp(-x))) for power in BENDS for x in far],  # Matern 3/2
        [(power, 6.0 / n * np.minimum.outer(since, since)) for power in WALKS],
        [(power, np.outer(line, line)) for power in LINES],
    ]
