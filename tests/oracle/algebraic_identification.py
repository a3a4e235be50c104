"""Parameters of y'' + a1 y' + a0 y = b0 u + q from one record: iterated integrals by quadrature, and the model's fit.

`algebraic` is the closed form: d^3/ds^3 of s (A Y - B U) over s^4, each term an iterated integral of t^p y or t^p u,
written as one convolution and summed by Gauss-Legendre. `fitted` varies (a0, a1) only; b0, q and the start are linear.
"""

from math import comb, factorial

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.optimize import least_squares


def square_wave(T, h, half_period):
    return np.where((np.arange(T) * h + 1e-9) // half_period % 2 == 0, 1.0, -1.0)


def simulated(a0, a1, b0, q, z0, u, h):
    """y at k h, k = 0..len(u)-1, u held: z1' = -a1 z1 + z2, z2' = -a0 z1 + b0 u + q."""
    M = np.zeros((4, 4))
    M[:2, :2], M[1, 2], M[1, 3] = [[-a1, 1], [-a0, 0]], b0, q
    E, z, kept = expm(M * h), np.array(z0, dtype=float), []
    for each in u:
        kept.append(z[0])
        z = E[:2, :2] @ z + E[:2, 2] * each + E[:2, 3]
    return np.array(kept)


def algebraic(y, u, h, extra=1):
    """Return a0, a1, b0 of the closed form, nu = N + extra; y by a spline, u held; rows from T/4 on."""
    N, T = 3, len(y)
    nodes, weight = np.polynomial.legendre.leggauss(5)
    tau = (np.arange(T - 1)[:, None] + (nodes + 1) / 2) * h
    weight = np.broadcast_to(weight * h / 2, tau.shape).ravel()
    held = np.broadcast_to(u[:-1, None], tau.shape).ravel()
    tau = tau.ravel()
    y = CubicSpline(np.arange(T) * h, y)(tau)
    ends = np.arange(T // 4, T) * h

    def term(signal, p):
        """s^-(N + extra) d^N/ds^N (s^p signal), at each end."""
        total = 0.0
        for i in range(p + 1):
            r = N + extra - p + i  # (N - i)-th derivative of the transform, integrated r times
            gain = comb(N, i) * factorial(p) / factorial(p - i) / factorial(r - 1)
            lag = np.maximum(ends[:, None] - tau, 0.0)
            total = total + gain * (lag ** (r - 1) * (lag > 0)) @ (weight * (-tau) ** (N - i) * signal)
        return total

    X = np.column_stack([term(y, 1), term(y, 2), -term(held, 1)]) / ends[:, None] ** (N + 1)
    return np.linalg.lstsq(X, -term(y, 3) / ends ** (N + 1))[0]


def fitted(y, u, h, start):
    """Return a0, a1, b0 of the best fit, from `start` = (a0, a1)."""

    def regression(a):
        a0, a1 = a
        units = [(1, 0, (0, 0)), (0, 1, (0, 0)), (0, 0, (1, 0)), (0, 0, (0, 1))]
        X = np.column_stack([simulated(a0, a1, b0, q, z0, u, h) for b0, q, z0 in units])
        return X, np.linalg.lstsq(X, y)[0]

    def residual(a):
        X, linear = regression(a)
        return y - X @ linear

    a = least_squares(residual, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=np.abs(start)).x
    return np.array([*a, regression(a)[1][0]])
