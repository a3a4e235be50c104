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
    columns = x.reshape(T, -1)
    w = np.column_stack([np.convolve(b, column)[:T] for column in columns.T]) / a[0] if columns.size else columns
    if len(a) > 1 and columns.size:
        from scipy.linalg.lapack import dtbtrs

        band = np.repeat((a[:T] / a[0])[:, None], T, axis=1)
        w, _ = dtbtrs(band, w, uplo="L", diag="U")
    return np.asarray(w).reshape(x.shape)
