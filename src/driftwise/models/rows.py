"""Salut's equation as regression rows: y(t) is linear in [x(0) ; theta] given the data before t."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .canonical import Canonical

BLOCK = 8000  # numbers in a stretch: larger ones send LAPACK to several threads, which only wait for each other


def regression_rows(form: Canonical, y, u, d=None) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield (X (B, N), target (B,), tail (n, 2 + k)) of one stretch of the record after the other.

    With h the impulse response of 1/C, and y_f, u_f the data filtered by 1/C from rest,

        y_f(t) = sum_j h(t-j) x_j(0) - sum_k a_k y_f(t-k) + sum_k b_k u_f(t-k) + b0 u_f(t) + v(t)

    Columns are in the kernel's order: x(0), measured state first, then theta. ``d`` lists d_0 .. d_{n-1} (Salut's
    order; C = 1 if omitted). ``tail`` holds the last n values of (h, y_f, u_f), newest first. A NaN spoils the rows it
    touches: those are for the caller to leave out.
    """
    n, k, T = form.n, form.inputs, len(y)
    c = None if d is None or not np.any(d) else np.append(1.0, np.asarray(d, float)[::-1])
    memory = np.zeros((2 + k, n)) if c is not None else None
    before = np.zeros((n, 2 + k))  # values of the n samples before the stretch, oldest first
    size = max(BLOCK // (form.N + 1), 2 * form.N)
    for start in range(0, T, size):
        stop = min(start + size, T)
        stretch = np.zeros((stop - start, 2 + k))
        stretch[:, 0] = np.arange(start, stop) == 0
        stretch[:, 1], stretch[:, 2:] = y[start:stop], u[start:stop]
        if c is not None:
            from scipy.signal import lfilter

            stretch, memory = lfilter([1.0], c, stretch.T, zi=memory)
            stretch = stretch.T
        known = np.vstack([before, stretch])
        rows = len(stretch)

        def lag(column, by):
            return known[n - by : n - by + rows, column]

        X = np.empty((rows, form.N))
        for j in range(n):
            X[:, j] = lag(0, j)
            X[:, n + j] = -lag(1, j + 1)
            for i in range(k):
                X[:, n * (i + 2) + j] = lag(2 + i, j + 1)
        X[:, form.N - form.direct_terms :] = stretch[:, 2 : 2 + form.direct_terms]
        before = known[len(known) - n :]
        yield X, stretch[:, 1], before[::-1]


def triangle(R, rows) -> np.ndarray:
    """Return the triangle of [R; rows]: R'R gains rows'rows. ``R`` is None at the start."""
    stacked = rows if R is None else np.vstack([R, rows])
    return np.asarray(np.linalg.qr(stacked, mode="r"))
