"""A rational filter over a whole record, from rest."""

from __future__ import annotations

import numpy as np

from ..engine import compile


def linear_filter(b, a, x) -> np.ndarray:
    """Return y of a(q) y = b(q) x, (T,) or (T, k), polynomials in powers of q^-1; before the record all is zero.

    Bad at: gaps, which it does not know.

    Examples
    --------
    >>> linear_filter([0.0, 1.0], [1.0, -0.5], [1.0, 0.0, 0.0, 0.0]).tolist()
    [0.0, 1.0, 0.5, 0.25]
    """
    b, a, x = (np.asarray(values, float) for values in (b, a, x))
    rows = np.ascontiguousarray(x.reshape(len(x), -1).T)
    return filter_rows(b / a[0], a / a[0], rows).T.reshape(x.shape)


def filter_rows(b, a, x) -> np.ndarray:
    """Return the same of rows ``x`` (k, T), contiguous; a[0] is one.

    Examples
    --------
    >>> filter_rows(np.array([0.0, 1.0]), np.array([1.0, -0.5]), np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])).tolist()
    [[0.0, 1.0, 0.5], [0.0, 0.0, 2.0]]
    """
    y = np.empty(x.shape)
    compile.function(run_filter, 1, 1, 2, 2)(b, a, x, y)
    return y


def run_filter(b, a, x, y):
    """Fill ``y`` (k, T) with what the filter b/a, whose a[0] is one, makes of ``x``."""
    count, T, n = x.shape[0], x.shape[1], a.size - 1
    for i in range(count):
        for t in range(T):
            y[i, t] = b[0] * x[i, t]
        for j in range(1, b.size):
            for t in range(j, T):
                y[i, t] += b[j] * x[i, t - j]
    for t in range(T if n > 0 else 0):
        for i in range(count):  # signals beside each other: while one waits for its last value, others are added up
            value = y[i, t]
            for j in range(min(n, t), 0, -1):
                value -= a[j] * y[i, t - j]
            y[i, t] = value


def many_filters(b, a, x) -> np.ndarray:
    """Return y (S, T) of S rational filters, b and a (S, n), over one record x (T,): `linear_filter` of each.

    One system, a block for each filter. Bad at: filters that grow beyond all numbers, which are done one by one.

    Examples
    --------
    >>> many_filters([[0.0, 1.0], [0.0, 2.0]], [[1.0, -0.5], [1.0, 0.0]], [1.0, 0.0, 0.0, 0.0]).tolist()
    [[0.0, 1.0, 0.5, 0.25], [0.0, 2.0, 0.0, 0.0]]
    """
    a, b, T = np.asarray(a, float), np.asarray(b, float), len(x)
    first, w = a[:, :1], np.zeros((len(b), T))
    for j in range(min(b.shape[1], T)):
        w[:, j:] += np.multiply.outer(b[:, j] / a[:, 0], x[: T - j])
    if a.shape[1] > 1 and w.size:
        from scipy.linalg.lapack import dtbtrs

        n = min(a.shape[1], T)
        band = np.repeat((a / first)[:, None, :n], T, axis=1)
        for j in range(1, n):  # nothing of a filter goes on in the next
            band[:, T - j :, j] = 0.0
        y, _ = dtbtrs(band.reshape(-1, n).T, w.reshape(-1, 1), uplo="L", diag="U")
        y = y.reshape(w.shape)
        w = y if np.isfinite(y).all() else np.array([linear_filter([1.0], *one) for one in zip(a / first, w)])
    return w
