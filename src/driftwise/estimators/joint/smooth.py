"""The joint filter backwards, in the coordinates of its own factors.

Write s = s^ + S z with P = S S', S = U sqrt(D): before a sample, after its correction, and after its prediction. In
these coordinates the filter says z ~ N(0, I) everywhere, and later samples make it z ~ N(mu, C):

    prediction   z+ = X z + noise,       X = S+^-1 (F - kappa H) S:     mu = X' mu+,           C = I - X'X + X' C+ X
    correction   z = g e/T + G z_f,      g = S'H', G = S^-1 S_f:        mu = g e/T + G mu_f,   C = G C_f G'

and s(t | T) = s + S mu, P(t | T) = S C S'. This is the modified Bryson-Frazier recursion (1963) with mu = S' lambda and
C = I - S' Lambda S. Nothing is inverted but the triangle S+ (where D = 0 nothing is left to learn), everything
is at most of size one, and G is known in closed form from Bierman's update: no digits are lost to a wide prior.
"""

import math

import numpy as np

from ...engine.dispatch import kernel, look_back, open_row, remember, retreat
from ...engine.status import LOST
from ...engine.ud import correct, entry
from ...models.scale import sigma2
from .row import (
    CHI2,
    HAS_KAPPA,
    MEMO,
    OBSERVED,
    STATUS,
    USED_E,
    USED_R,
    USED_T,
    USED_Y,
    Form,
    memo_size,
    project,
)

EPS = 2.2e-16
HEAD = 2  # of a note: sigma^2 after the sample, status; then what the step did, kappa, and the inputs used


def note_size(form) -> int:
    """Return how many numbers a note has."""
    return HEAD + memo_size(form) + int(form.rows + form.inputs + form.coloured)


def space(N: int) -> np.ndarray:
    """Return room for mu, C and what a step back needs: nothing is known beyond the end."""
    room = np.zeros((4 * N + 5, N))
    room[5 : N + 5] = np.eye(N)
    return room


@kernel
def open_space(space, N):
    """Return mu, D, g, weight, shrink, C, X, Z and packed U as views."""
    U = space[3 * N + 5 :].reshape(N * N)[: N * (N - 1) // 2]
    C, X, Z = space[5 : N + 5], space[N + 5 : 2 * N + 5], space[2 * N + 5 : 3 * N + 5]
    return space[0], space[1], space[2], space[3], space[4], C, X, Z, U


@remember.on(Form)
def remember_form(form, scale, state, scratch, note):
    note[0] = sigma2(scale, state.head[OBSERVED], state.head[CHI2])
    note[1] = state.head[STATUS]
    at = HEAD + scratch.memo.size
    for i in range(scratch.memo.size):
        note[HEAD + i] = scratch.memo[i]
    for i in range(scratch.rows):
        note[at + i] = scratch.kappa[i] if scratch.memo[HAS_KAPPA] > 0.0 else 0.0
    for l in range(scratch.blocks):
        note[at + scratch.rows + l] = state.held[l]


@kernel
def advance_factor(U, f, y, held, kappa, scratch, columns, X):
    """X = (F - kappa H) U, its first columns, in the very order of operations of the filter."""
    n = scratch.n
    for j in range(columns):
        for i in range(n, X.shape[0] if columns > n else n):
            X[i, j] = entry(U, i, j) if i <= j else 0.0
        for i in range(n):
            x = entry(U, i + 1, j) if i + 1 < n and i + 1 <= j else 0.0
            x += -y * (entry(U, n + i, j) if n + i <= j else 0.0)
            for l in range(scratch.blocks):
                at = n * (l + 2) + i
                x += held[l] * (entry(U, at, j) if at <= j else 0.0)
            X[i, j] = x
        for i in range(scratch.rows):
            X[i, j] -= kappa[i] * f[j]


@kernel
def in_coordinates(U, D, D_before, m, X):
    """X <- S^-1 X sqrt(D_before), S = U sqrt(D): its first m rows and columns."""
    for i in range(m - 1, -1, -1):
        for j in range(m):
            x = X[i, j]
            for k in range(i + 1, m):
                x -= U[k * (k - 1) // 2 + i] * X[k, j]
            X[i, j] = x
    for i in range(m):
        for j in range(m):
            X[i, j] = X[i, j] * math.sqrt(D_before[j] / D[i]) if D[i] > 0.0 else 0.0


@kernel
def before_prediction(mu, C, m, X, Z, g):
    """mu <- X' mu, C <- I - X'(I - C) X, where X moves the first m coordinates alone; g is scratch."""
    for r in range(m, mu.size):
        for j in range(m):
            g[j] = 0.0
            for k in range(m):
                g[j] += X[k, j] * C[k, r]
        for j in range(m):
            C[j, r] = C[r, j] = g[j]
    for i in range(m):
        for j in range(m):
            z = 0.0
            for k in range(m):
                z += ((1.0 if i == k else 0.0) - C[i, k]) * X[k, j]
            Z[i, j] = z
    for j in range(m):
        g[j] = 0.0
        for k in range(m):
            g[j] += X[k, j] * mu[k]
        for i in range(j + 1):
            c = 1.0 if i == j else 0.0
            for k in range(m):
                c -= X[k, i] * Z[k, j]
            C[i, j] = C[j, i] = c
    for j in range(m):
        mu[j] = g[j]


@retreat.on(Form)
def retreat_form(form, row, after, note, scratch, space):
    state, later, n = open_row(form, row), open_row(form, after), scratch.n
    N = state.D.size
    mu, D, g, weight, shrink, C, X, Z, U = open_space(space, N)
    at = HEAD + scratch.memo.size
    memo, kappa, held = note[HEAD:at], note[at : at + scratch.rows], note[at + scratch.rows :]
    T, e = memo[USED_T], memo[USED_E]

    # the correction once more: factors after it, and what G is made of
    for i in range(U.size):
        U[i] = state.U[i]
    for i in range(N):
        D[i] = state.D[i]
    is_lost = int(note[1]) & LOST != 0
    if is_lost:
        for j in range(n, N):
            for i in range(n):
                U[j * (j - 1) // 2 + i] = 0.0
    project(U, N, held, scratch.direct, scratch.offset, scratch.f)
    if T > 0.0:
        for i in range(N):
            g[i] = math.sqrt(D[i]) * scratch.f[i]
        correct(U, D, scratch.f, memo[USED_R], scratch.b)
        project(U, N, held, scratch.direct, scratch.offset, scratch.f)

    moved = n if scratch.rows == n else N  # the parameters' coordinates stay, unless a memory widened them since
    for i in range(n, N):
        moved = moved if later.D[i] == D[i] else N
    advance_factor(U, scratch.f, memo[USED_Y], held, kappa, scratch, moved, X)
    in_coordinates(later.U, later.D, D, moved, X)
    before_prediction(mu, C, moved, X, Z, weight)
    if is_lost:  # x was restarted here: what comes later says nothing about the x before
        for i in range(n):
            mu[i] = 0.0
            for j in range(N):
                C[i, j] = C[j, i] = 1.0 if i == j else 0.0
    if T > 0.0:
        first = n * (scratch.inputs + 2)
        for i in range(memo.size - MEMO):  # d was drawn back by P w: mu += S' w
            for j in range(first + i, N):
                mu[j] += math.sqrt(D[j]) * entry(U, first + i, j) * memo[MEMO + i]
        before_correction(mu, C, g, weight, shrink, memo[USED_R], e / T)


@kernel
def turn(g, weight, shrink, v):
    """v <- G v for the upper triangle G_jj = shrink_j, G_ij = -g_i weight_j (i < j): O(N)."""
    later = 0.0
    for i in range(g.size - 1, -1, -1):
        x = v[i]
        v[i] = shrink[i] * x - g[i] * later
        later += weight[i] * x


@kernel
def before_correction(mu, C, g, weight, shrink, R, step):
    """mu <- g e/T + G mu, C <- G C G'; ``step`` is e/T.

    With alpha_j = R + g_1^2 + .. + g_j^2: G_jj = sqrt(alpha_{j-1} / alpha_j) and, for i < j, G_ij = -g_i g_j /
    sqrt(alpha_{j-1} alpha_j); G G' = I - g g'/T.
    """
    N, a = g.size, R
    for j in range(N):
        before = a
        a = before + g[j] * g[j]
        weight[j] = g[j] / (math.sqrt(before) * math.sqrt(a)) if before > 0.0 else 0.0
        shrink[j] = math.sqrt(before / a) if a > 0.0 else 1.0
    turn(g, weight, shrink, mu)
    for i in range(N):
        mu[i] += g[i] * step
        turn(g, weight, shrink, C[i])
    for i in range(N):  # C is symmetric: its rows turned, then its columns
        for k in range(i):
            C[i, k], C[k, i] = C[k, i], C[i, k]
    for i in range(N):
        turn(g, weight, shrink, C[i])


@look_back.on(Form)
def look_back_form(form, row, s2, space, out):
    state = open_row(form, row)
    mu, _, _, _, _, C, X, Z, _ = open_space(space, state.D.size)
    hindsight(state.s, state.U, state.D, mu, C, X, Z, s2, out)


@kernel
def hindsight(s, U, D, mu, C, X, Z, s2, out):
    """Write s + S mu, and of s2 S C S' nothing, its deviations, or its upper triangle; X and Z are scratch."""
    N = D.size
    for i in range(N):
        out[i] = s[i]
        for j in range(i, N):
            X[i, j] = entry(U, i, j) * math.sqrt(D[j])
            out[i] += X[i, j] * mu[j]
    if out.size == N:
        return
    for i in range(N):
        for j in range(N):
            z = 0.0
            for k in range(i, N):
                z += X[i, k] * C[k, j]
            Z[i, j] = z
    at = N
    for j in range(N):
        for i in range(j + 1) if out.size > 2 * N else range(j, j + 1):
            p = most = 0.0
            for k in range(j, N):
                p += Z[i, k] * X[j, k]
                most += X[j, k] * X[j, k]
            # C = I - ... is good to some N eps: less than that of P(t | t-1) nobody can tell from nothing
            out[at] = s2 * p if out.size > 2 * N else math.sqrt(s2 * max(p, 4.0 * N * EPS * most))
            at += 1
