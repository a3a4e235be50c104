"""Continuous-time regression by brute force: filters as matrix exponentials, one batch least squares.

Nothing here knows closed forms: p^(n-i)/lambda is a companion matrix, an interval with a held or a straight-line input
is one exponential of an augmented matrix. Parameters a1..an, b1..bn of each input; x is the state in observer form,
measured state first.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm


class Interval(NamedTuple):
    """z(D) = free z(0) + held w(0) + rise (w(D) - w(0)) of z' = A z + B w."""

    free: np.ndarray
    held: np.ndarray
    rise: np.ndarray


def interval(A, B, seconds):
    n, k = B.shape
    M = np.zeros((n + 2 * k, n + 2 * k))
    M[:n, :n], M[:n, n : n + k] = A, B
    M[n : n + k, n + k :] = np.eye(k)
    E = expm(M * seconds)
    held = E[:n, n : n + k]
    rise = E[:n, n + k :] / seconds if seconds > 0 else np.zeros((n, k))
    return Interval(E[:n, :n], held, rise)


def observer_matrix(lam):
    n = len(lam)
    A = np.eye(n, k=1)
    A[:, 0] -= lam
    return A


def companion(lam):
    """f' = A f + e1 w has f_i = p^(n-i) / lambda(p) w."""
    n = len(lam)
    A = np.eye(n, k=-1)
    A[0] -= lam
    return A


def regression(c, n, time, y, u):
    """Return rows H (T', N) on [x(t0); a; b], targets z (T',), own weights (T', n), indices of the measured samples."""
    lam = np.poly(np.full(n, -c))[1:]
    A, B = companion(lam), np.eye(n, 1)
    measured = np.flatnonzero(np.isfinite(y))
    first, k = measured[0], u.shape[1]
    fu, held = np.zeros((k, n)), np.zeros(k)
    inputs = {}
    for t in range(len(time)):
        if t > first:
            step = interval(A, B, time[t] - time[t - 1])
            fu = fu @ step.free.T + np.outer(held, step.held[:, 0])
        held = np.where(np.isfinite(u[t]), u[t], held)
        inputs[t] = fu.copy()
    fy, rows, targets, own = np.zeros(n), [], [], []
    for before, t in zip([first, *measured], measured):
        step = interval(A, B, time[t] - time[before])
        fy = step.free @ fy + step.held[:, 0] * y[before] + step.rise[:, 0] * (y[t] - y[before])
        x = expm(observer_matrix(lam) * (time[t] - time[first]))[0]
        rows.append(np.concatenate([x, -fy, inputs[t].ravel()]))
        targets.append(y[t] - lam @ fy)
        own.append(step.rise[:, 0])
    return np.array(rows), np.array(targets), np.array(own), measured


def posterior(H, z, s0, P0, R):
    """Return mean and covariance of ridge least squares, scaled columns and QR."""
    size = np.sqrt(np.diag(P0))
    L = np.linalg.cholesky(np.linalg.inv(P0 / np.outer(size, size))).T
    top = np.vstack([L, H * size / np.sqrt(R)])
    Q, r = np.linalg.qr(top)
    right = Q.T @ np.concatenate([L @ (s0 / size), z / np.sqrt(R)])
    inverse = np.linalg.inv(r)
    return size * (inverse @ right), np.outer(size, size) * (inverse @ inverse.T)


def own_law(c, a, b, x0, time, u, v):
    """Return y that obeys the filtered equation exactly: y_k = x_1(t_k) + v_k, x driven by straight lines through y.

    y_k closes its own straight line, so it is solved for.
    """
    n, k = len(a), len(b)
    lam = np.poly(np.full(n, -c))[1:]
    A, B = observer_matrix(lam), np.column_stack([lam - a, *b]) if k else (lam - a)[:, None]
    x, y = np.array(x0, float), np.empty(len(time))
    y[0] = x[0] + v[0]
    for t in range(1, len(time)):
        step = interval(A, B, time[t] - time[t - 1])
        w = np.concatenate([[y[t - 1]], u[t - 1]])
        x = step.free @ x + step.held @ w - step.rise[:, 0] * y[t - 1]
        y[t] = (x[0] + v[t]) / (1 - step.rise[0, 0])
        x = x + step.rise[:, 0] * y[t]
    return y


def states(c, a, b, x0, time, y, u):
    """Return x(t_k) (T, n) for given parameters and measured y."""
    n = len(a)
    lam = np.poly(np.full(n, -c))[1:]
    A, B = observer_matrix(lam), np.column_stack([lam - a, *b]) if len(b) else (lam - a)[:, None]
    x, out = np.array(x0, float), []
    for t in range(len(time)):
        if t:
            step = interval(A, B, time[t] - time[t - 1])
            w = np.concatenate([[y[t - 1]], u[t - 1]])
            x = step.free @ x + step.held @ w + step.rise[:, 0] * (y[t] - y[t - 1])
        out.append(x)
    return np.array(out)


def problem(seed, n=2, k=1, samples=60, gaps=True, late=True):
    """Irregular instants, random y and u, gaps in both, y missing at the start."""
    rng = np.random.default_rng(seed)
    time = 5.0 + np.cumsum(rng.exponential(0.3, samples))
    y, u = rng.standard_normal(samples).cumsum() / 3, rng.standard_normal((samples, k))
    if gaps:
        y[rng.random(samples) < 0.25] = np.nan
        y[20:30] = np.nan
        u[rng.random((samples, k)) < 0.1] = np.nan
    if late:
        y[:4] = np.nan
    return time, y, u
