"""The compiled recursions of the fixed filters; imported when one first runs."""

from __future__ import annotations

import numpy as np
from numba import njit

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@njit(cache=True)
def spread_of(d, alpha, Q):
    """Fill Q (6,) with the upper triangle of the integral of g g' over d seconds, g the response to a unit of jerk."""
    Q[:] = 0.0
    for i in range(NODES.size):
        s, w = 0.5 * d * (1 + NODES[i]), 0.5 * d * WEIGHTS[i]
        p, v, a = 0.5 * s * s, s, 1.0
        if alpha > 0:
            lost = np.expm1(-alpha * s)
            p, v, a = (alpha * s + lost) / alpha**2, -lost / alpha, 1 + lost
        Q[0] += w * p * p
        Q[1] += w * p * v
        Q[2] += w * p * a
        Q[3] += w * v * v
        Q[4] += w * v * a
        Q[5] += w * a * a


@njit(cache=True)
def predict(x, P, d, alpha, jerk, push, Q):
    """Take position, velocity, acceleration and the upper triangle of their covariance d seconds on."""
    f, g, s = 1.0, d, 0.5 * d * d
    if alpha > 0:
        lost = np.expm1(-alpha * d)
        f, g, s = 1 + lost, -lost / alpha, (alpha * d + lost) / alpha**2
    x[0] += d * x[1] + s * x[2]
    x[1] += g * x[2]
    x[2] *= f
    a, b, c = P[0] + d * P[1] + s * P[2], P[1] + d * P[3] + s * P[4], P[2] + d * P[4] + s * P[5]
    e, h = P[3] + g * P[4], P[4] + g * P[5]
    P[0] = a + d * b + s * c + jerk * Q[0] + push * d**3 / 3
    P[1] = b + g * c + jerk * Q[1] + push * d * d / 2
    P[2] = f * c + jerk * Q[2]
    P[3] = e + g * h + jerk * Q[3] + push * d
    P[4] = f * h + jerk * Q[4]
    P[5] = f * f * P[5] + jerk * Q[5]


@njit(cache=True)
def correct(x, P, e, S):
    """Let the position be measured: innovation e of variance S."""
    a, b, c = P[0] / S, P[1] / S, P[2] / S
    x[0] += a * e
    x[1] += b * e
    x[2] += c * e
    P[5] -= c * P[2]
    P[4] -= b * P[2]
    P[3] -= b * P[1]
    P[2] -= a * P[2]
    P[1] -= a * P[1]
    P[0] -= a * P[0]


@njit(cache=True)
def mix(x, P, mu, switch, xs, Ps):
    """Let every filter begin with a mixture of all (``xs``, ``Ps``: room for what they were)."""
    M = mu.size
    arrive = np.zeros(M)
    xs[:], Ps[:] = x, P
    for m in range(M):
        for j in range(M):
            arrive[m] += mu[j] * (1 - switch if j == m else switch / (M - 1))
        x[m], P[m] = 0.0, 0.0
        for j in range(M):
            w = mu[j] * (1 - switch if j == m else switch / (M - 1)) / arrive[m]
            for i in range(3):
                x[m, i] += w * xs[j, i]
        for j in range(M):
            w = mu[j] * (1 - switch if j == m else switch / (M - 1)) / arrive[m]
            k = 0
            for i in range(3):
                for l in range(i, 3):
                    P[m, k] += w * (Ps[j, k] + (xs[j, i] - x[m, i]) * (xs[j, l] - x[m, l]))
                    k += 1
    mu[:] = arrive


@njit(cache=True)
def interacting(t, y, r, jerk, push, alpha, switch, v0, a0):
    """Return predictions and variances of interacting filters of position, velocity and acceleration.

    ``jerk`` and ``push`` (M,) are the intensities of white noise on the derivative of the acceleration (which is
    forgotten at rate alpha) and on that of the velocity. A filter without jerk has no acceleration.
    """
    T, M = len(y), len(jerk)
    x, P, mu, logs, S, Q = np.zeros((M, 3)), np.zeros((M, 6)), np.full(M, 0.1), np.zeros(M), np.zeros(M), np.zeros(6)
    xs, Ps = np.zeros((M, 3)), np.zeros((M, 6))
    mu[0] = 1.0 if M == 1 else 0.9
    for m in range(M):
        x[m, 0], P[m, 0], P[m, 3] = y[0], r, v0**2
        P[m, 5] = a0**2 if jerk[m] > 0 else 0.0
    prediction, variance = np.full(T, np.nan), np.full(T, np.nan)
    before = 0.0
    for k in range(1, T):
        d = t[k] - t[k - 1]
        if d != before and jerk.max() > 0:
            spread_of(d, alpha, Q)
        before = d
        if M > 1:
            mix(x, P, mu, switch, xs, Ps)
        mean = spread = 0.0
        for m in range(M):
            predict(x[m], P[m], d, alpha, jerk[m], push[m], Q)
            S[m] = P[m, 0] + r
            mean += mu[m] * x[m, 0]
        for m in range(M):
            spread += mu[m] * (S[m] + (x[m, 0] - mean) ** 2)
        prediction[k], variance[k] = mean, spread
        for m in range(M):
            e = y[k] - x[m, 0]
            logs[m] = np.log(mu[m]) - 0.5 * np.log(S[m]) - 0.5 * e * e / S[m]
            correct(x[m], P[m], e, S[m])
        if M > 1:
            mu[:] = np.maximum(np.exp(logs - logs.max()), 1e-6)
            mu /= mu.sum()
    return prediction, variance


@njit(cache=True)
def scaled(t, y, q, r, v0):
    """Return predictions and variances of a constant-velocity filter in units of its noise r, which is learnt."""
    T = len(y)
    p, v, a, b, c = y[0], 0.0, 1.0, 0.0, v0**2 / r  # P = [[a, b], [b, c]]
    prediction, variance = np.full(T, np.nan), np.full(T, np.nan)
    for k in range(1, T):
        d = t[k] - t[k - 1]
        p += v * d
        a += 2 * d * b + d * d * c + q * d**3 / 3
        b += d * c + q * d * d / 2
        c += q * d
        s, e = a + 1.0, y[k] - p
        prediction[k], variance[k] = p, s * r
        p, v = p + a / s * e, v + b / s * e
        c -= b * b / s
        b, a = b / s, a / s
        if k >= 4:
            r += 0.05 * (min(e * e / (s * r), 9.0) * r - r)
    return prediction, variance
