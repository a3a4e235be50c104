"""What the lags of one signal explain of another, whichever lag comes first."""

from __future__ import annotations

import math

import numpy as np

from ..engine import compile
from ..engine.dense import at, solve
from ..engine.dispatch import kernel


def shares_left(y, x, many: int, most: int, ridge: float) -> np.ndarray:
    """Return the shares of the squares of y that x(t - d), .. x(t - d - many + 1) and an offset leave, d = 0, .. most.

    Parameters
    ----------
    y, x : (T,), finite; from sample ``most + many - 1`` on
    ridge : float
        Of a lag's own square, added to it: what makes two that are the same solvable.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal(300)
    >>> int(np.argmin(shares_left(np.append(np.zeros(3), x[:-3]), x, 2, 6, 1e-10)))
    2
    """
    reach, left = most + many, np.empty(most + 1)
    cross = np.correlate(x, y[reach - 1 :])[::-1].copy()
    go = compile.function(fill_left, 1, 1, 1, float, 2, 1, 1, 1, 1)
    rooms = np.empty((reach, many)), np.empty(reach), np.empty(many * (many + 1) // 2), np.empty(many)
    go(y, x, cross, ridge, *rooms, left)
    return left


def fill_left(y, x, cross, ridge, products, sums, G, z, left):
    """Fill ``left`` as `shares_left` says; ``cross`` (reach,) are the products of y with x at each lag.

    Of ``products`` (reach, many) are those of x at a lag with those at the next ones: each follows from that a lag
    before, but for the ends.
    """
    T, reach, many = x.size, products.shape[0], products.shape[1]
    first, n = reach - 1, float(x.size - reach + 1)
    total, square, sums[0] = 0.0, 0.0, 0.0
    for t in range(first, T):
        total += y[t]
        sums[0] += x[t]
        square += y[t] * y[t]
    square -= total * total / n
    for j in range(many):
        products[0, j] = 0.0
        for t in range(first, T):
            products[0, j] += x[t] * x[t - j]
    for lag in range(1, reach):
        sums[lag] = sums[lag - 1] + x[first - lag] - x[T - lag]
        for j in range(min(many, reach - lag)):
            ahead, behind = x[first - lag] * x[first - lag - j], x[T - lag] * x[T - lag - j]
            products[lag, j] = products[lag - 1, j] + ahead - behind
    for d in range(left.size):
        for j in range(many):
            for i in range(j + 1):
                own = centred(products, sums, d + i, j - i, n) / size_of(products, sums, d + i, n)
                G[at(i, j)] = own / size_of(products, sums, d + j, n) + (ridge if i == j else 0.0)
            z[j] = (cross[d + j] - sums[d + j] * total / n) / size_of(products, sums, d + j, n)
        solve(G, z)
        taken = 0.0
        for j in range(many):
            taken += z[j] * (cross[d + j] - sums[d + j] * total / n) / size_of(products, sums, d + j, n)
        left[d] = max(1.0 - taken / square, 1e-14) if square > 0.0 else 1.0


@kernel
def centred(products, sums, lag, later, n):
    """Return the sum of products about the means of what is ``lag`` samples late and ``later`` more."""
    return products[lag, later] - sums[lag] * sums[lag + later] / n


@kernel
def size_of(products, sums, lag, n):
    """Return the root of the squares about the mean of what is ``lag`` samples late; one where there are none."""
    own = centred(products, sums, lag, 0, n)
    return math.sqrt(own) if own > 0.0 else 1.0
