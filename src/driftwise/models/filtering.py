"""A rational filter over a whole record, from rest."""

from __future__ import annotations

import numpy as np


def linear_filter(b, a, x) -> np.ndarray:
    """Return y of a(q) y = b(q) x, (T,) or (T, k), polynomials in powers of q^-1; before the record all is zero.

    One triangular system with a band, solved by LAPACK: what `scipy.signal.lfilter` returns to round-off, without the
    second that `scipy.signal` takes to load. Bad at: gaps, which it does not know.

    Examples
    --------
    >>> linear_filter([0.0, 1.0], [1.0, -0.5], [1.0, 0.0, 0.0, 0.0]).tolist()
    [0.0, 1.0, 0.5, 0.25]
    """
    b, a, x = (np.asarray(values, float) for values in (b, a, x))
    T = len(x)
    columns, b = x.reshape(T, -1), b / a[0]
    if x.ndim == 1 and T and len(b) > 1:
        w = np.convolve(b, x)[:T, None]
    elif T and len(b) > 1:
        w = _shifted_sums(b[:T], columns)
    else:
        w = np.multiply(b[0] if len(b) else 0.0, columns, order="F")  # as LAPACK has it
    if len(a) > 1 and w.size:
        from scipy.linalg.lapack import dtbtrs

        band = np.empty((min(len(a), T), T), order="F")
        for j in range(len(band)):  # one broadcast over all makes what follows four times slower
            band[j] = a[j] / a[0]
        w, _ = dtbtrs(band, w, uplo="L", diag="U", overwrite_b=True)
    return np.asarray(w).reshape(x.shape)


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


def _shifted_sums(b, columns) -> np.ndarray:
    """Return sum b[j] x(t - j) of columns (T, k), which lie one after the other, with room for the longest shift.

    So every shift is one pass over numbers in a row.
    """
    T, k = columns.shape
    room = len(b) - 1
    x = np.zeros((k, room + T))
    x[:, room:] = columns.T
    x = x.reshape(-1)
    w = b[0] * x
    for j in np.flatnonzero(b[1:]) + 1:
        w[j:] += b[j] * x[: len(x) - j]
    return w.reshape(k, room + T)[:, room:].T
