"""What is left in the innovations: lags of an input, feedback into it, squares. Numbers whose chance is known.

Innovations of a recursive filter are not those of a fit: nothing was chosen to make their correlations small, so under
the right model they are white and owe nothing to past inputs, and no degree of freedom is taken off (Brown, Durbin and
Evans 1975). Every sum of products z(t) x(t-k) is divided by the root of its sum of squares (White 1980), so that
neither the law of the noise nor one that changes its size matters.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..engine.validation import deviation
from .delays import RIDGE, ROWS, lagged, longest_delay

LAGS = 20  # of each cross-correlation, at least
PAST = 20  # samples of its own past by which an input is told beforehand
OWN = 8  # past outputs and inputs of the equation that stands for "all of the past"
MOVES = 30.0  # of an input, below which nothing is told by it
FAINT = 0.05  # a correlation below is no matter, however long the record
EXACT = 1e-4  # of the size of what is new in an input: what an input that was computed leaves unexplained
CLIP = 4.0  # deviations
LAWS, FEW = (0, 1, 2, 3, 5, 8, 13, 20, 30, 45, 70, 100), 4  # own past samples of an input; how many of these are few


class Correlated(NamedTuple):
    """Deviations of the correlations at ``lags`` from zero, what chance allows the largest, and the samples behind."""

    lags: np.ndarray
    deviations: np.ndarray
    limit: float
    samples: int

    @property
    def is_known(self) -> bool:
        """Whether there was enough to judge by."""
        return self.samples > 0

    @property
    def correlations(self) -> np.ndarray:
        """The same as correlations."""
        return self.deviations / math.sqrt(max(self.samples, 1))

    @property
    def largest(self) -> float:
        """The largest in deviations."""
        return float(np.abs(self.deviations).max(initial=0.0)) if self.is_known else math.nan

    def without(self, lag: int) -> float:
        """Return the largest but that at one lag, in deviations."""
        return float(np.abs(self.deviations[self.lags != lag]).max(initial=0.0))

    @property
    def at(self) -> int:
        """The lag of the largest."""
        return int(self.lags[np.abs(self.deviations).argmax()])


NOTHING = Correlated(np.zeros(0, int), np.zeros(0), math.inf, 0)


def limit_of(tried: int, samples: int, level: float) -> float:
    """Return what the largest of so many deviations stays below with that probability, or what is no matter."""
    from scipy.special import ndtri

    chance = float(ndtri(0.5 + 0.5 * level ** (1 / max(tried, 1))))
    return max(chance, FAINT * math.sqrt(samples))


def regressed(target, columns) -> np.ndarray:
    """Return what columns (T, m) and a constant leave of a target (T,), by least squares on complete rows; else NaN."""
    use = np.isfinite(columns).all(axis=1) & np.isfinite(target)
    left = np.full(len(target), np.nan)
    if np.count_nonzero(use) > 2 * (columns.shape[1] + 1):
        X, y = columns[use], target[use]
        X, y = X - X.mean(axis=0), y - y.mean()
        largest = np.abs(X).max(axis=0, initial=0.0)
        X = X / np.where(largest > 0, largest, 1.0)  # whose squares are numbers
        size = np.sqrt(np.einsum("ij,ij->j", X, X))
        X = X / np.where(size > 0, size, 1.0)
        left[use] = y - X @ np.linalg.solve(X.T @ X + RIDGE * np.eye(X.shape[1]), X.T @ y)
    return left


def prewhitened(x) -> np.ndarray:
    """Return what is new in a series: less what its own last samples told (Box and Jenkins 1970, sec. 11.2)."""
    left = regressed(x, lagged(x, range(1, min(PAST, len(x) // 20) + 1)))
    if not np.isfinite(left).any():  # no sample has a past of which nothing is missing
        return left
    return left if deviation(left) > 1e-4 * deviation(x) else np.full(len(x), np.nan)


def moves(x) -> float:
    """Return how many samples moved a series: (sum of squares)^2 over the sum of fourth powers."""
    x = x[np.isfinite(x)]
    largest = np.abs(x).max(initial=0.0)
    if not largest > 0:
        return 0.0
    square = (x / largest) ** 2
    return float(square.sum() ** 2 / (square @ square))


def correlate(z, x, lags, level: float) -> Correlated:
    """Return how far sums of z(t) x(t - k) lie from zero, k of ``lags``, each over the root of its sum of squares."""
    if moves(x) < MOVES:
        return NOTHING
    products = z[:, None] * lagged(x / np.nanmax(np.abs(x)), lags)
    seen = np.isfinite(products)
    products = np.where(seen, products, 0.0)
    scale = np.sqrt(np.einsum("ij,ij->j", products, products))
    found = products.sum(axis=0) / np.where(scale > 0, scale, 1.0)
    samples = int(seen.sum(axis=0).min(initial=len(z)))
    if samples < 3 * len(found):
        return NOTHING
    return Correlated(np.asarray(lags), found, limit_of(len(found), samples, level), samples)


def missing_lags(z, u, lags: int, level: float) -> Correlated:
    """Return how innovations go with what was new in an input 0, 1, .. samples ago (Ljung 1999, sec. 16.6)."""
    return correlate(z, prewhitened(u), range(lags + 1), level)


def clipped(x) -> np.ndarray:
    """Return a series with its outliers drawn in."""
    most = CLIP * 1.4826 * float(np.nanmedian(np.abs(x))) if np.isfinite(x).any() else 0.0
    return x.clip(-most, most) if most > 0 else x


def feedback(y, u, level: float, is_late) -> list[Correlated]:
    """Return how what is new in each input goes with y 0, 1, .. samples before, beyond what the inputs' past tells.

    An input that nobody steers by y owes nothing to the past of y, whatever the plant and its model are (Granger 1969;
    Caines and Chan 1975): only that past is asked, and, where the plant ``is_late`` (k,) (an input acts after a sample
    or more, so that what is new in both at once came by the controller), the same sample. Asked are what is new in y,
    which shows an answer to white noise among what is slow, and all of y, which shows one to slow noise, whose news
    are little of it; the one that shows more is returned.
    """
    k = 1 + u.shape[1]
    if k == 1:
        return []
    deep = min(max(PAST, longest_delay(y)), len(y) // (20 * k))
    past = np.hstack([lagged(x, range(1, deep + 1)) for x in u.T])
    news = clipped(regressed(y, np.hstack([lagged(y, range(1, OWN + 1)), past])))
    whole = clipped(regressed(y, past))
    found = []
    for x, late in zip(u.T, is_late):
        pairs, lags = ((prewhitened(x), news), (regressed(x, past), whole)), range(0 if late else 1, LAGS + 1)
        both = [correlate(new, left, lags, level ** (1 / len(pairs))) for new, left in pairs]
        found.append(max(both, key=lambda c: c.largest / c.limit if c.is_known else -1.0))
    return found


def echoed(y, u) -> float:
    """Return the log odds that an input u (T,) answers y one or two samples ago, to those that it has a law of its own.

    `feedback` asks what the own past of the input leaves, so that the response of y to it is none: an input that nobody
    steers may echo itself as late as the plant does. But one that is steered has the echo of just this plant: of y one
    number tells it, of its own past many. Both are weighed by Schwarz's criterion; laws of its own are its last
    samples, however many, and a few with an echo wherever that is likeliest. Bad at: several inputs, as y is then the
    short way to say how one follows another.
    """
    deep = min(max(PAST, longest_delay(y)), len(u) // 20)
    if deep < FEW or moves(prewhitened(u)) < MOVES:
        return -math.inf
    own, past = lagged(u, range(1, deep + 1)), lagged(clipped(y - np.nanmedian(y)), (1, 2))
    use = np.isfinite(own).all(axis=1) & np.isfinite(past).all(axis=1) & np.isfinite(u)
    target, own, past, n = u[use], own[use], past[use], int(use.sum())
    if n < 20 * FEW:
        return -math.inf

    def price(left, many: int) -> float:
        return n * math.log(float(np.nanmean(left * left)) + 1e-300) + many * math.log(n)

    some = [q for q in LAWS if q <= min(deep, n // 10)]
    alone = {q: regressed(target, own[:, :q]) for q in some}
    found = [price(left, q) for q, left in alone.items()]
    for q in some[:FEW]:
        at = int(np.argmax(abs(np.nan_to_num(alone[q]) @ own[:, q:])))
        beside = own[:, [*range(q), *range(max(q + at - 1, q), min(q + at + 2, deep))]]
        found.append(price(regressed(target, beside), beside.shape[1] + 1))
    best = -math.inf
    for q in some[:FEW]:
        new = np.column_stack([regressed(x, own[:, :q]) for x in past.T])
        for j in (1, 2):
            with_y = price(regressed(target, np.hstack([own[:, :q], past[:, :j]])), q + j)
            s = new[:, :j] / np.abs(new[:, :j]).max() * alone[q][:, None]
            answer = 0.5 * float(s.sum(axis=0) @ np.linalg.lstsq(s.T @ s, s.sum(axis=0), rcond=None)[0])
            best = max(best, min(0.5 * (min(found) - with_y), answer - 0.5 * j * math.log(n)))
    return best


def is_computed(y, u) -> bool:
    """Say whether an input is computed from y: three samples of y and two of its own tell most of its moves exactly."""
    own = lagged(u, range(1, 3))
    columns = np.column_stack([np.ones(len(u)), own, lagged(y, range(3))])
    moved = (np.abs(u - own[:, 0]) > EXACT * deviation(u)) & np.isfinite(columns).all(axis=1) & np.isfinite(u)
    if np.count_nonzero(moved) < MOVES:
        return False
    X = columns[moved] / np.maximum(np.abs(columns[moved]).max(axis=0), 1e-300)
    alone, size = unexplained(X[:, :3], u[moved]), deviation(u)
    return alone > EXACT * size and unexplained(X, u[moved]) < EXACT * alone


def unexplained(X, target) -> float:
    """Return what X leaves of four fifths of a target, at most; the worst sixth is left aside: a set point may step."""
    left, kept = target, np.ones(len(target), bool)
    for _ in range(5):
        left = np.abs(target - X @ np.linalg.lstsq(X[kept], target[kept], rcond=1e-12)[0])
        kept = left <= np.quantile(left, 0.85)
    return float(np.quantile(left, 0.8))


def squares(z, y, u, prediction, nk, many: int, level: float) -> tuple[float, float, int]:
    """Return how much squares explain beyond everything linear: the score statistic, its limit, its degrees.

    The squares are those of the last outputs, of the prediction, and of each input at its first lags (Keenan 1985,
    Tsay 1986; of an input alone: Haber 1985). What is linear, 20 lags of all, is taken off both sides first. Zero
    degrees where nothing can be seen: an input of two values has no square of its own.
    """
    from scipy.special import gammaincinv

    z, y, u, prediction = z[:ROWS], y[:ROWS], u[:ROWS], prediction[:ROWS]
    deep = min(LAGS, max(len(z) // (20 * (1 + u.shape[1])), 2))
    lags = [lagged(y, range(1, min(OWN, deep) + 1)), *(lagged(x, range(k, k + deep)) for x, k in zip(u.T, nk))]
    linear = np.hstack(lags)

    def about(x):
        return (x - np.nanmean(x)) / (deviation(x) or 1.0)

    block = [about(prediction) ** 2, *lagged(about(y) ** 2, [1]).T]
    for x, k in zip(u.T, nk):
        block += list(lagged(about(x) ** 2, range(k, k + min(many, 4))).T)
    left = [regressed(b, linear) for b in block]
    seen = [g for g, b in zip(left, block) if deviation(g) > 1e-6 * max(deviation(b), 1e-300) and moves(g) > 20]
    e = regressed(z, linear)
    if not seen or not deviation(e) > 1e-3 * deviation(z):
        return math.nan, math.inf, 0
    G = np.column_stack(seen)
    use = np.isfinite(G).all(axis=1) & np.isfinite(e)
    G, e = G[use], e[use]
    if len(e) < 20 * G.shape[1]:
        return math.nan, math.inf, 0
    G = G / np.sqrt(np.einsum("ij,ij->j", G, G))
    basis, size, _ = np.linalg.svd(G, full_matrices=False)
    basis = basis[:, size > 0.05 * size[0]]
    s = basis * e[:, None]
    total, m = s.sum(axis=0), basis.shape[1]
    spread = s.T @ s
    statistic = float(total @ np.linalg.solve(spread + 1e-9 * np.trace(spread) * np.eye(m), total))
    chance = 2 * float(gammaincinv(m / 2, level))
    return statistic, max(chance, FAINT**2 * len(e)), m
