"""Continuous time: the observer's filters, a model out of estimated parameters, and records from a known plant."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import ClassVar

import numpy as np
from scipy.special import ndtri

from ..engine.errors import InputError
from .canonical import Canonical
from .convert import ObserverForm
from .response import ratio
from .roots import derivatives, own_blocks, spread


def observer(n: int, c: float) -> tuple[np.ndarray, np.ndarray]:
    """Return lam (n,), the coefficients of (p + c)^n after the leading 1, and V (n, n, n).

    V[i, j, m] takes the chain of lags c^(m+1) / (p + c)^(m+1) of what drives x_j to x_i, in x' = (E - lam e')x + ..,
    measured state first: the entries of (p - E + lam e')^-1 in partial fractions.
    """
    lam = [comb(n, j) for j in range(n + 1)]
    V = np.zeros((n, n, n))
    for j in range(n):
        first = [0] * j + [1] + [0] * (n - 1 - j)  # x_1 = p^(n-1-j) / (p + 1)^n, highest power first
        row = first
        for i in range(n):
            V[i, j] = _powers(row)
            up = [*row, 0]  # p x_i = x_{i+1} - lam_i x_1 + w_i
            row = [up[k] + lam[i + 1] * ([0] + first)[k] - (lam[k] if i == j else 0) for k in range(n + 1)][1:]
    size = float(c) ** np.arange(n)
    return np.array(lam[1:]) * float(c) ** np.arange(1, n + 1), V * (size[:, None] / (size * c))[:, :, None]


def _powers(numerator) -> list[int]:
    """Return the coefficients of 1/(p + 1), .., 1/(p + 1)^n of numerator / (p + 1)^n (repeated division)."""
    rest, found = list(numerator), []
    while rest:
        for k in range(1, len(rest)):
            rest[k] -= rest[k - 1]
        found.append(rest.pop())
    return found[::-1]


@dataclass(frozen=True)
class ContinuousModel(ObserverForm):
    """Continuous-time state space in observer canonical form, with the covariance of its parameters.

    x' = A x + B u, y = C x, C = [1, 0, ..]; A(p) = p^n + a1 p^(n-1) + .. + an, B(p) = b1 p^(n-1) + .. + bn, p = d/dt in
    1/s. Uncertainties are first order (delta method): they fail near multiple poles, where sampling from ``covariance``
    is the remedy.

    Parameters
    ----------
    form, values, covariance, dt
        As for `Model`; ``values`` are those of the differential equation, per second.

    Examples
    --------
    >>> m = ContinuousModel(Canonical(2, 1), [0.3, 1.0, 0.0, 2.0], np.diag([1e-4, 1e-4, 1e-4, 4e-4]))
    >>> print(m.poles.round(3), m.dc_gain, m.dc_gain_std.round(4))
    [-0.15+0.989j -0.15-0.989j] [2.] [0.0283]
    """

    form: Canonical
    values: np.ndarray  # a1..an, b1..bn of each input
    covariance: np.ndarray
    dt: float = 0.0
    is_continuous: ClassVar[bool] = True

    @property
    def B(self) -> np.ndarray:
        """Input matrix (n, k)."""
        return self.form.polynomials(self.values)[1][:, 1:].T

    @property
    def D(self) -> np.ndarray:
        """Direct terms (1, k): none."""
        return np.zeros((1, self.form.inputs))

    @property
    def poles(self) -> np.ndarray:
        """Poles in rad/s, the slowest to decay first."""
        p = np.roots(self.form.polynomials(self.values)[0]).astype(complex)
        return p[np.lexsort((-p.imag, -p.real.round(12)))]

    @property
    def poles_covariance(self) -> np.ndarray:
        """Covariance (n, 2, 2) of (real, imaginary) part of each pole, first order: dp/da_i = -p^(n-i) / A'(p).

        Infinite for a pole that is exactly double.
        """
        return own_blocks(self._slopes, np.asarray(self.covariance)[: self.form.n, : self.form.n])

    @property
    def poles_joint_covariance(self) -> np.ndarray:
        """Covariance (2 n, 2 n) of all poles at once, real and imaginary part in turn; NaN beside a double one."""
        return spread(self._slopes, np.asarray(self.covariance)[: self.form.n, : self.form.n])

    @property
    def _slopes(self) -> np.ndarray:
        return derivatives(self.form.polynomials(self.values)[0], self.poles)[:, 1:]

    @property
    def poles_std(self) -> np.ndarray:
        """Root mean square radius of uncertainty of each pole, rad/s."""
        return np.sqrt(np.trace(self.poles_covariance, axis1=1, axis2=2))

    def frequency_response(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return G (k, len(w)) and the covariance (k, len(w), 2, 2) of its (real, imaginary) parts at ``w`` rad/s.

        Both are infinite where A(jw) = 0.
        """
        n, k, m = self.form.n, self.form.inputs, len(self.values)
        a, b = self.form.polynomials(self.values)
        powers = (1j * np.atleast_1d(np.asarray(w, float)))[:, None] ** np.arange(n, -1, -1)
        den = powers @ a
        G = ratio(b @ powers.T, den)
        J = np.zeros((k, len(powers), m), complex)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for i in range(k):
                J[i, :, :n] = -(G[i] / den)[:, None] * powers[:, 1:]
                J[i, :, n * (i + 1) : n * (i + 2)] = powers[:, 1:] / den[:, None]
            J = np.stack([J.real, J.imag], axis=2)
            C = J @ self.covariance @ J.swapaxes(-1, -2)
        C[~np.isfinite(C).all(axis=(2, 3))] = np.diag([np.inf, np.inf])
        return G, C

    @property
    def dc_gain(self) -> np.ndarray:
        """Steady-state gain bn / an from each input, (k,)."""
        return self.frequency_response(0.0)[0][:, 0].real

    @property
    def dc_gain_std(self) -> np.ndarray:
        """Standard deviation of the steady-state gains, first order."""
        return np.sqrt(self.frequency_response(0.0)[1][:, 0, 0, 0])

    def dc_gain_interval(self, level: float = 0.95) -> np.ndarray:
        """Return an interval (k, 2) of each steady-state gain, first order; the whole line where it has no std."""
        half = ndtri(0.5 + level / 2) * self.dc_gain_std
        known = np.isfinite(half)
        low, high = (np.where(known, self.dc_gain + s * np.where(known, half, 0), s * np.inf) for s in (-1, 1))
        return np.stack([low, high], axis=1)

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies in the left half plane."""
        return bool(np.all(self.poles.real < 0))

    def to_scipy(self) -> tuple:
        """Return ``(A, B, C, D)``, what scipy.signal's lti and lsim take (`scipy.signal.lti(*abcd)`)."""
        return self.A, self.B, self.C, self.D


def simulate_continuous(a, b=None, *, time, u=None, noise_std: float = 0.0, x0=None, missing: float = 0.0, seed=0):
    """Return (y, u) of a continuous-time plant A(p) y = B(p) u at the given instants, white noise added to y.

    The plant itself is exact (matrix exponentials); each input value is held until the next instant.

    Parameters
    ----------
    a : (n,)
        a1..an, 1/s to the power of their index.
    b : (n,) or (k, n), optional
        b1..bn of each input.
    time : (T,)
        Increasing instants in seconds, as irregular as you like.
    u : (T,) or (T, k), optional
        Inputs; random signs held for one to five samples if omitted.
    noise_std : float
        Standard deviation of the white noise on the measured y; it does not enter the plant.
    x0 : (n,), optional
        State at the first instant, measured state first; zero if omitted.
    missing : float
        Fraction of the outputs to lose (NaN).
    seed : int

    Examples
    --------
    >>> y, u = simulate_continuous([1.0], [2.0], time=[0.0, 1.0, 3.0], u=[1.0, 1.0, 0.0])
    >>> print(y.round(4))
    [0.     1.2642 1.9004]
    """
    from scipy.linalg import expm

    rng = np.random.default_rng(seed)
    a, time = np.atleast_1d(np.asarray(a, float)), np.asarray(time, float)
    n, T = len(a), len(time)
    if time.ndim != 1 or np.any(np.diff(time) <= 0):
        raise InputError("time must be one increasing list of instants in seconds. Is it sorted?")
    b = np.zeros((0, n)) if b is None else np.atleast_2d(np.asarray(b, float))
    if b.shape[1] != n:
        raise InputError(f"b must list b1..b{n} for each input, like a; got shape {b.shape}")
    k = len(b)
    if u is None:
        u = np.repeat(rng.choice([-1.0, 1.0], (T, k)), rng.integers(1, 6, T), axis=0)[:T]
    u = np.asarray(u, float).reshape(T, k)
    M = np.zeros((n + k, n + k))
    M[:n, :n] = np.eye(n, k=1)
    M[:n, 0] -= a
    M[:n, n:] = b.T
    steps, kind = np.unique(np.diff(time), return_inverse=True)
    step = expm(M * steps[:, None, None])[:, :n]
    x, y = np.zeros(n) if x0 is None else np.array(x0, float), np.empty(T)
    for t in range(T):
        y[t] = x[0]
        if t + 1 < T:
            x = step[kind[t]] @ np.append(x, u[t])
    y += noise_std * rng.standard_normal(T)
    y[rng.random(T) < missing] = np.nan
    return y, (None if k == 0 else u[:, 0] if k == 1 else u)
