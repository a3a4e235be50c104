"""The carriage by batch: SciPy's least squares on the prediction errors of its innovations form, friction by its sign.

    q' = v + ..,  v' = (g u - Fv v - Fc sign(v) - offset)/M + ..,   both corrected by k1 e and k2 e, e = y - q

The gains k1, k2 are unknowns as the parameters are (Ljung 1999, section 7.3). Nothing here is the package's.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from .prediction_error import Found

NAMES = "M", "Fv", "Fc", "offset", "k1", "k2"
START, SCALE = (100.0, 200.0, 20.0, -3.0, 0.5, 30.0), np.array([100.0, 200.0, 20.0, 3.0, 0.3, 50.0])
GAIN, STEP = 35.15065188, 1e-5  # N/V; of differences


def errors(P, u, position, dt: float):
    """Return the prediction errors (T, B) of parameters (6, B)."""
    M, Fv, Fc, offset, k1, k2 = P
    x, v = np.full(P.shape[1], position[0]), np.zeros(P.shape[1])
    found = np.empty((len(position), P.shape[1]))
    for k, seen in enumerate(position):
        found[k] = e = seen - x
        x, v = x + k1 * e, v + k2 * e
        a = (GAIN * u[k] - Fv * v - Fc * np.sign(v) - offset) / M
        x, v = x + dt * v + 0.5 * dt * dt * a, v + dt * a
    return found


def fit(u, position, dt: float = 1e-3, unit: float = 1e-6) -> Found:
    """Return the fit, with standard deviations by the slopes of the errors."""
    kept: dict[tuple, tuple] = {}

    def both(z):
        if tuple(z) not in kept:
            kept.clear()
            around = z[:, None] + STEP * np.hstack([np.zeros((6, 1)), np.eye(6), -np.eye(6)])
            with np.errstate(all="ignore"):
                e = np.nan_to_num(errors(around * SCALE[:, None], u, position, dt) / unit, nan=1e6)
            e = np.clip(e, -1e6, 1e6)
            kept[tuple(z)] = e[:, 0], (e[:, 1:7] - e[:, 7:]) / (2 * STEP)
        return kept[tuple(z)]

    r = least_squares(lambda z: both(z)[0], np.array(START) / SCALE, lambda z: both(z)[1], max_nfev=40)
    variance = float(np.mean(r.fun**2))
    bars = np.sqrt(variance * np.diag(np.linalg.inv(r.jac.T @ r.jac))) * SCALE
    loglik = -0.5 * len(u) * (np.log(2 * np.pi * variance * unit**2) + 1)
    return Found(
        dict(zip(NAMES, (r.x * SCALE).tolist())), dict(zip(NAMES, bars.tolist())), loglik, r.fun / np.sqrt(variance)
    )  # fmt: skip
