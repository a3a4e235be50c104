"""What becomes of a bank between two samples: its modes mixed or apart, drifted, and the mixture that they are."""

import math

from ..engine.dense import add_square, at
from ..engine.dispatch import kernel, rare
from ..engine.ud import factor_within
from .gauss_markov import relax, widen_within
from .modes import CHI2, FREEDOM, OWN, WEIGHT, count_of, mode, own_sigma2
from .sensitivity import pass_time, stays
from .wind_up import hold_within


@kernel
def merge(memory, own, theta, U, D):
    """Let theta and U D U' be mean and covariance of the mixture; return its freedom and sigma^2.

    ``dense`` has the P of every mode, packed one behind the other, and receives that of the mixture behind them. Where
    they have met their caps, what parts their means leads no farther.
    """
    bank, dense, logs, P = own.bank, own.dense, own.logs, own.P
    N, size = D.size, P.size
    M = count_of(bank, N)
    for m in range(M):
        one = mode(bank, m, N).own
        logs[m], logs[M + m] = one[WEIGHT], own_sigma2(memory, one)
    freedom, _, s2 = amount(bank, logs[:M], logs[M : 2 * M], dense, theta, P)
    shrink(P, memory.cap[:N])
    for i in range(size):
        dense[M * size + i] = P[i]
    factor_within(P, U, D)
    return freedom, s2


@kernel
def amount(bank, odds, sigma2, dense, theta, P):
    """Let theta and P (packed) be mean and covariance of a mode drawn with these odds; return freedom, chi2, sigma^2.

    ``sigma2`` is that of each mode, ``dense`` has their P, which like the result is relative to sigma^2.
    """
    N, M, size, freedom, chi2, s2 = theta.size, odds.size, P.size, 0.0, 0.0, 0.0
    for i in range(N):
        theta[i] = 0.0
    for i in range(size):
        P[i] = 0.0
    for m in range(M):
        one, w = mode(bank, m, N), odds[m]
        freedom += w * one.own[FREEDOM]
        chi2 += w * one.own[CHI2]
        s2 += w * sigma2[m]
        for i in range(N):
            theta[i] += w * one.theta[i]
    inverse = 1.0 / s2
    for m in range(M):
        w = odds[m] * inverse
        add_spread(P, w * sigma2[m], dense[m * size : (m + 1) * size], w, mode(bank, m, N).theta, theta)
    return freedom, chi2, s2


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


@kernel
def drift_beside_state(memory, bank, q, view):
    """theta <- Phi theta, P <- Phi P Phi' + Q beside a state, whose own moments stay: Q is the modes' on average.

    ``q`` has N of each mode. Mixed again their theta and P would come out the same, but for caps; what they share with
    the state no mode knows, the filter does.
    """
    N, total, c = memory.cap.size, 0.0, view.c
    for i in range(N):
        c[i] = 0.0
    for m in range(count_of(bank, N)):
        one = mode(bank, m, N).own
        share = one[WEIGHT] * own_sigma2(memory, one)
        total += share
        for i in range(N):
            c[i] += share * q[m * N + i]
    relax(view.theta, view.U, view.D, memory.phi, view.b)
    for i in range(N):
        widen_within(view.U, view.D, view.first + i, c[i] / total, memory.cap[i], view.b)


@kernel
def interact(memory, own, bank, q, N):
    """Take a bank one sample on: mixed by memory.A (M, M), then drifted, each mode with its own q (N of each).

    Mode j becomes what a mode drawn with the odds w_i A_ij amounts to: its mean, and its covariance about that. No
    variance exceeds its cap (D P D keeps P a covariance); say whether one met it. ``dense`` has the P of every mode,
    packed, and is used up: second moments about the mean of all serve every mixture.
    """
    old, dense, logs, P, A = own.old, own.dense, own.logs, own.P, memory.A
    cap, phi, size = memory.cap[:N], memory.phi[:N], N * (N + 1) // 2  # a compiler may know N, but not of settings
    M, is_capped, is_still, centre = count_of(bank, N), False, stays(phi), mode(old, 0, N).D
    for i in range(N):
        centre[i] = 0.0
    for m in range(M):
        one, before = mode(bank, m, N), mode(old, m, N)
        for i in range(OWN):
            before.own[i] = one.own[i]
        for i in range(N):
            centre[i] += one.own[WEIGHT] * one.theta[i]
    for m in range(M):
        one, before = mode(bank, m, N), mode(old, m, N)
        logs[M + m] = own_sigma2(memory, one.own)
        for i in range(N):
            before.theta[i] = one.theta[i] - centre[i]
        about_centre(dense[m * size : (m + 1) * size], logs[M + m], before.theta)
    for j in range(M):
        one, weight = mode(bank, j, N), 0.0
        for i in range(M):
            logs[i] = mode(old, i, N).own[WEIGHT] * A[i * M + j]
            weight += logs[i]
        inverse, freedom, chi2, s2 = 1.0 / weight, 0.0, 0.0, 0.0
        for i in range(N):
            one.theta[i] = 0.0
        for m in range(M):
            before, w = mode(old, m, N), logs[m] * inverse
            logs[m] = w
            freedom += w * before.own[FREEDOM]
            chi2 += w * before.own[CHI2]
            s2 += w * logs[M + m]
            for i in range(N):
                one.theta[i] += w * before.theta[i]
        inverse = 1.0 / s2
        for m in range(M):
            logs[m] *= inverse
        for i in range(size):
            P[i] = logs[0] * dense[i]
            for m in range(1, M):
                P[i] += logs[m] * dense[m * size + i]
        add_square(P, -inverse, one.theta)
        for i in range(N):
            one.theta[i] += centre[i]
        one.own[WEIGHT], one.own[FREEDOM] = weight, freedom
        one.own[CHI2] = s2 * freedom if freedom >= 1.0 else chi2
        if not is_still:
            pass_time(one.theta, P, phi)
        for i in range(N):
            P[at(i, i)] += q[j * N + i]
        if shrink(P, cap):
            is_capped = True
        factor_within(P, one.U, one.D)
    return is_capped


@kernel
def about_centre(Q, s2, d):
    """Q <- s2 Q + d d', packed: the second moment about a point that the mean is d away from, Q relative to s2."""
    for i in range(Q.size):
        Q[i] *= s2
    add_square(Q, 1.0, d)


@kernel
def shrink(P, cap):
    """Let no variance exceed its cap: P <- D P D (packed) stays a covariance; say whether one met it."""
    is_capped = False
    for j in range(cap.size):
        if P[at(j, j)] > cap[j]:
            share = math.sqrt(cap[j] / P[at(j, j)])
            for i in range(cap.size):
                P[at(min(i, j), max(i, j))] *= share
            P[at(j, j)] = cap[j]
            is_capped = True
    return is_capped


@rare
def take_modes_along(memory, bank, change, view):
    """Do a change to every mode: its theta, and its P as U D U', relative to its own sigma^2."""
    N = memory.cap.size
    for m in range(count_of(bank, N)):
        one = mode(bank, m, N)
        ratio = view.s2 / own_sigma2(memory, one.own)
        for i in range(N):
            one.theta[i] += change.moved[i]
            widen_within(one.U, one.D, i, ratio * change.freed[i], memory.cap[i], view.b)
        for i in range(N):
            one.D[i] /= change.lam
        if change.lam < 1.0:
            hold_within(one.U, one.D, memory.cap, view.c, view.f, view.b)


@rare
def take_dense_along(memory, bank, dense, change, view):
    """Do it to the P of modes that wait to be mixed, packed one behind the other, and to that of the mixture behind."""
    N, half = memory.cap.size, dense.size // (count_of(bank, memory.cap.size) + 1)
    for m in range(dense.size // half):
        P, ratio = dense[m * half : (m + 1) * half], 1.0
        if m < count_of(bank, N):
            ratio = view.s2 / own_sigma2(memory, mode(bank, m, N).own)
        for i in range(N):
            P[at(i, i)] += min(ratio * change.freed[i], max(memory.cap[i] - P[at(i, i)], 0.0))
        for i in range(half):
            P[i] /= change.lam
        if change.lam < 1.0:
            shrink(P, memory.cap)
