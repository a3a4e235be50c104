"""Small dense and packed symmetric matrices: entry (i, j), i <= j, of a packed one lies at ``j (j + 1) / 2 + i``."""

from .dispatch import kernel


@kernel
def at(i, j):
    """Return where entry (i, j), i <= j, of a packed symmetric matrix lies."""
    return j * (j + 1) // 2 + i


@kernel
def dot(a, b):
    """Return a' b."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


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
def add_square(M, w, x):
    """M += w x x' for a packed symmetric M."""
    start = 0
    for j in range(x.size):
        wx = w * x[j]
        for i in range(j + 1):
            M[start + i] += x[i] * wx
        start += j + 1


@kernel
def rescale(M, x):
    """M <- diag(x) M diag(x) for a packed symmetric M."""
    start = 0
    for j in range(x.size):
        for i in range(j + 1):
            M[start + i] *= x[i] * x[j]
        start += j + 1


@kernel
def solve(A, x):
    """Overwrite x with A^-1 x for a packed positive definite A, which is destroyed: Gauss needs no pivots there."""
    n = x.size
    for j in range(n):
        inverse = 1.0 / A[at(j, j)]
        for i in range(j + 1, n):
            share = A[at(j, i)] * inverse
            for k in range(i, n):
                A[at(i, k)] -= share * A[at(j, k)]
            x[i] -= share * x[j]
        A[at(j, j)] = inverse
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            x[j] -= A[at(j, k)] * x[k]
        x[j] *= A[at(j, j)]
