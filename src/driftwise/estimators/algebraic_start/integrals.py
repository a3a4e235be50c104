"""Iterated integrals of t^i y, and the regression that is linear in the parameters because of them."""

from __future__ import annotations

from math import comb, factorial, perm

import numpy as np
from numpy.polynomial.legendre import leggauss

from ..algebraic_observer.theorem import disturbance_polynomial


def iterated(t, left, right, N: int) -> np.ndarray:
    """Return J (N + 1, N + 2, T): J[i, r] is the r-fold integral from t[0] = 0 to t of tau^i y(tau).

    y runs straight from ``left[k]`` to ``right[k]`` between t[k] and t[k + 1]; the products are integrated exactly, by
    Gauss quadrature of their degree. J[:, 0] is not used.
    """
    h, (x, w) = np.diff(t)[:, None], leggauss(N + 1)
    x, w = (x + 1) / 2, w / 2
    tau, y = t[:-1, None] + h * x, left[:, None] + (right - left)[:, None] * x
    powers = tau ** np.arange(N + 1)[:, None, None] * y * (h * w)
    rest = np.stack([(h * (1 - x)) ** (r - 1) / factorial(r - 1) for r in range(1, N + 2)])
    own = np.einsum("ikg,rkg->irk", powers, rest)  # what the step itself adds to each
    J = np.zeros((N + 1, N + 2, len(t)))
    for r in range(1, N + 2):
        step = own[:, r - 1].copy()
        for q in range(1, r):
            step += h[:, 0] ** q / factorial(q) * J[:, r - q, :-1]
        J[:, r, 1:] = np.cumsum(step, axis=1)
    return J


def annihilated(J, N: int) -> np.ndarray:
    """Return V (N + 1, T): V[k] is s^-(N+1) d^N/ds^N (s^k Y) as a function of time.

    s^(k-j-N-1) Y^(N-j) is an integral of order N + 1 - k + j of (-t)^(N-j) y; Leibniz does the rest.
    """
    V = np.zeros((N + 1, J.shape[-1]))
    for k in range(N + 1):
        for j in range(k + 1):
            V[k] += comb(N, j) * perm(k, j) * (-1) ** (N - j) * J[N - j, N + 1 - k + j]
    return V


def closed_form(t, y, u, n: int, m: int, hold: str, degree: int, frequencies):
    """Return a (n,), b (k, n) and the condition of their regression; t runs from 0 to 1, y is complete.

    d^N/ds^N of P (A Y - B U), N = n + deg P, holds neither the initial state nor the disturbance.
    """
    P = np.array(disturbance_polynomial(degree, frequencies), float)
    N = n + len(P) - 1
    rows = t >= 0.25
    weight = t[rows] ** -(N + 1.0)

    def terms(left, right, highest):
        """Return the columns of s^highest .. s^0 times P."""
        V = annihilated(iterated(t, left, right, N), N)[:, rows] * weight
        return np.stack([P @ V[e : e + len(P)] for e in range(highest, -1, -1)], axis=1)

    Y = terms(y[:-1], y[1:], n)
    U = [-terms(c[:-1], c[1:] if hold == "foh" else c[:-1], m) for c in u.T]
    X = np.concatenate([Y[:, 1:], *U], axis=1)
    size = np.linalg.norm(X, axis=0)
    size[size == 0] = 1.0
    found, _, _, s = np.linalg.lstsq(X / size, -Y[:, 0], rcond=None)
    found = found / size
    b = np.zeros((u.shape[1], n))
    b[:, n - m - 1 :] = found[n:].reshape(-1, m + 1)
    return found[:n], b, float(s[0] / s[-1]) if s[-1] > 0 else np.inf
