"""The paper's recursion (9)-(12) in plain NumPy, with its gain as printed or as it must be; a row for each record.

    e = y - psi' theta,   S = psi' P psi + sigma^2,   theta <- Phi theta + L e,   P <- Phi (P - P psi psi' P/S) Phi' + Q
    printed: L = P psi/S.   Correct: L = Phi P psi/S.

It shares no code with the compiled memories: it is their oracle here, and the only place where the printed gain lives.
theta and P are those given the samples before; Q comes from a rule that sees the sample: `Known`, `Fuzzy`, `Auxiliary`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .systems import System

FLOOR = 0.01  # of its largest mean square so far: the least that counts of a regressor
SLOWEST = 0.005  # gain of the running mean squares
START, FIRST = 1e-3, 10  # noise variance ratio until the auxiliary filter begins, and when


class Now(NamedTuple):
    """What a rule sees of sample k."""

    k: int
    psi: np.ndarray
    theta: np.ndarray
    e: np.ndarray
    S: np.ndarray
    explained: np.ndarray  # psi' P psi
    sigma2: np.ndarray
    unit: np.ndarray  # sigma^2/ms_i, 0 until regressor i has moved


class Path(NamedTuple):
    """What came out, (S, T, ..): parameters and their variances before the sample and given it, e, S and q."""

    theta: np.ndarray
    variance: np.ndarray
    filtered: np.ndarray
    filtered_variance: np.ndarray
    e: np.ndarray
    S: np.ndarray
    q: np.ndarray

    @property
    def nis(self) -> np.ndarray:
        """e^2/S, (S, T)."""
        return self.e**2 / self.S


def times(P, x):
    """Return P x for each record."""
    return (P @ x[..., None])[..., 0]


def over(a, b):
    """Return a/b, 0 where b is."""
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)


class Units:
    """Running mean squares of the regressors: R/ms_i is the variance of theta_i that moves y as much as the noise."""

    def __init__(self):
        self.ms: Any = 0.0
        self.top: Any = 0.0

    def take(self, psi, k, sigma2):
        """Take a row; return the units."""
        self.ms = self.ms + max(1 / (k + 1), SLOWEST) * (psi**2 - self.ms)
        self.top = np.maximum(self.top, self.ms)
        return over(np.broadcast_to(sigma2[:, None], psi.shape), np.maximum(self.ms, FLOOR * self.top))


def follow(s: System, rule, printed: bool = False, sigma2: float | None = None, P0: float = 1000.0) -> Path:
    """Run the recursion over every record of a system; ``sigma2`` is what the filter is told instead."""
    records, T, n = s.psi.shape
    theta, P, units, kept = np.zeros((records, n)), np.tile(P0 * np.eye(n), (records, 1, 1)), Units(), []
    R = np.full(records, s.told if sigma2 is None else sigma2)
    outer = s.phi[:, None] * s.phi
    for k in range(T):
        psi = s.psi[:, k]
        b = times(P, psi)
        explained = (psi * b).sum(axis=1)
        S, e = explained + R, s.y[:, k] - (psi * theta).sum(axis=1)
        unit = units.take(psi, k, R)
        K = b / S[:, None]
        after, P_after = theta + K * e[:, None], P - K[:, :, None] * b[:, None, :]
        q = rule(Now(k, psi, theta, e, S, explained, R, unit))
        kept.append((theta, diagonal(P), after, diagonal(P_after), e, S, q))
        theta = s.phi * theta + K * e[:, None] if printed else s.phi * after
        P = outer * P_after
        P[:, range(n), range(n)] += q
    return Path(*(np.stack(each, axis=1) for each in zip(*kept)))


def diagonal(P):
    """Return the diagonal of each matrix, copied."""
    return np.diagonal(P, axis1=1, axis2=2).copy()


class Known:
    """Q given: (T, n)."""

    def __init__(self, q):
        self.q = q

    def __call__(self, now):
        return np.broadcast_to(self.q[now.k], now.psi.shape)


class Fuzzy:
    """Table 1 of the paper: inputs one sample old, the step of theta between two predictions; see `FuzzyDrift`."""

    def __init__(self, levels=(1e-4, 1e-2, 1.0), error=(1.0, 3.0), increment=1.0):
        self.levels, self.error, self.increment = levels, error, increment
        self.inputs: Any = None
        self.before: Any = 0.0

    def __call__(self, now):
        step = over(np.abs(now.theta - self.before), np.sqrt(now.unit))
        mine = np.abs(now.e) / np.sqrt(now.S), step
        used = mine if self.inputs is None else self.inputs
        self.inputs, self.before = mine, now.theta
        m = np.clip((used[0] - self.error[0]) / (self.error[1] - self.error[0]), 0, 1)[:, None]
        d = np.minimum(used[1] / self.increment, 1)
        small, medium, large = self.levels
        return ((1 - m) * (1 - d) * small + ((1 - m) * d + m * (1 - d)) * medium + m * d * large) * now.unit


class Auxiliary:
    """A second Kalman filter with state q, its measurement e^2; see `AuxiliaryFilter`."""

    def __init__(self, start=0.1, forgetting=0.995, most=10.0, least=0.0):
        self.start, self.forgetting, self.most, self.least = start, forgetting, most, least
        self.q: Any = None
        self.Pq: Any = None

    def __call__(self, now):
        if now.k < FIRST:
            self.q = START * now.unit
            return self.q
        h = now.psi**2
        z = now.e**2 - now.sigma2 - (now.explained - (h * self.q).sum(axis=1))  # h' q and what a square of e scatters
        if now.k == FIRST:
            self.q = START * now.unit
            self.Pq = (self.start * now.unit)[:, :, None] ** 2 * np.eye(h.shape[1])
        b = times(self.Pq, h)
        K = b / ((h * b).sum(axis=1) + 2 * now.S**2)[:, None]
        self.q = self.q + K * (z - (h * self.q).sum(axis=1))[:, None]
        self.Pq = (self.Pq - K[:, :, None] * b[:, None, :]) / self.forgetting
        D = np.minimum(1, over(10 * now.unit, np.sqrt(diagonal(self.Pq))))
        self.Pq = D[:, :, None] * self.Pq * D[:, None, :]
        self.q = np.clip(self.q, self.least * now.unit, self.most * now.unit)
        return self.q
