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
    if x.ndim == 1 and T and len(b):
        w = np.convolve(b / a[0], x)[:T, None]
    else:
        w = np.zeros(columns.shape, order="F")  # as LAPACK has it
        for j in np.flatnonzero(b[:T]):
            w[j:] += b[j] / a[0] * columns[: T - j]
    if len(a) > 1 and w.size:
        from scipy.linalg.lapack import dtbtrs

        band = np.empty((min(len(a), T), T), order="F")
        band[:] = (a[:T] / a[0])[:, None]
        w, _ = dtbtrs(band, w, uplo="L", diag="U", overwrite_b=True)
    return np.asarray(w).reshape(x.shape)
