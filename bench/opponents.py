"""The same filter by others: in C, compiled here with -O3, and by filterpy fed with the same matrices."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from .plant import VARIANCE

SIZE = 49  # MAX_SIZE of joint.c
FLAGS = ("-O3", "-shared", "-fPIC")


class InC:
    """bench/joint.c as a shared library; the folder lives as long as the object."""

    def __init__(self, *flags: str):
        compiler = os.environ.get("CC", "gcc")
        if not shutil.which(compiler):
            raise FileNotFoundError(f"no C compiler called {compiler}; set CC")
        self._folder = tempfile.TemporaryDirectory()
        target = Path(self._folder.name) / "joint.so"
        source = Path(__file__).with_name("joint.c")
        subprocess.run([compiler, *FLAGS, *flags, "-o", str(target), str(source), "-lm"], check=True)
        self._library = ctypes.CDLL(str(target))
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
            est.model.n, ctypes.c_long(len(y)), _pointer(y), _pointer(u), ctypes.c_double(VARIANCE),
            _pointer(memory), _pointer(out), out.shape[1],
        )  # fmt: skip


class FilterPy:
    """filterpy's KalmanFilter on the joint state, fed with the matrices of every sample (built beforehand)."""

    def __init__(self, est, y, u):
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

    def run(self) -> np.ndarray:
        """Return the predictions."""
        from filterpy.kalman import KalmanFilter

        filter = KalmanFilter(dim_x=self.N, dim_z=1)
        filter.P = self.P.copy()
        predictions = np.empty(len(self.y))
        for t, y in enumerate(self.y):
            predictions[t] = (self.H[t] @ filter.x)[0, 0]
            filter.update(y, R=self.R, H=self.H[t])
            filter.predict(F=self.F[t], Q=self.Q)
        return predictions


def _pointer(array: np.ndarray):
    return array.ctypes.data_as(ctypes.c_void_p)
