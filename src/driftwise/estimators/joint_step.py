"""Theorem 3 of Salut et al. (1979) on U D U' factors: one sample of the joint filter.

Kernel order of s: the state reversed, x_n first, then theta = a_{n-1}..a_0, b_{n-1}..b_0 of each input and the
direct terms b_n: in q^-1 language a1..an, b1..bn, b0. In this order F is a shift up plus data times
parameter blocks that line up with the shift, and H = [1, 0, .., 0, u]:

    x+ = shift_up(x) - y a + sum_l u_l b_l + w,      y = x_n + sum_l u_l b_n,l + w_n

The state row carries s(t+1 | t). U, D are the factors of its covariance (relative to sigma^2).
"""

import math
from typing import NamedTuple

import numpy as np

from ..detect.gate import admit
from ..kernel.compose import advance, choice, kernel, open_row, open_work
from ..kernel.status import BAD_VALUE, EXACT, FLOORED, LOST, MISSING_INPUT, MISSING_OUTPUT, REJECTED
from ..kernel.ud import correct, orthogonalise, variances
from ..memory.drift import drift
from ..models.noise import Coloured, PlugIn, White, correlate
from ..models.scale import sigma2

# head of the row: one number each
SAMPLES, OBSERVED, STATUS, IN_A_ROW, CHI2, LOGDET, PEAK, TOP = range(8)
HEAD = 8
HUGE = 1e100  # beyond this a square or a product of two would overflow


class Form(NamedTuple):
    """Sizes and constants of a joint filter."""

    n: float
    inputs: float
    direct: float  # number of direct terms: 0 or the number of inputs
    rows: float  # rows that the time update re-triangularises: n (the state), or N (noise on the parameters)
    noises: float  # columns of G
    floor: float  # relative error carried by each y: R_t = R + (floor max|y recent|)^2


class Row(NamedTuple):
    """Views of one state row."""

    head: np.ndarray
    s: np.ndarray
    D: np.ndarray
    U: np.ndarray
    held: np.ndarray  # last known value of each input
    steps: np.ndarray  # sum of squared steps of each input, and their number
    pairs: np.ndarray


class Work(NamedTuple):
    """Sizes as integers, and scratch."""

    n: int
    inputs: int
    direct: int
    rows: int
    u: np.ndarray
    unsure: np.ndarray  # variance of a held input about its true value
    f: np.ndarray
    v: np.ndarray
    b: np.ndarray
    c: np.ndarray
    kappa: np.ndarray
    Y: np.ndarray
    d: np.ndarray


@open_row.on(Form)
def _(form, row):
    n, k = int(form.n), int(form.inputs)
    N = n + n * (k + 1) + int(form.direct)
    s = HEAD
    D = s + N
    U = D + N
    h = U + N * (N - 1) // 2
    return Row(row[:s], row[s:D], row[D:U], row[U:h], row[h : h + k], row[h + k : h + 2 * k], row[h + 2 * k : h + 3 * k])


def scratch_size(form) -> int:
    """Return how many numbers of scratch a run needs."""
    n, k, rows = int(form.n), int(form.inputs), int(form.rows)
    m = n * (k + 1) + int(form.direct)
    width = rows + int(form.noises) + (k + 1) * (m + 1) + 2
    return 2 * k + 5 * (n + m) + (rows + 1) * width


@open_work.on(Form)
def _(form, scratch):
    n, k, rows = int(form.n), int(form.inputs), int(form.rows)
    N = n + n * (k + 1) + int(form.direct)
    at = 2 * k + 5 * N
    width = (scratch.size - at) // (rows + 1)
    vectors = scratch[2 * k : at].reshape(5, N)
    return Work(
        n, k, int(form.direct), rows, scratch[:k], scratch[k : 2 * k],
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4],
        scratch[at : at + rows * width].reshape(rows, width), scratch[at + rows * width :],
    )  # fmt: skip


# --- the pieces of a step, in their order ------------------------------------------------------------------


@kernel
def take_inputs(state, work, u, t):
    """Copy the inputs of sample t, holding the last value of a missing one; return a status."""
    status = 0
    for l in range(work.inputs):
        value = u[t, l]
        if abs(value) < HUGE:
            if state.pairs[l] >= 0.0:
                step = value - state.held[l]
                state.steps[l] += step * step
            state.pairs[l] += 1.0
            state.held[l] = value
            work.unsure[l] = 0.0
        else:
            status |= MISSING_INPUT if value != value else MISSING_INPUT | BAD_VALUE
            work.unsure[l] = state.steps[l] / max(state.pairs[l], 1.0)
        work.u[l] = state.held[l]
    return status


@kernel
def project(s, U, D, u, direct, f, v):
    """Fill f = U'h and v = D f for h = [1, 0, .., 0, u]; return H s."""
    N = D.size
    yhat = s[0]
    f[0] = 1.0
    v[0] = D[0]
    at = 0
    first = N - direct
    for j in range(1, N):
        at += j - 1
        fj = U[at]
        if j >= first:
            for i in range(first, j):
                fj += u[i - first] * U[at + i]
            fj += u[j - first]
            yhat += u[j - first] * s[j]
        f[j] = fj
        v[j] = D[j] * fj
    return yhat


@kernel
def shift_mean(s, n, inputs, y, u):
    """x+ = shift_up(x) - y a + sum_l u_l b_l."""
    for i in range(n):
        x = -y * s[n + i]
        if i + 1 < n:
            x += s[i + 1]
        for l in range(inputs):
            x += u[l] * s[n * (l + 2) + i]
        s[i] = x


@kernel
def shift_factor(U, N, n, inputs, y, u):
    """The same for the parameter columns of U: U[x, theta] becomes (F U)[x, theta]."""
    at = n * (n - 1) // 2
    for c in range(n, N):
        for i in range(n - 1):
            U[at + i] = U[at + i + 1]
        U[at + n - 1] = 0.0
        for g in range(inputs + 1):
            weight = -y if g == 0 else u[g - 1]
            lo = n * (g + 1)
            for i in range(min(n, c - lo)):
                U[at + i] += weight * U[at + lo + i]
            if 0 <= c - lo < n:
                U[at + c - lo] += weight
        at += c


@kernel
def drop_measured(U, D, n):
    """With no state noise the measured state leaves and a known zero enters: U[x, x] moves up, D = 0 enters."""
    for j in range(n - 1):
        at, after = j * (j - 1) // 2, (j + 1) * j // 2
        for i in range(j):
            U[at + i] = U[after + i + 1]
        D[j] = D[j + 1]
    at = (n - 1) * (n - 2) // 2
    for i in range(n - 1):
        U[at + i] = 0.0
    D[n - 1] = 0.0


@kernel
def lay_out(U, D, f, kappa, n, rows, Y, d):
    """Write (F - kappa H) U into Y and U: Y takes the columns to re-triangularise, U keeps the others.

    The parameter columns of U have been shifted already.
    """
    N = D.size
    for j in range(n):
        at, d[j] = j * (j - 1) // 2, D[j]
        for i in range(n - 1):
            below = U[at + i + 1] if i + 1 < j else (1.0 if i + 1 == j else 0.0)
            Y[i, j] = below - kappa[i] * f[j]
        Y[n - 1, j] = -kappa[n - 1] * f[j]
        for i in range(n, rows):
            Y[i, j] = -kappa[i] * f[j]
    for c in range(n, N):
        at = c * (c - 1) // 2
        if rows == n:
            for i in range(n):
                U[at + i] -= kappa[i] * f[c]
        else:
            d[c] = D[c]
            for i in range(rows):
                Uic = U[at + i] if i < c else (1.0 if i == c else 0.0)
                Y[i, c] = Uic - kappa[i] * f[c]


@kernel
def add_product(U, D, mean, first, weight, n, rows, Y, d, at):
    """Append noise of covariance weight (P_pp + p p') to x, p the n parameters from ``first`` on.

    That is the variance of p times an independent error of variance ``weight``. Return the next column.
    """
    for c in range(first, D.size):
        d[at] = weight * D[c]
        for i in range(n):
            j = first + i
            Y[i, at] = U[c * (c - 1) // 2 + j] if j < c else (1.0 if j == c else 0.0)
        for i in range(n, rows):
            Y[i, at] = 0.0
        at += 1
    d[at] = weight
    for i in range(rows):
        Y[i, at] = mean[first + i] if i < n else 0.0
    return at + 1


@choice
def propagate(noise, state, work, z, yhat, R, T, is_measured, is_held):
    """Time update of mean and factors; z is the measured y, unused where there is none."""


@propagate.on(White)
def _(noise, state, work, z, yhat, R, T, is_measured, is_held):
    if is_held or not is_measured:
        return propagate_dense(noise, state, work, z, yhat, R, T, is_measured)
    n = work.n
    shift_mean(state.s, n, work.inputs, z, work.u)
    shift_factor(state.U, state.D.size, n, work.inputs, z, work.u)
    drop_measured(state.U, state.D, n)
    return 0


@propagate.on(PlugIn, Coloured)
def _(noise, state, work, z, yhat, R, T, is_measured, is_held):
    return propagate_dense(noise, state, work, z, yhat, R, T, is_measured)


@kernel
def propagate_dense(noise, state, work, z, yhat, R, T, is_measured):
    """The time update that re-triangularises: correlated noise, and every kind of missing sample."""
    s, U, D, n, rows, kappa, Y, d = state.s, state.U, state.D, work.n, work.rows, work.kappa, work.Y, work.d
    N = D.size
    flags = correlate(noise, s[n:], n, kappa, work.c)
    at = rows  # U itself takes the first columns of Y, noise the others
    if is_measured:
        if R > noise.R:  # part of R is not w_n: regress on the whole, keep the rest as noise
            d[at] = noise.R * (1.0 - noise.R / R)
            for i in range(rows):
                Y[i, at] = kappa[i]
                kappa[i] *= noise.R / R
            at += 1
        rest = z - project(s, U, D, work.u, work.direct, work.f, work.v)
        shift_mean(s, n, work.inputs, z, work.u)
        for i in range(rows):
            s[i] += kappa[i] * rest
        shift_factor(U, N, n, work.inputs, z, work.u)
    else:
        # A = F(yhat, u) - [a; 0] H, noise (kappa - [a; 0]) w_n, and the Isserlis terms T P_aa + c c'
        for i in range(rows):
            a = s[n + i] if i < n else 0.0
            Y[i, at] = kappa[i] - a
            kappa[i] = a
        d[at] = noise.R
        covariance_with_output(U, work.v, n, n, work.c)
        at = add_product(U, D, s, n, T, n, rows, Y, d, at + 1)
        d[at - 1] = 1.0  # c where the mean was
        for i in range(n):
            Y[i, at - 1] = work.c[i]
        shift_mean(s, n, work.inputs, yhat, work.u)
        for i in range(n):
            s[i] -= work.c[i]
        shift_factor(U, N, n, work.inputs, yhat, work.u)
    for l in range(work.inputs):
        if work.unsure[l] > 0.0:
            at = add_product(U, D, s, n * (l + 2), work.unsure[l], n, rows, Y, d, at)
    at = add_columns(noise, rows, Y, d, at)
    lay_out(U, D, work.f, kappa, n, rows, Y, d)
    orthogonalise(Y, d, rows, at, U, D)
    return flags


@kernel
def covariance_with_output(U, v, first, count, c):
    """Fill c with cov(s_i, y) = (U v)_i for ``count`` indices from ``first`` on."""
    for i in range(count):
        p = v[first + i]
        for j in range(first + i + 1, v.size):
            p += U[j * (j - 1) // 2 + first + i] * v[j]
        c[i] = p


@choice
def add_columns(noise, rows, Y, d, at):
    """Append the constant noise columns to Y and return the next free column."""


@add_columns.on(White, PlugIn)
def _(noise, rows, Y, d, at):
    return at


@add_columns.on(Coloured)
def _(noise, rows, Y, d, at):
    G = noise.G
    for k in range(G.size // rows):
        d[at] = 1.0
        for i in range(rows):
            Y[i, at] = G[k * rows + i]
        at += 1
    return at


@kernel
def write(out, t, state, work, yhat, e, variance, status, s2):
    """Write one row of the trace: prediction, innovation, its variance, status, then s, its spread or P."""
    N, C = state.D.size, out.shape[1]
    out[t, 0], out[t, 1], out[t, 2], out[t, 3] = yhat, e, variance, status
    if C >= 4 + N:
        for i in range(N):
            out[t, 4 + i] = state.s[i]
    if C == 4 + 2 * N:
        variances(state.U, state.D, work.c)
        for i in range(N):
            out[t, 4 + N + i] = math.sqrt(s2 * work.c[i])
    elif C > 4 + N:
        at = 4 + N
        for j in range(N):
            for i in range(j + 1):
                p = 0.0
                for k in range(j, N):
                    Uik = U_entry(state.U, i, k)
                    p += Uik * U_entry(state.U, j, k) * state.D[k]
                out[t, at] = s2 * p
                at += 1


@kernel
def U_entry(U, i, j):
    """Return U[i, j] for i <= j."""
    return 1.0 if i == j else U[j * (j - 1) // 2 + i]


@kernel
def restart_state(state, work):
    """Forget x but not theta: x = 0 with the range of the data as its standard deviation."""
    top = max(state.head[TOP], 1.0)
    for i in range(work.n):
        state.s[i] = 0.0
        state.D[i] = top * top
    for j in range(state.D.size):
        for i in range(min(j, work.n)):
            state.U[j * (j - 1) // 2 + i] = 0.0


@advance.on(Form)
def _(form, noise, memory, gate, scale, state, work, y, u, out, t):
    head, s, U, D, n = state.head, state.s, state.U, state.D, work.n
    status = take_inputs(state, work, u, t)
    z = y[t, 0]
    head[PEAK] *= 0.75
    is_measured = abs(z) < HUGE
    if is_measured:
        head[PEAK] = max(head[PEAK], abs(z))
        head[TOP] = max(head[TOP], abs(z))
    else:
        status |= MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE

    # project
    R = noise.R
    if R > 0.0:
        rounding = (form.floor * head[PEAK]) ** 2
        if rounding > R:
            status |= FLOORED
        R += rounding
    yhat = project(s, U, D, work.u, work.direct, work.f, work.v)
    for l in range(work.direct):
        if work.unsure[l] > 0.0:  # the direct term passes the error of a held input on to y
            i = D.size - work.direct + l
            b = s[i]
            p = D[i]
            for j in range(i + 1, D.size):
                p += U_entry(U, i, j) ** 2 * D[j]
            R += work.unsure[l] * (b * b + p)
    s2 = sigma2(scale, head[OBSERVED], head[CHI2])

    # detect
    e = z - yhat if is_measured else np.nan
    if is_measured and not admit(gate, e, work.f, work.v, R, s2, head[IN_A_ROW], head[OBSERVED]):
        is_measured = False
        status |= REJECTED
    head[IN_A_ROW] = head[IN_A_ROW] + 1.0 if status & REJECTED else 0.0

    # correct
    T = R
    if is_measured:
        T = correct(U, D, work.f, work.v, R, work.b)
        if T > 0.0:
            for i in range(D.size):
                s[i] += work.b[i] * (e / T)
            head[OBSERVED] += 1.0
            head[CHI2] += e * e / T
            head[LOGDET] += math.log(T)
        else:
            status |= EXACT
    else:
        for j in range(D.size):
            T += work.f[j] * work.v[j]
    if not T < HUGE * HUGE:
        restart_state(state, work)
        status |= LOST
        head[STATUS] = status
        head[SAMPLES] += 1.0
        write(out, t, state, work, yhat, np.nan, np.inf, status, s2)
        return
    write(out, t, state, work, yhat, e, s2 * T, status, sigma2(scale, head[OBSERVED], head[CHI2]))

    # predict
    status |= propagate(noise, state, work, z, yhat, R, T, is_measured, status & MISSING_INPUT != 0)
    status |= drift(memory, U, D, n, work.c)
    out[t, 3] = status
    head[STATUS] = status
    head[SAMPLES] += 1.0
