"""After how many samples an input acts: difference equations of every delay compared, by one table of products."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..engine import bounds
from ..models.lags import shares_left

ROWS = 20_000  # of a record that are looked at, at most
LEAST = 4  # rows for each unknown, below which nothing is compared
SURE = math.log(100.0)  # odds, in logarithms
USUAL = 2  # samples: delays that candidates have anyway
ORDER = 4  # past outputs, and coefficients of each input, by which delays are looked for
LONGEST = 40  # samples, looked at in any case
RIDGE = 1e-10  # of a regressor's own square: what makes two that are the same solvable


def lagged(x, lags) -> np.ndarray:
    """Return x(t - k) for each of ``lags``, (T, len(lags)); NaN before the record and, for leads, after it."""
    found = np.full((len(x), len(lags)), np.nan)
    for j, k in enumerate(lags):
        if abs(k) < len(x):
            found[max(k, 0) : len(x) + min(k, 0), j] = x[max(-k, 0) : len(x) - max(k, 0)]
    return found


def about_mean(x) -> np.ndarray:
    """Return a signal about the mean of what is known of it."""
    known = x[np.isfinite(x)]
    return x - (known.mean() if known.size else 0.0)


def lagged_products(signals, spans) -> np.ndarray:
    """Return sums of products of signals at 0, 1, .. lags, ``spans`` of each, over the samples where all are known.

    Sums over all samples follow from those of one lag less, but for the ends. Of these are taken what is not known in
    full; or, where that is most, the others are summed.
    """
    T, reach, many = len(signals[0]), max(spans), sum(spans)
    if T < reach:
        return np.zeros((many, many))
    gaps = [~np.isfinite(x) for x in signals]
    out = [_windows(gap, span, reach).any(axis=1) for gap, span in zip(gaps, spans) if gap[reach - span :].any()]
    if not out:
        return _all_products(signals, spans)  # what is before the first row is not looked at
    unknown = np.logical_or.reduce(out)
    signals = [np.where(gap, 0.0, x) for x, gap in zip(signals, gaps)]
    is_few = 2 * np.count_nonzero(unknown) < len(unknown)
    rows = np.flatnonzero(unknown == is_few)
    X = np.hstack([_windows(x, span, reach)[rows, ::-1] for x, span in zip(signals, spans)])
    return _all_products(signals, spans) - X.T @ X if is_few else X.T @ X


def _windows(x, span: int, reach: int) -> np.ndarray:
    """Return the last ``span`` samples up to each from the ``reach``-th on, (T - reach + 1, span)."""
    return sliding_window_view(x, span)[reach - span :]


def _all_products(signals, spans) -> np.ndarray:
    """Return the same over all samples: G(a + 1, b + 1) is G(a, b), the sample before the first for the last."""
    reach, ends = max(spans), list(accumulate(spans, initial=0))
    latest = [x[reach - span :] for x, span in zip(signals, spans)]
    before = [x[: span - 1][::-1] for x, span in zip(latest, spans)]
    after = [x[:-span:-1] for x, span in zip(latest, spans)]
    found = np.empty((ends[-1], ends[-1]))
    for i, p in enumerate(spans):
        for j, q in enumerate(spans[: i + 1]):
            line = np.zeros(p * (p + q + 1))  # rows of p + q: what is below and to the right of it is p + q + 1 further
            G = line[: p * (p + q)].reshape(p, p + q)
            G[0, :q] = np.correlate(latest[j], latest[i][p - 1 :])[::-1]
            if p > 1:
                G[:, 0] = G[0, :q] if i == j else np.correlate(latest[i], latest[j][q - 1 :])[::-1]
                G[1:, 1:q] = np.multiply.outer(before[i], before[j]) - np.multiply.outer(after[i], after[j])
                steps = line.reshape(p, p + q + 1)
                np.cumsum(steps, axis=0, out=steps)
            own, other = slice(ends[i], ends[i + 1]), slice(ends[j], ends[j + 1])
            found[own, other], found[other, own] = G[:, :q], G[:, :q].T
    return found


def cost(delays) -> np.ndarray:
    """Return what delays cost, in nats: as whole numbers of no known size do (Rissanen, 1983, to the first term).

    Where rows are few some long delay fits a little better by chance, or by what a change left.
    """
    return np.log1p(np.asarray(delays, float))


def with_cost(left, delays, rows: int) -> np.ndarray:
    """Return the shares of squares that delays leave in so many rows, (D,), larger by what they cost."""
    return left * np.exp(2 / rows * cost(delays))


def best_delay(y, x, many: int, most: int) -> int | None:
    """Return the likeliest delay of one signal x (T,), that is known, of which ``many`` lags leave a part of y (T,).

    None where outputs are missing, or too few: `DelayScan` finds the same of any, in three times the time.
    """
    y, x = y[:ROWS], x[:ROWS]
    late = y[most + many - 1 :]
    if len(late) < LEAST * (many + 1) or not np.isfinite(late).all() or not np.ptp(late) > 0:
        return None
    y, x = y - late.mean(), x - x.mean()
    return int(np.argmin(with_cost(shares_left(y, x, many, most, RIDGE), np.arange(most + 1), len(late))))


class DelayScan:
    """Sums of squares that y = -a y.. + b u.. + offset leaves for any delay of any input, ``most`` samples at most.

    Parameters
    ----------
    y : (T,), u : (T, k)
        NaN where missing; the first rows of a long record are taken.
    na, nb : int, (k,)
        Past outputs, and coefficients of each input.
    most : int
        The longest delay.
    is_costly : bool
        Whether a delay has its `cost`.

    Notes
    -----
    Least squares by the normal equations of all lags at once: a delay more costs the solution of a small system. Bad at
    noise that is far from an equation error (filter both by the noise model first), and at inputs that hardly move.
    """

    def __init__(self, y, u, na: int, nb, most: int, is_costly: bool = False):
        self.na, self.nb, self.most, self.is_costly = na, tuple(nb), most, is_costly
        self.deep = most + max(self.nb)
        signals = [*(about_mean(x[:ROWS]) for x in (y, *u.T)), np.ones(min(len(y), ROWS))]
        products = lagged_products(signals, [na + 1, *(self.deep for _ in self.nb), 1])  # the output is the first
        sums, self.rows = products[-1], int(products[-1, -1])
        products = products - sums[:, None] * sums / max(self.rows, 1)
        size = np.sqrt(np.maximum(np.diag(products), 0.0))
        self.scale = float(size[0]) ** 2
        size = np.where(size > 0, size, 1.0)
        self.products = products / size / size[:, None]

    @property
    def unknowns(self) -> int:
        """How many coefficients there are, the offset among them."""
        return self.na + sum(self.nb) + 1

    @property
    def is_enough(self) -> bool:
        """Whether there are rows enough to compare by."""
        return self.rows >= LEAST * self.unknowns and self.scale > 0

    def left(self, nk, skipped: dict[int, int] | None = None) -> float:
        """Return the share of the squares of y that delays ``nk`` (k,) leave; without the first lags of some inputs."""
        return float(self._left(np.array([self._places(nk, skipped)]))[0])

    def _places(self, nk, skipped: dict[int, int] | None = None) -> list[int]:
        """Return where the regressors of such delays are among all."""
        at = list(range(1, self.na + 1))
        for i, (size, delay) in enumerate(zip(self.nb, nk)):
            first = self.na + 1 + i * self.deep + delay
            at += range(first + (skipped or {}).get(i, 0), first + size)
        return at

    def _left(self, at) -> np.ndarray:
        """Return the shares that regressors at (D, m) leave, (D,)."""
        G, b = self.products[at[:, :, None], at[:, None, :]], self.products[at, 0]
        taken = np.einsum("ij,ij->i", b, np.linalg.solve(G + RIDGE * np.eye(at.shape[1]), b[:, :, None])[:, :, 0])
        return np.maximum(self.products[0, 0] - taken, 1e-14)

    def _scanned(self, nk, i: int, least: int) -> int:
        """Return the likeliest delay of one input, ``least`` or more."""
        before = self.na + sum(self.nb[:i])
        tried = np.arange(least, self.most + 1)
        every = np.tile(self._places(nk), (len(tried), 1))
        every[:, before : before + self.nb[i]] += tried[:, None] - nk[i]
        left = self._left(every)
        if self.is_costly:
            left = with_cost(left, tried, self.rows)
        return int(tried[np.argmin(left)])

    def best(self, nk, least) -> tuple[int, ...]:
        """Return the likeliest delays, ``least`` (k,) or more: one input after the other, twice over."""
        found = list(nk)
        for _ in range(2 if len(found) > 1 else 1):
            for i in range(len(found)):
                found[i] = self._scanned(found, i, least[i])
        return tuple(found)

    def odds(self, nk, other) -> float:
        """Return the log odds of delays ``other`` against ``nk``: of two with as many coefficients."""
        return 0.5 * self.rows * math.log(self.left(nk) / self.left(other))


def longest_delay(y) -> int:
    """Return how far to look for a delay, in samples: a quarter of the settling time of y, and forty samples at least.

    The settling time is four times the time in which the autocorrelation of y falls to 1/e; never more than a sixth
    of the record, or than a model takes.
    """
    known = y[np.isfinite(y)]
    T = len(known)
    if T < 2 or not known.std() > 0:
        return 0
    z = known - known.mean()
    size = 1 << (2 * T - 1).bit_length()
    f = np.fft.rfft(z, size)
    r = np.fft.irfft(f * f.conj(), size)[: T // 3 + 1]
    below = np.flatnonzero(r < r[0] / math.e)
    tau = int(below[0]) if len(below) else T // 3
    return min(max(tau, LONGEST), T // 6, bounds.ORDER - ORDER)


def shown_delays(y, u) -> tuple[int, ...]:
    """Return after how many samples each input acts, where that is not one; nothing where the inputs tell nothing.

    Asked are the delays of an equation of fourth order up to `longest_delay`; they must beat the best of those within
    ``USUAL`` at odds of 100:1, times the delays tried. Then each begins as late as costs next to nothing. Bad at inputs
    that follow each other.
    """
    k, most = u.shape[1], longest_delay(y)
    if not k or most <= USUAL:
        return ()
    scan = DelayScan(y, u, ORDER, (ORDER,) * k, most)
    if not scan.is_enough:
        return ()
    best = scan.best((1,) * k, (0,) * k)
    near = min((scan.left((d,) * k), (d,) * k) for d in range(USUAL + 1))[1]
    if scan.odds(near, best) <= SURE + math.log(most):
        best = near
    wide = DelayScan(y, u, 2 * ORDER, (2 * ORDER,) * k, max(best))
    found = tuple(first_lag(wide if wide.is_enough else scan, best, i) for i in range(k))
    return () if set(found) == {1} else found


def first_lag(scan: DelayScan, nk: tuple[int, ...], i: int) -> int:
    """Return the first lag of an input that counts, ``nk`` or some before or after: those before it can go.

    They can at odds of less than ``SURE``, times the lags tried.
    """
    least = -min(ORDER - 1, nk[i])
    whole, sure = scan.left(nk, {i: least}), SURE + math.log(2 * (ORDER - 1))
    for skipped in range(ORDER, least, -1):
        left = scan.left(nk, {i: skipped})
        if 0.5 * scan.rows * math.log(left / whole) < sure:
            return nk[i] + skipped if skipped < ORDER else 1
    return nk[i] + least
