"""The covariance that white noise adds to x' = A x in any number of seconds; matrices lie flat, row after row."""

import math

from .dispatch import kernel, rare
from .expm import exponential, largest_row_sum, product

SHORT = 0.5  # |A| t up to which Van Loan's matrix is well behaved


@rare
def noise(A, W, m, seconds, Q, M, F, powers):
    """Fill Q (m, m) with int_0^t exp(A r) W exp(A' r) dr: Van Loan (1978) over t / 2^i, then doubled i times.

    exp [A W; 0 -A'] t = [Phi, Q Phi'^-1; 0, Phi'^-1] is kept short, or a mode that decays would overflow in it. ``M``
    and ``F`` (2m, 2m) and ``powers`` (5, 4 m^2) are scratch.
    """
    reach, step, doublings, n, most = largest_row_sum(A, m) * seconds, seconds, 0, 2 * m, 0.0
    for i in range(m):
        most = max(most, W[i * m + i])
    unit = math.ldexp(1.0, math.frexp(most)[1])  # a power of two: variances in other units are the same numbers
    while reach > SHORT:
        reach, step = 0.5 * reach, 0.5 * step
        doublings += 1
    for i in range(n * n):
        M[i] = 0.0
    for i in range(m):
        for j in range(m):
            M[i * n + m + j] = W[i * m + j] / unit
            M[i * n + j], M[(m + j) * n + m + i] = A[i * m + j], -A[i * m + j]
    exponential(M, M[:0], n, 0, step, F, M[:0], M[:0], powers)
    Phi, right, spare = powers[0], powers[1], powers[2]
    for i in range(m):
        for j in range(m):
            Phi[i * m + j], right[i * m + j] = F[i * n + j], F[i * n + m + j]
    rest_into(right, Phi, Q, m)
    for _ in range(doublings):
        product(Phi, Q, right, m, m, m)
        rest_into(right, Phi, spare, m)
        for i in range(m * m):
            Q[i] += spare[i]
        product(Phi, Phi, right, m, m, m)
        for i in range(m * m):
            Phi[i] = right[i]
    for i in range(m * m):
        Q[i] *= unit


@kernel
def rest_into(M, Phi, Q, m):
    """Fill Q = M Phi'."""
    for i in range(m):
        for j in range(m):
            total = 0.0
            for l in range(m):
                total += M[i * m + l] * Phi[j * m + l]
            Q[i * m + j] = total
