"""One step in time of a growing window: z <- Phi z + inputs, P <- Phi P Phi' + Q, over any number of seconds."""

import math

from ...engine.dense import at
from ...engine.dispatch import kernel, rare
from ...engine.expm import exponential, largest_row_sum, product
from ...engine.ud import entry, factor_within
from .anchored import ANCHORED, refactor
from .row import along

SHORT = 0.5  # |A| t up to which Van Loan's matrix is well behaved


@rare
def noise(A, walk, m, seconds, Q, M, F, powers):
    """Fill Q (m, m) with int_0^t exp(A r) W exp(A' r) dr: Van Loan (1978) over t / 2^i, then doubled i times.

    exp [A W; 0 -A'] t = [Phi, Q Phi'^-1; 0, Phi'^-1] is kept short, or a mode that decays would overflow in it.
    """
    reach, step, doublings, n, most = largest_row_sum(A, m) * seconds, seconds, 0, 2 * m, 0.0
    for i in range(m):
        most = max(most, walk[i] * walk[i])
    unit = math.ldexp(1.0, math.frexp(most)[1])  # a power of two: variances in other units are the same numbers
    while reach > SHORT:
        reach, step = 0.5 * reach, 0.5 * step
        doublings += 1
    for i in range(n * n):
        M[i] = 0.0
    for i in range(m):
        M[i * n + m + i] = walk[i] * walk[i] / unit
        for j in range(m):
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


@rare
def discretise(form, scratch, seconds):
    """Fill the step of so many seconds into work.Phi, G0, G1 and, of the walks, Uq and Dq."""
    m, k = int(form.m), int(form.inputs)
    exponential(form.A, form.B, m, k, seconds, scratch.Phi, scratch.G0, scratch.G1, scratch.powers)
    for i in range(m * k):
        if form.line > 0.0:
            scratch.G0[i] -= scratch.G1[i]
        else:
            scratch.G1[i] = 0.0
    if form.Dq.size > 0:
        noise(form.A, form.walk, m, seconds, scratch.Q, scratch.M, scratch.F, scratch.powers)
        for j in range(m):
            for i in range(j + 1):
                scratch.F[at(i, j)] = scratch.Q[i * m + j]
        factor_within(scratch.F, scratch.Uq, scratch.Dq)


@kernel
def move(Phi, G0, G1, Uq, Dq, state, scratch):
    """zhat <- Phi zhat + G0 u(t-1) + G1 u(t), X <- Phi X, U D U' <- Phi U D U' Phi' + Q; work.u has u(t-1)."""
    m, k, zhat, U, Y = state.zhat.size, scratch.u.size, state.zhat, state.U, scratch.Y
    for i in range(m):
        scratch.a[i] = along(Phi, i * m, zhat) + along(G0, i * k, scratch.u) + along(G1, i * k, state.held)
    for i in range(m):
        zhat[i] = scratch.a[i]
    if state.start[ANCHORED] > 0.0:
        for j in range(state.X.shape[1]):
            for i in range(m):
                scratch.a[i] = 0.0
                for l in range(m):
                    scratch.a[i] += Phi[i * m + l] * state.X[l, j]
            for i in range(m):
                state.X[i, j] = scratch.a[i]
    for i in range(m):
        scratch.weight[i] = state.D[i]
        start = 0
        for j in range(m):
            Y[i, j] = Phi[i * m + j]
            for l in range(j):
                Y[i, j] += Phi[i * m + l] * U[start + l]
            start += j
    columns = m
    if Dq.size > 0:
        columns = 2 * m
        for j in range(m):
            scratch.weight[m + j] = Dq[j]
            for i in range(m):
                Y[i, m + j] = entry(Uq, i, j) if i <= j else 0.0
    refactor(state, scratch, columns)
