"""The least error that anybody can reach on a record, with and without knowing the noise polynomial."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..engine.errors import InputError
from .asymptotic import companion, lyapunov, output_row
from .canonical import Canonical
from .rows import regression_rows, triangle
from .spectral import inside, noise_polynomial


@dataclass(frozen=True)
class CramerRao:
    """The least covariance that any unbiased estimate of (a, b, d) can have, and whether it lets you trust a.

    Attributes
    ----------
    names : list of str
        Names of the rows of `covariance`: a_0 .. a_{n-1} (that is a{n} .. a1), b_0 .. b_{n-1} of each input, direct
        terms, and d_0 .. d_{n-1} unless d is known.
    information : (p, p)
        Fisher information of the whole record for (a, b, d), d last.
    d_known : bool
        Whether `covariance` and `std` take d as known.
    """

    names: list[str]
    information: np.ndarray
    order: int
    d_known: bool

    @cached_property
    def covariance(self) -> np.ndarray:
        """The bound, (p, p): infinite where the parameters cannot be told apart."""
        return self._inverse(self.d_known)

    @property
    def std(self) -> np.ndarray:
        """Square root of its diagonal."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def a_std(self) -> np.ndarray:
        """Least standard deviation (n,) of a_0 .. a_{n-1} when d is unknown too."""
        return np.sqrt(np.diag(self._inverse(False))[: self.order])

    @property
    def a_std_known(self) -> np.ndarray:
        """The same when d is known."""
        return np.sqrt(np.diag(self._inverse(True))[: self.order])

    @property
    def ratio(self) -> np.ndarray:
        """`a_std` over `a_std_known`, (n,): how much not knowing d costs. Above ten or so a rests on the assumed d."""
        return self.a_std / self.a_std_known

    @property
    def words(self) -> str:
        """Whether to trust a, in a sentence."""
        worst = float(np.max(self.ratio))
        if not np.isfinite(worst):
            return "A zero of C cancels a pole: without knowing d, a cannot be estimated at all."
        size = f"{worst:.0f}" if worst >= 10 else f"{worst:.1f}"
        text = f"Not knowing d makes the error of a {size} times that with d known"
        if worst >= 10:
            return text + ": a is only as good as the assumed d, whatever its error bars say."
        if worst >= 3:
            return text + ": treat a with care unless d is known."
        return text + ": a can be trusted without knowing d."

    def _inverse(self, d_known):
        size = len(self.information) - (self.order if d_known else 0)
        info = self.information[:size, :size]
        unit = np.sqrt(np.diag(info))
        if np.any(unit == 0):
            return np.full((size, size), np.inf)
        scaled = info / np.outer(unit, unit)
        if np.linalg.eigvalsh(scaled)[0] < 1e-13:
            return np.full((size, size), np.inf)
        return np.linalg.inv(scaled) / np.outer(unit, unit)


def cramer_rao(
    a, d, b=None, *, samples: int, direct=None, d_known: bool = False, noise_variance=1.0, input_variance=1.0
) -> CramerRao:
    """Return the asymptotic Cramer-Rao bound of (a, b, d) for A(q) y = B(q) u + C(q) v with white inputs.

    Parameters
    ----------
    a, d : (n,)
        a_0 .. a_{n-1} and d_0 .. d_{n-1}, Salut's order.
    b : (n,) or (k, n), optional
        b_0 .. b_{n-1} of each input.
    samples : int
        Length of the record.
    direct : (k,), optional
        Direct terms b_n, if they are to be estimated.
    d_known : bool
        Whether `covariance` takes d as known; the ratio compares both anyway.
    noise_variance : float
        Variance of v.
    input_variance : float or (k,)
        Variances of the inputs, white and independent.

    Returns
    -------
    CramerRao

    Raises
    ------
    InputError
        Where a zero of A or C is not inside the circle (see `driftwise.models.minimum_phase`), or sizes do not fit.

    Notes
    -----
    The prediction error is (A y - B u)/C, so its gradients are y, u and the error itself filtered by 1/C; their
    stationary covariance solves a discrete Lyapunov equation (Ljung, *System Identification*, 1999, section 9.4). Bad
    at: short records, and inputs that are not white (use `cramer_rao_of_record`).

    Examples
    --------
    >>> bound = cramer_rao([-0.24, 1.18, -1.9], [-0.056, 0.5, -1.3], samples=1000)
    >>> print(bound.a_std_known.round(3), bound.a_std.round(1))
    [0.031 0.056 0.031] [ 5.4 13.   7.8]
    >>> print(bound.words)
    Not knowing d makes the error of a 255 times that with d known:
    a is only as good as the assumed d, whatever its error bars say.
    """
    a = inside("a", a)
    n = len(a)
    if not n:
        raise InputError("a is empty: it lists a_0 .. a_{n-1}")
    d = inside("d", d, n)
    b, direct, k = _inputs(b, direct, n)
    try:
        T, r = float(samples), float(noise_variance)
        powers = np.broadcast_to(np.asarray(input_variance, float), (k,))
    except (TypeError, ValueError):
        raise InputError(f"samples, noise_variance and input_variance ({k} inputs) must be numbers") from None
    if not (T >= 1 and 0 < r < np.inf and np.all(powers >= 0) and np.isfinite(powers).all()):
        raise InputError("samples and variances must be positive and finite")
    form = Canonical(n, k, direct is not None)
    A, C = np.append(1.0, a[::-1]), np.append(1.0, d[::-1])
    one, last = np.ones(1), form.N - n

    def lagged(first, num, den):
        return [(first + j, num, den, n - j) for j in range(n)]

    info = _gradient_information(lagged(0, one, A) + lagged(last, -one, C), form.N)
    for i in range(k):
        B = np.append(0.0 if direct is None else direct[i], b[i, ::-1])
        gradients = lagged(0, B, np.convolve(A, C)) + lagged(n * (i + 1), -one, C)
        if direct is not None:
            gradients.append((n * (k + 1) + i, -one, C, 0))
        info += powers[i] / r * _gradient_information(gradients, form.N)
    return CramerRao(_names(form), T * info, n, bool(d_known))


def cramer_rao_of_record(
    y, u=None, *, a, d, b=None, direct=None, d_known: bool = False, noise_variance=None
) -> CramerRao:
    """Return the Cramer-Rao bound of (a, b, d) at estimates, from the record they came from: whether to trust a.

    The information is that of the measured data, whatever the input was, the unknown initial state taken out.

    Parameters
    ----------
    y : (T,)
    u : (T,) or (T, k), optional
    a, d, b, direct
        Estimates in Salut's order, as for `cramer_rao`.
    d_known : bool
        Whether `covariance` takes d as known.
    noise_variance : float, optional
        Variance of v; that of the residuals if omitted.

    Returns
    -------
    CramerRao

    Raises
    ------
    InputError
        For missing samples, fewer samples than unknowns, or zeros of C not inside the circle.

    Notes
    -----
    The information is a sample average, whose own noise fills a direction in which there is almost none: near a
    cancellation the ratio comes out too small (14 to 90 instead of 177 to 255 for the system below, 2000 samples), so
    read a ratio above ten as "at least". Where there is no input, or a white one, `cramer_rao` at the estimates does
    not have that noise. Bad at: estimates far from the truth (the bound is that of the estimates), and missing samples.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, _ = dw.simulate([-1.9, 1.18, -0.24], d=[-1.3, 0.5, -0.056], samples=2000, noise_std=1.0, seed=3)
    >>> bound = cramer_rao_of_record(y, a=[-0.24, 1.18, -1.9], d=[-0.056, 0.5, -1.3])
    >>> bool(bound.ratio.min() > 10)
    True
    """
    a = noise_polynomial("a", a)
    n = len(a)
    if not n:
        raise InputError("a is empty: it lists a_0 .. a_{n-1}")
    d = inside("d", d, n)
    b, direct, k = _inputs(b, direct, n)
    y, u = _record(y, u, k)
    form = Canonical(n, k, direct is not None)
    unknowns = form.N + n
    if len(y) <= unknowns:
        raise InputError(f"{len(y)} samples are too few for {unknowns} unknowns (state, a, b, d)")
    theta = np.concatenate([a[::-1], b[:, ::-1].ravel(), [] if direct is None else direct])
    X, target = (np.concatenate(part) for part in list(zip(*regression_rows(form, y, u, d)))[:2])
    x0, rest = X[:, :n], target - X[:, n:] @ theta
    start = np.linalg.lstsq(x0, rest, rcond=None)[0]
    residual = rest - x0 @ start
    if noise_variance is None:
        noise_variance = residual @ residual / (len(y) - unknowns)
    if not 0 < noise_variance < np.inf:
        raise InputError(
            "the residuals are zero, so there is no noise whose polynomial d could matter; give noise_variance"
        )
    from scipy.signal import lfilter

    again = np.append(lfilter([1.0], np.append(1.0, d[::-1]), residual), 0.0)
    shifted = np.column_stack([-np.append(np.zeros(lag), again[: len(y) - lag]) for lag in range(n, 0, -1)])
    salut = n + np.arange(form.N - n)
    salut[: n * (k + 1)] = salut[: n * (k + 1)].reshape(-1, n)[:, ::-1].ravel()
    R = triangle(None, np.column_stack([x0, -X[:, salut], shifted]))[n:, n:]
    return CramerRao(_names(form), R.T @ R / noise_variance, n, bool(d_known))


# --- small parts -------------------------------------------------------------------------------------------


def _names(form):
    n = form.n
    names = list(form.names)
    blocks = [names[i : i + n][::-1] for i in range(0, n * (form.inputs + 1), n)]
    return [
        *(name for block in blocks for name in block),
        *names[n * (form.inputs + 1) :],
        *(f"d{lag}" for lag in range(n, 0, -1)),
    ]


def _inputs(b, direct, n):
    """Return b (k, n), direct (k,) or None, and k."""
    if b is None:
        if direct is not None:
            raise InputError("direct terms were given but no b: list b_0 .. b_{n-1} (zeros where there are none)")
        return np.zeros((0, n)), None, 0
    try:
        b = np.atleast_2d(np.asarray(b, float))
        direct = None if direct is None else np.atleast_1d(np.asarray(direct, float))
    except (TypeError, ValueError):
        raise InputError("b and direct must hold numbers") from None
    if b.ndim != 2 or b.shape[1] != n or not np.isfinite(b).all():
        raise InputError(f"b must list {n} finite coefficients b_0 .. b_{n - 1} for each input, got shape {b.shape}")
    if direct is not None and (direct.shape != (len(b),) or not np.isfinite(direct).all()):
        raise InputError(f"direct must list {len(b)} finite terms, one for each input, got shape {direct.shape}")
    return b, direct, len(b)


def _record(y, u, k):
    """Return a complete record."""
    try:
        y = np.asarray(y, float)
        u = np.zeros((len(y), 0)) if u is None else np.asarray(u, float)
    except (TypeError, ValueError):
        raise InputError("y and u must hold numbers, y of shape (T,)") from None
    u = u[:, None] if u.ndim == 1 else u
    if y.ndim != 1 or u.shape != (len(y), k):
        raise InputError(f"y must be (T,) and u (T, {k}) as b says, got {y.shape} and {u.shape}")
    if not (np.isfinite(y).all() and np.isfinite(u).all()):
        raise InputError("samples are missing or infinite: filtering by 1/C needs a complete stretch; cut one out")
    return y, u


def _gradient_information(gradients, size):
    """Covariance (size, size) of gradients (index, num, den, lag): num(q)/den(q) e(t - lag), e unit white noise."""
    sizes: dict[tuple, int] = {}  # of one state for each denominator
    for _, num, den, lag in gradients:
        key = tuple(den)
        sizes[key] = max(sizes.get(key, 1), len(den) - 1, lag + len(num) - 1)
    ends = np.cumsum(list(sizes.values()))
    F, g = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1])
    place = {}
    for (den, p), end in zip(sizes.items(), ends):
        here, full = slice(end - p, end), np.append(den, np.zeros(p + 1 - len(den)))
        F[here, here], g[here] = companion(full)
        place[den] = here, full
    rows, straight = np.zeros((size, len(F))), np.zeros(size)
    for index, num, den, lag in gradients:
        here, full = place[tuple(den)]
        delayed = np.append(np.zeros(lag), num)
        rows[index, here], straight[index] = output_row(delayed, full), delayed[0]
    return rows @ lyapunov(F, np.outer(g, g)) @ rows.T + np.outer(straight, straight)
