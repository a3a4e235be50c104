"""Fixed filters for one coordinate of a track: constant velocity or acceleration, Singer, their IMM, a bank.

Plain Kalman filters with the exact time of every plot. All but the bank are tuned on the very series that they are
scored on: opponents in hindsight. Blackman and Popoli (1999); Singer (1970); Blom and Bar-Shalom (1988).
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from .recordings import Series

STEPS = (1.0, 2.0)  # of the first simplex, in logarithms
CAP = 16.0  # of e^2/S in every likelihood
LEAST = 1e-2  # of r, over the noise that the first plots show: likelihood drives it to zero on resampled tracks
SHARES = (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)  # of the bank: q T^3 / r
R_AT = {"constant velocity": 1, "constant acceleration": 1, "Singer": 1, "IMM": 2}  # where r stands
STARTS: dict[str, list[list[float]]] = {  # logarithms of the numbers to tune, two starts each
    "constant velocity": [[0.0, 3.0], [3.0, 8.0]],  # q, r
    "constant acceleration": [[-4.0, 3.0], [0.0, 8.0]],  # q, r
    "Singer": [[0.0, 3.0, -3.0], [1.0, 8.0, -2.0]],  # variance of the acceleration, r, its rate of forgetting
    "IMM": [[-1.5, -2.0, 4.0, -4.0], [-1.5, -1.5, 9.0, -4.0]],  # q of both, r, probability to switch
}


class Forecast(NamedTuple):
    """One step ahead at every sample: prediction, and the variance of its error (NaN where none is claimed)."""

    prediction: np.ndarray
    variance: np.ndarray


def forecast(kind: str, logs, series: Series, v0: float, a0: float) -> Forecast:
    """Return the one-step forecast of a fixed filter with the logarithms of its numbers."""
    from .kalman import interacting as run

    x, t, y = np.exp(np.asarray(logs, float)), series.time, series.y
    if kind == "IMM":
        return Forecast(*run(t, y, x[2], np.array([0.0, x[1]]), np.array([x[0], 0.0]), 0.0, min(x[3], 0.5), v0, a0))
    none = np.zeros(1)
    if kind == "constant velocity":
        return Forecast(*run(t, y, x[1], none, x[:1], 0.0, 0.0, v0, 0.0))
    if kind == "constant acceleration":
        return Forecast(*run(t, y, x[1], x[:1], none, 0.0, 0.0, v0, a0))
    return Forecast(*run(t, y, x[1], 2 * x[2:] * x[:1], none, x[2], 0.0, v0, np.sqrt(x[0])))


def tuned(kind: str, series: list[Series], v0: float, a0: float) -> np.ndarray:
    """Return the logarithms of the numbers most likely on all these series (e^2/S capped)."""
    from scipy.optimize import minimize

    least = np.log(LEAST * np.median([start_noise(one.y) for one in series]))

    def loss(logs):
        if np.any(np.abs(logs) > 20) or logs[R_AT[kind]] < least:
            return 1e12
        total = 0.0
        for one in series:
            prediction, S = forecast(kind, logs, one, v0, a0)
            total += 0.5 * np.sum(np.minimum((one.y - prediction)[1:] ** 2 / S[1:], CAP) + np.log(S[1:]))
        return total if np.isfinite(total) else 1e12

    tries = []
    for start, step in product(STARTS[kind], STEPS):
        simplex = np.vstack([start, start + step * np.eye(len(start))])
        options = dict(xatol=0.02, fatol=0.02, maxiter=600, initial_simplex=simplex)
        tries.append(minimize(loss, start, method="Nelder-Mead", options=options))
    return min(tries, key=lambda found: found.fun).x


def start_noise(y) -> float:
    """Return the variance of the plots from the second differences of the first ten."""
    return max((1.4826 * float(np.median(np.abs(np.diff(y[:10], n=2))))) ** 2 / 6, 0.01)


def bank(series: Series, v0: float) -> Forecast:
    """Return the forecast of six untuned constant-velocity filters, each with its own noise, weighted by evidence."""
    from .kalman import scaled

    t, y = series.time, series.y
    period, r = float(np.median(np.diff(t))), start_noise(y)
    members = [scaled(t, y, share / period**3, r, v0) for share in SHARES]
    predictions, variances = (np.array(part) for part in zip(*members))
    w, mean, spread = np.zeros(len(SHARES)), np.full(len(y), np.nan), np.full(len(y), np.nan)
    for k in range(1, len(y)):
        p = np.exp(w - w.max())
        p /= p.sum()
        mean[k] = p @ predictions[:, k]
        spread[k] = p @ (variances[:, k] + (predictions[:, k] - mean[k]) ** 2)
        chi2 = np.minimum((y[k] - predictions[:, k]) ** 2 / variances[:, k], CAP)
        w = 0.97 * w - 0.5 * np.log(2 * np.pi * variances[:, k]) - 0.5 * chi2
        w -= w.max()
    return Forecast(mean, spread)


def last_value(series: Series) -> Forecast:
    """Return the plot before."""
    return Forecast(np.concatenate([series.y[:1], series.y[:-1]]), np.full(len(series.y), np.nan))
