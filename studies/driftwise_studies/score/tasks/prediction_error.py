"""A batch grey-box fit by prediction errors: SciPy's least squares on the innovations of a Kalman filter.

For plants x' = A x + b(u) + w, y = C x + D u + v, given by functions of named parameters, at any instants. Minus twice
the log likelihood is the sum of e^2/S + log S; both are squares of residuals, so that least squares finds its minimum
(Ljung 1999, section 7.4). Slopes are central differences, all in one pass. Nothing here is the package's.

Bars are those of residuals as they are: the covariance of the scores is summed over lags (Newey and West, 1987) up to
1.3 sqrt(T), as Lazarus, Lewis, Stock and Watson (2018, "HAR inference: recommendations for practice", Journal of
Business and Economic Statistics 36, 541-559) have it, and never below that of white residuals.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..plants.simulation import exponential

STEP, SHIFT = 1e-5, 60.0  # of differences, in deviations; what makes every log S + SHIFT positive
LAGS = 1.3  # times sqrt(T): lags over which scores are summed


class Linear(NamedTuple):
    """A plant that is linear in its state, with an input that is held, and one output."""

    starts: dict[str, tuple[float, float]]  # of each unknown: middle, and factor (above 1) or minus its deviation
    slopes: Callable  # (x, u, p) -> dx/dt, a list
    output: Callable  # (x, u, p) -> y
    x0: tuple[tuple[float, float], ...]  # start and deviation of each state
    walk: Callable  # p -> deviation that each state gains in a root of a second
    noise: Callable  # p -> deviation of the output's noise


class Found(NamedTuple):
    """What a batch fit came to."""

    values: dict[str, float]
    bars: dict[str, float]  # standard deviations, in the same units
    white: dict[str, float]  # the same, were residuals white
    loglik: float
    innovations: np.ndarray  # over their deviations


def values_of(plant: Linear, z):
    """Return the unknowns by name, (B,) each, from numbers (B, m) that have deviation one."""
    made = {}
    for (name, (middle, width)), column in zip(plant.starts.items(), np.atleast_2d(z).T):
        if width > 0:
            made[name] = middle * np.exp(column * np.log(width) / 1.96)
        else:
            made[name] = middle - width * column
    return made


def innovations(plant: Linear, z, t, u, y):
    """Return e and S, (T, B) each, of the Kalman filter at each of the points (B, m); NaN where y is missing."""
    p, n, B = values_of(plant, z), len(plant.x0), len(np.atleast_2d(z))
    start, std = np.array(plant.x0).T
    x, P = np.tile(start, (B, 1)), np.tile(np.diag(std**2), (B, 1, 1))
    zero, one = np.zeros((n, B)), np.ones(B)
    b0 = np.array([v * one for v in plant.slopes(zero, 0.0, p)])
    c0 = plant.output(zero, 0.0, p) * one
    unit = [np.repeat(np.eye(n)[:, [j]], B, 1) for j in range(n)]
    A = np.stack([np.array([v * one for v in plant.slopes(e, 0.0, p)]) - b0 for e in unit], -1).transpose(1, 0, 2)
    C = np.stack([plant.output(e, 0.0, p) - c0 for e in unit], -1)
    g = (np.array([v * one for v in plant.slopes(zero, 1.0, p)]) - b0).T
    d = plant.output(zero, 1.0, p) - c0
    W = np.stack([np.broadcast_to(w, B) ** 2 for w in plant.walk(p)], -1)
    r = np.broadcast_to(plant.noise(p), B) ** 2
    steps, which = np.unique(np.round(np.diff(t), 6), return_inverse=True)
    tables = [_step(A, b0.T, g, W, float(dt)) for dt in steps]
    es, Ss = np.full((len(y), B), np.nan), np.full((len(y), B), np.nan)
    for k in range(len(y)):
        if np.isfinite(y[k]):
            PC = np.einsum("bij,bj->bi", P, C)
            S = np.einsum("bi,bi->b", PC, C) + r
            e = y[k] - c0 - d * u[k] - np.einsum("bi,bi->b", C, x)
            K = PC / S[:, None]
            x, P = x + K * e[:, None], P - K[:, :, None] * PC[:, None, :]
            es[k], Ss[k] = e, S
        if k + 1 < len(y):
            F, f, G, Q = tables[which[k]]
            x = np.einsum("bij,bj->bi", F, x) + f + G * u[k]
            P = F @ P @ F.transpose(0, 2, 1) + Q
    return es, Ss


def _step(A, b, g, W, dt):
    """Return F, the constant, what an input does, and Q after dt (Van Loan, 1978)."""
    B, n = b.shape
    M = np.zeros((B, n + 3, n + 3))
    M[:, :n, :n], M[:, :n, n], M[:, :n, n + 1] = A * dt, b * dt, g * dt
    E = exponential(M)
    V = np.zeros((B, 2 * n + 1, 2 * n + 1))
    V[:, :n, :n], V[:, n : 2 * n, n : 2 * n] = -A * dt, A.transpose(0, 2, 1) * dt
    V[:, range(n), range(n, 2 * n)] = W * dt
    V = exponential(V)
    F = E[:, :n, :n]
    return F, E[:, :n, n], E[:, :n, n + 1], F @ V[:, :n, n : 2 * n]


def deviations(slopes, residuals, samples: int):
    """Return standard deviations of a least-squares fit, and what they were if its residuals were white.

    Rows come in blocks of so many samples; behind them may stand those of what was believed beforehand.
    """
    blocks = len(slopes) // samples * samples
    g = (slopes * residuals[:, None])[:blocks].reshape(-1, samples, slopes.shape[1]).sum(axis=0)
    prior, P = slopes[blocks:], np.linalg.inv(slopes.T @ slopes)
    J, lags = g.T @ g + prior.T @ prior, int(LAGS * np.sqrt(samples))
    for lag in range(1, lags):
        G = g[lag:].T @ g[:-lag]
        J += (1 - lag / lags) * (G + G.T)
    white = np.sqrt(np.diag(P))
    return np.maximum(np.sqrt(np.diag(P @ J @ P)), white), white


def fit(plant: Linear, t, u, y, tries: int = 1, seed: int = 0) -> Found:
    """Return the best of several fits: from the middle of what is believed, and from points that are drawn of it."""
    m = len(plant.starts)
    kept: dict[tuple, tuple] = {}

    def both(z):
        if tuple(z) not in kept:
            kept.clear()
            around = z + STEP * np.vstack([np.zeros((1, m)), np.eye(m), -np.eye(m)])
            with np.errstate(all="ignore"):
                e, S = innovations(plant, around, t, u, y)
            there = np.isfinite(y)
            rows = np.vstack([e[there] / np.sqrt(S[there]), np.sqrt(np.log(S[there]) + SHIFT)])
            rows = np.nan_to_num(rows, nan=1e6, posinf=1e6, neginf=1e6)
            kept[tuple(z)] = rows[:, 0], (rows[:, 1 : m + 1] - rows[:, m + 1 :]) / (2 * STEP)
        return kept[tuple(z)]

    rng = np.random.default_rng(seed)
    starts = [np.zeros(m), *(rng.standard_normal(m) for _ in range(tries - 1))]
    ended = [
        least_squares(
            lambda z: np.append(both(z)[0], z), z, lambda z: np.vstack([both(z)[1], np.eye(m)]), max_nfev=60, xtol=1e-6
        )
        for z in starts
    ]
    best = min(ended, key=lambda r: r.cost)
    there = np.isfinite(y)
    count = int(there.sum())
    bars, white = (
        {name: float(abs(b[0] - a[0]) / 2) for name, a, b in _both_ends(plant, best.x, std)}
        for std in deviations(best.jac, best.fun, count)
    )
    return Found(
        {name: float(v[0]) for name, v in values_of(plant, best.x).items()},
        bars,
        white,
        float(-best.cost + 0.5 * np.sum(best.x**2) + 0.5 * SHIFT * count - 0.5 * count * np.log(2 * np.pi)),
        best.fun[:count],
    )  # fmt: skip


def _both_ends(plant: Linear, z, std):
    """Yield each unknown's name and its values a deviation to either side."""
    low, high = (values_of(plant, z + way * std) for way in (-1, 1))
    yield from ((name, low[name], high[name]) for name in plant.starts)
