"""A drifting regression by other libraries: each takes y (T,) and regressors h (T, N), returns estimates (T, N).

theta takes a random step of variance `Q` per sample, e has the variance `R`, theta ~ N(0, P0 I) at first.
"""

from __future__ import annotations

import ctypes
from functools import cache

import numpy as np

from .compiler import NATIVE, library, pointer

Q, R, P0, N = 1e-6, 0.04, 100.0, 4


def textbook(y, h) -> np.ndarray:
    """Return the estimates of the five lines of a textbook in NumPy."""
    theta, P, out = np.zeros(N), P0 * np.eye(N), np.empty(h.shape)
    for t in range(len(y)):
        P = P + Q * np.eye(N)
        b = P @ h[t]
        gain = b / (h[t] @ b + R)
        theta = theta + gain * (y[t] - h[t] @ theta)
        P = P - np.outer(gain, b)
        out[t] = theta
    return out


@cache
def _compiled():
    return library("regression.c", NATIVE)


def in_c(y, h) -> np.ndarray:
    """Return the same by ``regression.c``."""
    out, theta, P = np.empty(h.shape), np.zeros(N), P0 * np.eye(N)
    numbers = ctypes.c_double(Q), ctypes.c_double(R)
    _compiled().track(ctypes.c_long(len(y)), pointer(y), pointer(h), *numbers, *map(pointer, (theta, P, out)))
    return out


def filterpy(y, h) -> np.ndarray:
    """Return filterpy's, one sample at a time."""
    from filterpy.kalman import KalmanFilter

    filter, out = KalmanFilter(dim_x=N, dim_z=1), np.empty(h.shape)
    filter.P, filter.Q, filter.R = P0 * np.eye(N), Q * np.eye(N), np.array([[R]])
    for t in range(len(y)):
        filter.predict()
        filter.update(y[t], H=h[t : t + 1])
        out[t] = filter.x[:, 0]
    return out


def kalman_py(y, h) -> np.ndarray:
    """Return kalman-py's, one sample at a time."""
    from kalman_py import KalmanFilter

    filter = KalmanFilter(np.eye(N), h[:1], Q * np.eye(N), np.array([[R]]), np.zeros(N), P0 * np.eye(N))
    out = np.empty(h.shape)
    for t in range(len(y)):
        filter.predict()
        filter.update(y[t : t + 1], H=h[t : t + 1])
        out[t] = filter.x
    return out


def fast_kalman(y, h) -> np.ndarray:
    """Return fast-kalman's (C++), one sample at a time."""
    from kalman import LinearKalmanFilter

    filter, out = LinearKalmanFilter(N, 1), np.empty(h.shape)
    filter.P, filter.Q = (P0 * np.eye(N)).ravel().tolist(), (Q * np.eye(N)).ravel().tolist()
    filter.F, filter.x = np.eye(N).ravel().tolist(), [0.0] * N
    rows, values = h.tolist(), y.tolist()
    for t in range(len(values)):
        filter.predict()
        filter.correct_scalar(values[t], rows[t], R)
        out[t] = filter.x
    return out


def statsmodels(y, h) -> np.ndarray:
    """Return statsmodels' (Cython), the whole record at once."""
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    filter = KalmanFilter(k_endog=1, k_states=N, loglikelihood_burn=0)
    filter.bind(np.ascontiguousarray(y).reshape(-1, 1))
    filter["design"] = np.ascontiguousarray(h.T[None])
    filter["transition"] = filter["selection"] = np.eye(N)
    filter["state_cov"], filter["obs_cov"] = Q * np.eye(N), np.array([[R]])
    filter.initialize_known(np.zeros(N), (P0 + Q) * np.eye(N))
    return filter.filter().filtered_state.T


PEERS = {
    "C -O3 -march=native, textbook": in_c,
    "statsmodels KalmanFilter": statsmodels,
    "fast-kalman": fast_kalman,
    "kalman-py": kalman_py,
    "filterpy": filterpy,
    "NumPy, textbook": textbook,
}
BATCH = ("C -O3 -march=native, textbook", "statsmodels KalmanFilter")  # not one sample at a time from Python
