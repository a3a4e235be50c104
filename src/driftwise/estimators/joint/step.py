"""Theorem 3 of Salut et al. (1979) on U D U' factors: one sample of the joint filter, in the order of the book."""

import math

import numpy as np

from ...detect.gate import admit, count_rejections
from ...detect.watch import WHICH
from ...engine.dispatch import advance, choice, kernel, rare, watch
from ...engine.elementary import log, square
from ...engine.status import BAD_VALUE, EXACT, FLOORED, LOST, MISSING_INPUT, MISSING_OUTPUT, REJECTED
from ...engine.ud import entry, measurement_update, predicted_variance, variance, variances, widen_along
from ...memory.questions import Alarm, View, begin, count, found_jump, on_alarm, outlier_probability, time_update
from ...models.noise import Coloured, Sensor, Unknown, White, held_back
from ...models.scale import sigma2
from ..common.fresh import pass_fresh
from ..common.given_state import (
    COUNT,
    SCORE,
    WEIGHT,
    adapt_given_state,
    begin_given_state,
    pass_time_given_state,
    separate,
    sigma2_of_few,
)
from .invertible import restrain
from .predict import propagate, release
from .row import (
    CHI2,
    HUGE,
    IN_A_ROW,
    LOGDET,
    OBSERVED,
    PEAK,
    SAMPLES,
    STATUS,
    TOP,
    USED_E,
    USED_R,
    USED_T,
    USED_Y,
    Form,
    predict_output,
    project,
)  # fmt: skip

DOUBTED, SURE = 0.05, 0.92  # probability of an outlier from which y is not relied on as it is, and not at all
SUSPECTED = 1e-3  # sigma^2 before it is known, in that of the data: noise of a thirtieth of what y moves by
LIMIT = 1e8  # a variance so many times that of all data seen says that the state is lost


# --- what drifts, the parameters of a regression or those of a plant with a memory of its own -------------------------


@choice
def state_is_given(noise):
    """Say whether outputs and inputs give the state, once the parameters are known: with no memory of older ones."""


@state_is_given.on(White, Coloured, Unknown)
def state_is_given_white(noise):
    return True


@state_is_given.on(Sensor)
def state_is_given_sensor(noise):
    return False


@kernel
def take_inputs(state, inputs, u, t):
    """Take the inputs of sample t into ``state.held``, a missing one as predicted; return a status."""
    status = 0
    for l in range(inputs):
        value = u[t, l]
        if abs(value) < HUGE:
            hold_input(state, l, value)
        else:
            status |= MISSING_INPUT if value != value else MISSING_INPUT | BAD_VALUE
            predict_input(state, l)
    return status


@kernel
def hold_input(state, l, value):
    """Hold a measured input, and count what `predict_input` goes by."""
    if state.known[l] > 0.0:
        step = value - state.held[l]
        state.steps[l] += step * step
    state.known[l] += 1.0
    state.sums[l] += value
    state.squares[l] += value * value
    state.held[l] = value
    state.input_variance[l] = 0.0


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
        state.input_variance[l] = rho * rho * state.input_variance[l] + (1.0 - rho * rho) * spread


@kernel
def known_so_far(form, scale, state):
    """Return sigma^2; where samples fade, and those that are left are few, it may be anything up to the data's own."""
    head = state.head
    if form.fades == 0.0:
        return sigma2(scale, head[OBSERVED], head[CHI2])
    return sigma2_of_few(scale, state.counts[COUNT], head[CHI2])


@kernel
def shown_so_far(form, noise, scale, state, s2):
    """Return sigma^2 for what is quadratic in it, the spread of products of unknowns: the least that data have shown.

    Where the state follows its own past, the data's own variance in its place would make them noisier than any noise,
    teach nothing of it, and so stay. Until a sample counts innovations have shown too little, since they are smaller
    than a wide prior lets expect: then it is SUSPECTED at least, or products would be as good as none.
    """
    if form.fades == 0.0 or state_is_given(noise):
        return s2
    least = sigma2(scale, state.counts[COUNT], state.head[CHI2])
    return max(least, SUSPECTED) if state.counts[COUNT] < 1.0 else least


@kernel
def write(form, noise, scale, out, t, state, scratch, yhat, e, T, status):
    """Write one row of the trace: prediction, innovation, its variance, status, then s, its spread or P."""
    N, C, n = state.D.size, out.shape[1], scratch.n
    out[t, 0], out[t, 1], out[t, 2], out[t, 3] = yhat, e, T, status
    if C >= 4 + N:
        s2 = known_so_far(form, scale, state)
        for i in range(N):
            out[t, 4 + i] = state.s[i]
        d, free = n * (scratch.inputs + 2), held_back(noise, state.head[OBSERVED] - 1.0, s2)
        if free > 0.0 and state.D[d] > 0.0:  # freed already, and nothing seen since
            free = 0.0
    if C == 4 + 2 * N:
        variances(state.U, state.D, scratch.c)
        if free > 0.0:
            for i in range(d, d + n):
                scratch.c[i] += free
        for i in range(N):
            out[t, 4 + N + i] = math.sqrt(s2 * scratch.c[i])
    elif C > 4 + N:
        at = 4 + N
        for j in range(N):
            for i in range(j + 1):
                p = 0.0
                for k in range(j, N):
                    p += entry(state.U, i, k) * entry(state.U, j, k) * state.D[k]
                p += free if i == j and d <= i < d + n else 0.0
                out[t, at] = s2 * p
                at += 1


@rare
def part_from_parameters(U, D, n, a):
    """Let x be what it is, but tell nothing of theta, which has jumped since: the old one made it."""
    for c in range(n, D.size):
        at = c * (c - 1) // 2
        for i in range(n):
            a[i] = U[at + i]
            U[at + i] = 0.0
        widen_along(U[: n * (n - 1) // 2], D[:n], a, D[c], n - 1)


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
    for i in range(1, state.fresh.size):
        state.fresh[i] = 0.0


# --- the step ---------------------------------------------------------------------------------------------


@kernel
def view_of(form, state, scratch, s2, surprise):
    """Return what the memory sees between two samples."""
    s, weight = state.s, state.counts[WEIGHT] if form.fades > 0.0 else state.head[OBSERVED]
    return View(
        scratch.n, s, state.U, state.D, s[:0], scratch.f, scratch.c, scratch.b,
        s2, weight, surprise, 0.0, s[:0], s[:0], math.nan, s[:0], 0.0,
    )  # fmt: skip


@kernel
def begin_memory(form, memory, state, scratch):
    """Let the memory begin with the prior."""
    if form.learns > 0.0:
        begin_given_state(memory, state.memory_state, state.s, state.U, state.D, scratch.room)
    else:
        begin(memory, state.memory_state, view_of(form, state, scratch, 1.0, np.nan))


@kernel
def take_in(form, memory, state, scratch, y, e, R, usual, s2):
    """Take the innovation e of y into s and U D U'; return the variance T it was expected to have."""
    if form.learns > 0.0:
        weight, has_past = state.counts[WEIGHT], 1.0 if state.fresh.size > 0 else 0.0
        return adapt_given_state(
            memory, state.memory_state, e, R, usual, state.s, state.U, state.D, scratch.f, scratch.room, s2, weight, y,
            state.fresh, has_past,
        )  # fmt: skip
    return measurement_update(state.s, state.U, state.D, scratch.f, e, R, scratch.b)


@kernel
def slope_of(form, room, spread):
    """Fill ``room.b`` with the slopes of the whitened innovation by the parameters, and return how many are wanted."""
    if form.slopes == 0.0:
        return 0
    for i in range(room.psi.size):
        room.b[i] = room.psi[i] / spread
    return room.psi.size


@kernel
def fade(form, state, n, lam):
    """Let the sums over the past shrink, and what is known of the state given the parameters if it is to."""
    state.counts[WEIGHT] *= lam
    state.counts[COUNT] *= lam
    state.head[CHI2] *= lam
    if form.forgets_state > 0.0:
        for i in range(n):
            state.D[i] /= lam


@advance.on(Form)
@kernel
def step(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    """Take sample t: predict, project, detect, correct, predict."""
    head, s, U, D, n = state.head, state.s, state.U, state.D, scratch.n
    if head[SAMPLES] == 0.0:
        begin_memory(form, memory, state, scratch)
    status = take_inputs(state, scratch.inputs, u, t)
    z = y[t, 0]
    head[PEAK] *= 0.75
    is_measured = abs(z) < HUGE
    if is_measured:
        head[PEAK] = max(head[PEAK], abs(z))
        head[TOP] = max(head[TOP], abs(z))
    else:
        status |= MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE

    # project
    s2 = known_so_far(form, scale, state)
    shown = shown_so_far(form, noise, scale, state, s2)
    R = noise.R
    if R > 0.0:
        rounding = square(form.floor * head[PEAK]) / s2
        if rounding > R:
            status |= FLOORED
        R += rounding
    yhat = predict_output(s, state.held, scratch.direct, scratch.offset)
    project(U, D.size, state.held, scratch.direct, scratch.offset, scratch.f)
    Rn = R
    for l in range(scratch.direct):
        if state.input_variance[l] > 0.0:  # the direct term passes the error of a held input on to y
            i = D.size - scratch.direct - scratch.offset + l
            R += state.input_variance[l] * (s[i] * s[i] / s2 + variance(U, D, i))

    if not is_measured and not predicted_variance(scratch.f, D, R) < LIMIT * (square(head[TOP]) / s2 + form.Px + R):
        restart_state(state, n, form.Px, s2)  # a gap so long that the model has lost the state
        status |= LOST
        yhat = predict_output(s, state.held, scratch.direct, scratch.offset)
        project(U, D.size, state.held, scratch.direct, scratch.offset, scratch.f)

    # detect
    e = z - yhat if is_measured else np.nan
    if is_measured:
        is_measured = admit(gate, e, scratch.f, D, R, s2, head[IN_A_ROW], head[OBSERVED])
        head[IN_A_ROW] = count_rejections(gate, head[IN_A_ROW], not is_measured)
        status |= 0 if is_measured else REJECTED

    # correct
    white, alarm = np.nan, 0.0
    scratch.memo[USED_T] = 0.0
    if form.slopes > 0.0 and is_measured:
        separate(U, scratch.f, scratch.room)
    if is_measured:
        T = take_in(form, memory, state, scratch, z, e, R, noise.R, s2)
        if T > 0.0:
            white = e / math.sqrt(s2 * T)
            restrain(noise, state, scratch)
            scratch.memo[USED_T], scratch.memo[USED_R], scratch.memo[USED_E] = T, R, e
            head[OBSERVED] += 1.0
            head[LOGDET] += log(T)
            if form.fades > 0.0:
                chi2 = head[CHI2] + e * e / T
                state.counts[COUNT], head[CHI2], state.counts[WEIGHT] = count(
                    memory, state.memory_state, state.counts[COUNT], head[CHI2], state.counts[WEIGHT], e * e / T
                )
                if state.counts[COUNT] < 1.0 and not state_is_given(noise):
                    head[CHI2] = min(chi2, head[CHI2])
                state.counts[SCORE] -= 0.5 * (log(2.0 * math.pi * s2 * T) + white * white)
                alarm = found_jump(memory, state.memory_state, state.detector_state)
                if alarm != 0.0 and not state_is_given(noise) and state.fresh.size == 0:
                    part_from_parameters(U, D, n, scratch.c)
            else:
                head[CHI2] += e * e / T
        else:
            status |= EXACT
    else:
        T = predicted_variance(scratch.f, D, R)
    write(form, noise, scale, out, t, state, scratch, yhat, e, s2 * T, status)

    # predict
    rho = outlier_probability(memory, state.memory_state) if form.learns > 0.0 and white == white else 0.0
    doubt, spread, is_known = 0.0, T, is_measured and not rho > SURE
    if rho > SURE:  # as good as missing: what y would have been is what is predicted, now
        yhat = predict_output(s, state.held, scratch.direct, scratch.offset)
        project(U, D.size, state.held, scratch.direct, scratch.offset, scratch.f)
        spread = predicted_variance(scratch.f, D, R)
    elif rho > DOUBTED:  # mean and variance of what it may be, itself or what was predicted
        z, doubt = z - rho * e, rho * (1.0 - rho) * e * e
    propagate(noise, state, scratch, z, yhat, Rn, spread, shown, is_known, status & MISSING_INPUT != 0, R - Rn, doubt)
    if state.fresh.size > 0:
        pass_fresh(state.fresh, s, n, scratch.blocks, scratch.memo[USED_Y], state.held)
    if white == white:
        release(noise, state, scratch, s2)
    if white == white and head[OBSERVED] > form.settle:
        slopes = slope_of(form, scratch.room, math.sqrt(s2 * T))
        alarm += watch(detector, state.detector_state, white, scratch.room.b[:slopes])
    view = view_of(form, state, scratch, s2, white * white)
    if alarm != 0.0:
        found = Alarm(alarm, state.detector_state[WHICH] if form.slopes > 0.0 else -1.0)
        weight, moved = on_alarm(memory, state.memory_state, found, view)
        status |= moved
        if form.fades > 0.0:
            state.counts[WEIGHT] = weight
            view = view_of(form, state, scratch, s2, white * white)
    if form.learns > 0.0 and state_is_given(noise):
        weight, surprise = state.counts[WEIGHT], white * white
        lam, moved = pass_time_given_state(memory, state.memory_state, s, U, D, scratch.room, s2, weight, surprise)
    else:
        lam, moved = time_update(memory, state.memory_state, 1.0, view)
    status |= moved
    if form.fades > 0.0 and lam < 1.0:
        fade(form, state, n, lam)
    out[t, 3] = status
    head[STATUS] = status
    head[SAMPLES] += 1.0
