"""A plain constant-velocity Kalman filter with the interface of `TrackEstimator`: a double for tests of the tracker."""

from typing import NamedTuple

import numpy as np

DTYPE = np.dtype([("time", "f8"), ("seen", "f8"), ("x", "f8", (4,)), ("P", "f8", (4, 4))])
H = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0]])


class Step(NamedTuple):
    innovation: np.ndarray
    covariance: np.ndarray
    nis: float
    position: np.ndarray
    velocity: np.ndarray


class PlainFilter:
    def __init__(self, speed=250.0, q=1.0, r=1e4):
        self.speed, self.q, self.r = speed, q, r
        self.options = dict(speed=speed, q=q, r=r)

    def start(self):
        return np.zeros((), DTYPE)

    def _ahead(self, state, time):
        d = time - state["time"]
        F = np.eye(4)
        F[0, 2] = F[1, 3] = d
        G = np.vstack([np.eye(2) * d**2 / 2, np.eye(2) * d])
        return F @ state["x"], F @ state["P"] @ F.T + self.q * G @ G.T

    def predict(self, state, time):
        if not state["seen"]:
            return np.full(2, np.nan), np.full((2, 2), np.inf)
        x, P = self._ahead(state, time)
        return H @ x, H @ P @ H.T + self.r * np.eye(2)

    def update(self, state, time, position, covariance=None):
        state, y = state.copy(), np.asarray(position, float)
        R = self.r * np.eye(2) if covariance is None else covariance
        if state["seen"]:
            assert time > state["time"]
            x, P = self._ahead(state, time)
            e, S = y - H @ x, H @ P @ H.T + R
            K = P @ H.T @ np.linalg.inv(S)
            x, P = x + K @ e, P - K @ S @ K.T
            nis = e @ np.linalg.solve(S, e) / 2
        else:
            x, P = np.r_[y, 0, 0], np.diag([self.r, self.r, self.speed**2, self.speed**2])
            e, S, nis = np.full(2, np.nan), np.full((2, 2), np.inf), np.nan
        state["time"], state["seen"], state["x"], state["P"] = time, state["seen"] + 1, x, P
        return state, Step(e, S, nis, x[:2], x[2:])
