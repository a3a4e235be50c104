"""The carriage by batch: SciPy's least squares on the innovations of a Kalman filter, friction by its sign.

    q' = v,    v' = (g u - Fv v - Fc sign(v) - offset)/M + w,    y = q + r

with the noises that are said. The filter's gain hardly depends on the parameters; slopes of the state by them go along
with it, those of the sign left out. Nothing here is the package's.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from .prediction_error import Found, deviations

NAMES = "M", "Fv", "Fc", "offset"
START = np.array([100.0, 200.0, 20.0, -3.0])
GAIN, STD = 35.15065188, 1e-3  # N/V; deviation of position and speed at first


def gains(y, dt: float, walk: float, noise: float, decay: float):
    """Return the filter's gains (T, 2), 0 where y is missing, and the innovation's variance; v' = -decay v."""
    P, F = STD**2 * np.eye(2), np.array([[1.0, dt - 0.5 * dt * dt * decay], [0.0, 1.0 - dt * decay]])
    Q = walk**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    K, S = np.zeros((len(y), 2)), np.full(len(y), np.nan)
    for k in np.arange(len(y)):
        if np.isfinite(y[k]):
            S[k] = P[0, 0] + noise**2
            K[k] = P[:, 0] / S[k]
            P = P - np.outer(K[k], P[0])
        P = F @ P @ F.T + Q
    return K, S


def errors(theta, K, u, y, dt: float):
    """Return innovations (T,) and their slopes by the parameters (T, 4)."""
    M, Fv, Fc, offset = theta
    s, slope = np.zeros(2), np.zeros((2, 4))
    e, slopes = np.empty(len(y)), np.empty((len(y), 4))
    way = np.array([0.5 * dt * dt, dt])
    for k in range(len(y)):
        e[k], slopes[k] = y[k] - s[0], -slope[0]
        if np.isfinite(e[k]):
            s, slope = s + K[k] * e[k], slope - K[k][:, None] * slope[0]
        turn = np.sign(s[1])
        a = (GAIN * u[k] - Fv * s[1] - Fc * turn - offset) / M
        by = (np.array([-a, -s[1], -turn, -1.0]) - Fv * slope[1]) / M
        s, slope = s + way * a, slope + way[:, None] * by
        s[0], slope[0] = s[0] + dt * (s[1] - dt * a), slope[0] + dt * (slope[1] - dt * by)
    return e, slopes


def fit(u, y, walk: float, noise: float, dt: float = 1e-3) -> Found:
    """Return the fit, with standard deviations by the slopes; positions may be missing."""
    K, S = gains(y, dt, walk, noise, START[1] / START[0])
    there, kept = np.isfinite(y), dict[tuple, tuple]()

    def both(z):
        if tuple(z) not in kept:
            e, slopes = errors(z * START, K, u, y, dt)
            root = np.sqrt(S[there])
            kept[tuple(z)] = e[there] / root, slopes[there] / root[:, None] * START
        return kept[tuple(z)]

    r = least_squares(lambda z: both(z)[0], np.ones(4), lambda z: both(z)[1], max_nfev=40)
    bars, white = (dict(zip(NAMES, std * abs(START))) for std in deviations(r.jac, r.fun, len(r.fun)))
    loglik = -0.5 * np.sum(r.fun**2 + np.log(2 * np.pi * S[there]))
    return Found(dict(zip(NAMES, r.x * START)), bars, white, float(loglik), r.fun)
