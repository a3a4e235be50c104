"""The noise of Salut's form: how w (on the state) and w_n (on the output) are correlated.

Given w_n, the state noise is ``w = kappa w_n + G xi`` with xi standard normal: ``kappa = S / R`` and
``G G' = Q - S S'/R``. Every kind below says what kappa and G are; R is the variance of w_n.
"""

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..kernel import ud
from ..kernel.compose import Vector, choice, kernel
from ..kernel.status import PROJECTED


class EquationError(NamedTuple):
    """White equation error: w = 0, the ARX model. ``variance=None`` learns the variance.

    Bad at measurement noise: white noise on y biases the parameters (use `OutputError`).
    """

    variance: float | None = None


class OutputError(NamedTuple):
    """White measurement noise on y: the noise polynomial is the plug-in d = a-hat, kept inside ``radius``.

    ``variance=None`` learns the variance. The default of `Joint`, and what most measured records are.
    Bad at a plant disturbance that passes through the dynamics (use `EquationError` or `NoisePolynomial`).
    """

    variance: float | None = None
    radius: float = 0.98


class NoisePolynomial(NamedTuple):
    """Coloured noise C(z) v with known C: w = d v, w_n = v, Salut's own assumption.

    ``d`` lists d_0 .. d_{n-1} of C(z) = z^n + d_{n-1} z^{n-1} + ... + d_0; ``variance`` is that of v
    (None: learnt). A wrong d biases the parameters (theory: the limit is that of data filtered by 1/C).
    """

    d: tuple
    variance: float | None = None


class NoiseCovariance(NamedTuple):
    """Known covariances: Q of w (n, n) or of the whole noise (N, N), S = cov(w, w_n), R = var w_n."""

    Q: np.ndarray
    S: np.ndarray
    R: float


class White(NamedTuple):
    """What the kernel sees of an equation error."""

    R: float


class PlugIn(NamedTuple):
    """What the kernel sees of an output error."""

    R: float
    radius: float


class Coloured(NamedTuple):
    """What the kernel sees of a constant noise: ``G`` lists its columns one after another."""

    R: float
    kappa: Vector
    G: Vector


def resolve(noise, n: int, N: int, salut, unit: float):
    """Return the kernel's policy for a user's noise; ``salut`` maps Salut's order to the kernel's."""
    if isinstance(noise, EquationError | OutputError | NoisePolynomial):
        R = unit if noise.variance is None else float(noise.variance)
        if not 0.0 <= R < np.inf:
            raise InputError(f"noise variance must be finite and not negative, got {R}")
        if isinstance(noise, EquationError):
            return White(R)
        if isinstance(noise, OutputError):
            if not 0.0 < noise.radius <= 1.0:
                raise InputError(f"radius must lie in (0, 1], got {noise.radius}")
            return PlugIn(R, float(noise.radius))
        d = np.asarray(noise.d, float)
        if d.shape != (n,) or not np.all(np.isfinite(d)):
            raise InputError(f"d must list the {n} finite coefficients d_0 .. d_{n - 1}, got {noise.d!r}")
        return Coloured(R, d[::-1].copy(), np.zeros(0))
    return _covariance(noise, n, N, salut)


def _covariance(noise, n, N, salut):
    """Split a joint covariance of (w, w_n) into R, kappa and G; refuse one that is not a covariance."""
    Q, S, R = np.array(noise.Q, float), np.array(noise.S, float), float(noise.R)
    size = len(np.atleast_1d(S))
    if Q.shape != (size, size) or size not in (n, N):
        raise InputError(
            f"Q must be ({n}, {n}) with S ({n},), or ({N}, {N}) with S ({N},); got {Q.shape} and {S.shape}"
        )
    if not (np.isfinite(Q).all() and np.isfinite(S).all() and np.isfinite(R)) or not np.allclose(Q, Q.T):
        raise InputError("Q, S and R must be finite and Q symmetric")
    joint = np.zeros((N + 1, N + 1))
    joint[:size, :size], joint[:size, N], joint[N, :size], joint[N, N] = Q, S, S, R
    order = np.append(salut, N)
    try:
        U, D = ud.factor(joint[np.ix_(order, order)])
    except ValueError:
        raise InputError(
            f"S is inconsistent with Q and R: [[Q, S], [S', R]] with R = {R:g} has a negative eigenvalue, so it is no "
            "covariance; S must satisfy Q - S S'/R >= 0 (and S = 0 where R = 0). Was a standard deviation given for R?"
        ) from None
    rows = N if np.any(U[n:N, N]) or np.any(D[n:N]) else n
    keep = D[:N] > 0
    G = (U[:rows, :N] * np.sqrt(D[:N]))[:, keep]
    return Coloured(float(D[N]), U[:rows, N].copy(), np.ascontiguousarray(G.T).ravel())


@choice
def correlate(noise, theta, n, kappa, scratch):
    """Fill ``kappa`` for this sample and return a status bit."""


@correlate.on(White)
def _(noise, theta, n, kappa, scratch):
    for i in range(kappa.size):
        kappa[i] = 0.0
    return 0


@correlate.on(Coloured)
def _(noise, theta, n, kappa, scratch):
    for i in range(kappa.size):
        kappa[i] = noise.kappa[i] if i < noise.kappa.size else 0.0
    return 0


@correlate.on(PlugIn)
def _(noise, theta, n, kappa, scratch):
    for i in range(n):
        kappa[i] = theta[i]
    for i in range(n, kappa.size):
        kappa[i] = 0.0
    return project_roots(kappa, n, noise.radius, scratch)


@kernel
def is_inside(c, n, radius, a):
    """Say whether z^n + c_0 z^(n-1) + ... + c_(n-1) has all roots in |z| < radius (Schur-Cohn, step down)."""
    scale = 1.0
    for i in range(n):
        scale /= radius
        a[i] = c[i] * scale
    for order in range(n, 0, -1):
        k = a[order - 1]
        if not abs(k) < 1.0:
            return False
        g = 1.0 - k * k
        for i in range(order // 2):
            low, high = a[i], a[order - 2 - i]
            a[i] = (low - k * high) / g
            a[order - 2 - i] = (high - k * low) / g
    return True


@kernel
def project_roots(c, n, radius, scratch):
    """Scale c_k by rho^(k+1) until all roots lie inside ``radius``; return PROJECTED if it had to."""
    status = 0
    for _ in range(600):
        if is_inside(c, n, radius, scratch):
            return status
        status = PROJECTED
        rho = 1.0
        for i in range(n):
            rho *= 0.98
            c[i] *= rho
    for i in range(n):
        c[i] = 0.0
    return status
