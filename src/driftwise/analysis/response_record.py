"""A record as a response is fitted to it, and the sizes, colours and long-run variances of what is left of one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..engine.validation import deviation
from ..models.regression import CLEAR, TOLD, solved
from ..tables.stuck_sensor import still
from .held_model import filled

HUBER, FAR = 2.5, 5.0  # deviations beyond which a sample counts less, beyond which it is an outlier
LOCAL = 50  # samples either side by which the size of the noise is known
COLOUR = 8  # past values of the noise by which it is whitened, at most
HALF = 0.5  # of the samples, which whitening by past values must leave
FLOOR = 1e-4  # of the deviation of y, below which noise is none
USUAL, OFTEN = 0.9, 20  # of the samples, which values have that tell how y is rounded; samples of each, on average
LAGS, SHARE = 200, 8  # lags of the correlation of scores at most, and as a share of them


@dataclass(frozen=True)
class Record:
    """y (T,), NaN where missing, u (T, k) without gaps, both about zero; what bends are made of, for each input."""

    y: np.ndarray
    u: np.ndarray
    shapes: tuple[np.ndarray, ...]  # of each input (m, T), without a straight part
    floor: float  # what rounding leaves of the noise, at least
    is_scattered: bool = False  # few samples follow each other: each is whitened by the one before, if long ago
    events: tuple[int, ...] = ()  # samples at which the table says that something was done

    @property
    def first(self) -> int:
        """The first sample that was measured: what a plant began with long before has died out by then."""
        return int(np.argmax(np.isfinite(self.y)))


def recorded(y, u, events=()) -> tuple[Record, float, float, np.ndarray, np.ndarray]:
    """Return y (T,) and u (T, k) about their middles in units of their deviations; deviation and middle of each.

    Readings that repeat themselves as no others do are the sensor's, not the plant's: they count as missing.
    """
    y = np.array(y, float)
    for one in still(y):
        y[one.start : one.stop] = np.nan
    u = np.column_stack([filled(x) for x in u.T]) if u.shape[1] else np.zeros((len(y), 0))
    seen = y[np.isfinite(y)]
    y_middle = float(np.median(seen))
    y_scale, u_scale = deviation(seen) or 1.0, np.array([deviation(x) or 1.0 for x in u.T])
    middle = u.mean(axis=0)
    v = (u - middle) / u_scale
    record = Record(
        (y - y_middle) / y_scale, v, tuple(shapes(x) for x in v.T), rounding(seen) / y_scale, is_scattered(y),
        tuple(events),
    )  # fmt: skip
    return record, y_scale, y_middle, u_scale, middle


def is_scattered(y) -> bool:
    """Say whether less than `HALF` of the samples that were measured follow another."""
    known = np.isfinite(y)
    return int(np.count_nonzero(known[1:] & known[:-1])) < HALF * int(np.count_nonzero(known))


def shapes(x) -> np.ndarray:
    """Return squares and cubes of a signal of deviation one, (m, T), without a straight part; fewer of few values."""
    found, straight = [], np.linalg.qr(np.column_stack([np.ones(len(x)), x]))[0]
    for f in (x * abs(x), x * x, x**3):
        f = f - straight @ (straight.T @ f)
        size = float(np.sqrt(np.mean(f * f)))
        if size > 1e-3:
            found.append(f / size)
            straight = np.column_stack([straight, f / (size * math.sqrt(len(x)))])
    return np.array(found).reshape(-1, len(x))


def rounding(y) -> float:
    """Return the deviation of the rounding of y (T,), and no less than what nobody would call noise."""
    values, which, many = np.unique(y, return_inverse=True, return_counts=True)
    steps = np.diff(values)
    step = float(steps.min()) if len(steps) else 0.0
    if not step > 1e-9 * float(steps.sum() if len(steps) else 0.0) or np.any(abs(steps / step % 1 - 0.5) < 0.45):
        step = usual_step(y, which, many)  # not all of them are multiples of the smallest
    return max(step / math.sqrt(12), FLOOR * deviation(y) if len(y) else 0.0)


def usual_step(y, which, many) -> float:
    """Return the usual step of a rounded y (T,) that was brought to another clock; 0 where it is none.

    Between two rounded values lie others, then, but `USUAL` of the samples have few, and go from one to the other.
    ``which`` (T,) value a sample has, and how ``many`` have that.
    """
    order = np.argsort(-many, kind="stable")
    few = order[: int(np.searchsorted(np.cumsum(many[order]), USUAL * len(y))) + 1]
    is_common = np.isin(which, few)
    steps = abs(np.diff(y))
    steps = steps[is_common[1:] & is_common[:-1] & (steps > 0)]
    if len(few) * OFTEN > len(y) or len(steps) <= np.count_nonzero(~is_common):
        return 0.0  # what is moved from rest to rest goes over values of its own
    return float(np.median(steps))


def delayed(x, lag: int) -> np.ndarray:
    """Return x(t - lag), zero before the record."""
    found = np.zeros(len(x))
    found[lag:] = x[: len(x) - lag]
    return found


def local_size(r, least=0.0) -> np.ndarray:
    """Return the standard deviation about each sample, by the median of what is near; ``least`` is that of rounding.

    Of rounded values more than half may be the same.
    """
    edges, size = np.arange(0, len(r), LOCAL), abs(r)
    inside = sliding_window_view(size, 2 * LOCAL)[LOCAL // 2 :: LOCAL] if len(r) > 2 * LOCAL else np.zeros((0, 1))
    middles = [float(np.median(size[: 3 * LOCAL // 2])), *np.median(inside, axis=1)]
    middles += [float(np.median(size[k - LOCAL // 2 : k + 3 * LOCAL // 2])) for k in edges[len(middles) :]]
    size = 1.4826 * np.interp(np.arange(len(r)), edges + LOCAL / 2, middles)
    return np.maximum(size, np.maximum(least, 1e-12 * (abs(r).max(initial=0.0) + 1e-300)))


def least_squares(X, y) -> np.ndarray:
    """Return the parameters of columns X (T, P) that leave least of y (T,); what X hardly tells apart stays near zero.

    By the normal equations of columns of one size: a fifth of the time of singular values of X, and half the digits.
    """
    return solved(X.T @ X, X.T @ y)


def autoregression(v, most: int) -> np.ndarray:
    """Return f of v(t) = -f1 v(t-1) .. + e, as many as Schwarz's criterion asks for; v is NaN where not known.

    What has run away beyond all numbers has no colour.
    """
    known = np.isfinite(v)
    X = regressors(v, known, min(most, max(len(v) // 30, 0)))
    if len(X) < 2:
        return np.zeros(0)
    with np.errstate(over="ignore", invalid="ignore"):
        whole = X @ X.T
    if not np.isfinite(whole).all():
        return np.zeros(0)
    G, g, power, n = whole[1:, 1:], whole[0, 1:], float(whole[0, 0]), X.shape[1]
    q = np.arange(1, len(X))
    f = ahead(G, g)
    left = np.maximum(power - f @ g, TOLD * power)
    value = np.log(left / n + 1e-300) * n + q * math.log(n)
    best = int(np.argmin(value))
    return -f[best, : best + 1] if value[best] < math.log(power / n + 1e-300) * n else np.zeros(0)


def regressors(v, known, most: int) -> np.ndarray:
    """Return v(t), v(t - 1), .. (1 + p, n) where all are known: ``most`` lags, or as many as leave `HALF` of them."""
    uses = [known]
    while len(uses) <= most:
        p = len(uses)
        use = np.zeros(len(v), bool)
        use[p:] = uses[-1][p:] & known[:-p]
        if np.count_nonzero(use) <= HALF * np.count_nonzero(known):
            break
        uses.append(use)
    rows = np.flatnonzero(uses[-1])
    if len(rows) and rows[-1] - rows[0] < len(rows):  # one after the other: no row is looked up
        return np.array([v[rows[0] - lag :][: len(rows)] for lag in range(len(uses))])
    return np.array([v[rows - lag] for lag in range(len(uses))])


def ahead(G, g) -> np.ndarray:
    """Return the least squares of normal equations G (p, p), g (p,) of the first unknown, the first two, .., (p, p)."""
    from scipy.linalg.lapack import dpotrf, dtrtri

    size = np.sqrt(np.maximum(G.diagonal(), 1e-300))
    U, trouble = dpotrf(G / size / size[:, None])
    if not trouble and U.diagonal().min() > CLEAR:  # the first unknowns have the first rows and columns of U
        inverse, _ = dtrtri(U)
        return np.cumsum((g / size @ inverse) * inverse, axis=1).T / size
    first = np.tri(len(g))
    root, V = np.linalg.eigh(first[:, :, None] * first[:, None] * G)
    told = root > TOLD * root[:, -1:]
    return (V @ np.where(told, (g @ V) / np.where(told, root, 1.0), 0.0)[:, :, None])[..., 0]


def huber(r) -> float:
    """Return Huber's loss of what is left."""
    r = np.minimum(abs(r), 1e6)
    near = np.minimum(r, HUBER)
    return float(np.sum(near * (r - 0.5 * near)))


def long_run(s) -> float:
    """Return the long-run variance of a series, not below its variance (Newey and West, 1987)."""
    n = len(s)
    s = s - s.mean()
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(s, size)
    lags = min(n // SHARE, LAGS)
    found = np.fft.irfft(spectrum * spectrum.conj(), size)[: lags + 1] / n
    weights = 1 - np.arange(1, lags + 1) / (lags + 1)
    return float(max(found[0] + 2 * weights @ found[1:], found[0], 1e-300))


def long_run_of(s) -> np.ndarray:
    """Return the long-run covariance of series (n, m), no direction of it below one."""
    n = len(s)
    lags = min(n // SHARE, LAGS // 4)
    S = s.T @ s / n
    for j in range(1, lags + 1):
        cross = s[j:].T @ s[:-j] / n
        S += (1 - j / (lags + 1)) * (cross + cross.T)
    value, vector = np.linalg.eigh(S)
    return (vector * np.maximum(value, 1.0)) @ vector.T
