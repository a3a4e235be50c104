"""What a gap leaves unknown in the past outputs: the covariance S of their errors, carried and corrected.

For known parameters this is the Kalman filter of A(q) y = B(q) u + e. Where nothing is missing S is zero, and costs
nothing. A negative variance is that of a measured y that may be a glitch of the sensor, or a jump of the plant: it is
uncertain, but what comes next does not tell which, and does not correct it.
"""

from ...engine.dispatch import kernel, rare
from ...engine.ud import entry


@kernel
def is_clear(S, n):
    """Say whether all of n past outputs are known; ``S`` is (n, n), row after row."""
    for i in range(n):
        if S[i * n + i] != 0.0:
            return False
    return True


@rare
def spread(S, c, U, D, first, s2):
    """Return E (c' d)^2: errors d have covariance S, coefficients c that of s2 U D U' from index ``first`` on."""
    n, total = c.size, 0.0
    for i in range(n):
        for j in range(n):
            if S[i * n + j] != 0.0:
                low, high = first + min(i, j), first + max(i, j)
                both = 0.0
                for k in range(high, D.size):
                    both += entry(U, low, k) * entry(U, high, k) * D[k]
                total += (S[i * n + j] if i != j else abs(S[i * n + i])) * (c[i] * c[j] + s2 * both)
    return total


@kernel
def shift(S, n, top, g):
    """Let a new error in first, the oldest out: its variance is ``top``, its covariance with the others ``g``."""
    for i in range(n - 1, 0, -1):
        for j in range(n - 1, 0, -1):
            S[i * n + j] = S[(i - 1) * n + j - 1]
    for i in range(1, n):
        S[i] = S[i * n] = g[i - 1]
    S[0] = top


@rare
def pass_gap(S, ys, theta, g, y, y_variance, e, T):
    """Correct past outputs by an innovation e of variance T, or let the error of a predicted y (e is NaN) join theirs.

    ``y_variance`` is that of y, ``g`` scratch. A prediction that was lost, y = 0, has nothing in common with them.
    """
    n, s = ys.size, 0.0
    for i in range(n):  # e = -a' errors + ...
        g[i] = 0.0
        if S[i * n + i] > 0.0:
            for j in range(n):
                g[i] -= S[i * n + j] * theta[j]
        s -= theta[i] * g[i]
    if e == e:
        T = max(T + y_variance, s)
        if T > 0.0:
            for i in range(n):
                ys[i] += g[i] * (e / T)
                for j in range(n):
                    S[i * n + j] -= g[i] * g[j] / T
    if e == e or y == 0.0:
        for i in range(n):
            g[i] = 0.0
    shift(S, n, -y_variance if e == e else y_variance, g)
