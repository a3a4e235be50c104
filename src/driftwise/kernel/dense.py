"""Small dense and packed symmetric matrices: entry (i, j), i <= j, of a packed one lies at ``j (j + 1) / 2 + i``."""

from .compose import kernel


@kernel
def at(i, j):
    """Return where entry (i, j), i <= j, of a packed symmetric matrix lies."""
    return j * (j + 1) // 2 + i


@kernel
def multiply(M, x, v):
    """Fill v = M x for a packed symmetric M; return x' M x."""
    square, start = 0.0, 0
    for j in range(x.size):
        v[j] = 0.0
        for i in range(j):
            v[i] += M[start + i] * x[j]
            v[j] += M[start + i] * x[i]
        v[j] += M[start + j] * x[j]
        start += j + 1
    for j in range(x.size):
        square += x[j] * v[j]
    return square


@kernel
def solve(A, x):
    """Overwrite x with A^-1 x for a positive definite A (n, n), which is destroyed: Gauss needs no pivots there."""
    n = x.size
    for j in range(n):
        for i in range(j + 1, n):
            share = A[i, j] / A[j, j]
            for k in range(j + 1, n):
                A[i, k] -= share * A[j, k]
            x[i] -= share * x[j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            x[j] -= A[j, k] * x[k]
        x[j] /= A[j, j]
