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

from ..detect.gate import admit, count_rejections
from ..kernel.compose import advance, choice, kernel, open_row, open_work, rare
from ..kernel.status import BAD_VALUE, EXACT, FLOORED, LOST, MISSING_INPUT, MISSING_OUTPUT, REJECTED
from ..kernel.ud import correct, entry, orthogonalise, predicted_variance, variance, variances
from ..memory.drift import drift
from ..models.noise import Coloured, PlugIn, White, correlate
from ..models.scale import sigma2

# head of the row: one number each
SAMPLES, OBSERVED, STATUS, IN_A_ROW, CHI2, LOGDET, PEAK, TOP = range(8)
HEAD = 8
INPUT = 6  # numbers kept for each input
LIMIT = 1e8  # a variance so many times that of all data seen says that the state is lost
HUGE = 1e100  # beyond this a square or a product of two would overflow


class Form(NamedTuple):
    """Sizes and constants of a joint filter."""

    n: float
    inputs: float
    direct: float  # number of direct terms: 0 or the number of inputs
    rows: float  # rows that the time update re-triangularises: n (the state), or N (noise on the parameters)
    noises: float  # columns of G
    floor: float  # relative error carried by each y: R_t = R + (floor max|y recent|)^2
    quantum: float  # variance of the quantisation of y
    Px: float  # prior variance of the measured state
    least: float  # variance of the state, negligible beside R, that counts as none


class Row(NamedTuple):
    """Views of one state row."""

    head: np.ndarray
    s: np.ndarray
    D: np.ndarray
    U: np.ndarray
    held: np.ndarray  # each input: its value, predicted while missing
    unsure: np.ndarray  # variance of that prediction
    known: np.ndarray  # how many values are known, and their sums of values, squares and squared steps
    sums: np.ndarray
    squares: np.ndarray
    steps: np.ndarray


class Work(NamedTuple):
    """Sizes as integers, and scratch."""

    n: int
    inputs: int
    direct: int
    rows: int
    least: float
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    kappa: np.ndarray
    Y: np.ndarray
    d: np.ndarray
    g: np.ndarray


@open_row.on(Form)
def _(form, row):
    n, k = int(form.n), int(form.inputs)
    N = n + n * (k + 1) + int(form.direct)
    s = HEAD
    D = s + N
    U = D + N
    h = U + N * (N - 1) // 2
    inputs = row[h:].reshape(INPUT, k)
    return Row(
        row[:s], row[s:D], row[D:U], row[U:h],
        inputs[0], inputs[1], inputs[2], inputs[3], inputs[4], inputs[5],
    )  # fmt: skip


def scratch_size(form) -> int:
    """Return how many numbers of scratch a run needs."""
    n, k, rows = int(form.n), int(form.inputs), int(form.rows)
    m = n * (k + 1) + int(form.direct)
    width = rows + int(form.noises) + (k + 1) * (m + 1) + 2
    return 4 * (n + m) + (rows + 2) * width


@open_work.on(Form)
def _(form, scratch):
    n, k, rows = int(form.n), int(form.inputs), int(form.rows)
    N = n + n * (k + 1) + int(form.direct)
    at = 4 * N
    width = (scratch.size - at) // (rows + 2)
    vectors = scratch[:at].reshape(4, N)
    wide = scratch[at:].reshape(rows + 2, width)
    return Work(
        n, k, int(form.direct), rows, form.least,
        vectors[0], vectors[1], vectors[2], vectors[3], wide[:rows], wide[rows], wide[rows + 1],
    )  # fmt: skip


# --- the pieces of a step, in their order ------------------------------------------------------------------


@kernel
def take_inputs(state, u, t):
    """Take the inputs of sample t into ``state.held``, a missing one as predicted; return a status."""
    status = 0
    for l in range(state.held.size):
        value = u[t, l]
        if abs(value) < HUGE:
            if state.known[l] > 0.0:
                step = value - state.held[l]
                state.steps[l] += step * step
            state.known[l] += 1.0
            state.sums[l] += value
            state.squares[l] += value * value
            state.held[l] = value
            state.unsure[l] = 0.0
        else:
            status |= MISSING_INPUT if value != value else MISSING_INPUT | BAD_VALUE
            predict_input(state, l)
    return status


@kernel
def predict_input(state, l):
    """One step of an AR(1) process with the mean, variance and mean squared step the input has shown so far.

    rho = 1 - E step^2 / (2 var): an input that moves slowly is held, a white one is put at its mean.
    """
    known = state.known[l]
    if known > 1.0:
        mean = state.sums[l] / known
        spread = max(state.squares[l] / known - mean * mean, 0.0)
        rho = max(1.0 - 0.5 * state.steps[l] / ((known - 1.0) * spread), 0.0) if spread > 0.0 else 1.0
        state.held[l] = mean + rho * (state.held[l] - mean)
        state.unsure[l] = rho * rho * state.unsure[l] + (1.0 - rho * rho) * spread


@kernel
def predict_output(s, u, direct):
    """Return H s, H = [1, 0, .., 0, u]."""
    yhat = s[0]
    first = s.size - direct
    for l in range(direct):
        yhat += u[l] * s[first + l]
    return yhat


@kernel
def project(U, N, u, direct, f):
    """Fill f = U' h."""
    first = N - direct
    f[0] = 1.0
    at = 0
    for j in range(1, N):
        at += j - 1
        f[j] = U[at]
        if j >= first:
            for i in range(first, j):
                f[j] += u[i - first] * U[at + i]
            f[j] += u[j - first]


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


@rare
def add_product(U, D, mean, first, last, weight, mean_weight, n, rows, Y, d, g, at):
    """Append noise of covariance weight P_pp + mean_weight p p' to x, p the n parameters from ``first`` on.

    With equal weights that is p times an independent error of that variance. Parameter ``last`` (none: -1)
    multiplies the same error into y: ``g`` takes its columns. Return the next free column.
    """
    for c in range(first, D.size):
        d[at] = weight * D[c]
        g[at] = entry(U, last, c) if 0 <= last <= c else 0.0
        for i in range(rows):
            Y[i, at] = entry(U, first + i, c) if i < n and first + i <= c else 0.0
        at += 1
    d[at] = mean_weight
    g[at] = mean[last] if last >= 0 else 0.0
    for i in range(rows):
        Y[i, at] = mean[first + i] if i < n else 0.0
    return at + 1


@choice
def propagate(noise, state, work, z, yhat, R, T, s2, is_measured, is_held):
    """Time update of mean and factors; z is the measured y, unused where there is none."""


@propagate.on(White)
def _(noise, state, work, z, yhat, R, T, s2, is_measured, is_held):
    if is_held or not is_measured:
        return propagate_dense(noise, state, work, z, yhat, R, T, s2, is_measured)
    n = work.n
    shift_mean(state.s, n, work.inputs, z, state.held)
    shift_factor(state.U, state.D.size, n, work.inputs, z, state.held)
    drop_measured(state.U, state.D, n)
    return 0


@propagate.on(PlugIn, Coloured)
def _(noise, state, work, z, yhat, R, T, s2, is_measured, is_held):
    return propagate_dense(noise, state, work, z, yhat, R, T, s2, is_measured)


@kernel
def propagate_dense(noise, state, work, z, yhat, R, T, s2, is_measured):
    """The time update that re-triangularises: correlated noise, and every kind of missing sample."""
    s, U, D, n, rows, kappa, Y, d = state.s, state.U, state.D, work.n, work.rows, work.kappa, work.Y, work.d
    N = D.size
    flags = correlate(noise, s[n:], n, kappa, work.c)
    at = add_noise(noise, state, work, R, s2, is_measured)
    if is_measured:
        rest = z - predict_output(s, state.held, work.direct)
        project(U, N, state.held, work.direct, work.f)
        shift_mean(s, n, work.inputs, z, state.held)
        for i in range(rows):
            s[i] += kappa[i] * rest
        shift_factor(U, N, n, work.inputs, z, state.held)
    else:
        # F(yhat, u) - [a; 0] H, and the Isserlis terms T P_aa + c c' of the product a y
        # (all relative to sigma^2, which a product of two covariances carries twice)
        covariance_with_output(U, D, work.f, n, n, work.c)
        at = add_product(U, D, s, n, -1, s2 * T, s2, n, rows, Y, d, work.g, at)
        for i in range(n):
            Y[i, at - 1] = work.c[i]  # c stands where the mean did
        shift_mean(s, n, work.inputs, yhat, state.held)
        for i in range(n):
            s[i] -= s2 * work.c[i]
        shift_factor(U, N, n, work.inputs, yhat, state.held)
    lay_out(U, D, work.f, kappa, n, rows, Y, d)
    orthogonalise(Y, d, work.g, rows, at, U, D, noise.R == 0.0)
    for i in range(n):  # known theta: x is known ever better, geometrically; denormal numbers are six times slower
        if D[i] < work.least:
            D[i] = 0.0
    return flags


@kernel
def add_noise(noise, state, work, R, s2, is_measured):
    """Write the noise on x into columns of Y and settle kappa; return the next free column.

    Each column is noise shared by x (in Y) and y (in g). A measured y tells about it: regress on y, kappa its
    coefficients. A missing y was replaced in F by its prediction: then kappa = [a; 0], since -a y carries it into x.
    U itself takes the first columns of Y.
    """
    s, U, D, n, rows, kappa, Y, d, g = state.s, state.U, state.D, work.n, work.rows, work.kappa, work.Y, work.d, work.g
    at = rows
    is_held = False
    for l in range(work.inputs):
        is_held = is_held or state.unsure[l] > 0.0
    if is_held or not is_measured:
        d[at], g[at] = R, 1.0
        for i in range(rows):
            Y[i, at] = kappa[i]
        at += 1
        for l in range(work.inputs):
            unsure = state.unsure[l]
            if unsure > 0.0:
                b0 = D.size - work.direct + l if work.direct > 0 else -1
                at = add_product(U, D, s, n * (l + 2), b0, unsure, unsure / s2, n, rows, Y, d, g, at)
        if is_measured:
            total = 0.0
            for c in range(rows, at):
                total += d[c] * g[c] * g[c]
            for i in range(rows):
                kappa[i] = 0.0
                for c in range(rows, at):
                    kappa[i] += d[c] * Y[i, c] * g[c]
                kappa[i] = kappa[i] / total if total > 0.0 else 0.0
        else:
            for i in range(rows):
                kappa[i] = s[n + i] if i < n else 0.0
        for c in range(rows, at):
            for i in range(rows):
                Y[i, c] -= kappa[i] * g[c]
    return add_columns(noise, rows, Y, d, at)


@rare
def covariance_with_output(U, D, f, first, count, c):
    """Fill c with cov(s_i, y) = (U D f)_i for ``count`` indices from ``first`` on."""
    for i in range(count):
        c[i] = 0.0
        for j in range(first + i, D.size):
            c[i] += entry(U, first + i, j) * D[j] * f[j]


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
def write(out, t, state, work, yhat, e, T, status, s2):
    """Write one row of the trace: prediction, innovation, its variance, status, then s, its spread or P."""
    N, C = state.D.size, out.shape[1]
    out[t, 0], out[t, 1], out[t, 2], out[t, 3] = yhat, e, T, status
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
                    p += entry(state.U, i, k) * entry(state.U, j, k) * state.D[k]
                out[t, at] = s2 * p
                at += 1


@rare
def restart_state(state, n, Px, s2):
    """Forget x but not theta: x = 0 with ten times the range of the data as its standard deviation."""
    top = state.head[TOP]
    for i in range(n):
        state.s[i] = 0.0
        state.D[i] = 100.0 * top * top / s2 if top > 0.0 else Px
    for j in range(state.D.size):
        for i in range(min(j, n)):
            state.U[j * (j - 1) // 2 + i] = 0.0


@advance.on(Form)
def _(form, noise, memory, gate, scale, state, work, y, u, out, t):
    head, s, U, D, n = state.head, state.s, state.U, state.D, work.n
    status = take_inputs(state, u, t)
    z = y[t, 0]
    head[PEAK] *= 0.75
    is_measured = abs(z) < HUGE
    if is_measured:
        head[PEAK] = max(head[PEAK], abs(z))
        head[TOP] = max(head[TOP], abs(z))
    else:
        status |= MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE

    # project
    s2 = sigma2(scale, head[OBSERVED], head[CHI2])
    R = noise.R
    if R > 0.0:
        rounding = ((form.floor * head[PEAK]) ** 2 + form.quantum) / s2
        if rounding > R:
            status |= FLOORED
        R += rounding
    yhat = predict_output(s, state.held, work.direct)
    project(U, D.size, state.held, work.direct, work.f)
    Rn = R
    for l in range(work.direct):
        if state.unsure[l] > 0.0:  # the direct term passes the error of a held input on to y
            i = D.size - work.direct + l
            R += state.unsure[l] * (s[i] * s[i] / s2 + variance(U, D, i))

    if not is_measured and not predicted_variance(work.f, D, R) < LIMIT * (head[TOP] ** 2 / s2 + form.Px + R):
        restart_state(state, n, form.Px, s2)  # a gap so long that the model has lost the state
        status |= LOST
        yhat = predict_output(s, state.held, work.direct)
        project(U, D.size, state.held, work.direct, work.f)

    # detect
    e = z - yhat if is_measured else np.nan
    if is_measured:
        is_measured = admit(gate, e, work.f, D, R, s2, head[IN_A_ROW], head[OBSERVED])
        head[IN_A_ROW] = count_rejections(gate, head[IN_A_ROW], not is_measured)
        status |= 0 if is_measured else REJECTED

    # correct
    if is_measured:
        T = correct(U, D, work.f, R, work.b)
        if T > 0.0:
            for i in range(D.size):
                s[i] += work.b[i] * (e / T)
            head[OBSERVED] += 1.0
            head[CHI2] += e * e / T
            head[LOGDET] += math.log(T)
        else:
            status |= EXACT
    else:
        T = predicted_variance(work.f, D, R)
    write(out, t, state, work, yhat, e, s2 * T, status, sigma2(scale, head[OBSERVED], head[CHI2]))

    # predict
    status |= propagate(noise, state, work, z, yhat, Rn, T, s2, is_measured, status & MISSING_INPUT != 0)
    status |= drift(memory, U, D, n, work.c)
    out[t, 3] = status
    head[STATUS] = status
    head[SAMPLES] += 1.0
