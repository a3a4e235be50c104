"""The smoothed trace: state and parameters at every sample, given later samples too."""

from __future__ import annotations

import numpy as np

from ..engine.errors import InputError
from ..models.markup import markup
from .bands import unpack
from .trace import KEEP

LEAST = KEEP[1:]


def width(keep: str, N: int) -> int:
    """Return the number of columns the smoother writes for each sample."""
    if keep not in LEAST:
        raise InputError(f"keep must be one of {', '.join(LEAST)}, got {keep!r}")
    return (N, 2 * N, N + N * (N + 1) // 2)[LEAST.index(keep)]


class Smoothed:
    """Columns of a smoothed record, time first.

    ``x`` and ``parameters`` belong to x(t) and theta at sample t, given the whole record (``lag`` None) or the samples
    up to t + lag; names and order as in a `Trace`. ``state`` is the filter's after the last sample.
    """

    def __init__(self, estimator, y, u, outs, keep, state, lag, time=None):
        self.estimator, self.keep, self.state, self.lag = estimator, keep, state, lag
        self.y, self.u, self.table = y.copy(), u.copy(), outs
        first = float(state["samples"]) - len(y)
        self.time = np.asarray(estimator.dt * (first + np.arange(len(y))) if time is None else time, float)
        if self.time.shape != self.y.shape[:1]:
            raise InputError(f"time must be ({len(y)},) like y, got shape {self.time.shape}")

    def __len__(self):
        return len(self.y)

    def _repr_html_(self):
        last = zip(self.names, self.parameters[-1], self.parameters_std[-1])
        return markup(repr(self), parameters=list(last))

    def __repr__(self):
        given = "the whole record" if self.lag is None else f"{self.lag} samples ahead"
        return f"Smoothed({len(self)} samples of {self.estimator!r}, given {given})"

    @property
    def names(self) -> list[str]:
        """Names of the parameter columns."""
        return self.estimator.names

    def of(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return one state or parameter by name, and its deviation, (T,) each."""
        names = [*self.estimator.state_names, *self.names]
        if name not in names:
            raise InputError(f"there is no {name!r}: {', '.join(names)}")
        return self.table[:, names.index(name)], self._std[:, names.index(name)]

    @property
    def x(self) -> np.ndarray:
        """State x(t), measured state first, (T, n)."""
        return self.table[:, : self.estimator.model.n]

    @property
    def parameters(self) -> np.ndarray:
        """Parameters in the order of ``names``, (T, m)."""
        return self.table[:, self.estimator.model.n : self.estimator.model.N]

    @property
    def _std(self):
        N = self.estimator.model.N
        if self.keep == "covariance":
            return np.sqrt(np.einsum("tii->ti", self.covariance).clip(0))
        if self.keep == "means":
            raise InputError("this record kept means only; run smooth(..., keep='std')")
        return self.table[:, N:]

    @property
    def x_std(self) -> np.ndarray:
        """Standard deviations of ``x``, (T, n)."""
        return self._std[:, : self.estimator.model.n]

    @property
    def parameters_std(self) -> np.ndarray:
        """Standard deviations of ``parameters``, (T, m)."""
        return self._std[:, self.estimator.model.n :]

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of [x ; parameters], (T, N, N); needs keep="covariance"."""
        if self.keep != "covariance":
            raise InputError(f"this record kept {self.keep!r} only; run smooth(..., keep='covariance')")
        N = self.estimator.model.N
        if N == 1:  # as wide as its deviation, which is what was written
            return self.table[:, 1:, None] ** 2
        return unpack(self.table[:, N:], N)
