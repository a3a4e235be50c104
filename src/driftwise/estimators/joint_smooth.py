"""The joint filter backwards: modified Bryson-Frazier (1963), which inverts neither F nor P (both are singular).

lambda(t-) = H' e/T + A' lambda(t),    Lambda(t-) = H' H/T + A' Lambda(t) A,    A = (F - kappa H) (I - P H' H / T)
s(t | T) = s + P lambda,               P(t | T) = P - P Lambda P               (s, P before sample t)
"""

import math

from ..kernel.compose import kernel, look_back, open_row, remember, retreat
from ..kernel.status import LOST
from ..kernel.ud import entry
from ..models.scale import sigma2
from .joint_row import CHI2, HAS_KAPPA, MEMO, OBSERVED, STATUS, USED_E, USED_T, USED_Y, Form, project

HEAD = 2 + MEMO  # of a note: sigma^2 after the sample, status, what the step did; then kappa and the inputs used
EPS = 2.2e-16


def note_size(form) -> int:
    """Return how many numbers a note has."""
    return HEAD + int(form.rows + form.inputs + form.coloured)


@remember.on(Form)
def _(form, scale, state, work, note):
    note[0] = sigma2(scale, state.head[OBSERVED], state.head[CHI2])
    note[1] = state.head[STATUS]
    for i in range(MEMO):
        note[2 + i] = work.memo[i]
    for i in range(work.rows):
        note[HEAD + i] = work.kappa[i] if work.memo[HAS_KAPPA] > 0.0 else 0.0
    for l in range(work.blocks):
        note[HEAD + work.rows + l] = state.held[l]


@kernel
def add_output_row(v, weight, held, direct):
    """v += H' weight."""
    v[0] += weight
    for l in range(direct):
        v[v.size - direct + l] += held[l] * weight


@kernel
def through_time(v, y, held, kappa, work):
    """v <- (F - kappa H)' v."""
    n, along = work.n, 0.0
    for i in range(work.rows):
        along += kappa[i] * v[i]
    for i in range(n):
        v[n + i] -= y * v[i]
        for l in range(work.blocks):
            v[n * (l + 2) + i] += held[l] * v[i]
    for i in range(n - 1, 0, -1):
        v[i] = v[i - 1]
    v[0] = 0.0
    add_output_row(v, -along, held, work.direct)


@kernel
def through_sample(v, b, T, held, work):
    """v <- (I - b H / T)' v, b = P H'."""
    along = 0.0
    for i in range(v.size):
        along += b[i] * v[i]
    add_output_row(v, -along / T, held, work.direct)


@kernel
def transpose(A, N):
    """A <- A'."""
    for i in range(N):
        for j in range(i):
            A[i, j], A[j, i] = A[j, i], A[i, j]


@retreat.on(Form)
def _(form, row, note, work, space):
    state, n = open_row(form, row), work.n
    U, D = state.U, state.D
    N = D.size
    lam, Lam = space[0], space[1 : N + 1]
    T, e, y = note[2 + USED_T], note[2 + USED_E], note[2 + USED_Y]
    kappa, held = note[HEAD : HEAD + work.rows], note[HEAD + work.rows :]

    through_time(lam, y, held, kappa, work)
    for _ in range(2):
        for i in range(N):
            through_time(Lam[i], y, held, kappa, work)
        transpose(Lam, N)
    if int(note[1]) & LOST:  # x was restarted here: what comes later says nothing about the x before
        for i in range(n):
            lam[i] = 0.0
            for j in range(N):
                Lam[i, j] = Lam[j, i] = 0.0
    if T > 0.0:
        project(U, N, held, work.direct, work.f)
        for i in range(N):
            work.b[i] = 0.0
            for j in range(i, N):
                work.b[i] += entry(U, i, j) * D[j] * work.f[j]
        through_sample(lam, work.b, T, held, work)
        add_output_row(lam, e / T, held, work.direct)
        for _ in range(2):
            for i in range(N):
                through_sample(Lam[i], work.b, T, held, work)
            transpose(Lam, N)
        add_output_row(Lam[0], 1.0 / T, held, work.direct)
        for l in range(work.direct):
            add_output_row(Lam[N - work.direct + l], held[l] / T, held, work.direct)


@look_back.on(Form)
def _(form, row, s2, space, out):
    state = open_row(form, row)
    s, U, D = state.s, state.U, state.D
    N = D.size
    lam, Lam, P, Z = space[0], space[1 : N + 1], space[N + 1 : 2 * N + 1], space[2 * N + 1 :]
    for i in range(N):
        for j in range(i, N):
            p = 0.0
            for k in range(j, N):
                p += entry(U, i, k) * D[k] * entry(U, j, k)
            P[i, j] = P[j, i] = p
    for i in range(N):
        out[i] = s[i]
        for j in range(N):
            out[i] += P[i, j] * lam[j]
            z = 0.0
            for k in range(N):
                z += P[i, k] * Lam[k, j]
            Z[i, j] = z
    if out.size == 2 * N:
        for i in range(N):
            p = P[i, i]
            for j in range(N):
                p -= Z[i, j] * P[j, i]
            out[N + i] = math.sqrt(s2 * max(p, N * EPS * P[i, i]))  # a difference is no better than its round-off
    elif out.size > 2 * N:
        at = N
        for j in range(N):
            for i in range(j + 1):
                p = P[i, j]
                for k in range(N):
                    p -= Z[i, k] * P[k, j]
                out[at] = s2 * p
                at += 1
