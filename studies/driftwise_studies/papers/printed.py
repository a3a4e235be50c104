"""Equation (20) of the paper as a book prints it: full matrices, whatever the numbers are made of.

    T = H P H' + R,   e = y - H s,   L = F P H',   K = L / T
    s+ = F s + K e,   P+ = F P F' - K T K'            (equation error: S = Q = 0)

s = [x_1..x_n ; a_0..a_{n-1} ; b_0..b_{n-1} ; b_n] in Salut's order, F and H from y and u. It shares no code with the
engine, and works in float64, float32 and `decimal.Decimal`. Fragile on purpose: that is what the page shows.
"""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np


def transition(n, y, u, size):
    """Return F: ones on the first subdiagonal, -y on a, u on b, the parameters stay."""
    F = np.full((size, size), 0 * y)
    for i in range(1, n):
        F[i, i - 1] = F[i, i - 1] + 1
    for i in range(n, size):
        F[i, i] = F[i, i] + 1
    for i in range(n):
        F[i, n + i] = -y
        if u is not None:
            F[i, 2 * n + i] = u
    return F


# P+ in four ways that are equal on paper; in few digits each amplifies its own round-off.
BRACKETS = {
    "K T K'": lambda F, P, H, K, L, T: F @ P @ F.T - np.outer(K, K) * T,
    "K L'": lambda F, P, H, K, L, T: F @ P @ F.T - np.outer(K, L),
    "L L'/T": lambda F, P, H, K, L, T: F @ P @ F.T - np.outer(L, L) / T,
    "(F - K H) P F'": lambda F, P, H, K, L, T: (F - np.outer(K, H)) @ P @ F.T,
}


def run(n, y, R, s, P, u=None, brackets="K T K'"):
    """Return (means, covariances, T), each after one more sample; s(t+1 | t) and P(t+1 | t) for S = Q = 0.

    A direct term is there if s has one number more than 3 n.
    """
    means, covariances, variances = [], [], []
    size, zero = len(s), 0 * y[0]
    is_direct = size == 3 * n + 1
    for t in range(len(y)):
        F = transition(n, y[t], None if u is None else u[t], size)
        H = np.full(size, zero)
        H[n - 1] = H[n - 1] + 1
        if is_direct:
            H[-1] = u[t]
        T = H @ P @ H + R
        e = y[t] - H @ s
        L = F @ P @ H
        K = L / T if T != 0 else L * zero
        s = F @ s + K * e
        P = BRACKETS[brackets](F, P, H, K, L, T)
        means.append(s)
        covariances.append(P)
        variances.append(T)
    return means, covariances, variances


def run_long(n, y, R, s, P, u=None, digits=60):
    """Return the last mean, the last covariance and all T in so many decimal digits, rounded once at the end."""
    with localcontext() as context:
        context.prec = digits
        exact = np.vectorize(lambda value: Decimal(float(value)), otypes=[object])
        means, covariances, variances = run(
            n, exact(y), Decimal(float(R)), exact(s), exact(P), None if u is None else exact(u)
        )
        return means[-1].astype(float), covariances[-1].astype(float), np.array(variances, dtype=float)
