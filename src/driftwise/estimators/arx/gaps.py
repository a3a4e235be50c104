"""What a gap leaves unknown in the past outputs: the covariance S of their errors, carried and corrected.

For known parameters this is the Kalman filter of A(q) y = B(q) u + e. Where nothing is missing S is zero, and costs
nothing. A negative variance is that of a measured y that may be a glitch of the sensor, or a jump of the plant: it is
uncertain, but what comes next does not tell which, and does not correct it.

An outlier is wrong in what was measured alone, or the plant goes on from it (Fox 1972): what comes next tells which,
before anything is learnt of it. A mixture of both would be a regressor that fits neither.
"""

import math

from ...engine.dispatch import kernel, rare
from ...engine.elementary import exp
from ...engine.ud import entry, predicted_variance, project

UNLIKELY = 0.1  # probability of a kind of outlier, below which it is the other one: what lies between fits neither
WRONG, WIDER = 0.01, 400.0  # share of outliers, and times the variance of the noise: what follows one may be another


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


@kernel
def likelihood_after(value, y, theta, U, D, psi, f, R, s2):
    """Return the likelihood of y, but for a factor, if this value is the last output; psi[0] stays it."""
    e = y
    psi[0] = -value
    for i in range(psi.size):
        e -= psi[i] * theta[i]
    project(U, psi, f)
    T = predicted_variance(f, D, R)
    return exp(-0.5 * e * e / (s2 * T)) / math.sqrt(T) + WRONG / math.sqrt(T + WIDER * R)


@rare
def tell_kind_of_last(S, ys, measured, expected, y, theta, U, D, psi, f, g, R, s2):
    """Let y tell whether the last output was wrong or what the plant goes on from; say whether it was in doubt.

    It had been taken for a mixture of both, as likely as such outliers are; it and S become as sure as y makes them.
    R is the variance of a sample over s2; f, g and psi[0] are scratch.
    """
    n, off = ys.size, measured - expected
    if n == 0 or not (measured - ys[0]) * off > 0.0 or not S[0] > 0.0:
        return False
    top, wrong = S[0], min((measured - ys[0]) / off, 1.0)
    own = max(top / wrong - (1.0 - wrong) * off * off, 0.0)  # variance of what was expected
    for i in range(n):
        g[i] = S[i]
        S[i] = S[i * n] = 0.0
    if not is_clear(S, n):
        R += spread(S, theta[:n], U, D, 0, s2) / s2
    additive = wrong * likelihood_after(expected, y, theta, U, D, psi, f, R + own * theta[0] * theta[0] / s2, s2)
    wrong = additive / (additive + (1.0 - wrong) * likelihood_after(measured, y, theta, U, D, psi, f, R, s2))
    if wrong < UNLIKELY or wrong > 1.0 - UNLIKELY:
        wrong = 0.0 if wrong < UNLIKELY else 1.0
    ys[0], S[0] = measured - wrong * off, wrong * ((1.0 - wrong) * off * off + own)
    for i in range(1, n):
        S[i] = S[i * n] = g[i] * math.sqrt(S[0] / top)
    return True
