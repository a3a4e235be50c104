"""Who else can predict the next sample: last value, a frozen ARX, recursive least squares, a Kalman random walk.

Written out in NumPy and sharing no code with the rest of the package. All work on data that the first half has brought
to mean 0 and standard deviation 1 (a mild look ahead, in their favour), with the structure that the first half prefers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..papers.fixed_filters import Forecast

PRIOR = 100.0  # covariance of theta before anything is known, times the identity
LEAST = 8  # samples that no batch fit uses: the longest memory of the output that is tried
TRACE = 1e8  # where a covariance that winds up is held
SPEEDS = (0.0, *(m * 10.0**k for k in range(-10, 1) for m in (1.0, 3.0)))  # Q = q r I


class Structure(NamedTuple):
    """An ARX structure: the same number of coefficients and the same delay for every input."""

    na: int
    nb: int
    nk: int

    @property
    def reach(self) -> int:
        """How many samples back the regressors go."""
        return max(self.na, self.nk + self.nb - 1 if self.nb else 0)


class Scale(NamedTuple):
    """Mean and standard deviation of output and inputs over the first half."""

    y: float
    sd: float
    u: np.ndarray
    u_sd: np.ndarray

    def apply(self, y, u):
        """Return the data in these units."""
        return (y - self.y) / self.sd, (u - self.u) / self.u_sd

    def undo(self, found: Forecast) -> Forecast:
        """Return a forecast in units of the output."""
        return Forecast(self.y + self.sd * found.prediction, self.sd**2 * found.variance)


def first_half(y, u) -> Scale:
    """Return the scale of the first half; a constant column keeps its unit."""
    h = len(y) // 2
    sd, u_sd = float(np.std(y[:h])), np.std(u[:h], axis=0)
    return Scale(float(np.mean(y[:h])), sd or 1.0, np.mean(u[:h], axis=0), np.where(u_sd > 0, u_sd, 1.0))


def regressors(y, u, s: Structure):
    """Return phi (T, na + m nb + 1): past outputs, inputs of each column, a constant; zero before the record."""
    T, columns = len(y), []
    for source, lags in [(y, range(1, s.na + 1)), *((c, range(s.nk, s.nk + s.nb)) for c in u.T)]:
        columns += [np.concatenate([np.zeros(k), source[: T - k]]) for k in lags]
    return np.stack([*columns, np.ones(T)], axis=1)


# --- structure ---------------------------------------------------------------------------------------------


def bounds(T: int, inputs: int) -> tuple[int, int, int]:
    """Return the largest na, nb and nk that are tried."""
    most = 2 if T <= 300 else 4 if T <= 400 or inputs >= 3 else 8
    return most, 0 if not inputs else min(most, 4) if inputs > 1 else most, 5 if inputs == 1 else 3 if inputs else 0


def by_bic(y, u) -> Structure:
    """Return the ARX structure of smallest BIC on the first half, all structures on the same samples."""
    h, m = len(y) // 2, u.shape[1]
    na, nb, nk = bounds(len(y), m)
    deep = nb + nk
    phi = np.concatenate([regressors(y[:h], u[:h], Structure(na, deep, 0)), y[:h, None]], axis=1)[LEAST:]
    G, N = phi.T @ phi, h - LEAST
    best, chosen = np.inf, Structure(1, 0, 0)
    for s in _structures(na, nb, nk, m):
        at = [*range(s.na), *(na + i * deep + s.nk + j for i in range(m) for j in range(s.nb)), na + m * deep]
        theta = np.linalg.lstsq(G[np.ix_(at, at)], G[at, -1], rcond=1e-13)[0]
        rss = max(float(G[-1, -1] - theta @ G[at, -1]), 1e-300)
        bic = N * np.log(rss / N) + len(at) * np.log(N)
        if bic < best:
            best, chosen = bic, s
    return chosen


def _structures(na, nb, nk, inputs):
    if not inputs:
        return [Structure(a, 0, 0) for a in range(1, na + 1)]
    return [Structure(a, b, k) for a in range(1, na + 1) for b in range(1, nb + 1) for k in range(nk + 1)]


# --- the opponents -----------------------------------------------------------------------------------------


def last_value(y) -> Forecast:
    """Return the value before."""
    return Forecast(np.concatenate([y[:1], y[:-1]]), np.full(len(y), np.nan))


def straight_line(y) -> Forecast:
    """Return the line through the two values before."""
    return Forecast(np.concatenate([y[:1], y[:1], 2 * y[1:-1] - y[:-2]]), np.full(len(y), np.nan))


def frozen(phi, y) -> Forecast:
    """Return the forecast of least squares on the first half, never updated."""
    used = slice(LEAST, len(y) // 2)
    theta, *_ = np.linalg.lstsq(phi[used], y[used], rcond=None)
    return Forecast(phi @ theta, np.full(len(y), np.mean((y[used] - phi[used] @ theta) ** 2)))


def rls(phi, y, reach: int, forgetting: float = 1.0) -> Forecast:
    """Return the forecast of recursive least squares; the variance is that of its innovations, .98 forgotten.

    It begins with that of the frozen fit.
    """
    prediction, _ = _from(reach, phi, y, forgetting, 0.0)
    variance, v = np.full(len(y), np.nan), float(frozen(phi, y).variance[0])
    for t in range(reach, len(y)):
        variance[t] = v
        v = 0.98 * v + 0.02 * (y[t] - prediction[t]) ** 2
    return Forecast(prediction, variance)


def random_walk(phi, y, reach: int) -> tuple[Forecast, float]:
    """Return the forecast of a Kalman filter whose parameters walk, Q = q r I, and the q most likely on the first half.

    The likelihood leaves out the first twenty samples, or a tenth of the half.
    """
    h, best, q, r = len(y) // 2, -np.inf, 0.0, 1.0
    used = slice(reach + min(20, h // 10), None)
    for speed in SPEEDS:
        prediction, s = _from(reach, phi[:h], y[:h], 1.0, speed)
        e, S = (y[:h] - prediction)[used], s[used]
        noise = float(np.mean(e**2 / S))
        loglik = -0.5 * np.sum(np.log(S)) - 0.5 * len(S) * np.log(noise)
        if loglik > best:
            best, q, r = loglik, speed, noise
    prediction, s = _from(reach, phi, y, 1.0, q)
    return Forecast(prediction, r * s), q


def _from(reach, phi, y, forgetting, q):
    """Return predictions and scales of the recursion, NaN before its lags are filled."""
    prediction, s = np.full(len(y), np.nan), np.full(len(y), np.nan)
    prediction[reach:], s[reach:] = _compiled()(phi[reach:], y[reach:], forgetting, q)
    return prediction, s


_built: list = []


def _compiled():
    """Return the recursion, compiled when first wanted."""
    if not _built:
        from numba import njit

        _built.append(njit(cache=True)(_recursion))
    return _built[0]


def _recursion(phi, y, forgetting, q):
    """Return predictions and phi' P phi + 1 at every sample; P is kept symmetric, and its trace below a bound."""
    T, n = phi.shape
    theta, P, K = np.zeros(n), PRIOR * np.eye(n), np.zeros(n)
    prediction, s = np.zeros(T), np.zeros(T)
    for t in range(T):
        for i in range(n):
            K[i] = 0.0
            for j in range(n):
                K[i] += P[i, j] * phi[t, j]
        yhat, spread = 0.0, forgetting
        for i in range(n):
            yhat += phi[t, i] * theta[i]
            spread += phi[t, i] * K[i]
        prediction[t], s[t] = yhat, spread
        e, trace = y[t] - yhat, 0.0
        for i in range(n):
            theta[i] += K[i] * e / spread
        for i in range(n):
            for j in range(i + 1):
                P[i, j] = P[j, i] = (P[i, j] - K[i] * K[j] / spread) / forgetting
            P[i, i] += q
            trace += P[i, i]
        if forgetting < 1.0 and trace > TRACE:
            P *= TRACE / trace
    return prediction, s
