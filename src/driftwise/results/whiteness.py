"""Is anything predictable left in the innovations, and are they as large as they were said to be?"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..engine.errors import InputError

LAGS = 20
LEAST = 10  # samples (and degrees of freedom of a Student prediction) below which there is no verdict


class Whiteness(NamedTuple):
    """Verdict of `ljung_box` at 1 %: statistic, lags that had pairs, p-value. White, too, where there is no verdict."""

    statistic: float
    lags: int
    p_value: float
    is_white: bool


class Nis(NamedTuple):
    """Mean normalised innovation squared, the interval it should lie in, the samples that count, and whether it does.

    Consistent, too, where nothing could be counted.
    """

    value: float
    low: float
    high: float
    samples: int
    is_consistent: bool


class Correlations:
    """Sums of z(t) z(t-k) and their numbers of pairs, fed piece by piece; memory does not grow."""

    def __init__(self, lags: int = LAGS):
        self.lags, self.count, self.total = lags, 0, 0.0
        self.products, self.pairs = np.zeros(lags + 1), np.zeros(lags + 1)
        self._tail = np.zeros(0)

    def add(self, z) -> Correlations:
        """Take in the next samples in time; NaN where there is none."""
        z = np.concatenate([self._tail, z])
        new, known = len(self._tail), np.isfinite(z)
        full = np.where(known, z, 0.0)
        for k in range(self.lags + 1):
            first = max(new, k)
            if first < len(z):
                self.products[k] += np.einsum("i,i->", full[first:], full[first - k : len(z) - k])
                self.pairs[k] += np.count_nonzero(known[first:] & known[first - k : len(z) - k])
        self.count = int(self.pairs[0])
        self.total += float(full[new:].sum())
        self._tail = z[-self.lags :] if self.lags else z[:0]
        return self

    @property
    def mean(self) -> float:
        """Mean of z; that of innovations should be zero."""
        return self.total / self.count if self.count else math.nan

    @property
    def correlations(self) -> np.ndarray:
        """Autocorrelation at lags 0, 1, ..; a lag without pairs counts as 0."""
        return self.products / self.products[0] if self.products[0] > 0 else self.products * math.nan

    @property
    def whiteness(self) -> Whiteness:
        """Ljung-Box verdict at 1 % (fewer lags on short records)."""
        from scipy.special import gammaincc

        n, most = self.count, min(self.lags, max(1, self.count // 5))
        use = self.pairs[1 : most + 1] > 0
        lags = int(np.count_nonzero(use))
        if n < LEAST or not lags or not self.products[0] > 0:
            return Whiteness(math.nan, most, math.nan, True)
        r = self.correlations[1 : most + 1][use]
        statistic = float(n * (n + 2) * np.sum(r * r / self.pairs[1 : most + 1][use]))
        p = float(gammaincc(lags / 2, statistic / 2))
        return Whiteness(statistic, lags, p, bool(p > 0.01))


def ljung_box(z, lags: int = LAGS) -> Whiteness:
    """Return the Ljung-Box verdict on standardised innovations ``z``: is anything predictable left?

    Parameters
    ----------
    z : (T,)
        Innovations over their predicted standard deviation, in time order; NaN where there is none.
    lags : int
        Lags to look at; at most a fifth of the samples are.

    Raises
    ------
    InputError
        Where ``z`` is no series of real numbers, or ``lags`` no positive count.

    Notes
    -----
    Q = n (n + 2) sum_k r_k^2 / n_k, chi-square with as many degrees as lags (Ljung and Box 1978, where n_k = n - k
    without gaps; n_k / (n (n + 2)) is the variance of r_k). No degrees of freedom are taken off: recursive innovations
    are exactly white under the right model (after a *batch* fit there would be some). Nor is a mean: that of
    innovations is zero, and a bias is something predictable.

    A gap is a gap: r_k sums the n_k pairs that lie k samples apart in *time*, of which both are there; a lag without
    pairs is left out and its degree with it. (Gluing the ends of a gap together would mix the lags.)

    Bad at: heavy tails (one giant drowns the rest: clip, as `Summary` does at 4), and changes of variance, which are
    no correlation.

    Examples
    --------
    >>> import numpy as np
    >>> z = np.random.default_rng(0).standard_normal(500)
    >>> ljung_box(z).is_white, ljung_box(z[1:] + 0.3 * z[:-1]).is_white
    (True, False)
    """
    if isinstance(lags, bool) or not isinstance(lags, int | np.integer) or lags < 1:
        raise InputError(f"lags must be a whole number of at least 1, got {lags!r}")
    z = _series("z", z)
    size = np.abs(z).max(initial=0.0, where=~np.isnan(z))
    return Correlations(int(lags)).add(np.ldexp(z, -int(np.frexp(size)[1]))).whiteness  # squares stay in range


def nis(innovation, variance, dof=math.inf, level: float = 0.95) -> Nis:
    """Return the mean of e^2 / T, 1 where the error bars mean what they say, and the interval it should lie in.

    Parameters
    ----------
    innovation : (T,), NaN where missing
    variance : (T,), or a number
        Predicted variance (squared scale where ``dof`` is finite), as `Trace.variance`.
    dof : (T,), or a number
        Degrees of freedom of the prediction, as `Trace.dof`; below 10 a sample does not count.
    level : float
        Probability of the interval.

    Raises
    ------
    InputError
        Where shapes differ or the level is no probability.

    Notes
    -----
    Of Gaussian innovations n NIS is chi-square with n degrees (Bar-Shalom, Li and Kirubarajan 2001, sec. 5.4). Student
    errors count times (dof - 2) / dof, and their interval is that of the chi-square law with the same two moments.
    Bad at: finding which sample is wrong, and at errors that cancel in the mean.

    Examples
    --------
    >>> e = [0.5, -1.2, float("nan"), 0.9, -0.3]
    >>> nis(e, 1.0).samples, round(nis(e, 1.0).value, 4)
    (4, 0.6475)
    """
    if not 0 < level < 1:
        raise InputError(f"level is a probability between 0 and 1, got {level!r}; was it meant in percent?")
    e = _series("innovation", innovation)
    try:
        T, nu = (np.broadcast_to(np.asarray(v, float), e.shape) for v in (variance, dof))
    except ValueError:
        raise InputError(f"variance and dof must be numbers or {e.shape} like the innovations") from None
    total, spread, count = score(e, T, nu)
    return verdict(total, spread, count, level)


def score(e, T, dof) -> tuple[float, float, int]:
    """Return the sum of normalised squares, the sum of their variances, and how many samples count."""
    use = np.isfinite(e) & (T > 0) & (dof >= LEAST)
    e, T, dof = e[use], T[use], dof[use]
    with np.errstate(invalid="ignore"):
        kurtosis = np.where(np.isinf(dof), 3.0, 3 * (1 + 2 / (dof - 4)))
    return float(np.sum(e * e / T * (1 - 2 / dof))), float(np.sum(kurtosis - 1)), len(e)


def verdict(total: float, spread: float, count: int, level: float = 0.95) -> Nis:
    """Return the `Nis` of what `score` adds up to."""
    from scipy.special import gammaincinv

    if not count:
        return Nis(math.nan, 0.0, math.inf, 0, True)
    degrees = 2 * count * count / spread
    low, high = (float(2 * gammaincinv(degrees / 2, p) / degrees) for p in (0.5 - level / 2, 0.5 + level / 2))
    value = total / count
    return Nis(value, low, high, count, low <= value <= high)


def _series(name, value) -> np.ndarray:
    try:
        value = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must hold real numbers, got {value!r}") from None
    if value.ndim != 1:
        raise InputError(f"{name} must be one-dimensional, (T,), got shape {value.shape}")
    if np.isinf(value).any():
        raise InputError(f"{name} is infinite at index {int(np.argmax(np.isinf(value)))}; mark what is missing by NaN")
    return value
