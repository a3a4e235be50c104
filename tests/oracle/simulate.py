"""Data from the canonical model, many records at once."""

import numpy as np


def canonical(a, w, w_n, b=None, u=None, direct=0.0, x0=0.0):
    """y (S, T) and x (S, T+1, n) from x+ = E x - a y + b u + w, y = x_n + direct u + w_n; one input or none.

    `w` (S, T, n), `w_n` (S, T); `a`, `b` (n,) or (S, n); `u` (S, T).
    """
    S, T, n = w.shape
    b, u = (np.zeros(n), np.zeros((S, T))) if u is None else (b, u)
    x, y = np.zeros((S, T + 1, n)), np.zeros((S, T))
    x[:, 0] = x0
    for t in range(T):
        y[:, t] = x[:, t, -1] + direct * u[:, t] + w_n[:, t]
        x[:, t + 1, 1:] = x[:, t, :-1]
        x[:, t + 1] += w[:, t] - a * y[:, t, None] + b * u[:, t, None]
    return y, x


def polynomial_noise(d, v):
    """w = d v and w_n = v."""
    return v[..., None] * np.asarray(d), v
