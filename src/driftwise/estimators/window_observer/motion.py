"""One step in time of a growing window: z <- Phi z + inputs, P <- Phi P Phi' + Q, over any number of seconds."""

from ...engine.dense import at
from ...engine.dispatch import kernel, rare
from ...engine.expm import exponential
from ...engine.ud import entry, factor_within
from ...engine.van_loan import noise
from .anchored import ANCHORED, refactor
from .row import along


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
        noise(form.A, form.W, m, seconds, scratch.Q, scratch.M, scratch.F, scratch.powers)
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
