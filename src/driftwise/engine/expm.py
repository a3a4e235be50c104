"""The exponential of a small matrix with what an input does meanwhile; matrices lie flat, row after row.

    F = exp(A t),   whole = int_0^t exp(A r) dr B,   slope = int_0^t exp(A (t - r)) r/t dr B

x(t) = F x(0) + whole u where u is held, F x(0) + (whole - slope) u(0) + slope u(t) where it is a straight line. Taylor
series over t / 2^i, grouped as Paterson and Stockmeyer (1973) do, and i doublings. What is carried is F - I: its
digits would be lost against those of I.
"""

from .dispatch import kernel, rare

GROUP = 4  # powers of A in one group
REACH = (0.016, 0.17, 0.55)  # |A| t up to which two, three, four groups are exact to 1e-17


@rare
def product(A, B, C, rows, inner, columns):
    """Fill C = A B."""
    for i in range(rows):
        for j in range(columns):
            total = 0.0
            for l in range(inner):
                total += A[i * inner + l] * B[l * columns + j]
            C[i * columns + j] = total


@kernel
def largest_row_sum(A, n):
    """Return the norm of A that bounds every eigenvalue: the largest sum of absolute values of a row."""
    largest = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(A[i * n + j])
        largest = max(largest, total)
    return largest


@kernel
def taylor(n, groups, F, powers, spare):
    """Fill F = exp(A) - I, given A, A^2, .. in ``powers``."""
    size, weight = n * n, 1.0  # weight of a group's first power: 1 / (its factorial)
    for l in range(2, GROUP * (groups - 1) + 1):
        weight /= l
    for i in range(size):
        F[i] = 0.0
    for group in range(groups - 1, -1, -1):
        first = group * GROUP
        if group < groups - 1:
            product(powers[GROUP - 1], F, spare, n, n, n)
            for i in range(size):
                F[i] = spare[i]
        share = weight
        for l in range(GROUP):
            if l > 0:
                share /= first + l
                for i in range(size):
                    F[i] += share * powers[l - 1, i]
            elif first > 0:
                for i in range(n):
                    F[i * n + i] += share
        for l in range(max(first - GROUP, 0) + 1, first + 1):
            weight *= l


@rare
def exponential(A, B, n, k, seconds, F, whole, slope, powers):
    """Fill F (n, n), whole and slope (n, k); ``powers`` (5, n max(n, k)) is scratch."""
    size = n * n
    reach, halvings, step = largest_row_sum(A, n) * abs(seconds), 0, seconds
    while reach > REACH[2]:
        reach, step = 0.5 * reach, 0.5 * step
        halvings += 1
    groups = 2 if reach <= REACH[0] else 3 if reach <= REACH[1] else 4
    for i in range(size):
        powers[0, i] = step * A[i]

    # the input first, by its own series: (A h)^l B h / (l + 1)!, its scratch is free then
    for i in range(n * k):
        whole[i] = powers[1, i] = step * B[i]
        slope[i] = 0.5 * whole[i]
    for l in range(1, GROUP * groups + 1):
        product(powers[0], powers[1], powers[2], n, n, k)
        for i in range(n * k):
            powers[1, i] = powers[2, i] / (l + 1)
            whole[i] += powers[1, i]
            slope[i] += powers[1, i] / (l + 2)

    for l in range(1, GROUP):
        product(powers[0], powers[l - 1], powers[l], n, n, n)
    taylor(n, groups, F, powers, powers[GROUP])
    for _ in range(halvings):
        product(F, slope, powers[0], n, n, k)
        product(F, whole, powers[1], n, n, k)
        product(F, F, powers[2], n, n, n)
        for i in range(n * k):  # a ramp of twice the length: half of it, then a constant and again half of it
            slope[i] += 0.5 * (powers[0, i] + whole[i])
            whole[i] += whole[i] + powers[1, i]
        for i in range(size):
            F[i] += F[i] + powers[2, i]
    for i in range(n):
        F[i * n + i] += 1.0
