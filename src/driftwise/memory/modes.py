"""A bank of Kalman filters, one for each speed of drift, weighted by how well they predict.

Each mode has its own weight, theta, P = U D U' in units of its own sigma^2, and that sigma^2 as chi2/freedom. What the
estimator shows as theta and P is the mean and covariance of the mixture, what it shows as sigma^2 their mean.
"""

import math
from typing import NamedTuple

import numpy as np

from ..kernel.compose import kernel, rare
from ..kernel.dense import at
from ..kernel.ud import correct, covariances, factor_within, predicted_variance, project, widen_along
from .drift import widen_within
from .transition import relax

WEIGHT, FREEDOM, CHI2, OWN = range(4)  # the numbers of a mode; then theta, D, U
FADE = 0.995  # per sample, of what each sigma^2 rests on
FAINTEST = 1e-6  # least weight of a mode
OUTLIERS, WIDER = 0.01, 400.0  # share of outliers, and how many times the noise variance theirs is


class Mode(NamedTuple):
    """Views of one mode."""

    own: np.ndarray
    theta: np.ndarray
    D: np.ndarray
    U: np.ndarray


@kernel
def size_of(N):
    """Return how many numbers a mode has."""
    return OWN + 2 * N + N * (N - 1) // 2


@kernel
def mode(bank, m, N):
    """Return the views of mode m."""
    size = size_of(N)
    a = m * size
    b = a + OWN
    c = b + N
    d = c + N
    return Mode(bank[a:b], bank[b:c], bank[c:d], bank[d : a + size])


@kernel
def count_of(bank, N):
    """Return how many modes there are."""
    return bank.size // size_of(N)


@kernel
def own_sigma2(memory, own):
    """Return the sigma^2 of a mode: 1 where it is known, and until it has a degree of freedom."""
    return own[CHI2] / own[FREEDOM] if memory.learns > 0.0 and own[FREEDOM] >= 1.0 else 1.0


@kernel
def open_bank(memory, bank, theta, U, D):
    """Let every mode begin as the estimator does; the weights are equal."""
    M = count_of(bank, D.size)
    for m in range(M):
        one = mode(bank, m, D.size)
        one.own[WEIGHT], one.own[FREEDOM], one.own[CHI2] = 1.0 / M, memory.freedom, memory.chi2
        for i in range(D.size):
            one.theta[i], one.D[i] = theta[i], D[i]
        for i in range(U.size):
            one.U[i] = U[i]


@kernel
def log_density(nu, z, V):
    """Return the log of Student's t with nu degrees of freedom and squared scale V at z = e^2/V (normal: inf).

    The unit of V is free: it shifts all logs alike.
    """
    if nu == math.inf:
        return -0.5 * (z + math.log(2.0 * math.pi * V))
    if nu < 50.0:
        constant = math.lgamma(0.5 * (nu + 1.0)) - math.lgamma(0.5 * nu) - 0.5 * math.log(0.5 * nu)
    else:  # the same to 1e-13 (Stirling)
        constant = (-0.25 + (1.0 / 24.0 - 0.05 / (nu * nu)) / (nu * nu)) / nu
    return constant - 0.5 * (math.log(2.0 * math.pi * V) + (nu + 1.0) * math.log1p(z / nu))


@kernel
def outlier(nu, z, V, St, St2):
    """Return log p of an error that is an outlier OUTLIERS of the time, and the probability that this one is."""
    wider = St2 / St
    if nu == math.inf:
        ratio = 0.5 * z * (1.0 - 1.0 / wider)
    else:
        ratio = 0.5 * (nu + 1.0) * math.log((nu + z) / (nu + z / wider))
    odds = ratio - 0.5 * math.log(wider) + math.log(OUTLIERS / (1.0 - OUTLIERS))  # their logarithm
    less = math.exp(-abs(odds))
    rho = 1.0 / (1.0 + less) if odds > 0.0 else less / (1.0 + less)
    return log_density(nu, z, V) + math.log1p(-OUTLIERS) + max(odds, 0.0) + math.log1p(less), rho


@kernel
def take(memory, one, error, R, work, is_robust, rests):
    """Let one mode learn from its error; return log p of the error, the probability of an outlier, T, sigma^2.

    An error that is an outlier with probability rho is taken in with the gain (1 - rho) K + rho K2, K2 that of a noise
    WIDER times as large, and P is that of the two outcomes together (moment matching): a rank-one change along P psi.
    """
    D, U, own, f, b = one.D, one.U, one.own, work.f, work.b
    s2, nu = own_sigma2(memory, own), math.inf
    is_ready = memory.learns == 0.0 or own[FREEDOM] >= 1.0
    if memory.learns > 0.0:
        nu = max(own[FREEDOM], 1.0)
    project(U, work.psi, f)
    p = predicted_variance(f, D, 0.0)
    St = p + R
    z, log_p, rho = error * error / (s2 * St), 0.0, 0.0
    if is_ready and is_robust:
        log_p, rho = outlier(nu, z, s2 * (St / memory.R), St, St + (WIDER - 1.0) * R)
    elif is_ready:
        log_p = log_density(nu, z, s2 * (St / memory.R))
    k, k2 = 1.0 / St, 1.0 / (St + (WIDER - 1.0) * R)
    gain = (1.0 - rho) * k + rho * k2
    less = gain - rho * (1.0 - rho) * z * St * (k - k2) * (k - k2)
    if less * St > 1e-12:
        correct(U, D, f, 1.0 / less - p, b)
    else:
        covariances(U, D, f, b)
    for i in range(D.size):
        one.theta[i] += b[i] * gain * error
    if less < 0.0:
        for i in range(D.size):
            work.c[i] = b[i]
        widen_along(U, D, work.c, -less, D.size - 1)
    if memory.learns > 0.0 and not rests:
        own[FREEDOM] = FADE * own[FREEDOM] + 1.0 - rho
        own[CHI2] = FADE * own[CHI2] + (1.0 - rho) * error * error / St
    return log_p, rho, St, s2


@rare
def update(memory, bank, e, R, theta, work, logs, is_robust, rests):
    """Let every mode learn, and the weights; return the log evidence and the probability of an outlier.

    e is the innovation of ``theta``, R the variance of the noise. ``logs`` is scratch of two numbers a mode; between
    them stays, of the last mode, what `likelihood.follow` wants: innovation, T, sigma^2, share that is no outlier.
    """
    N, M, top = theta.size, count_of(bank, theta.size), -math.inf
    for m in range(M):
        one = mode(bank, m, N)
        error = e
        for i in range(N):
            error += work.psi[i] * (theta[i] - one.theta[i])
        logs[m], share, T, s2 = take(memory, one, error, R, work, is_robust, rests)
        logs[m] += math.log(one.own[WEIGHT])
        logs[M + 4 + m] = share
        top = max(top, logs[m])
        if m == M - 1:
            logs[M], logs[M + 1], logs[M + 2], logs[M + 3] = error, T, s2, 1.0 - share
    total = rho = 0.0
    for m in range(M):
        logs[m] = math.exp(logs[m] - top)
        total += logs[m]
        rho += logs[m] * logs[M + 4 + m]
    normalise(bank, logs, total, N)
    return top + math.log(total), rho / total


@kernel
def normalise(bank, weights, total, N):
    """Let the weights of the modes be these, whose sum is ``total``, over their sum, none of them below FAINTEST."""
    M, again = count_of(bank, N), 0.0
    for m in range(M):
        weights[m] = max(weights[m] / total, FAINTEST)
        again += weights[m]
    for m in range(M):
        mode(bank, m, N).own[WEIGHT] = weights[m] / again


@kernel
def expand(U, D, P):
    """P = U D U', packed."""
    start = 0
    for j in range(D.size):
        for i in range(j + 1):
            P[start + i] = 0.0
        start += j + 1
    below = 0
    for j in range(D.size):
        start = 0
        for k in range(j):
            g = U[below + k] * D[j]
            for i in range(k + 1):
                P[start + i] += U[below + i] * g
            start += k + 1
            P[at(k, j)] = g
        P[at(j, j)] = D[j]
        below += j


@rare
def merge(memory, bank, dense, theta, U, D, P):
    """Let theta and U D U' be mean and covariance of the mixture; return its freedom and sigma^2.

    ``dense`` is left with the P of every mode, packed one behind the other; P (packed) is scratch.
    """
    N, s2, freedom, size = D.size, 0.0, 0.0, P.size
    M = count_of(bank, N)
    for i in range(N):
        theta[i] = 0.0
    for i in range(size):
        P[i] = 0.0
    for m in range(M):
        one = mode(bank, m, N)
        w = one.own[WEIGHT]
        s2 += w * own_sigma2(memory, one.own)
        freedom += w * one.own[FREEDOM]
        for i in range(N):
            theta[i] += w * one.theta[i]
        expand(one.U, one.D, dense[m * size : (m + 1) * size])
    for m in range(M):
        one = mode(bank, m, N)
        w = one.own[WEIGHT] / s2
        add_spread(P, w * own_sigma2(memory, one.own), dense[m * size : (m + 1) * size], w, one.theta, theta)
    factor_within(P, U, D)
    return freedom, s2


@kernel
def add_spread(P, v, Q, w, a, b):
    """P += v Q + w (a - b)(a - b)', packed."""
    start = 0
    for j in range(b.size):
        d = w * (a[j] - b[j])
        for i in range(j + 1):
            P[start + i] += v * Q[start + i] + d * (a[i] - b[i])
        start += j + 1


@rare
def drift_apart(memory, bank, q, b):
    """theta <- Phi theta, P <- Phi P Phi' + diag(q) of every mode, each with its own q (N of each).

    Say whether a variance met its cap.
    """
    N, is_capped = memory.cap.size, False
    for m in range(count_of(bank, N)):
        one = mode(bank, m, N)
        relax(one.theta, one.U, one.D, memory.phi, b)
        for i in range(N):
            if not widen_within(one.U, one.D, i, q[m * N + i], memory.cap[i], b):
                is_capped = True
    return is_capped


@rare
def interact(memory, bank, dense, A, q, old, P):
    """Take an interacting bank one sample on: mixed by A (M, M), then drifted, each mode with its own q (N of each).

    Mode j becomes what a mode drawn with the odds w_i A_ij amounts to: its mean, and its covariance about that. No
    variance exceeds its cap (D P D keeps P a covariance); say whether one met it. ``dense`` has the P of every mode,
    packed; ``old`` (a copy of the bank) and P (packed) are scratch.
    """
    N, size, is_capped = memory.cap.size, P.size, False
    M = count_of(bank, N)
    for i in range(bank.size):
        old[i] = bank[i]
    for j in range(M):
        one = mode(bank, j, N)
        own, theta, weight, s2 = one.own, one.theta, 0.0, 0.0
        for i in range(M):
            weight += mode(old, i, N).own[WEIGHT] * A[i * M + j]
        own[WEIGHT], own[FREEDOM], own[CHI2] = weight, 0.0, 0.0
        for k in range(N):
            theta[k] = 0.0
        for k in range(size):
            P[k] = 0.0
        for i in range(M):
            other = mode(old, i, N)
            mu = other.own[WEIGHT] * A[i * M + j] / weight
            own[FREEDOM] += mu * other.own[FREEDOM]
            own[CHI2] += mu * other.own[CHI2]
            s2 += mu * own_sigma2(memory, other.own)
            for k in range(N):
                theta[k] += mu * other.theta[k]
        for i in range(M):
            other = mode(old, i, N)
            w = other.own[WEIGHT] * A[i * M + j] / (weight * s2)
            add_spread(P, w * own_sigma2(memory, other.own), dense[i * size : (i + 1) * size], w, other.theta, theta)
        if own[FREEDOM] >= 1.0:
            own[CHI2] = s2 * own[FREEDOM]
        if move(memory, theta, P, q[j * N : (j + 1) * N]):
            is_capped = True
        factor_within(P, one.U, one.D)
    return is_capped


@kernel
def move(memory, theta, P, q):
    """theta <- Phi theta, P <- Phi P Phi' + diag(q), packed, no variance beyond its cap; say whether one met it."""
    phi, cap, start, is_capped = memory.phi, memory.cap, 0, False
    for j in range(theta.size):
        theta[j] *= phi[j]
        for i in range(j + 1):
            P[start + i] *= phi[i] * phi[j]
        P[start + j] += q[j]
        start += j + 1
    for j in range(theta.size):
        if P[at(j, j)] > cap[j]:
            share = math.sqrt(cap[j] / P[at(j, j)])
            for i in range(theta.size):
                P[at(min(i, j), max(i, j))] *= share
            P[at(j, j)] = cap[j]
            is_capped = True
    return is_capped
