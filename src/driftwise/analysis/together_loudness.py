"""How loud a column is, in blocks, and how far that is a matter of chance: as far as the halves of blocks differ.

How loud is told by the errors of predicting a row from those before it: of white noise these are the rows themselves,
where differences would hold each row twice and tell a third less; of what is slow they are what is quick in it.
Noise that is as loud throughout differs by chance from block to block, and from half to half as much; what is louder
for a while, or grows, hardly differs between the halves of a block. So the halves tell what chance does, and a change
is held against that.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import toeplitz

from .together_noise import FAST, slow_ones

RESTING = 0.6  # of the rows, that a sensor may repeat itself for its noise to be heard in its digits
HEARD, SHARE = 3, 0.5  # errors in a block, or in a half, from which on they tell how loud it is; of its rows
ABOUT = 9  # blocks whose mean stands for those that are not heard beside them
FAINT = 0.02  # of the mean square of all errors, that is added to that of each block
PAST = 3  # rows that the next is predicted from
FAR = 4.0  # deviations beyond which two halves differ by as many
EXACT = 1e-6


class Loudness(NamedTuple):
    """Logarithms of mean squares of errors in n blocks, (n,), and half of what the halves of each differ by, (m,).

    The latter of those blocks whose halves are heard: none where they are short.
    """

    blocks: np.ndarray
    halves: np.ndarray

    def less(self, by) -> Loudness:
        """Return the same without what a change did to each block, (n,)."""
        return self._replace(blocks=self.blocks - by)


def loudness(x, calm, n: int) -> Loudness | None:
    """Return how loud a column (T,) is in n blocks, by its own errors; None where it is not heard.

    ``x`` is NaN where a row is missing, ``calm`` is not.
    """
    heard = np.isfinite(x[1:]) & np.isfinite(x[:-1])
    if np.mean(np.diff(calm)[heard] == 0) > RESTING:
        return None
    heard[: PAST - 1] = False
    squares = np.where(heard, errors(calm), 0.0) ** 2
    faint = FAINT * squares.sum() / max(heard.sum(), 1)
    means = _means(squares, heard, n)
    there = np.flatnonzero(np.isfinite(means))
    if len(there) < n / 2 or not faint > 0.0:
        return None
    logs = np.log(means[there] + faint)
    about = np.convolve(np.pad(logs, ABOUT // 2, mode="edge"), np.full(ABOUT, 1 / ABOUT), "valid")
    found = np.interp(np.arange(n), there, about)  # one block is chance
    found[there] = logs
    return Loudness(found, _halves(np.log(_means(squares, heard, 2 * n) + faint))) if np.ptp(found) > EXACT else None


def errors(x) -> np.ndarray:
    """Return the errors of predicting rows (T,) but the first from the last ones, by least squares; 0 before `PAST`."""
    past = np.column_stack([np.ones(len(x) - PAST), *(x[k : len(x) - PAST + k] for k in range(PAST))])
    weights = np.linalg.lstsq(past, x[PAST:], rcond=None)[0]
    return np.concatenate([np.zeros(PAST - 1), x[PAST:] - past @ weights])


def _means(squares, heard, n: int) -> np.ndarray:
    """Return the means of n blocks of what is heard, (n,); NaN where that is too little."""
    edges = np.linspace(0, len(squares), n + 1).astype(int)
    counts = np.add.reduceat(heard.astype(int), edges[:-1])
    enough = np.maximum(SHARE * np.diff(edges), HEARD)
    return np.where(counts >= enough, np.add.reduceat(squares, edges[:-1]) / np.maximum(counts, 1), np.nan)


def _halves(logs) -> np.ndarray:
    """Return half of what halves of blocks (2 n,) differ by, where both are heard; those far from others cut."""
    by = (logs[::2] - logs[1::2]) / 2
    by = by[np.isfinite(by)]
    far = FAR * 1.4826 * float(np.median(abs(by))) if len(by) else 0.0
    return np.clip(by, -far, far)


@lru_cache(2)
def of_halves(n: int) -> np.ndarray:
    """Return the variance of half of what halves of n blocks differ by, under each noise of `noises`, (noises,).

    That of the blocks about their mean is one.
    """
    lag = np.arange(2 * n)
    slow = [(power, *_variances(K)) for kind in slow_ones(2 * n) for power, K in kind]
    found = []
    for keeps, _ in FAST:
        fast, own = _variances(toeplitz(keeps ** (lag / 2)))
        found.append(own / fast)
        found += [(own / fast + power * by) / (1 + power * whole) for power, whole, by in slow]
    return np.array(found)


def _variances(K) -> tuple[float, float]:
    """Return, of halves of covariance K, the variance of blocks about their mean, and of half of their difference."""
    first, second, both = K[::2, ::2], K[1::2, 1::2], K[::2, 1::2]
    blocks = (first + second + both + both.T) / 4
    by = np.mean(np.diag(first) + np.diag(second) - 2 * np.diag(both)) / 4
    return float(np.mean(np.diag(blocks)) - blocks.mean()), float(by)
