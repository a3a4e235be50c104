"""U-D factors written out for the engine: factorise, widen by a diagonal, correct with rows; and whitening."""

from __future__ import annotations

import numpy as np


def factorise(P):
    """Return U (unit upper triangular) and d with P = U diag(d) U', from the last column."""
    P = np.array(P, float)
    n = len(P)
    U, d = np.eye(n), np.zeros(n)
    for j in range(n - 1, -1, -1):
        d[j] = P[j, j]
        U[:j, j] = P[:j, j] / d[j] if d[j] else 0.0
        P[:j, :j] -= d[j] * np.outer(U[:j, j], U[:j, j])
    return U, d


def widen(U, d, q):
    """Return the factors of P + diag(q) (Thornton's weighted Gram-Schmidt)."""
    n = len(d)
    A, weights = np.hstack([U, np.eye(n)]), np.concatenate([d, np.broadcast_to(q, n)])
    U, d = np.eye(n), np.zeros(n)
    for j in range(n - 1, -1, -1):
        d[j] = A[j] ** 2 @ weights
        for i in range(j):
            U[i, j] = (A[i] * weights) @ A[j] / d[j] if d[j] else 0.0
            A[i] -= U[i, j] * A[j]
    return U, d


def correct(U, d, rows, e):
    """Return U, d and the change of the mean after rows (r, n) with unit noise and errors e (r, c) (Bierman)."""
    U, d, change = U.copy(), d.copy(), np.zeros((len(d), e.shape[1]))
    for row, error in zip(rows, e):
        f, alpha, L = U.T @ row, 1.0, np.zeros(len(d))
        v = d * f
        for j in range(len(d)):
            after = alpha + f[j] * v[j]
            d[j] *= alpha / after
            m = -f[j] / alpha
            old = U[:j, j].copy()
            U[:j, j] += m * L[:j]
            L[:j] += v[j] * old
            L[j], alpha = v[j], after
        change += np.outer(L / alpha, error - row @ change)
    return U, d, change


def whiten(Lam, rows, e):
    """Return rows and errors with the noise covariance Lam made I."""
    if Lam is None:
        return rows, e
    root = np.linalg.cholesky(Lam)
    return np.linalg.solve(root, rows), np.linalg.solve(root, e)
