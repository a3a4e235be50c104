"""How long since the last jump? One Kalman filter for every answer, mixed by how well each predicts."""

import math
from typing import Any, NamedTuple

from ..kernel.compose import Vector, kernel, rare
from ..kernel.status import CAPPED
from ..kernel.ud import correct, predicted_variance, project, widen_along
from .adapt import age, learn, plain
from .drift import widen_within
from .hold import hold_within

COUNT, NEWEST, FIRST = range(3)  # cells: how many hypotheses, which one is the newest; then log w, theta, D, U of each


class RunLengths(NamedTuple):
    """Jumps of size ``jump``, one every so many samples on average: all instants are considered, the likely ones kept.

    The ``hypotheses`` most likely answers to "when was the last jump?" each have their own Kalman filter; theta and P
    are mean and covariance of the mixture. No threshold, no alarm: it re-learns as far as the data ask for it. A sample
    costs more than ``hypotheses`` updates. ``jump`` is one number or one per parameter, in the units of `y_scale` and
    `u_scale`. Source: Adams and MacKay (2007); here the least likely run is dropped. Bad at: jumps below half the noise
    (dropping hurts there: use `Walk`), drift, noise that grows, speed.
    """

    jump: Any
    every: float
    hypotheses: int = 20


class Mixture(NamedTuple):
    """What the kernel sees of `RunLengths`: a jump has probability ``rate`` and variances q (absolute)."""

    rate: float
    hypotheses: float
    settle: float
    q: Vector
    cap: Vector


def cells_of(hypotheses: int, N: int) -> int:
    """Return how many numbers the mixture keeps."""
    return FIRST + hypotheses * (1 + 2 * N + N * (N - 1) // 2)


plain(Mixture)


@kernel
def hypothesis(cells, i, N):
    """Return log weight (a view of one), theta, D, U of hypothesis i."""
    at = FIRST + i * (1 + 2 * N + N * (N - 1) // 2)
    m, d, u = at + 1, at + 1 + N, at + 1 + 2 * N
    return cells[at : at + 1], cells[m:d], cells[d:u], cells[u : u + N * (N - 1) // 2]


@kernel
def settle_in(cells, i, log_weight, theta, U, D):
    """Write hypothesis i and make it the newest."""
    lw, m, d, u = hypothesis(cells, i, D.size)
    lw[0] = log_weight
    for j in range(D.size):
        m[j], d[j] = theta[j], D[j]
    for j in range(U.size):
        u[j] = U[j]
    cells[NEWEST] = i


@learn.on(Mixture)
def _(memory, cells, e, R, s2, theta, U, D, work):
    N, T, top = D.size, predicted_variance(work.f, D, R), -math.inf
    if cells[COUNT] == 0.0:
        settle_in(cells, 0, 0.0, theta, U, D)
        cells[COUNT] = 1.0
    for i in range(int(cells[COUNT])):
        lw, m, d, u = hypothesis(cells, i, N)
        own = e
        for j in range(N):
            own += work.psi[j] * (theta[j] - m[j])
        project(u, work.psi, work.f)
        S = correct(u, d, work.f, R, work.b)
        for j in range(N):
            m[j] += work.b[j] * (own / S)
        lw[0] -= 0.5 * (own * own / (s2 * S) + math.log(S / T))
        top = max(top, lw[0])
    total = 0.0
    for i in range(int(cells[COUNT])):
        lw, m, d, u = hypothesis(cells, i, N)
        total += math.exp(lw[0] - top)
    mix(cells, top + math.log(total), s2, theta, U, D, work.c)
    return T


@rare
def mix(cells, evidence, s2, theta, U, D, a):
    """Normalise the weights; let theta and U, D be mean and covariance of the mixture, by rank-one additions."""
    N = D.size
    for j in range(N):
        theta[j] = D[j] = 0.0
    for j in range(U.size):
        U[j] = 0.0
    for i in range(int(cells[COUNT])):
        lw, m, d, u = hypothesis(cells, i, N)
        lw[0] -= evidence
        w = math.exp(lw[0])
        for j in range(N):
            theta[j] += w * m[j]
    for i in range(int(cells[COUNT])):
        lw, m, d, u = hypothesis(cells, i, N)
        w = math.exp(lw[0])
        for j in range(N):
            for k in range(j):
                a[k] = u[j * (j - 1) // 2 + k]
            a[j] = 1.0
            widen_along(U, D, a, w * d[j], j)
        for j in range(N):
            a[j] = m[j] - theta[j]
        widen_along(U, D, a, w / s2, N - 1)


@age.on(Mixture)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    N, count = D.size, int(cells[COUNT])
    is_learnt = surprise >= 0.0
    if weight <= memory.settle or (count < 2 and not is_learnt):
        return 1.0, 0
    is_held = hold_within(U, D, memory.cap, work.c, work.f, work.b)
    moved = memory.rate
    if is_learnt:
        branch(memory, cells, count, theta, U, D, s2, work)
    else:  # the newest hypothesis has seen nothing yet: in a gap it takes later jumps in as well
        moved *= 1.0 - math.exp(hypothesis(cells, int(cells[NEWEST]), N)[0][0])
        for i in range(count):
            lw = hypothesis(cells, i, N)[0]
            lw[0] += math.log1p(-memory.rate)
            if i == int(cells[NEWEST]):
                lw[0] = math.log(math.exp(lw[0]) + memory.rate)
    for i in range(N):  # the covariance of the mixture with a new member of the same mean
        is_held |= not widen_within(U, D, i, moved * memory.q[i] / s2, memory.cap[i], work.b)
    return 1.0, CAPPED if is_held else 0


@rare
def branch(memory, cells, count, theta, U, D, s2, work):
    """Add the hypothesis that the parameters jump now; the least likely one goes where there is no room."""
    slot, least = count, math.inf
    for i in range(count):
        lw = hypothesis(cells, i, D.size)[0]
        if count == int(memory.hypotheses) and lw[0] < least:
            slot, least = i, lw[0]
        lw[0] += math.log1p(-memory.rate)
    settle_in(cells, slot, math.log(memory.rate), theta, U, D)
    cells[COUNT] = max(cells[COUNT], slot + 1.0)
    _, _, d, u = hypothesis(cells, slot, D.size)
    for i in range(D.size):
        widen_within(u, d, i, memory.q[i] / s2, memory.cap[i], work.b)
