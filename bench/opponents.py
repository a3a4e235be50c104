"""The same filter by others: in C compiled here with -O3, by filterpy fed with the same matrices, in dense NumPy."""

from __future__ import annotations

import ctypes

import numpy as np

from .compiler import library, pointer
from .plant import VARIANCE

SIZE = 49  # MAX_SIZE of joint.c


class InC:
    """bench/joint.c as a shared library."""

    def __init__(self, *flags: str):
        self._library = library("joint.c", *flags)
        self._library.filter_size.restype = ctypes.c_long
        self._bytes = self._library.filter_size()

    def start(self, est) -> np.ndarray:
        """Return the prior of ``est`` as the C filter keeps it."""
        state, n, N = est.start(), est.model.n, est.model.N
        memory = np.zeros(self._bytes // 8)
        memory[:n], memory[n:N] = state["x"], state["theta"]
        memory[SIZE : SIZE + N] = state["D"]
        memory[2 * SIZE : 2 * SIZE + state["U"].size] = state["U"]
        return memory

    def run(self, noise: str, est, y, u, out) -> None:
        """Filter the record from the prior of ``est`` and fill ``out`` (T, columns)."""
        memory = self.start(est)
        filter = self._library.equation_error if noise == "EquationError" else self._library.output_error
        filter(
            est.model.n, ctypes.c_long(len(y)), pointer(y), pointer(u), ctypes.c_double(VARIANCE),
            pointer(memory), pointer(out), out.shape[1],
        )  # fmt: skip


class FilterPy:
    """filterpy's KalmanFilter on the joint state, fed with the matrices of every sample (built beforehand).

    ``Q`` is the covariance of the noise on the state.
    """

    def __init__(self, est, y, u, Q=0.0):
        n, N = est.model.n, est.model.N
        self.n, self.N, self.y, self.R = n, N, y, np.array([[VARIANCE]])
        shift = np.eye(N)
        shift[:n, :n] = np.eye(n, k=1)
        self.F = np.repeat(shift[None], len(y), axis=0)
        self.H = np.zeros((len(y), 1, N))
        self.H[:, 0, 0] = 1.0
        for i in range(n):
            self.F[:, i, n + i] = -y
            if est.model.inputs:
                self.F[:, i, 2 * n + i] = u
        if est.model.direct:
            self.H[:, 0, N - 1] = u
        self.P = est.prior_covariance
        self.Q = np.zeros((N, N))
        self.Q[:n, :n] = Q

    def _filter(self):
        from filterpy.kalman import KalmanFilter

        filter = KalmanFilter(dim_x=self.N, dim_z=1)
        filter.P = self.P.copy()
        return filter

    def run(self) -> np.ndarray:
        """Return the predictions."""
        filter = self._filter()
        predictions = np.empty(len(self.y))
        for t, y in enumerate(self.y):
            predictions[t] = (self.H[t] @ filter.x)[0, 0]
            filter.update(y, R=self.R, H=self.H[t])
            filter.predict(F=self.F[t], Q=self.Q)
        return predictions

    def smooth(self) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (T, N) and standard deviations given the whole record (Rauch, Tung, Striebel)."""
        filter, T = self._filter(), len(self.y)
        means, covariances = np.empty((T, self.N, 1)), np.empty((T, self.N, self.N))
        for t, y in enumerate(self.y):
            filter.update(y, R=self.R, H=self.H[t])
            means[t], covariances[t] = filter.x, filter.P
            filter.predict(F=self.F[t], Q=self.Q)
        before = np.concatenate([self.F[:1], self.F[:-1]])  # rts_smoother counts F by where it leads to
        means, covariances, _, _ = filter.rts_smoother(means, covariances, before, [self.Q] * T)
        return means[:, :, 0], np.sqrt(np.einsum("tii->ti", covariances))


class DenseMIMO:
    """A Kalman filter on all unknowns of several outputs in NumPy, fed with the matrices of every sample."""

    def __init__(self, est, y, u, R):
        form = est.model
        n, N, p = form.n, form.N, form.outputs
        shift = np.zeros((N, N))
        for first, last in zip(form.x_at, form.x_at[1:]):
            shift[first:last, first:last] = np.eye(last - first, k=1)
        shift[n:, n:] = np.eye(N - n)
        self.F, self.H = np.repeat(shift[None], len(y), axis=0), np.zeros((len(y), p, N))
        self.H[:, range(p), form.x_at[:-1]] = 1.0
        data = np.column_stack([-y, u])
        for m, (source, target, lag) in enumerate(zip(form.sources, form.targets, form.lags)):
            if lag > 0:
                self.F[:, form.x_at[target] + lag - 1, n + m] = data[:, source]
            else:
                self.H[:, target, n + m] = data[:, source]
        self.y, self.R, self.P = y, R, est.prior_covariance

    def run(self) -> np.ndarray:
        """Return the last mean, having predicted."""
        s, P = np.zeros(len(self.P)), self.P
        for y, F, H in zip(self.y, self.F, self.H):
            b = P @ H.T
            K = np.linalg.solve(H @ b + self.R, b.T).T
            s = F @ (s + K @ (y - H @ s))
            P = F @ (P - K @ b.T) @ F.T
        return s
