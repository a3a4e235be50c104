"""A model out of estimated parameters: state space, poles and gains with their covariances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .canonical import Canonical


@dataclass(frozen=True)
class Model:
    """Discrete state space in observer canonical form, with the covariance of its parameters.

    x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t); C = [1, 0, ..]. Uncertainties are first order (delta method,
    with dp/da_i = -p^i / D'(p) for a pole p): they fail near multiple poles, where sampling from ``covariance`` is
    the remedy.
    """

    form: Canonical
    values: np.ndarray  # a1..an, b1..bn of each input, b0
    covariance: np.ndarray
    dt: float = 1.0

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return self.form.names

    @property
    def A(self) -> np.ndarray:
        """State matrix E - a C."""
        n = self.form.n
        A = np.eye(n, k=1)
        A[:, 0] -= self.values[:n]
        return A

    @property
    def B(self) -> np.ndarray:
        """Input matrix b - a b0, (n, k)."""
        a, b = self.form.polynomials(self.values)
        return b[:, 1:].T - np.outer(a[1:], b[:, 0])

    @property
    def C(self) -> np.ndarray:
        """Output matrix (1, n)."""
        return np.eye(1, self.form.n)

    @property
    def D(self) -> np.ndarray:
        """Direct terms (1, k)."""
        return self.form.polynomials(self.values)[1][:, :1].T

    @property
    def poles(self) -> np.ndarray:
        """Poles, largest first."""
        p = np.roots(self.form.polynomials(self.values)[0]).astype(complex)
        p = np.concatenate([p, np.zeros(self.form.n - len(p))])
        return p[np.lexsort((p.imag, -abs(p)))]

    @property
    def poles_covariance(self) -> np.ndarray:
        """Covariance (n, 2, 2) of (real, imaginary) part of each pole, first order."""
        n, p = self.form.n, self.poles
        a = self.form.polynomials(self.values)[0]
        slope = np.polyval(np.polyder(a), p)
        with np.errstate(divide="ignore", invalid="ignore"):
            J = -(p[:, None] ** np.arange(n - 1, -1, -1)) / slope[:, None]
        J = np.stack([J.real, J.imag], axis=1)
        return J @ self.covariance[:n, :n] @ J.swapaxes(1, 2)

    @property
    def poles_std(self) -> np.ndarray:
        """Root mean square radius of uncertainty of each pole."""
        return np.sqrt(np.trace(self.poles_covariance, axis1=1, axis2=2))

    def frequency_response(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return G (k, len(w)) and the covariance (k, len(w), 2, 2) of its (real, imaginary) parts at ``w`` rad/s."""
        z = np.exp(1j * np.asarray(w, float) * self.dt)
        return self._response(np.atleast_1d(z))

    def _response(self, z):
        n, k, m = self.form.n, self.form.inputs, len(self.values)
        a, b = self.form.polynomials(self.values)
        lags = z[:, None] ** -np.arange(n + 1.0)
        den = lags @ a
        G = (b @ lags.T) / den
        J = np.zeros((k, len(z), m), complex)
        for i in range(k):
            J[i, :, :n] = -(G[i] / den)[:, None] * lags[:, 1:]
            J[i, :, n * (i + 1) : n * (i + 2)] = lags[:, 1:] / den[:, None]
            if self.form.direct:
                J[i, :, n * (self.form.blocks - 1) + i] = 1 / den
        J = np.stack([J.real, J.imag], axis=2)
        return G, J @ self.covariance @ J.swapaxes(-1, -2)

    @property
    def dc_gain(self) -> np.ndarray:
        """Steady-state gain from each input, (k,)."""
        return self._response(np.ones(1))[0][:, 0].real

    @property
    def dc_gain_std(self) -> np.ndarray:
        """Standard deviation of the steady-state gains, first order."""
        return np.sqrt(self._response(np.ones(1))[1][:, 0, 0, 0])

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(abs(self.poles) < 1))

    def to_scipy(self) -> tuple:
        """Return ``(A, B, C, D, dt)``, what scipy.signal's dlti and dlsim take (`scipy.signal.dlti(*abcd, dt=dt)`)."""
        return self.A, self.B, self.C, self.D, self.dt

    def to_control(self) -> Any:
        """Return a python-control StateSpace (needs the extra ``control``)."""
        if not self.form.inputs:
            raise InputError("the model has no input, so it has no transfer function; its poles are in model.poles")
        try:
            import control
        except ImportError:
            raise ImportError("to_control() needs python-control: pip install driftwise[control]") from None
        return control.StateSpace(self.A, self.B, self.C, self.D, self.dt)
