"""The covariance as P = U D U', U unit upper triangular: never asymmetric, never negative.

``U`` is packed by columns: entry (i, j), i < j, lies at ``j (j - 1) / 2 + i``. Sources: Bierman (1977),
*Factorization Methods for Discrete Sequential Estimation*, chapters V-VI; Thornton (1976); Agee and Turner (1972).
"""

from functools import lru_cache

import numpy as np

from .dispatch import kernel

EPS = np.finfo(float).eps
TINY = (64 * EPS) ** 2  # a squared length that has lost all its digits
NOTHING = 1e-300  # a pivot whose inverse would overflow


@kernel
def entry(U, i, j):
    """Return U[i, j], i <= j."""
    return 1.0 if i == j else U[j * (j - 1) // 2 + i]


@kernel
def correct(U, D, f, R, b):
    """Bierman's measurement update: U, D become those of P - b b'/T; b = P h; return T = h' P h + R.

    ``f = U'h``. With R = 0 the first informative column gets D = 0 exactly.
    """
    b[0] = D[0] * f[0]
    a = R + f[0] * b[0]
    D[0] = D[0] * (R / a) if a > 0.0 else D[0]
    at = 0
    for j in range(1, D.size):
        fj = f[j]
        vj = D[j] * fj
        before = a
        a = before + fj * vj
        b[j] = vj
        if before > 0.0:
            lam = -fj / before
            column = U[at : at + j]
            for i in range(j):
                Uij = column[i]
                column[i] = Uij + b[i] * lam
                b[i] += Uij * vj
            D[j] *= before / a
        elif a > 0.0:  # so far nothing is uncertain: b is zero and the column keeps its direction
            for i in range(j):
                b[i] = U[at + i] * vj
            D[j] = 0.0
        at += j
    return a


@kernel
def measurement_update(s, U, D, f, e, R, b):
    """Kalman's measurement update of mean s and U D U' by the innovation e of the row h, f = U'h; return T."""
    T = correct(U, D, f, R, b)
    if T > 0.0:
        for i in range(D.size):
            s[i] += b[i] * (e / T)
    return T


@kernel
def predicted_variance(f, D, R):
    """Return T = h' P h + R."""
    T = R
    for j in range(D.size):
        T += f[j] * f[j] * D[j]
    return T


@kernel
def orthogonalise(Y, d, g, rows, columns, U, D, is_exact):
    """Weighted Gram-Schmidt: U D U' = Y diag(d) Y' for the first ``rows`` indices (Thornton).

    ``Y`` (rows, columns) is destroyed, ``g`` is scratch. Where the measurements are exact (R = 0) a row whose
    remainder is pure round-off gets D = 0, so that what is known exactly stays so.
    """
    if is_exact:
        for i in range(rows):  # the squared length before projection, kept in D
            D[i] = TINY * length(Y, d, i, columns)
    for j in range(rows - 1, -1, -1):
        s = 0.0
        Yj = Y[j]
        for c in range(columns):
            g[c] = d[c] * Yj[c]
            s += g[c] * Yj[c]
        if is_exact and s <= D[j]:
            s = 0.0
        D[j] = s
        at = j * (j - 1) // 2
        for i in range(j):
            p = 0.0
            if s > 0.0:
                Yi = Y[i]
                for c in range(columns):
                    p += Yi[c] * g[c]
                p /= s
                for c in range(columns):
                    Yi[c] -= p * Yj[c]
            U[at + i] = p


@kernel
def length(Y, d, i, columns):
    """Return the weighted squared length of row i."""
    s = 0.0
    for c in range(columns):
        s += d[c] * Y[i, c] * Y[i, c]
    return s


@kernel
def widen(U, D, i, q, a):
    """Add variance q to element i; ``a`` is scratch of size N."""
    for k in range(i):
        a[k] = 0.0
    a[i] = 1.0
    widen_along(U, D, a, q, i)


@kernel
def widen_along(U, D, a, q, last):
    """P <- P + q a a' for a vector that ends at index ``last`` (Agee and Turner's rank-one update); a is destroyed."""
    for j in range(last, -1, -1):
        aj = a[j]
        before = D[j]
        after = before + q * aj * aj
        if after > 0.0 and q > 0.0:
            D[j] = after
            g = q * aj / after
            at = j * (j - 1) // 2
            for k in range(j):
                a[k] -= aj * U[at + k]
                U[at + k] += g * a[k]
            q *= before / after


@kernel
def project(U, psi, f):
    """Fill f = U' psi."""
    at = 0
    for j in range(psi.size):
        fj = psi[j]
        for i in range(j):
            fj += U[at + i] * psi[i]
        f[j] = fj
        at += j


@kernel
def covariances(U, D, f, q):
    """Fill q = P psi, where f = U' psi."""
    at = 0
    for j in range(D.size):
        q[j] = D[j] * f[j]
        for i in range(j):
            q[i] += U[at + i] * q[j]
        at += j


@kernel
def marginal(U, first, N, u):
    """Fill ``u`` with the factor of the last N unknowns alone: the trailing block of U, which ``first`` precede."""
    to = 0
    for j in range(N):
        at = (first + j) * (first + j - 1) // 2 + first
        for i in range(j):
            u[to + i] = U[at + i]
        to += j


@kernel
def variance(U, D, i):
    """Return P[i, i]."""
    p = 0.0
    for j in range(i, D.size):
        Uij = entry(U, i, j)
        p += Uij * Uij * D[j]
    return p


@kernel
def variances(U, D, p):
    """Fill ``p`` with the diagonal of P."""
    at = 0
    for j in range(D.size):
        Dj = D[j]
        p[j] = Dj
        column = U[at : at + j]
        for i in range(j):
            p[i] += column[i] * column[i] * Dj
        at += j


@kernel
def factor_within(P, U, D):
    """U D U' = P, packed (`kernel.dense`) and destroyed; a pivot that is round-off, or less, becomes zero."""
    N = D.size
    for j in range(N):
        D[j] = P[j * (j + 1) // 2 + j]
    for j in range(N - 1, -1, -1):
        at, column = j * (j - 1) // 2, P[j * (j + 1) // 2 :]
        pivot = column[j]
        is_live = pivot > max(8 * N * EPS * D[j], NOTHING)
        D[j], inverse = (pivot, 1.0 / pivot) if is_live else (0.0, 0.0)
        start = 0
        for k in range(j):
            g = column[k] * inverse
            U[at + k] = g
            for i in range(k + 1):
                P[start + i] -= g * column[i]
            start += k + 1


@kernel
def expand(U, D, P):
    """P = U D U', packed (`kernel.dense`)."""
    below, own = 0, 0
    for j in range(D.size):
        start = 0
        for k in range(j):
            g = U[below + k] * D[j]
            for i in range(k + 1):
                P[start + i] += U[below + i] * g
            start += k + 1
            P[own + k] = g
        P[own + j] = D[j]
        below += j
        own += j + 1


def unpack(U, D) -> np.ndarray:
    """Return the full covariance P = U D U' of shape (..., N, N)."""
    N = D.shape[-1]
    full, own = np.zeros((*D.shape[:-1], N, N)), np.arange(N)
    i, j = packed_indices(N)
    full[..., i, j], full[..., own, own] = U, 1.0
    return (full * D[..., None, :]) @ np.swapaxes(full, -1, -2)


@lru_cache(maxsize=64)
def packed_indices(N: int):
    """Return the row and column indices of the packed entries of U, in storage order."""
    j, i = np.tril_indices(N, -1)
    return i, j


def unpack_root(U, D) -> np.ndarray:
    """Return the root L = U D^1/2 of P = L L', (N, N)."""
    root = np.eye(len(D))
    root[packed_indices(len(D))] = U
    return root * np.sqrt(D)


def factor_root(root):
    """Return D, packed U of root root' by Gram-Schmidt; what is round-off becomes an exact zero."""
    Y, N = root.copy(), len(root)
    least = TINY * (Y * Y).sum(axis=1)
    D, U = np.zeros(N), np.zeros((N, N))
    for j in range(N - 1, -1, -1):
        s = Y[j] @ Y[j]
        if s > least[j]:
            D[j], U[:j, j] = s, Y[:j] @ Y[j] / s
            Y[:j] -= np.outer(U[:j, j], Y[j])
    return D, U[packed_indices(N)]


def factor(P):
    """Return (U (N, N), D (N,)) of a symmetric non-negative matrix; raise ValueError if it is not one.

    A pivot within round-off of zero is zero; its column must then vanish too, or eigenvalues are to tell.
    """
    given = np.array(P, float)
    P, N = given.copy(), len(given)
    U, D = np.eye(N), np.zeros(N)
    own = np.diag(P)
    if np.count_nonzero(P) == np.count_nonzero(own) and np.all((own >= 0) & (own < np.inf)):
        return U, own.copy()
    size = np.sqrt(np.diag(P).clip(0))  # Cauchy-Schwarz: |P_ij| <= size_i size_j
    slack = 8 * N * np.finfo(float).eps
    for j in range(N - 1, -1, -1):
        column, pivot = P[:j, j], P[j, j]
        if pivot <= slack * size[j] ** 2:
            if pivot < -slack * size[j] ** 2 or np.any(np.abs(column) > np.sqrt(slack) * size[:j] * size[j]):
                return _factor_singular(given, size, slack)
            continue
        D[j], U[:j, j] = pivot, column / pivot
        if column.any():  # a prior of thousands of unknowns is mostly a diagonal
            P[:j, :j] -= np.outer(U[:j, j], column)
    return U, D


def _factor_singular(P, size, slack):
    """Do so by eigenvalues of the correlations: a pivot just above round-off makes the next ones worse than that."""
    units = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(P / units[:, None] / units)
    if values[0] < -slack or np.any(P[size == 0]):
        raise ValueError("the matrix has a negative eigenvalue")
    D, packed = factor_root(units[:, None] * vectors * np.sqrt(values.clip(0)))
    U = np.eye(len(D))
    U[packed_indices(len(D))] = packed
    return U, D
