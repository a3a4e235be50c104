"""Noise between samples of which few follow each other: what decays over any gap, and what each sample adds.

v(t) = m(t) + w(t), m(t + d) = phi^d m(t) + e (Uhlenbeck and Ornstein, 1930, at the instants of a clock), w white; the
variance of e is (1 - phi^(2 d))/(1 - phi^2). What the past leaves open is whitened by Kalman's filter of one state.
Bad at: noise that swings, or is sharper than that from sample to sample.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..engine import compile
from ..engine.elementary import log

TIMES, SHARES = 16, (0.0, 0.3, 1.0, 3.0, 10.0)  # that are tried: of the decay, of the variance of w in that of a step
FASTEST, LONGEST = 0.3, 4  # samples of the shortest time; part of the record of the longest
FINER = 1.25  # steps by which the best of them is moved
ROWS, FEW = 1000, 20  # by which they are compared, at most; below which noise is white


class Bridge(NamedTuple):
    """m(k) = keep m(k-1) + take v(k-1) is expected of v(k), and missed by ``size``: (n,) each, size of unit steps."""

    keep: np.ndarray
    take: np.ndarray
    size: np.ndarray

    def whitened(self, x) -> np.ndarray:
        """Return what the past leaves open of signals (.., n), in deviations."""
        rows = np.ascontiguousarray(x.reshape(math.prod(x.shape[:-1]), x.shape[-1]))
        left = np.empty(rows.shape)
        compile.function(fill_left, 1, 1, 1, 2, 2, 1)(*self, rows, left, np.zeros(len(rows)))
        return left.reshape(x.shape)


def fill_left(keep, take, size, x, left, m):
    """Fill in what the past leaves open of signals ``x`` (k, n), in deviations; ``m`` (k,) is first expected."""
    for t in range(size.size):
        for i in range(m.size):
            if t > 0:
                m[i] = keep[t] * m[i] + take[t] * x[i, t - 1]
            left[i, t] = (x[i, t] - m[i]) / size[t]


def bridge(phi: float, share: float, at) -> Bridge:
    """Return how samples ``at`` (n,) follow from each other; ``share`` is the variance of w in that of a step."""
    return _bridge(phi, share, np.asarray(at, np.int64).tobytes())


@lru_cache(8)  # responses that are tried one after the other have the same noise at the same samples
def _bridge(phi: float, share: float, samples: bytes) -> Bridge:
    at = np.frombuffer(samples, np.int64)
    decays = np.append(1.0, phi ** np.diff(at))
    found = np.empty((3, len(at)))
    compile.function(fill_bridge, 1, 2, float, float)(decays, found, 1 / max(1 - phi * phi, 1e-12), share)
    keep, take, size = found
    return Bridge(keep, take, np.sqrt(size))


def fill_bridge(decays, found, still, share):
    """Fill in what is kept and taken at each sample (n,), and the variance of what is missed."""
    P, gain = still, 0.0
    for k in range(decays.size):
        decay = decays[k]
        found[0, k], found[1, k] = decay * (1 - gain), decay * gain
        if k > 0:
            P = decay * decay * P * (1 - gain) + (1 - decay * decay) * still
        gain = P / (P + share)
        found[2, k] = P + share


def scattered(v, at) -> tuple[float, ...]:
    """Return (phi, share) of values ``v`` (n,) at samples ``at``; (phi,) or () where Schwarz's criterion prefers that.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> m = np.zeros(4000)
    >>> for t in range(1, 4000):
    ...     m[t] = 0.95 * m[t - 1] + rng.normal()
    >>> at = np.flatnonzero(rng.random(4000) < 0.25)
    >>> phi, share = scattered(m[at] + rng.normal(size=len(at)), at)
    >>> 0.92 < phi < 0.97, 0.2 < share < 3
    (True, True)
    >>> scattered(rng.normal(size=len(at)), at)
    ()
    """
    v, at = v[:ROWS], at[:ROWS]
    n = len(v)
    if n < FEW:
        return ()
    longest = max((at[-1] - at[0]) / LONGEST, 2 * FASTEST)
    times, shares = (x.ravel() for x in np.meshgrid(np.geomspace(FASTEST, longest, TIMES), SHARES))
    value = misfits(v, at, times, shares)
    best: list[tuple[tuple[float, ...], float]] = [((), n * math.log(float(v @ v) / n + 1e-300))]
    for many, ok in ((1, shares == 0.0), (2, shares > 0.0)):
        k = int(np.argmin(np.where(ok, value, np.inf)))
        step = FINER ** np.arange(-2, 3)
        some, more = (x.ravel() for x in np.meshgrid(times[k] * step, shares[k] * step[:: 1 if many == 2 else 5]))
        finer = misfits(v, at, some, more)
        j = int(np.argmin(finer))
        found = (math.exp(-1 / float(some[j])), float(more[j]))[:many]
        best.append((found, float(finer[j]) + many * math.log(n)))
    return min(best, key=lambda one: one[1])[0]


def misfits(v, at, times, shares) -> np.ndarray:
    """Return minus twice the log likelihoods of several decays and shares (S,) each, the deviation at its best."""
    gaps, which = np.unique(np.append(np.diff(at), 0), return_inverse=True)
    decays = np.exp(-1 / times) ** gaps[:, None].astype(float)
    squares, logs = np.zeros((2, len(times)))
    still = 1 / -np.expm1(-2 / times)
    compile.function(fill_misfits, 1, "index", 2, 1, 1, 1, 1)(v, which, decays, still, shares, squares, logs)
    return len(v) * np.log(squares / len(v) + 1e-300) + logs


def fill_misfits(v, which, decays, still, shares, squares, logs):
    """Fill in the sums of squares and log variances of what each noise (S,) leaves of ``v`` in its own units.

    ``decays`` (G, S) are those over each gap, ``which`` (n,) tells the gap after a value, and ``still`` (S,) is the
    variance of what decays.
    """
    for s in range(still.size):
        P, m, product = still[s], 0.0, 1.0
        for k in range(v.size):
            size, e = P + shares[s], v[k] - m
            squares[s] += e * e / size
            product *= size
            if product > 1e100 or product < 1e-100:
                logs[s] += log(product)
                product = 1.0
            decay = decays[which[k], s]
            m = decay * (m + P / size * e)
            P = decay * decay * (P * (1 - P / size) - still[s]) + still[s]
        logs[s] += log(product)
