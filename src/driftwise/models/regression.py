"""Regressions on filtered signals: their rows, and the parameters that leave least where what is far off counts less.

Compiled as a whole: a fit of a few thousand rows takes less time than the calls of NumPy that it would be made of.
"""

from __future__ import annotations

import math
import threading

import numpy as np

from ..engine import compile
from ..engine.dispatch import kernel
from ..engine.elementary import square
from ..engine.order import smallest

TOLD = 1e-14  # of what is told best, squared: a direction of less is not told by a record
FAINT = 1e-8  # of the size of the largest column: what one that is smaller does is lost beside it
CLEAR = 1e-4  # the least pivot, of columns of one size, from which all is told
SPREAD = 1.4826  # times the median distance is the deviation of a normal law
NOTHING = np.zeros(0, np.int64), np.zeros((0, 1))  # rows after gaps
ROOM, NO_ROOM = threading.local(), np.empty(0)


def filtered_rows(a, signals, places, beside, rows, deviations, gaps=NOTHING, more: int = 0) -> np.ndarray:
    """Return signals through 1/a, each after each of some lags, and others beside them, at some samples: (R, P + m).

    What is returned is overwritten by the next call from the same thread.

    Parameters
    ----------
    a : (n + 1,), which begins with one
    signals : (s, T), at rest before the record
    places : (2 P,) of integers: which of the signals, after how many samples, one after the other
    beside : (m, T), not filtered
    rows : (R,) of integers: the samples
    deviations : (R,) by which they are divided
    gaps : (K,) of integers, (K, W)
        Which of the rows are sums of that many samples up to theirs, the latest first, with which weights; these are
        not divided.
    more : int
        Columns behind these that the caller fills.

    Examples
    --------
    >>> x = np.array([[1.0, 0.0, 0.0]])
    >>> filtered_rows(np.array([1.0, -0.5]), x, np.array([0, 0, 0, 1]), x, np.array([1, 2]), np.ones(2)).tolist()
    [[0.5, 1.0, 0.0], [0.25, 0.5, 0.0]]
    """
    X = room("rows", len(rows), len(places) // 2 + len(beside) + more)
    go = compile.function(fill_rows, 1, 2, "index", 2, "index", 1, "index", 2, 2, 2)
    go(a, signals, places, beside, rows, deviations, *gaps, room("passed", *signals.shape), X)
    return X


def room(name: str, *shape: int) -> np.ndarray:
    """Return an array of that shape, with anything in it: the same memory each time, of each thread its own.

    A new array of this size would be made of new pages, which take longer than what is done with it.
    """
    size, kept = math.prod(shape), getattr(ROOM, name, NO_ROOM)
    if kept.size < size:
        kept = np.empty(size)
        setattr(ROOM, name, kept)
    return kept[:size].reshape(shape)


def fill_rows(a, signals, places, beside, rows, deviations, after, mixing, passed, X):
    """Fill ``X`` as `filtered_rows` says, and ``passed`` (s, T) with signals through 1/a."""
    n, T = a.size - 1, signals.shape[1]
    for t in range(T):
        for i in range(signals.shape[0]):
            value = signals[i, t]
            for j in range(min(n, t), 0, -1):
                value -= a[j] * passed[i, t - j]
            passed[i, t] = value
    P = places.size // 2
    for r in range(rows.size):
        t, scale = rows[r], 1.0 / deviations[r]
        for c in range(P):
            at = t - places[2 * c + 1]
            X[r, c] = passed[places[2 * c], at] * scale if at >= 0 else 0.0
        for c in range(beside.shape[0]):
            X[r, P + c] = beside[c, t] * scale
    for k in range(after.size):
        r = after[k]
        for c in range(P + beside.shape[0]):
            total = 0.0
            for j in range(min(mixing.shape[1], rows[r] + 1)):
                t = rows[r] - j
                if c >= P:
                    total += mixing[k, j] * beside[c - P, t]
                elif t >= places[2 * c + 1]:
                    total += mixing[k, j] * passed[places[2 * c], t - places[2 * c + 1]]
            X[r, c] = total


def fitted(X, weight, faint: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return what of the columns of X (R, P + 1) but the last leaves least of the last, (P,), and what is left, (R,).

    ``weight`` (R,) multiplies rows; what is left is not weighted. What X hardly tells apart stays near zero, as do the
    parameters of columns that are less than ``faint`` of the largest.
    """
    P = X.shape[1] - 1
    G, L = np.empty((P + 1, P + 1)), np.empty((P + 1, P + 1))
    values, left, told = np.empty(P), np.empty(len(X)), np.zeros(1)
    compile.function(fill_fitted, 2, 1, 2, 2, 1, 1, 1, float)(X, weight, G, L, values, left, told, faint)
    if not told[0]:
        G = np.tril(G) + np.tril(G, -1).T
        values = solved(G[:-1, :-1], G[-1, :-1], faint)
        left = X[:, -1] - X[:, :-1] @ values
    return values, left


def robustly_fitted(X, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of a second fit, in which rows count less that are far off in a first one.

    That is beyond ``limit`` deviations, told by the median distance (Huber, 1964).
    """
    weight = np.ones(len(X))
    _, left = fitted(X, weight, FAINT)
    compile.function(fill_weight, 1, 1, 1, float)(left, weight, room("near", len(X)), limit)
    return fitted(X, weight, FAINT)


def solved(G, g, faint: float = FAINT) -> np.ndarray:
    """Return the solution of normal equations G (P, P), g (P,): zero in directions that are hardly told."""
    from scipy.linalg.lapack import dposv

    size = np.sqrt(np.diag(G))
    size = np.maximum(size, max(faint * size.max(initial=0.0), 1e-150))
    G = G / size / size[:, None]
    U, x, trouble = dposv(G, g / size)
    if not trouble and U.diagonal().min(initial=1.0) > CLEAR:
        return x / size
    value, vector = np.linalg.eigh(G)
    told = value > TOLD * value[-1:]
    V = vector[:, told]
    return V @ (V.T @ (g / size) / value[told]) / size


def fill_fitted(X, weight, G, L, values, left, told, faint):
    """Fill ``G``, and where all is told ``values`` and ``left``, of rows that count as the squares of ``weight``."""
    P = X.shape[1] - 1
    add_products(X, weight, G)
    for i in range(P + 1):
        for j in range(i + 1):
            L[i, j] = G[i, j]
    told[0] = 1.0 if solve_normal(L, values, faint) else 0.0
    for r in range(X.shape[0] if told[0] > 0.0 else 0):
        rest = X[r, P]
        for c in range(P):
            rest -= X[r, c] * values[c]
        left[r] = rest


def fill_weight(left, weight, near, limit):
    """Fill ``weight``, the root of how much what is ``left`` counts: less beyond a number of deviations."""
    for r in range(left.size):
        near[r] = abs(left[r])
    far = limit * SPREAD * middle(near, left.size)
    for r in range(left.size):
        size = max(abs(left[r]), 1e-300)
        weight[r] = math.sqrt(far / size) if size > far else 1.0


@kernel
def middle(a, n):
    """Return the median of the first n, the mean of two, which it puts into another order."""
    lower = smallest(a, n, (n - 1) // 2)
    if n % 2 == 1:
        return lower
    upper = math.inf
    for k in range((n - 1) // 2 + 1, n):
        upper = min(upper, a[k])
    return 0.5 * (lower + upper)


@kernel
def add_products(X, weight, G):
    """Fill the lower triangle of G (C, C) with the sums of products of the columns of X (R, C), weighted twice."""
    R, C = X.shape[0], X.shape[1]
    for i in range(C):
        for j in range(i + 1):
            G[i, j] = 0.0
    for k in range(R // 4):  # four rows at a time: sums are fetched and put down once for them
        r = 4 * k
        p, q, s, t = square(weight[r]), square(weight[r + 1]), square(weight[r + 2]), square(weight[r + 3])
        for i in range(C):
            a, b, c, d = p * X[r, i], q * X[r + 1, i], s * X[r + 2, i], t * X[r + 3, i]
            for j in range(i + 1):
                G[i, j] += (a * X[r, j] + b * X[r + 1, j]) + (c * X[r + 2, j] + d * X[r + 3, j])
    for r in range(4 * (R // 4), R):
        p = square(weight[r])
        for i in range(C):
            a = p * X[r, i]
            for j in range(i + 1):
                G[i, j] += a * X[r, j]


@kernel
def solve_normal(G, values, faint):
    """Fill ``values`` (P,) from products G (P + 1, P + 1), the last the target's: a lower triangle, which it uses up.

    Return whether all is told: whether no pivot of columns of one size (Cholesky) is below `CLEAR`.
    """
    P, most = values.size, 0.0
    for i in range(P):
        most = max(most, G[i, i])
    least = max(faint * math.sqrt(most), 1e-150)
    for i in range(P):
        values[i] = max(math.sqrt(G[i, i]), least)  # the size of a column
    for i in range(P):
        for j in range(i + 1):
            G[i, j] /= values[i] * values[j]
        G[P, i] /= values[i]
    for i in range(P):
        for j in range(i + 1):
            rest = G[i, j]
            for k in range(j):
                rest -= G[i, k] * G[j, k]
            if j < i:
                G[i, j] = rest / G[j, j]
            elif rest > CLEAR * CLEAR:
                G[i, i] = math.sqrt(rest)
            else:
                return False
    for i in range(P):
        for k in range(i):
            G[P, i] -= G[i, k] * G[P, k]
        G[P, i] /= G[i, i]
    for i in range(P - 1, -1, -1):
        for k in range(i + 1, P):
            G[P, i] -= G[k, i] * G[P, k]
        G[P, i] /= G[i, i]
    for i in range(P):
        values[i] = G[P, i] / values[i]
    return True
