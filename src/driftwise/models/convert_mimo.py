"""Models of several outputs out of estimated parameters: state space, poles, gains, and their covariances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..engine.errors import InputError
from .convert import StateSpace
from .roots import parts, solve, spread
from .structure import Structure


@dataclass(frozen=True)
class ModelMIMO(StateSpace):
    """Discrete state space of several outputs, with the covariance of its parameters.

    x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t); the states are those of `Structure`, each output's measured one
    first.
    An output that acts at once on a later one (a0) is solved for in C and D. Uncertainties are first order: a simple
    pole p with left and right eigenvectors l, r moves by l' dA r / l' r. They fail for poles that nearly coincide:
    `close_poles` lists those that their error bars do not tell apart; sample from ``covariance`` there.

    Examples
    --------
    >>> model = ModelMIMO(Structure((1, 1)), np.array([-0.5, 0.0, -0.2, -0.9]), np.eye(4) * 1e-4)
    >>> print(model.poles.real, model.poles_std.round(4), model.close_poles)
    [0.9 0.5] [0.0112 0.0112] []
    """

    form: Structure
    values: np.ndarray
    covariance: np.ndarray
    dt: float = 1.0

    @cached_property
    def _parts(self):
        """Return G_y (n, p), G_u (n, k), L (p, p), D0 (p, k) of x+ = shift(x) - G_y y + G_u u, L y = x_0 + D0 u."""
        form = self.form
        n, p, k = form.n, form.outputs, form.inputs
        A, B = form.polynomials(self.values)
        G_y, G_u = np.zeros((n, p)), np.zeros((n, k))
        for i, nu in enumerate(form.nu):
            G_y[form.x_at[i] : form.x_at[i + 1]] = A[1 : nu + 1, i]
            G_u[form.x_at[i] : form.x_at[i + 1]] = B[1 : nu + 1, i]
        return G_y, G_u, A[0], B[0]

    @property
    def A(self) -> np.ndarray:
        """State matrix (n, n)."""
        form = self.form
        A = np.eye(form.n, k=1)
        A[np.array(form.x_at[1:]) - 1] = 0.0
        return A - self._parts[0] @ self.C

    @property
    def B(self) -> np.ndarray:
        """Input matrix (n, k)."""
        G_y, G_u, _, _ = self._parts
        return G_u - G_y @ self.D

    @property
    def C(self) -> np.ndarray:
        """Output matrix (p, n)."""
        measured = np.eye(self.form.n)[self.form.x_at[:-1]]
        return np.linalg.solve(self._parts[2], measured)

    @property
    def D(self) -> np.ndarray:
        """Direct terms (p, k)."""
        return np.linalg.solve(self._parts[2], self._parts[3])

    @cached_property
    def _poles(self):
        """Poles, largest first, and their derivatives with respect to the parameters (n, m)."""
        from scipy.linalg import eig

        form, A, C = self.form, self.A, self.C
        poles, left, right = eig(A, left=True)
        J = np.zeros((form.n, len(self.values)), complex)
        G_y, _, L, _ = self._parts
        seen = C @ right  # (p, n): what each mode shows
        push = left.conj().T  # (n, n)
        size = np.einsum("ij,ji->i", push, right)
        at_once = push @ G_y @ np.linalg.inv(L)
        with np.errstate(divide="ignore", invalid="ignore"):
            for m, (i, j, lag) in enumerate(zip(form.targets, form.sources, form.lags)):
                if j < form.outputs:
                    pushed = -push[:, form.x_at[i] + lag - 1] if lag else at_once[:, i]
                    J[:, m] = pushed * seen[j] / size
        order = np.argsort(-abs(poles), kind="stable")
        return poles[order].astype(complex), J[order]

    @property
    def poles(self) -> np.ndarray:
        """Poles, largest first, (n,)."""
        return self._poles[0]

    @property
    def poles_covariance(self) -> np.ndarray:
        """Covariance of (real, imaginary) of each pole, (n, 2, 2); infinite for a multiple one."""
        J = np.stack([self._poles[1].real, self._poles[1].imag], axis=1)
        with np.errstate(over="ignore", invalid="ignore"):
            C = J @ self.covariance @ J.swapaxes(1, 2)
        C[~np.isfinite(C).all(axis=(1, 2))] = np.inf
        return C

    @property
    def poles_joint_covariance(self) -> np.ndarray:
        """Covariance (2 n, 2 n) of all poles at once, real and imaginary part in turn; NaN beside a multiple one."""
        return spread(parts(self._poles[1]), self.covariance)

    @property
    def poles_std(self) -> np.ndarray:
        """Root mean square radius of uncertainty of each pole, (n,)."""
        return np.sqrt(np.trace(self.poles_covariance, axis1=1, axis2=2))

    @property
    def close_poles(self) -> list[tuple[int, int]]:
        """Pairs of poles nearer to each other than two of their standard deviations: their first-order bars fail."""
        p, std = self.poles, self.poles_std
        pairs = [(i, j) for i in range(len(p)) for j in range(i + 1, len(p))]
        return [(i, j) for i, j in pairs if not abs(p[i] - p[j]) > 2 * (std[i] + std[j])]

    @property
    def zeros(self) -> np.ndarray:
        """Transmission zeros, where G(z) loses rank, largest first; for as many inputs as outputs.

        The roots of det diag(z^nu_i) B(z), of degree n with direct terms, else n - p; inf at infinity. (A plant with
        more outputs than inputs, or fewer, has none, unless by coincidence.)
        """
        form = self.form
        if form.inputs != form.outputs:
            raise InputError(
                f"zeros are of as many inputs as outputs, the model has {form.inputs} and {form.outputs}; "
                "for one channel use control.tf or scipy on to_scipy()"
            )
        # a determinant of polynomials is interpolated on the unit circle, where the FFT is the inverse
        skip = 0 if form.direct else 1
        degree = form.n - skip * form.outputs
        z = np.exp(2j * np.pi * np.arange(degree + 1) / (degree + 1))
        rows = np.zeros((degree + 1, form.outputs, form.outputs), complex)
        B = form.polynomials(self.values)[1]
        for i, nu in enumerate(form.nu):
            rows[:, i] = z[:, None] ** np.arange(nu - skip, -1, -1) @ B[skip : nu + 1, i]
        c = np.fft.fft(np.linalg.det(rows)).real / (degree + 1)
        largest = abs(c).max()
        return solve(np.where(abs(c) > 1e-13 * largest, c, 0.0)[::-1]) if largest > 0 else np.zeros(0, complex)

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool(np.all(abs(self.poles) < 1))

    def frequency_response(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return G (p, k, len(w)) at ``w`` rad/s, and the covariance (.., 2, 2) of its (real, imaginary) parts.

        Both are infinite where z = e^{jw} is a pole.
        """
        return self._response(np.exp(1j * np.atleast_1d(np.asarray(w, float)) * self.dt))

    def _response(self, z):
        """A(q) y = B(q) u: G = A^-1 B, dG/da_ij = -A^-1[:, i] z^-lag G[j], dG/db_il = A^-1[:, i] z^-lag in column l."""
        form, m = self.form, len(self.values)
        p, k = form.outputs, form.inputs
        A, B = form.polynomials(self.values)
        lags = z[:, None] ** -np.arange(len(A), dtype=float)
        den = np.einsum("zh,hij->zij", lags, A)
        is_pole = np.linalg.det(den) == 0
        inverse = np.linalg.inv(np.where(is_pole[:, None, None], np.eye(p), den))
        G = inverse @ np.einsum("zh,hil->zil", lags, B)
        J = np.zeros((p, k, len(z), m), complex)
        for c, (i, j, lag) in enumerate(zip(form.targets, form.sources, form.lags)):
            gain = inverse[:, :, i].T * lags[:, lag]  # (p, z)
            if j < p:
                J[..., c] = -gain[:, None] * G[:, j].T
            else:
                J[:, j - p, :, c] = gain
        J = np.stack([J.real, J.imag], axis=3)
        C = J @ self.covariance @ J.swapaxes(-1, -2)
        G[is_pole], C[:, :, is_pole] = np.inf, np.diag([np.inf, np.inf])
        return np.moveaxis(G, 0, -1), C

    @property
    def dc_gain(self) -> np.ndarray:
        """Steady-state gain from each input to each output, (p, k)."""
        return self._response(np.ones(1))[0][..., 0].real

    @property
    def dc_gain_std(self) -> np.ndarray:
        """Standard deviation of the steady-state gains, first order, (p, k)."""
        return np.sqrt(self._response(np.ones(1))[1][:, :, 0, 0, 0])
