"""The linear case y_n = theta_n + w_n, F = -1, G = 1: every way to follow a theta that jumps, as compiled loops.

Each loop returns the mean square of (estimate after the sample - theta) from sample 1000 on, over all series.
"""

from __future__ import annotations

import numpy as np

from .walks import compiled

EVERY, LENGTH, SKIP = 500, 50_000, 1000


def series(jump, count, seed=10):
    """Return y and theta (count, LENGTH): steps of +d or -d with probability 1/500, unit noise."""
    rng = np.random.default_rng([seed, int(10 * jump)])
    steps = jump * rng.choice([-1.0, 1.0], (count, LENGTH)) * (rng.random((count, LENGTH)) < 1 / EVERY)
    theta = np.cumsum(steps, axis=1)
    return theta + rng.standard_normal(theta.shape), theta


def walk_loop(y, theta, q, P0, skip):
    """Random walk: P <- P + q, gain P/(P + 1). P0 = 1 is a start gain of 1/2."""
    total = 0.0
    for i in range(y.shape[0]):
        x, P = 0.0, P0
        for n in range(y.shape[1]):
            P += q
            gain = P / (P + 1)
            x += gain * (y[i, n] - x)
            P = (1 - gain) * P
            if n >= skip:
                total += (x - theta[i, n]) ** 2
    return total / (y.shape[0] * (y.shape[1] - skip))


def constant_loop(y, theta, least, skip):
    """Limited gain: 1/2, 1/3, ..., least."""
    total = 0.0
    for i in range(y.shape[0]):
        x, g = 0.0, 1.0
        for n in range(y.shape[1]):
            g = max(least, g / (1 + g))
            x += g * (y[i, n] - x)
            if n >= skip:
                total += (x - theta[i, n]) ** 2
    return total / (y.shape[0] * (y.shape[1] - skip))


def fortescue_loop(y, theta, s, skip):
    """Variable forgetting: lam = max(.5, 1 - e^2/((1 + g) s)), g <- g/(lam + g)."""
    total = 0.0
    for i in range(y.shape[0]):
        x, g = 0.0, 1.0
        for n in range(y.shape[1]):
            e = y[i, n] - x
            lam = max(0.5, 1 - e * e / ((1 + g) * s))
            g = g / (lam + g)
            x += g * e
            if n >= skip:
                total += (x - theta[i, n]) ** 2
    return total / (y.shape[0] * (y.shape[1] - skip))


def hinkley_loop(y, theta, dmu, h, N0, warm, skip):
    """Gains 1/2, 1/3, ..., and 1/N0 after an alarm; ``warm`` also moves x to the mean since the change time."""
    total = 0.0
    for i in range(y.shape[0]):
        x, t, a, b = 0.0, 2.0, 0.0, 0.0
        since_a, since_b, sum_a, sum_b = 0.0, 0.0, 0.0, 0.0
        for n in range(y.shape[1]):
            Z = y[i, n] - x
            a, b = max(0.0, a + Z - dmu), max(0.0, b - Z - dmu)
            since_a, sum_a = (since_a + 1, sum_a + y[i, n]) if a > 0 else (0.0, 0.0)
            since_b, sum_b = (since_b + 1, sum_b + y[i, n]) if b > 0 else (0.0, 0.0)
            if a >= h or b >= h:
                since, mean = (since_a, sum_a / since_a) if a >= h else (since_b, sum_b / since_b)
                if warm:
                    x += since / (since + N0 - 1) * (mean - x)
                    t = since + N0
                else:
                    x += Z / t
                    t = N0
                a, b, since_a, since_b, sum_a, sum_b = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            else:
                x += Z / t
                t += 1.0
            if n >= skip:
                total += (x - theta[i, n]) ** 2
    return total / (y.shape[0] * (y.shape[1] - skip))


def mixture_loop(y, theta, jump, every, most, skip):
    """Run-length mixture of Kalman filters: one hypothesis per time of the last jump, the least likely dropped."""
    total, m, v, w, l = 0.0, np.zeros(most), np.zeros(most), np.zeros(most), np.zeros(most)
    for i in range(y.shape[0]):
        k, m[0], v[0], w[0] = 1, 0.0, 1.0, 1.0
        for n in range(y.shape[1]):
            mean, spread = 0.0, 0.0
            for j in range(k):
                mean += w[j] * m[j]
            for j in range(k):
                spread += w[j] * (v[j] + (m[j] - mean) ** 2)
            if k == most:
                least = np.argmin(w)
                k -= 1
                m[least], v[least], w[least] = m[k], v[k], w[k]
            for j in range(k):
                w[j] *= 1 - 1 / every
            m[k], v[k], w[k] = mean, spread + jump * jump, 1 / every
            k += 1
            highest = -np.inf
            for j in range(k):
                S, e = v[j] + 1, y[i, n] - m[j]
                l[j] = np.log(w[j] + 1e-300) - e * e / (2 * S) - np.log(S) / 2
                m[j] += v[j] / S * e
                v[j] *= 1 / S
                highest = max(highest, l[j])
            weights, x = 0.0, 0.0
            for j in range(k):
                w[j] = np.exp(l[j] - highest)
                weights += w[j]
            for j in range(k):
                w[j] /= weights
                x += w[j] * m[j]
            if n >= skip:
                total += (x - theta[i, n]) ** 2
    return total / (y.shape[0] * (y.shape[1] - skip))


def walk(y, theta, q, P0=1.0):
    """Return the error of a random walk with variance q."""
    return compiled(walk_loop)(y, theta, q, P0, SKIP)


def constant(y, theta, gain):
    """Return the error of a gain that never falls below ``gain``."""
    return compiled(constant_loop)(y, theta, gain, SKIP)


def fortescue(y, theta, s):
    """Return the error of variable forgetting with memory s."""
    return compiled(fortescue_loop)(y, theta, s, SKIP)


def hinkley(y, theta, jump, h, N0, warm=False):
    """Return the error of re-initialisation at 1/N0 where Hinkley's test with dmu = d/2 alarms."""
    return compiled(hinkley_loop)(y, theta, jump / 2, float(h), float(N0), warm, SKIP)


def mixture(y, theta, jump, hypotheses=60):
    """Return the error of the run-length mixture."""
    return compiled(mixture_loop)(y, theta, jump, float(EVERY), hypotheses, SKIP)
