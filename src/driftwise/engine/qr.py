"""Least squares of a few unknowns by orthogonal transformations: rows are stacked, never squared, never subtracted.

A stack lies transposed: ``M[j, i]`` is entry j of row i, so that columns are contiguous; the right-hand side is
column n.
"""

import math

from .dispatch import kernel, rare


@rare
def triangularise(M, rows, n):
    """Make the first ``rows`` rows of [X | y] upper triangular (Householder); return the squares left over.

    Then R = the first min(rows, n) rows: |X w - y|^2 = |R w - z|^2 + what is returned, for every w.
    """
    for j in range(min(n, rows)):
        tail = 0.0
        for i in range(j + 1, rows):
            tail += M[j, i] * M[j, i]
        if tail == 0.0:
            continue
        head = M[j, j]
        diagonal = -math.copysign(math.sqrt(head * head + tail), head)
        own = head - diagonal
        scale = -1.0 / (own * diagonal)
        for l in range(j + 1, n + 1):
            share = own * M[l, j]
            for i in range(j + 1, rows):
                share += M[j, i] * M[l, i]
            share *= scale
            M[l, j] -= share * own
            for i in range(j + 1, rows):
                M[l, i] -= share * M[j, i]
        M[j, j] = diagonal
        for i in range(j + 1, rows):
            M[j, i] = 0.0
    left = 0.0
    for i in range(n, rows):
        left += M[n, i] * M[n, i]
        M[n, i] = 0.0
    return left


@kernel
def invert(M, n, X):
    """Fill X (n, n) = R^-1; return the condition of R with columns of length one (Frobenius), infinite if singular."""
    condition = 0.0
    for j in range(n):
        if M[j, j] == 0.0:
            return math.inf
    for j in range(n - 1, -1, -1):
        for i in range(n):
            X[i, j] = 0.0
        X[j, j] = 1.0 / M[j, j]
        for i in range(j - 1, -1, -1):
            total = 0.0
            for l in range(i + 1, j + 1):
                total -= M[l, i] * X[l, j]
            X[i, j] = total / M[i, i]
    for i in range(n):
        column, spread = 0.0, 0.0
        for l in range(i + 1):
            column += M[i, l] * M[i, l]
        for l in range(i, n):
            spread += X[i, l] * X[i, l]
        condition += column * spread
    return math.sqrt(n * condition)


@kernel
def solve_triangular(M, n, x):
    """Fill x = R^-1 z."""
    for i in range(n - 1, -1, -1):
        total = M[n, i]
        for l in range(i + 1, n):
            total -= M[l, i] * x[l]
        x[i] = total / M[i, i]
