"""The noise of Salut's form: how w (on the state) and w_n (on the output) are correlated.

Given w_n, the state noise is ``w = kappa w_n + G xi`` with xi standard normal: ``kappa = S / R`` and
``G G' = Q - S S'/R``. Every kind below says what kappa and G are; R is the variance of w_n.
"""

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..kernel import ud
from ..kernel.compose import Vector, choice


class EquationError(NamedTuple):
    """White equation error: w = 0, the ARX model. ``variance=None`` learns the variance.

    The default of `Joint`: exact, and on most process records the better predictor. Bad at measurement noise: white
    noise on y biases the parameters (use `OutputError`).
    """

    variance: float | None = None


class OutputError(NamedTuple):
    """White measurement noise on y; the plant itself is undisturbed. ``variance=None`` learns the variance.

    The product of uncertain a and uncertain x makes it a nonlinear problem: each step carries the exact first two
    moments of a Gaussian posterior, so the posterior is approximate: in strong noise some records settle wrongly from
    a bad start, one in ten where 1/A is not positive real. Bad at a plant disturbance that passes through the
    dynamics, which most process records have (use `EquationError`: it is exact).
    """

    variance: float | None = None


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


class Sensor(NamedTuple):
    """What the kernel sees of an output error."""

    R: float


class Coloured(NamedTuple):
    """What the kernel sees of a constant noise: ``G`` lists its columns one after another."""

    R: float
    kappa: Vector
    G: Vector


def resolve(noise, n: int, N: int, salut, unit: float):
    """Return the kernel's policy for a user's noise; ``salut`` maps Salut's order to the kernel's."""
    if not isinstance(noise, EquationError | OutputError | NoisePolynomial | NoiseCovariance):
        raise InputError(
            "noise must be OutputError(), EquationError(), NoisePolynomial(d) or NoiseCovariance(Q, S, R), "
            f"got {noise!r}; were the brackets forgotten?"
        )
    if not isinstance(noise, NoiseCovariance):
        try:
            R = unit if noise.variance is None else float(noise.variance)
        except (TypeError, ValueError):
            raise InputError(f"noise variance must be a number, got {noise.variance!r}") from None
        if not 0.0 <= R < np.inf:
            raise InputError(f"noise variance must be finite and not negative, got {R}")
        if isinstance(noise, EquationError):
            return White(R)
        if isinstance(noise, OutputError):
            return Sensor(R)
        try:
            d = np.asarray(noise.d, float)
        except ValueError:
            d = np.full(0, np.nan)
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
def correlate(noise, kappa):
    """Fill kappa."""


@correlate.on(White, Sensor)
def _(noise, kappa):
    for i in range(kappa.size):
        kappa[i] = 0.0


@correlate.on(Coloured)
def _(noise, kappa):
    for i in range(noise.kappa.size):
        kappa[i] = noise.kappa[i]
