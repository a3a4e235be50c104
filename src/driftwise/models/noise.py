"""The noise of Salut's form: how w (on the state) and w_n (on the output) are correlated.

Given w_n, the state noise is ``w = kappa w_n + G xi`` with xi standard normal: ``kappa = S / R`` and
``G G' = Q - S S'/R``. Every kind below says what kappa and G are; R is the variance of w_n.
"""

from typing import NamedTuple

import numpy as np

from ..engine import ud
from ..engine.dispatch import Vector, choice
from ..engine.errors import InputError
from ..engine.validation import within


class EquationError(NamedTuple):
    """White equation error: w = 0, the ARX model. ``variance=None`` learns the variance.

    The default of `Joint`: exact, and on most process records the better predictor. Bad at measurement noise: white
    noise on y biases the parameters (use `OutputError`).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> dw.Joint(1, inputs=1, noise=dw.models.EquationError()).scan(y, u).parameters[-1].round(1).tolist()
    [-0.8, 1.0]
    """

    variance: float | None = None


class OutputError(NamedTuple):
    """White measurement noise on y; the plant itself is undisturbed. ``variance=None`` learns the variance.

    The product of uncertain a and uncertain x makes it a nonlinear problem: each step carries the exact first two
    moments of a Gaussian posterior, so the posterior is approximate: in strong noise some records settle wrongly from
    a bad start, one in ten where 1/A is not positive real. Bad at a plant disturbance that passes through the
    dynamics, which most process records have (use `EquationError`: it is exact).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=1000, noise_std=2.0, noise="output", seed=1)
    >>> est = dw.Joint(1, inputs=1, noise=dw.models.OutputError())
    >>> [one.scan(y, u).parameters[-1].round(1).tolist() for one in (est, dw.Joint(1, inputs=1))]
    [[-0.8, 1.0], [-0.5, 1.4]]
    """

    variance: float | None = None


class NoisePolynomial(NamedTuple):
    """Coloured noise C(z) v with known C: w = d v, w_n = v, Salut's own assumption.

    ``d`` lists d_0 .. d_{n-1} of C(z) = z^n + d_{n-1} z^{n-1} + ... + d_0; ``variance`` is that of v
    (None: learnt). A wrong d biases the parameters: `asymptotic_bias` gives the limit. Zeros of C outside the circle
    do no harm: the filter then predicts as with their reflections (`minimum_phase`). On the circle it settles as 1/t.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=2000, noise_std=0.5, d=[0.6], seed=1)
    >>> est = dw.Joint(1, inputs=1, noise=dw.models.NoisePolynomial((0.6,)))
    >>> est.scan(y, u).parameters[-1].round(2).tolist()
    [-0.8, 1.01]
    """

    d: tuple
    variance: float | None = None


class UnknownPolynomial(NamedTuple):
    """Coloured noise C(z) v whose C is estimated too, an ARMAX model: names c1..cn, c_k = d_{n-k}.

    ``d`` is where C starts, ``std`` how far each coefficient may be from it. Where sigma^2 is learnt, d is held for the
    first 2 N measured samples, until sigma^2 has shown its size. ``method`` is
    "ekf" (d v multiplies two unknowns: exact first two moments of a Gaussian posterior, the best of the three), "rml"
    (recursive maximum likelihood: the same without second-order terms) or "els" (extended least squares: the residual
    as a known input). C's zeros are kept within ``radius``: where they leave it,
    they are drawn back and the rest of the estimate moves with them. Bad at systems whose poles and zeros of C
    nearly cancel: a is then known only as well as d is (`cramer_rao` gives the ratio). Source: Ljung and Soderstrom
    (1983), chapter 3.

    ``variance`` is that of v (None: learnt).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=2000, noise_std=0.5, d=[0.6], seed=1)
    >>> trace = dw.Joint(1, inputs=1, noise=dw.models.UnknownPolynomial()).scan(y, u)
    >>> trace.names, trace.parameters[-1].round(1).tolist()
    (['a1', 'b1', 'c1'], [-0.8, 1.0, 0.6])
    """

    d: tuple | None = None
    std: float = 1.0
    variance: float | None = None
    method: str = "ekf"
    radius: float = 0.99


class NoiseCovariance(NamedTuple):
    """Known covariances: Q of w (n, n) or of the whole noise (N, N), S = cov(w, w_n), R = var w_n.

    Examples
    --------
    >>> import driftwise as dw
    >>> import numpy as np
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> noise = dw.models.NoiseCovariance(Q=np.array([[0.0]]), S=np.array([0.0]), R=0.01)
    >>> dw.Joint(1, inputs=1, noise=noise).scan(y, u).parameters[-1].round(1).tolist()
    [-0.8, 1.0]
    """

    Q: np.ndarray
    S: np.ndarray
    R: float


class White(NamedTuple):
    """What the kernel sees of an equation error."""

    R: float


class Sensor(NamedTuple):
    """What the kernel sees of an output error."""

    R: float


class Unknown(NamedTuple):
    """What the kernel sees of an unknown noise polynomial."""

    R: float
    gradient: float  # 1: v = y - H s is uncertain as s is, so regressors pass 1/C; 0: it is a known input
    spread: float  # 1: with the second-order terms of the product d v
    radius: float
    settle: float  # after so many measured samples d becomes unknown (0: it is from the start)
    free: float  # by this variance,
    most: float  # relative to sigma^2 at most by this one


class Coloured(NamedTuple):
    """What the kernel sees of a constant noise: ``G`` lists its columns one after another."""

    R: float
    kappa: Vector
    G: Vector


def resolve(noise, n: int, N: int, salut, unit: float):
    """Return the kernel's policy for a user's noise; ``salut`` maps Salut's order to the kernel's."""
    if not isinstance(noise, EquationError | OutputError | NoisePolynomial | UnknownPolynomial | NoiseCovariance):
        raise InputError(
            "noise must be OutputError(), EquationError(), NoisePolynomial(d), UnknownPolynomial() or "
            f"NoiseCovariance(Q, S, R), "
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
        if isinstance(noise, UnknownPolynomial):
            return _unknown(noise, R, n)
        return Coloured(R, coefficients(noise.d, n)[::-1].copy(), np.zeros(0))
    return _covariance(noise, n, N, salut)


def coefficients(d, n) -> np.ndarray:
    """Return d_0 .. d_{n-1} as an array."""
    try:
        values = np.asarray(d, float)
    except ValueError:
        values = np.full(0, np.nan)
    if values.shape != (n,) or not np.all(np.isfinite(values)):
        raise InputError(f"d must list the {n} finite coefficients d_0 .. d_{n - 1}, got {d!r}")
    return within("d", values, d)


def _unknown(noise, R, n):
    methods = {"els": (0.0, 0.0), "rml": (1.0, 0.0), "ekf": (1.0, 1.0)}
    if noise.method not in methods:
        raise InputError(f"method must be one of {', '.join(methods)}, got {noise.method!r}")
    if not 0.0 < noise.radius < 1.0:
        raise InputError(f"radius must lie between 0 and 1, where C can be inverted, got {noise.radius!r}")
    if noise.d is not None:
        largest = np.max(abs(np.roots([1.0, *coefficients(noise.d, n)[::-1]])), initial=0.0)
        if largest >= noise.radius:
            raise InputError(
                f"d has a zero of modulus {largest:.3g}, and C must be invertible: keep it below radius = "
                f"{noise.radius:g}. driftwise.models.minimum_phase(d) gives the noise of the same spectrum with "
                f"its zeros inside"
            )
    if R == 0.0:
        raise InputError("an unknown noise polynomial needs noise: its variance must be positive")
    if not (np.isfinite(noise.std) and noise.std >= 0):
        raise InputError(f"std must be a finite number, not negative, got {noise.std!r}")
    return Unknown(R, *methods[noise.method], noise.radius, 0.0, noise.std**2, np.inf)


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
def held_back(noise, observed, s2):
    """Return the variance, relative to s2, that an unknown polynomial will get when it is freed; 0 once it is."""


@held_back.on(White, Sensor, Coloured)
def held_back_white(noise, observed, s2):
    return 0.0


@held_back.on(Unknown)
def held_back_unknown(noise, observed, s2):
    return noise.free / s2 if observed < noise.settle else 0.0


@choice
def correlate(noise, d, kappa):
    """Fill kappa; ``d`` are the current coefficients of an unknown noise polynomial."""


@correlate.on(White, Sensor)
def correlate_white(noise, d, kappa):
    for i in range(kappa.size):
        kappa[i] = 0.0


@correlate.on(Unknown)
def correlate_unknown(noise, d, kappa):
    for i in range(d.size):
        kappa[i] = noise.gradient * d[i]


@correlate.on(Coloured)
def correlate_coloured(noise, d, kappa):
    for i in range(noise.kappa.size):
        kappa[i] = noise.kappa[i]


# --- several outputs -------------------------------------------------------------------------------------------


class Stacked(NamedTuple):
    """What the kernel sees: w_n = W v, w = kappa v + G xi, with independent v of variance R and xi of variance 1.

    ``W`` (p, p) is unit upper triangular, ``kappa`` (n, p), ``G`` the columns of each group of outputs in turn.
    """

    R: Vector
    W: Vector
    kappa: Vector
    G: Vector
    G_at: Vector


def covariances(noise, form, units) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Q (n, n), S (n, p), R (p, p) in the kernel's order; ``units`` are R where the variance is to be learnt."""
    p, n = form.outputs, form.n
    if isinstance(noise, OutputError):
        raise InputError(
            "OutputError is not for several outputs. Run Joint(order, inputs, noise=OutputError()) on each output by "
            "itself, or give what is known of the disturbances as NoiseCovariance(Q, S, R)"
        )
    if isinstance(noise, NoiseCovariance):
        return _given(noise, form)
    if not isinstance(noise, EquationError | NoisePolynomial):
        raise InputError(
            "noise must be EquationError(), NoisePolynomial((d^1, .., d^p)) or NoiseCovariance(Q, S, R), "
            f"got {noise!r}; were the brackets forgotten?"
        )
    R = units if noise.variance is None else _variances(noise.variance, p)
    d = np.zeros((n, p))
    if isinstance(noise, NoisePolynomial):
        for i, column in enumerate(_polynomials(noise.d, form)):
            d[form.x_at[i] : form.x_at[i + 1], i] = column[::-1]
    return d * R @ d.T, d * R, np.diag(R)


def _variances(value, p) -> np.ndarray:
    try:
        R = np.asarray(value, float)
    except (TypeError, ValueError):
        R = np.full(0, np.nan)
    if R.shape not in ((), (p,)) or not np.all((R >= 0) & np.isfinite(R)):
        raise InputError(
            f"noise variance must be a number, or {p} (one per output), finite and not negative: {value!r}"
        )
    return np.full(p, R) if R.ndim == 0 else R


def _polynomials(d, form) -> list[np.ndarray]:
    """Return d^i (nu_i,) of each output; with one output d itself may be the list."""
    try:
        lists = (
            [np.asarray(d, float)] if form.outputs == 1 and np.ndim(d[0]) == 0 else [np.asarray(v, float) for v in d]
        )
    except (TypeError, ValueError, IndexError):
        lists = []
    shapes = [(nu,) for nu in form.nu]
    if [v.shape for v in lists] != shapes or not all(np.isfinite(v).all() for v in lists):
        raise InputError(
            f"d must list, for each of the {form.outputs} outputs, its nu_i = {form.nu} finite coefficients "
            f"d_0 .. d_(nu_i - 1); got {d!r}"
        )
    return lists


def _given(noise, form):
    p, n = form.outputs, form.n
    try:
        Q, S, R = (np.asarray(v, float) for v in noise)
    except (TypeError, ValueError):
        raise InputError(f"Q, S and R must hold numbers, got {noise!r}") from None
    if p == 1 and S.shape == (n,):
        S = S[:, None]
    if p == 1 and R.ndim == 0:
        R = R[None, None]
    if (Q.shape, S.shape, R.shape) != ((n, n), (n, p), (p, p)):
        raise InputError(
            f"Q must be ({n}, {n}), S ({n}, {p}) and R ({p}, {p}) for the stacked states and outputs; "
            f"got {Q.shape}, {S.shape} and {R.shape}. (Noise on the parameters is memory=RandomWalk(q).)"
        )
    if not all(np.isfinite(v).all() for v in (Q, S, R)) or not np.allclose(Q, Q.T) or not np.allclose(R, R.T):
        raise InputError("Q, S and R must be finite, Q and R symmetric")
    back = form.salut[:n]
    return Q[np.ix_(back, back)], S[back], R


def separates(P, owner) -> bool:
    """Say whether no entry of a covariance links unknowns of different outputs; ``owner`` names each one's output."""
    return not np.any(P[owner[:, None] != owner])


def stacked(Q, S, R, form, groups) -> Stacked:
    """Return the kernel's policy; ``groups`` lists the outputs that are filtered together."""
    p, n = form.outputs, form.n
    diagonal, W, kappa, columns, at = np.zeros(p), np.eye(p), np.zeros((n, p)), [], [0]
    for group in groups:
        x = np.arange(form.x_at[group[0]], form.x_at[group[-1] + 1])
        joint = np.block([[Q[np.ix_(x, x)], S[np.ix_(x, group)]], [S[np.ix_(x, group)].T, R[np.ix_(group, group)]]])
        try:
            U, D = ud.factor(joint)
        except ValueError:
            raise InputError(
                "[[Q, S], [S', R]] has a negative eigenvalue, so it is no covariance: S must satisfy "
                "Q - S R^-1 S' >= 0 (and S = 0 where R = 0). Were standard deviations given for R?"
            ) from None
        m = len(x)
        diagonal[group], W[np.ix_(group, group)], kappa[np.ix_(x, group)] = D[m:], U[m:, m:], U[:m, m:]
        G = (U[:m, :m] * np.sqrt(D[:m]))[:, D[:m] > 0]
        columns.append(G.T.ravel())
        at.append(at[-1] + G.size)
    return Stacked(diagonal, W.ravel(), kappa.ravel(), np.concatenate(columns), np.array(at, float))
