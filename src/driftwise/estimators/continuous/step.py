"""One sample of the continuous-time filter: exact filters between the samples, then one regression update.

A(p) y = B(p) u, filtered by lambda(p) = (p + c)^n: with phi_i = p^(n-i)/lambda of y and of u, and x(t0) the state at
the first measured sample,

    y(t_k) = sum_i (lam_i - a_i) phi_i[y] + b_i phi_i[u] + x_i(t0) phi_i[impulse]  + v_k

u is held, y is a straight line between measured samples: every phi is a number. There is no noise on the state, so s =
[x(t0); a; b] is constant: the update is Bierman's, and there is no time update. y_k itself ends its own straight
line: it enters its regressors with the weights ``line``, and y_k - (right-hand side) = w y_k + ..: see `project`.
"""

import math
from typing import NamedTuple

import numpy as np

from ...detect.gate import admit, count_rejections
from ...engine.dense import dot
from ...engine.dispatch import Vector, advance, kernel, open_scratch, rare, watch
from ...engine.elementary import log, square
from ...engine.layout import Field, Layout, joined, numbers, policy
from ...engine.status import BAD_VALUE, EXACT, FLOORED, MISSING_OUTPUT, REJECTED
from ...engine.ud import entry, measurement_update, predicted_variance, project
from ...memory.questions import Alarm, View, count, found_jump, on_alarm, outlier_probability, time_update
from ...models.scale import sigma2
from ..adaptive_gain.step import take_inputs
from ..common.given_state import (
    COUNT,
    COUNTS,
    SCORE,
    WEIGHT,
    Room,
    adapt_given_state,
    begin_given_state,
    open_room,
    pass_time_given_state,
    room_size,
    sigma2_of_few,
)
from ..joint.row import HUGE
from ..joint.step import DOUBTED, SURE
from .chain import decay, respond

SAMPLES, OBSERVED, STATUS, IN_A_ROW, CHI2, LOGDET, PEAK, TIME, STARTED, SINCE, LAST = range(11)  # of the head of a row
LEAST = 1e-3  # own weight w of y_k below which y_k cannot be predicted: the last one is held


class Continuous(NamedTuple):
    """Sizes and constants of a continuous-time filter."""

    n: float
    inputs: float
    c: float  # observer rate, rad/s
    dt: float  # seconds between samples that come without time stamps
    floor: float  # relative round-off of y
    settle: float  # measured samples before the detector watches
    detector_size: float  # numbers that the detector keeps
    memory_size: float  # and the memory
    is_timed: float  # 1: the memory goes by seconds, else by samples
    fades: float  # 1: it says how many samples count
    learns: float  # 1: it takes a sample in by its own rule
    lam: Vector  # coefficients of (p + c)^n, without the leading 1
    V: Vector  # (n, n, n): x_i = sum_j V[i, j, :] . chain of what drives x_j


CONTINUOUS = Layout(
    *numbers(
        "head",
        samples="samples taken",
        observed="of them, corrected by an output",
        status="bits of the last one",
        in_a_row="outliers in a row, until now",
        chi2="sum of e^2/T",
        logdet="sum of log T",
        peak="largest recent |y|",
        time="of the last sample",
        started="whether an output has been measured",
        since="seconds since the last measured output",
        last="the last measured output",
    ),
    *joined(
        "s",
        Field("x0", ("n",), "state at the first measured output"),
        Field("theta", ("N - n",), "parameters", trace="their names"),
    ),
    Field("D", ("N",), "P = U D U', relative to sigma^2: the diagonal"),
    Field("U", ("N * (N - 1) // 2",), "and the factor above it, column by column"),
    Field("y", ("n",), "chain of y, at the last measured sample"),
    Field("x", ("n",), "chain of the impulse that x0 stands for, there"),
    Field("u", ("inputs", "n"), "chains of the inputs, now"),
    Field("held", ("inputs",), "inputs as held now"),
    policy("detector_state", of="detector"),
    policy("memory_state", of="memory"),
    Field("counts", (f"{COUNTS} * fades",), "samples that count, for sigma^2 and for the gain; log density of all"),
    N="n * (inputs + 2)",
)
CONTINUOUS.on(Continuous)


class Work(NamedTuple):
    """Sizes as integers, and scratch."""

    n: int
    inputs: int
    e: np.ndarray
    hold: np.ndarray
    line: np.ndarray
    y: np.ndarray
    x: np.ndarray
    own: np.ndarray  # d phi_i / d y_k
    h: np.ndarray
    f: np.ndarray
    b: np.ndarray
    X: np.ndarray  # rows of x(t_k), and one for what they share with a y_k that is not known
    room: Room  # where the memory learns


def scratch_size(n: int, inputs: int) -> int:
    """Return how many numbers of scratch a run needs."""
    N = n * (inputs + 2)
    return 6 * n + 3 * N + (n + 1) * N + room_size(n, N - n)


@open_scratch.on(Continuous)
def open_scratch_continuous(form, buffer):
    n, k = int(form.n), int(form.inputs)
    N = n * (k + 2)
    small = buffer[: 6 * n].reshape(6, n)
    wide = buffer[6 * n : 6 * n + (n + 4) * N].reshape(n + 4, N)
    return Work(
        n, k, small[0], small[1], small[2], small[3], small[4], small[5], wide[0], wide[1], wide[2], wide[3:],
        open_room(buffer[6 * n + (n + 4) * N :], n, N - n),
    )  # fmt: skip


@kernel
def view_of(form, state, scratch, s2, surprise):
    """Return what the memory sees between two samples."""
    s, weight = state.s, state.counts[WEIGHT] if form.fades > 0.0 else state.head[OBSERVED]
    return View(
        scratch.n, s, state.U, state.D, s[:0], scratch.f, scratch.b, scratch.h,
        s2, weight, surprise, 0.0, s[:0], s[:0], math.nan, s[:0], 0.0,
    )  # fmt: skip


@kernel
def known_so_far(form, scale, state):
    """Return sigma^2; where samples fade, and those that are left are few, it may be anything up to the data's own."""
    if form.fades == 0.0:
        return sigma2(scale, state.head[OBSERVED], state.head[CHI2])
    return sigma2_of_few(scale, state.counts[COUNT], state.head[CHI2])


@kernel
def take_in(form, memory, state, scratch, e, R, usual, s2):
    """Take the residual e into s and U D U'; return the variance T it was expected to have."""
    s, U, D, f = state.s, state.U, state.D, scratch.f
    if form.learns > 0.0:
        memory_state, weight, room = state.memory_state, state.counts[WEIGHT], scratch.room
        return adapt_given_state(memory, memory_state, e, R, usual, s, U, D, f, room, s2, weight, math.nan, s[:0], 1.0)
    return measurement_update(s, U, D, f, e, R, scratch.b)


@kernel
def pass_sample(form, memory, state, scratch, s2, surprise):
    """Let a memory that goes by samples forget; return status bits."""
    if form.learns > 0.0:
        weight = state.counts[WEIGHT]
        lam, status = pass_time_given_state(
            memory, state.memory_state, state.s, state.U, state.D, scratch.room, s2, weight, surprise
        )
    else:
        lam, status = time_update(memory, state.memory_state, 1.0, view_of(form, state, scratch, s2, surprise))
    if form.fades > 0.0 and lam < 1.0:
        state.counts[WEIGHT] *= lam
        state.counts[COUNT] *= lam
        state.head[CHI2] *= lam
    return status


@kernel
def mix(form, n, i, j, chain):
    """Return V[i, j, :] . chain."""
    at = (i * n + j) * n
    total = 0.0
    for m in range(n):
        total += form.V[at + m] * chain[m]
    return total


@kernel
def fill_row(form, state, scratch, i, h):
    """Fill h with the row of x_i(t) on s = [x(t0); a; b]; return what does not depend on s."""
    n, known = scratch.n, 0.0
    for j in range(n):
        phi = mix(form, n, i, j, scratch.y)
        known += form.lam[j] * phi
        h[j] = form.c * mix(form, n, i, j, scratch.x)
        h[n + j] = -phi
    for l in range(scratch.inputs):
        for j in range(n):
            h[n * (l + 2) + j] = mix(form, n, i, j, state.u[l])
    return known


@kernel
def own_weights(form, state, scratch, i):
    """Fill own with d phi_j / d y_k in the row of x_i; return d x_i / d y_k."""
    n, total = scratch.n, 0.0
    for j in range(n):
        scratch.own[j] = mix(form, n, i, j, scratch.line)
        total += (form.lam[j] - state.s[n + j]) * scratch.own[j]
    return total


@kernel
def move_inputs(form, state, scratch, seconds):
    """Take the chains of the inputs over a stretch in which they were held."""
    respond(form.c * seconds, scratch.e, scratch.hold, scratch.line)
    for l in range(scratch.inputs):
        decay(scratch.e, state.u[l], state.u[l])
        for j in range(scratch.n):
            state.u[l, j] += state.held[l] * scratch.hold[j]


@kernel
def elapse(form, state, u, t):
    """Return the seconds since the sample before, from the stamp in the column behind the inputs, or dt without one."""
    head, k = state.head, state.held.size
    stamp = u[t, k] if u.shape[1] > k else np.nan
    before = head[TIME]
    if head[SAMPLES] == 0.0:
        head[TIME] = 0.0 if stamp != stamp else stamp
        return 0.0
    if stamp != stamp:
        head[TIME] += form.dt
        return form.dt
    head[TIME] = stamp
    return max(stamp - before, 0.0)


@rare
def begin(state, scratch):
    """Let t0 be now: x(t0) stands for all that came before."""
    state.head[SINCE] = state.head[LAST] = 0.0
    for j in range(scratch.n):
        state.y[j] = 0.0
        state.x[j] = 1.0 if j == 0 else 0.0
        for l in range(scratch.inputs):
            state.u[l, j] = 0.0


@rare
def write_estimates(form, state, scratch, out, t, w, R, s2, is_measured):
    """Write s with x(t) in place of x(t0), and its spread or covariance.

    A y_k that is not known is its prediction: with w y_k = h s + v its error reaches x_i with the weight dx_i/dy_k / w.
    """
    s, U, D, n, N, C = state.s, state.U, state.D, scratch.n, state.D.size, out.shape[1]
    X, gain = scratch.X, scratch.X[n]
    for i in range(n):
        out[t, 4 + i] = fill_row(form, state, scratch, i, scratch.h) + dot(scratch.h, s)
        project(U, scratch.h, X[i])
        gain[i] = 0.0 if is_measured else own_weights(form, state, scratch, i) / w
    for i in range(n, N):
        out[t, 4 + i] = s[i]
    if C == 4 + N:
        return
    for i in range(n - 1, -1, -1):
        for j in range(N):
            X[i, j] += gain[i] * X[0, j]
    at = 4 + N
    for j in range(N):
        for i in range(0 if C > 4 + 2 * N else j, j + 1):
            p = gain[i] * gain[j] * R if j < n else 0.0
            for m in range(j if j >= n else 0, N):
                Xi = X[i, m] if i < n else entry(U, i, m)
                Xj = X[j, m] if j < n else entry(U, j, m)
                p += Xi * Xj * D[m]
            out[t, at] = s2 * p if C > 4 + 2 * N else math.sqrt(s2 * p)
            at += 1


@advance.on(Continuous)
def advance_continuous(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, s, U, D, n = state.head, state.s, state.U, state.D, scratch.n
    seconds = elapse(form, state, u, t)
    if scratch.inputs > 0:
        move_inputs(form, state, scratch, seconds)
    status = take_inputs(state, u, t)
    if form.learns > 0.0 and head[SAMPLES] == 0.0:
        begin_given_state(memory, state.memory_state, s, U, D, scratch.room)
    if form.is_timed > 0.0:
        _, moved = time_update(memory, state.memory_state, seconds, view_of(form, state, scratch, 1.0, math.nan))
        status |= moved
    head[SINCE] += seconds
    if head[STARTED] == 0.0:
        begin(state, scratch)
    z = y[t, 0]
    is_measured = abs(z) < HUGE
    peak = max(0.75 * head[PEAK], abs(z)) if is_measured else head[PEAK]
    if not is_measured:
        status |= MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE

    s2 = known_so_far(form, scale, state)
    R = noise.R
    if R > 0.0:
        rounding = square(form.floor * peak) / s2
        if rounding > R:
            status |= FLOORED
        R += rounding

    # predict: the row as if y had stayed where it was; the residual of any other y_k is w (y_k - last) - rest
    last = head[LAST]
    respond(form.c * head[SINCE], scratch.e, scratch.hold, scratch.line)
    decay(scratch.e, state.y, scratch.y)
    decay(scratch.e, state.x, scratch.x)
    for j in range(n):
        scratch.y[j] += last * scratch.hold[j]
    rest = fill_row(form, state, scratch, 0, scratch.h) + dot(scratch.h, s) - last
    w = 1.0 - own_weights(form, state, scratch, 0)
    step = rest / w if w > LEAST else 0.0
    yhat, divisor = last + step, max(w, LEAST)

    # project: the row at the predicted y is w times the derivative of the prediction
    for j in range(n):
        scratch.h[n + j] -= scratch.own[j] * step
    project(U, scratch.h, scratch.f)
    T = predicted_variance(scratch.f, D, R)
    out[t, 2] = s2 * T / (divisor * divisor)

    # detect
    e = z - yhat if is_measured else np.nan
    if is_measured:
        is_measured = admit(gate, divisor * e, scratch.f, D, R, s2, head[IN_A_ROW], head[OBSERVED])
        head[IN_A_ROW] = count_rejections(gate, head[IN_A_ROW], not is_measured)
        status |= 0 if is_measured else REJECTED

    # correct: the row at the measured y
    alarm, surprise = 0.0, np.nan
    if is_measured:
        for j in range(n):
            scratch.h[n + j] -= scratch.own[j] * e
        project(U, scratch.h, scratch.f)
        residual = w * (z - last) - rest
        T = take_in(form, memory, state, scratch, residual, R, noise.R, s2)
        if T > 0.0:
            surprise = residual * residual / (s2 * T)
            head[OBSERVED] += 1.0
            head[LOGDET] += log(T) - 2.0 * log(divisor)
            if form.fades > 0.0:
                state.counts[COUNT], head[CHI2], state.counts[WEIGHT] = count(
                    memory, state.memory_state, state.counts[COUNT], head[CHI2], state.counts[WEIGHT],
                    residual * residual / T,
                )  # fmt: skip
                state.counts[SCORE] -= 0.5 * (log(2.0 * math.pi * s2 * T) + surprise) - log(divisor)
                alarm = found_jump(memory, state.memory_state, state.detector_state)
            else:
                head[CHI2] += residual * residual / T
            rho = outlier_probability(memory, state.memory_state) if form.learns > 0.0 else 0.0
            if rho > SURE:
                is_measured = False  # the straight line passes it by
            elif rho > DOUBTED:  # it ends at what y is on average
                z -= rho * e
            if head[OBSERVED] > form.settle:
                alarm += watch(detector, state.detector_state, residual / math.sqrt(s2 * T), state.detector_state[:0])
        else:
            status |= EXACT
    for j in range(n):
        scratch.y[j] += scratch.line[j] * (z - last if is_measured else step)
    out[t, 0], out[t, 1], out[t, 3] = yhat, e, status
    if out.shape[1] > 4:
        after = known_so_far(form, scale, state)
        write_estimates(form, state, scratch, out, t, divisor, R, after, is_measured)

    if alarm != 0.0:
        view = view_of(form, state, scratch, s2, surprise)
        weight, moved = on_alarm(memory, state.memory_state, Alarm(alarm, -1.0), view)
        status |= moved
        if form.fades > 0.0:
            state.counts[WEIGHT] = weight
    if form.is_timed == 0.0:
        status |= pass_sample(form, memory, state, scratch, s2, surprise)
    out[t, 3] = status

    # keep
    if is_measured:
        for j in range(n):
            state.y[j] = scratch.y[j]
            state.x[j] = scratch.x[j]
        head[LAST], head[SINCE], head[STARTED], head[PEAK] = z, 0.0, 1.0, peak
    head[STATUS] = status
    head[SAMPLES] += 1.0
