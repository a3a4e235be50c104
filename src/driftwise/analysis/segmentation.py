"""Where a record falls into pieces, in hindsight: a level, the gain of an input or the noise that jumps, with odds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

SURE = math.log(100.0)  # log odds from which a jump is told
LOCAL = 50  # samples either side by which the size of the noise is known
HUBER, FAR = 2.5, 5.0  # deviations beyond which a sample counts less, beyond which it is an outlier
LEAST, EACH = 30, 3  # samples of a piece at least, and for each coefficient
LAGS, SHARE = 200, 8  # lags of the correlation of residuals at most, and as a share of the piece
EDGE, BESIDE = 6, 3.0  # part of a record that is its edge; log odds that chance may take
PIECES = 20  # jumps that are told at most
FLOOR = 1e-3  # of the deviation of y, below which noise is none
LEVEL, GAIN, NOISE = "level", "gain", "noise"


class Jump(NamedTuple):
    """A jump: the first sample after it, where that lies in 95 of 100 cases, the log odds, and what jumped."""

    at: int
    interval: tuple[int, int]
    log_odds: float
    kind: str
    input: int  # of a gain
    before: float
    after: float


class Visible(NamedTuple):
    """The smallest jumps that would have been told outside of the edges of a record."""

    level: float
    gains: tuple[float, ...]  # as shares of the gain of each input
    noise: float  # as a factor


class Rows(NamedTuple):
    """The rows of a regression that are whole, weighted."""

    sample: np.ndarray
    X: np.ndarray
    y: np.ndarray
    na: int
    parts: list[slice]  # columns of each input
    floor: float  # what rounding leaves of the noise, at least
    is_far: np.ndarray  # from what was expected


def jumps(y, u, na: int, nb=(), nk=()) -> list[Jump]:
    """Return the jumps of a record, in order.

    The record is one regression of ARX form with a straight trend; a piece is cut in two where its likelihood gains
    most by another offset, another factor of one input's part, or another variance from there on (binary segmentation,
    Vostrikova 1981). The gain counts as the evidence that the samples are worth: it is divided by the long-run variance
    of the score, with Bartlett's weights (Newey and West, 1987), so that residuals that are correlated, or have heavy
    tails, tell less. The odds are those of a jump anywhere in the piece, with a prior of the worth of one sample.

    Bad at: slow drift and seasons, which are no jumps and make residuals that are correlated for long, so that nothing
    is told; several jumps close together; records with hardly two samples in a row.
    """
    if len(y) <= max([na, *(n + k for n, k in zip(nb, nk))]):
        return []
    rows = _regression(np.asarray(y, float), np.asarray(u, float), na, tuple(nb), tuple(nk))
    found: list[Jump] = []
    pieces = [(0, len(rows.y))]
    while pieces and len(found) < PIECES:
        a, b = pieces.pop()
        best = _split(rows, a, b)
        if best is not None and best[1].log_odds > SURE:
            found.append(best[1])
            pieces += [(a, best[0]), (best[0], b)]
    return sorted(found)


def visible(y, u, na: int, nb=(), nk=()) -> Visible | None:
    """Return the smallest jumps that `jumps` would have told, as what it found of the residuals has it.

    None where too few samples follow each other for any.
    """
    y = np.asarray(y, float)
    if len(y) <= max([na, *(n + k for n, k in zip(nb, nk))]):
        return None
    rows = _regression(y, np.asarray(u, float), na, tuple(nb), tuple(nk))
    X, n = rows.X, len(rows.y)
    if n // EDGE < max(LEAST, EACH * X.shape[1]):
        return None
    theta = _solve(X, rows.y)
    r, wide = rows.y - X @ theta, np.linalg.pinv(X.T @ X, hermitian=True)
    need = SURE + 0.5 * math.log(n) + math.log(2 + len(rows.parts)) + BESIDE
    ways = _directions(rows, X, theta)
    spread = (_long_run(g * r) / max(float(np.mean(g * g)), 1e-300) + rows.floor**2 for g in ways)
    level, *gains = (math.sqrt(2 * need * s2 / _free(X, wide, g)) for g, s2 in zip(ways, spread))
    settle = float(abs(1 + theta[:na].sum()))
    colour = max(_long_run(r**2 / max(float(np.mean(r**2)), 1e-300) - 1) / 2, 1.0)
    share, factors = 1 / EDGE, np.linspace(1.05, 10.0, 200)
    gain = 0.5 * n * (np.log(1 - share + share * factors**2) - share * np.log(factors**2))
    enough = np.flatnonzero(gain / colour > need)
    noise = float(factors[enough[0]]) if len(enough) else math.inf
    return Visible(level / settle if settle else math.inf, tuple(gains), noise)


def _free(X, wide, g) -> float:
    """Return what is left of a jump along ``g`` beside the regression, at the worse of both edges."""
    n = len(g)
    found = []
    for place in (n // EDGE, n - n // EDGE):
        late = g * (np.arange(n) >= place)
        found.append(float(late @ late - (late @ X) @ wide @ (X.T @ late)))
    return max(min(found), 1e-300)


def outliers(y, u, na: int, nb=(), nk=()) -> np.ndarray:
    """Return which samples stand out of the same regression, (T,); of several in a row the first: the others follow."""
    y = np.asarray(y, float)
    found = np.zeros(len(y), bool)
    if len(y) > max([na, *(n + k for n, k in zip(nb, nk))]):
        rows = _regression(y, np.asarray(u, float), na, tuple(nb), tuple(nk))
        found[rows.sample[rows.is_far]] = True
        found[1:] &= ~found[:-1].copy()
    return found


def _regression(y, u, na, nb, nk) -> Rows:
    """Return the rows, each weighted by Huber's rule beside the noise about it."""
    T = len(y)
    reach = max([na, *(n + k - 1 for n, k in zip(nb, nk)), 0])
    lags = [-y[reach - i : T - i] for i in range(1, na + 1)]
    parts, at = [], na
    for i, (n, k) in enumerate(zip(nb, nk)):
        lags += [u[reach - k - j : T - k - j, i] for j in range(n)]
        parts.append(slice(at, at + n))
        at += n
    target, sample = y[reach:], np.arange(reach, T)
    X = np.column_stack([*lags, sample / max(T, 1), np.ones(len(sample))])
    whole = np.isfinite(X).all(axis=1) & np.isfinite(target)
    X, target, sample = X[whole], target[whole], sample[whole]
    w, is_far = np.ones(len(target)), np.zeros(len(target), bool)
    for _ in range(2 if len(target) else 0):
        r = target - X @ _solve(X * w[:, None], target * w)
        size = _local(r)
        w, is_far = np.sqrt(np.minimum(1.0, HUBER * size / np.maximum(abs(r), 1e-300))), abs(r) > FAR * size
    return Rows(sample, X * w[:, None], target * w, na, parts, _rounding(target), is_far)


def _rounding(y) -> float:
    """Return the deviation of the rounding of y, and no less than what nobody would call noise."""
    levels = np.unique(y)
    steps = np.diff(levels) if 1 < len(levels) < len(y) / 2 else np.zeros(1)
    return max(float(np.median(steps)) / math.sqrt(12), FLOOR * float(np.std(y)) if len(y) else 0.0)


def _solve(X, y) -> np.ndarray:
    return np.linalg.lstsq(X, y, rcond=None)[0]


def _local(r) -> np.ndarray:
    """Return the standard deviation about each sample, by the median of what is near."""
    edges = np.arange(0, len(r), LOCAL)
    middles = [float(np.median(abs(r[max(k - LOCAL // 2, 0) : k + 3 * LOCAL // 2]))) for k in edges]
    return np.maximum(
        1.4826 * np.interp(np.arange(len(r)), edges + LOCAL / 2, middles), 1e-12 * (abs(r).max() + 1e-300)
    )


def _split(rows: Rows, a: int, b: int) -> tuple[int, Jump] | None:
    """Return where rows a to b are cut best, as a row, and the jump there."""
    X, y = rows.X[a:b], rows.y[a:b]
    n, N = X.shape
    margin = max(LEAST, EACH * N)
    if n <= 2 * margin:
        return None
    theta = _solve(X, y)
    r = y - X @ theta
    wide = np.linalg.pinv(X.T @ X, hermitian=True)
    candidates = [_noise(r, margin, rows.floor)]
    candidates += [_mean(X, r, wide, g, margin, rows.floor) for g in _directions(rows, X, theta)]
    k = int(np.argmax([odds for odds, _, _ in candidates]))
    odds, at, (low, high) = candidates[k]
    kind, which = (NOISE, 0) if k == 0 else (LEVEL, 0) if k == 1 else (GAIN, k - 2)
    before, after = _sizes(rows, X, y, r, theta, at, kind, which)
    sample = rows.sample[a:b]
    low, first, high = (int(sample[place]) for place in (low, at, high))
    jump = Jump(first, (low, high), odds - math.log(len(candidates)), kind, which, before, after)
    return a + at, jump


def _directions(rows: Rows, X, theta) -> list[np.ndarray]:
    """Return what a jump adds to the regression: the constant, the part of each input."""
    return [X[:, -1], *(X[:, part] @ theta[part] for part in rows.parts)]


def _mean(X, r, wide, g, margin: int, floor: float) -> tuple[float, int, tuple[int, int]]:
    """Return log odds, place and interval of a jump along ``g``."""
    n = len(r)
    after = np.cumsum((X * g[:, None])[::-1], axis=0)[::-1]  # (n, N) sums from each row on
    score, size = (np.cumsum(v[::-1])[::-1] for v in (g * r, g * g))
    free = size - np.einsum("ij,jk,ik->i", after, wide, after)
    taken = np.where(free > 1e-9 * size[0], score**2 / np.maximum(free, 1e-300), 0.0)
    place = margin + int(np.argmax(taken[margin : n - margin]))
    if not taken[place] > 0 or not np.any(g):
        return -math.inf, place, (place, place)
    direction = g * (np.arange(n) >= place) - X @ (wide @ after[place])
    rest = r - direction * (score[place] / free[place])
    return _odds(0.5 * taken / (_long_run(g * rest) / float(np.mean(g * g)) + floor**2), margin)


def _noise(r, margin: int, floor: float) -> tuple[float, int, tuple[int, int]]:
    """Return log odds, place and interval of another variance; what stands out of its surroundings is cut off."""
    limit = HUBER * _local(r)
    r = np.clip(r, -limit, limit)
    n, k = len(r), np.arange(1, len(r))
    total = np.cumsum(r**2)
    first, second = total[:-1] / k, (total[-1] - total[:-1]) / (n - k)
    low = floor**2 + 1e-300
    gain = 0.5 * (n * math.log(total[-1] / n + low) - k * np.log(first + low) - (n - k) * np.log(second + low))
    gain = np.concatenate([[0.0], gain])
    place = margin + int(np.argmax(gain[margin : n - margin]))
    z = np.concatenate([part**2 / (np.mean(part**2) + low) for part in (r[:place], r[place:])]) - 1
    return _odds(gain / max(_long_run(z) / 2, 1.0), margin)


def _long_run(s) -> float:
    """Return the long-run variance of a series, not below its variance."""
    n = len(s)
    s = s - s.mean()
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(s, size)
    lags = min(n // SHARE, LAGS)
    found = np.fft.irfft(spectrum * spectrum.conj(), size)[: lags + 1] / n
    weights = 1 - np.arange(1, lags + 1) / (lags + 1)
    return float(max(found[0] + 2 * weights @ found[1:], found[0], 1e-300))


def _odds(gain, margin: int) -> tuple[float, int, tuple[int, int]]:
    """Return log odds of a jump somewhere, the likeliest place, and 95 % of the places."""
    n = len(gain)
    inside = gain[margin : n - margin]
    best = float(inside.max())
    weight = np.exp(inside - best)
    share = np.cumsum(weight) / weight.sum()
    low, high = (margin + int(np.searchsorted(share, q)) for q in (0.025, 0.975))
    odds = best + math.log(weight.sum() / len(inside)) - 0.5 * math.log(n)
    return odds, margin + int(np.argmax(inside)), (low, min(high, n - margin - 1))


def _sizes(rows: Rows, X, y, r, theta, at: int, kind: str, which: int) -> tuple[float, float]:
    """Return what jumped before and after; of a level 0 and by how much."""
    if kind == NOISE:
        return float(np.std(r[:at])), float(np.std(r[at:]))
    g = _directions(rows, X, theta)[0 if kind == LEVEL else 1 + which]
    both = _solve(np.column_stack([X, g * (np.arange(len(y)) >= at)]), y)
    settle = 1 + both[: rows.na].sum()
    if kind == LEVEL:
        return 0.0, float(both[-1] / settle)
    old, part = theta[rows.parts[which]].sum(), both[rows.parts[which]].sum()
    return float(part / settle), float((part + both[-1] * old) / settle)
