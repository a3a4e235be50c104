"""One sample of the joint filter of state and parameters: predict, project, correct output by output, detect, forget.

What is known of [x; theta] is N(s, U D U'), the parameters last. With F and S the slopes of x(t+1) by x and by theta,

    x <- f(x, u, theta),   U_x,theta <- F U_x,theta + S U_theta,theta,   U_xx D_x U_xx' <- F U_xx D_x U_xx' F' + Q:

the parameters stay what they are, so only the state is made triangular again. Outputs are in units of their noise.
"""

import math

from ...detect.gate import admit, count_rejections
from ...detect.watch import SINCE as SINCE_OF
from ...detect.watch import STATISTIC as STATISTIC_OF
from ...detect.watch import WHICH as WHICH_OF
from ...engine.dispatch import advance, kernel, rare, watch
from ...engine.elementary import log
from ...engine.status import (
    AT_EDGE,
    BAD_VALUE,
    CURVED,
    EXACT,
    MISSING_OUTPUT,
    REJECTED,
    UNDEFINED,
)
from ...engine.ud import (
    covariances,
    measurement_update,
    predicted_variance,
    project,
    variance,
    variances,
)
from ...memory.questions import Alarm, View, begin, count, found_jump, on_alarm, time_update
from ...models.formula_kernels import show
from ...models.scale import freedom, sigma2
from ..adaptive_gain.step import take_inputs
from ..common.given_state import (
    COUNT,
    WEIGHT,
    adapt_given_state,
    begin_given_state,
    pass_time_given_state,
    separate,
    sigma2_of_few,
)
from ..joint.row import HUGE
from ..joint.step import part_from_parameters, slope_of
from ..state_space.step import log_density
from . import row
from .colour import add_output, take_colour
from .gain_slopes import (
    differentiate_gain,
    differentiate_outputs,
    find_slopes,
    is_wanted,
    move_with_gain,
)
from .predict import predict
from .row import GreyBoxForm, room_of
from .transform import LOGISTIC, in_units

BENDS = 0.5  # of one deviation of a parameter what a record bends over it, from which bars are not believed
TURNS = 6  # how often formulas are taken anew where an output is taken in, if they bend
FAR_OFF = 9.0  # squared deviations of a surprise that moves logarithms beyond where they are straight
# Of drawn plants whose inputs rest while the start is fitted, 9 and 6 hold most parameters within their bars: of 4, 9,
# 25 and never, and of 2, 3, 6 and 12 turns.
FAR, STEEP, LONG = 4.0, 4.0, 50.0  # deviations from the prior, or on the logistic scale, that are its edge; samples


@kernel
def known_so_far(form, scale, state):
    """Return sigma^2; where samples fade, and those that are left are few, it may be anything up to the data's own."""
    if form.fades == 0.0:
        return sigma2(scale, state.head[row.OBSERVED], state.head[row.CHI2])
    return sigma2_of_few(scale, state.counts[COUNT], state.head[row.CHI2])


@kernel
def view_of(form, s, state, scratch, s2, surprise):
    """Return what the memory sees between two samples."""
    weight = state.counts[WEIGHT] if form.fades > 0.0 else state.head[row.OBSERVED]
    return View(
        int(form.n), s, state.U, state.D, s[:0], scratch.f, scratch.c, scratch.b,
        s2, weight, surprise, 0.0, s[:0], s[:0], math.nan, s[:0], 0.0,
    )  # fmt: skip


@kernel
def begin_memory(form, memory, s, state, scratch):
    """Let the memory begin with what is known now."""
    state.head[row.IS_NEW] = 0.0
    for i in range(state.memory_state.size):
        state.memory_state[i] = 0.0
    if form.learns > 0.0:
        begin_given_state(memory, state.memory_state, s, state.U, state.D, room_of(form, scratch))
    else:
        begin(memory, state.memory_state, view_of(form, s, state, scratch, 1.0, math.nan))


# --- outputs ------------------------------------------------------------------------------------------------


@kernel
def show_at(form, plant, s, state, scratch):
    """Fill the outputs, and their slopes, at a point."""
    n = int(form.n)
    in_units(form, s[n:], scratch.values, scratch.rates)
    show(plant, s[:n], state.held, scratch.values, scratch.y, scratch.rows)


@kernel
def row_of(form, state, scratch, i):
    """Fill psi, the slopes of output i by state and parameters, in units of its noise."""
    n, k = int(form.n), int(form.inputs)
    for l in range(n):
        scratch.psi[l] = scratch.rows[i, l] / state.noise[i]
    for j in range(int(form.m)):
        scratch.psi[n + j] = scratch.rows[i, n + k + j] * scratch.rates[j] / state.noise[i]


@kernel
def predict_outputs(form, plant, scale, s, state, scratch, y, out, t):
    """Write each output's prediction by the samples before, the innovation, its variance, and what is missing."""
    p, s2 = int(form.outputs), known_so_far(form, scale, state)
    if is_wanted(form, state.D) > 0.0:
        find_slopes(form, state, room_of(form, scratch))
        differentiate_outputs(form, plant, s, state, room_of(form, scratch), scratch)
    show_at(form, plant, s, state, scratch)
    for i in range(p):
        value, status, r = y[t, i], 0, state.noise[i]
        row_of(form, state, scratch, i)
        project(state.U, scratch.psi, scratch.f)
        T = predicted_variance(scratch.f, state.D, 1.0)
        if not abs(value) < HUGE:
            status = MISSING_OUTPUT if value != value else MISSING_OUTPUT | BAD_VALUE
            value = math.nan
        if not (abs(scratch.y[i]) < HUGE and T < HUGE):  # a formula gave no number
            status |= UNDEFINED
            out[t, i], out[t, p + i], out[t, 2 * p + i] = math.nan, math.nan, math.nan
        else:
            out[t, i], out[t, p + i], out[t, 2 * p + i] = scratch.y[i], value - scratch.y[i], s2 * T * r * r
        out[t, 3 * p + i] = status


@kernel
def bends(form, state):
    """Return how much the record bends over one deviation of the parameter for which that is most."""
    n, most = int(form.n), 0.0
    for j in range(state.bend.size):
        most = max(most, state.bend[j] * math.sqrt(variance(state.U, state.D, n + j)))
    return most


@rare
def take_formulas_anew(form, plant, s, state, scratch, z, i):
    """Fill psi at where output i draws the estimate (an iterated update); return its innovation in units of noise."""
    N, e = s.size, 0.0
    for l in range(N):
        scratch.point[l] = s[l]
    for turn in range(TURNS):
        show_at(form, plant, scratch.point, state, scratch)
        row_of(form, state, scratch, i)
        project(state.U, scratch.psi, scratch.f)
        e = (z - scratch.y[i]) / state.noise[i]
        for l in range(N):
            e -= scratch.psi[l] * (s[l] - scratch.point[l])
        if turn < TURNS - 1:
            T = predicted_variance(scratch.f, state.D, 1.0)
            covariances(state.U, state.D, scratch.f, scratch.b)
            for l in range(N):
                scratch.point[l] = s[l] + scratch.b[l] * (e / T)
    return e


@kernel
def take_in(form, memory, s, state, scratch, e, s2):
    """Take the innovation e into s and U D U'; return the variance T it was expected to have."""
    if form.learns > 0.0:
        room, weight = room_of(form, scratch), state.counts[WEIGHT]
        memory_state, U, D, f = state.memory_state, state.U, state.D, scratch.f
        return adapt_given_state(memory, memory_state, e, 1.0, 1.0, s, U, D, f, room, s2, weight, math.nan, s[:0], 1.0)
    return measurement_update(s, state.U, state.D, scratch.f, e, 1.0, scratch.b)


@kernel
def correct(form, plant, memory, gate, scale, detector, s, state, scratch, y, out, t):
    """Take the outputs of a sample in, one after the other; return alarm, mean squared surprise, log density."""
    head, p, alarm, surprise, density, taken = state.head, int(form.outputs), 0.0, 0.0, 0.0, 0.0
    is_bent, C, first = bends(form, state) > BENDS, out.shape[1], 4 * p + 4
    for j in range(scratch.c_part.size):
        scratch.c_part[j], scratch.v_part[j] = 0.0, 0.0
    for i in range(p):
        if C > first:
            out[t, first + i], out[t, first + p + i] = math.nan, math.nan
        if int(out[t, 3 * p + i]) & (MISSING_OUTPUT | UNDEFINED):
            continue
        s2, r = known_so_far(form, scale, state), state.noise[i]
        row_of(form, state, scratch, i)
        project(state.U, scratch.psi, scratch.f)
        e = (y[t, i] - out[t, i]) / r
        if taken > 0.0:  # those before have moved the estimate
            for l in range(s.size):
                e -= scratch.psi[l] * (s[l] - scratch.point[l])
        else:
            for l in range(s.size):
                scratch.point[l] = s[l]
        is_believed = admit(gate, e, scratch.f, state.D, 1.0, s2, state.in_a_row[i], head[row.OBSERVED])
        state.in_a_row[i] = count_rejections(gate, state.in_a_row[i], not is_believed)
        if not is_believed:
            out[t, 3 * p + i] = REJECTED
            continue
        if p == 1 and (is_bent or e * e > FAR_OFF * s2 * predicted_variance(scratch.f, state.D, 1.0)):
            e = take_formulas_anew(form, plant, s, state, scratch, y[t, i], i)
        if form.slopes > 0.0:
            separate(state.U, scratch.f, room_of(form, scratch))
        own = predicted_variance(scratch.f[: int(form.n)], state.D[: int(form.n)], 1.0)
        is_exact = is_wanted(form, state.D)
        if is_exact > 0.0:
            differentiate_gain(form, state, scratch, i, own)
        T = take_in(form, memory, s, state, scratch, e, s2)
        if not T > 0.0:
            out[t, 3 * p + i] = EXACT
            continue
        if C > first:
            out[t, first + i], out[t, first + p + i] = e * r, s2 * T * r * r
        taken += 1.0
        white, gain = e / math.sqrt(s2 * T), e * e / T
        surprise += white * white
        if form.colours > 0.0:
            add_output(state, scratch, int(form.n), i, white, own)
        if form.fades > 0.0:
            density -= 0.5 * (log(2.0 * math.pi * s2 * T) + white * white) + log(r)
            state.counts[COUNT], head[row.CHI2], state.counts[WEIGHT] = count(
                memory, state.memory_state, state.counts[COUNT], head[row.CHI2], state.counts[WEIGHT], gain
            )
            jumped = found_jump(memory, state.memory_state, state.detector_state)
            if jumped != 0.0:
                part_from_parameters(state.U, state.D, int(form.n), scratch.c)
                alarm = jumped
        else:
            density += log_density(scale, head[row.OBSERVED], head[row.CHI2], e, T) - log(r)
            head[row.CHI2] += gain
        head[row.OBSERVED] += 1.0
        if head[row.OBSERVED] > form.settle:
            room = room_of(form, scratch)
            slopes = slope_of(form, room, math.sqrt(s2 * T))
            found = watch(detector, state.detector_state, white, room.b[:slopes])
            alarm = found if found != 0.0 else alarm
        if is_exact > 0.0:
            count_of = state.counts[COUNT] if form.fades > 0.0 else head[row.OBSERVED]
            move_with_gain(form, s, state, room_of(form, scratch), scratch, e, own, T, s2, freedom(scale, count_of))
    head[row.SCORE] += density
    if form.colours > 0.0 and taken > 0.0:
        take_colour(form, state, scratch)
    return alarm, surprise / taken if taken > 0.0 else math.nan, density


@kernel
def pass_time(form, memory, alarm, surprise, elapsed, s, state, scratch, s2):
    """Answer an alarm, and forget; return status bits."""
    status = 0
    if alarm != 0.0:
        found = Alarm(alarm, state.detector_state[WHICH_OF] if form.slopes > 0.0 else -1.0)
        weight, status = on_alarm(memory, state.memory_state, found, view_of(form, s, state, scratch, s2, surprise))
        if form.fades > 0.0:
            state.counts[WEIGHT] = weight
    if form.learns > 0.0:
        lam, moved = pass_time_given_state(
            memory, state.memory_state, s, state.U, state.D, room_of(form, scratch), s2, state.counts[WEIGHT], surprise
        )
    else:
        lam, moved = time_update(memory, state.memory_state, elapsed, view_of(form, s, state, scratch, s2, surprise))
    if form.fades > 0.0 and lam < 1.0:
        state.counts[WEIGHT] *= lam
        state.counts[COUNT] *= lam
        state.head[row.CHI2] *= lam
    return status | moved


@kernel
def at_edge(form, theta, state):
    """Count samples with a parameter at the edge of what its prior allows; return a status where that is for long."""
    far = 0.0
    for j in range(theta.size):
        limit = STEEP if form.kinds[j] == LOGISTIC else FAR * form.spread[j]
        size = abs(theta[j]) if form.kinds[j] == LOGISTIC else abs(theta[j] - form.start[int(form.n) + j])
        far = 1.0 if size > limit else far
    state.head[row.EDGE] = state.head[row.EDGE] + 1.0 if far > 0.0 else 0.0
    return AT_EDGE if state.head[row.EDGE] > LONG else 0


@kernel
def write(form, scale, s, state, scratch, out, t):
    """Write what is known behind the columns of the outputs, and its deviations."""
    N, C, first = s.size, out.shape[1], 6 * int(form.outputs) + 4
    if C < first + N:
        return
    s2 = known_so_far(form, scale, state)
    for i in range(N):
        out[t, first + i] = s[i]
    if C > first + N:
        variances(state.U, state.D, scratch.c)
        for i in range(N):
            wide = state.wide[i - int(form.n)] if i >= int(form.n) else 1.0
            out[t, first + N + i] = math.sqrt(s2 * wide * scratch.c[i])


@advance.on(GreyBoxForm)
def advance_grey_box(form, plant, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, s, n, k, p, status = state.head, state.s, int(form.n), int(form.inputs), int(form.outputs), 0
    stamp = u[t, k] if u.shape[1] > k else math.nan
    if head[row.IS_NEW] > 0.0 or head[row.SAMPLES] == 0.0:
        begin_memory(form, memory, s, state, scratch)

    # predict
    if head[row.SAMPLES] > 0.0:
        seconds = form.dt if stamp != stamp else stamp - head[row.TIME]
        head[row.TIME] += seconds
        if form.is_timed > 0.0:
            view = view_of(form, s, state, scratch, known_so_far(form, scale, state), math.nan)
            _, moved = time_update(memory, state.memory_state, seconds, view)
            status |= moved
        if seconds > 0.0:
            status |= predict(form, plant, seconds, s, state, scratch)
    else:
        head[row.TIME] = 0.0 if stamp != stamp else stamp
    status |= take_inputs(state, u, t)

    # project, correct and detect
    predict_outputs(form, plant, scale, s, state, scratch, y, out, t)
    s2 = known_so_far(form, scale, state)
    alarm, surprise, density = correct(form, plant, memory, gate, scale, detector, s, state, scratch, y, out, t)
    status |= at_edge(form, s[n:], state)
    if bends(form, state) > BENDS:
        status |= CURVED
    write(form, scale, s, state, scratch, out, t)

    # forget
    C, first = out.shape[1], 4 * p
    if C > first:
        out[t, first], out[t, first + 3] = state.detector_state[STATISTIC_OF], density
        out[t, first + 1] = alarm * max(state.detector_state[SINCE_OF], 1.0)
        out[t, first + 2] = state.detector_state[WHICH_OF] if form.slopes > 0.0 else -1.0
    elapsed = 0.0 if form.is_timed > 0.0 else 1.0
    status |= pass_time(form, memory, alarm, surprise, elapsed, s, state, scratch, s2)
    for i in range(p):
        out[t, 3 * p + i] = int(out[t, 3 * p + i]) | status
        head[row.STATUS] = out[t, 3 * p + i]
    head[row.READY] = 1.0
    head[row.SAMPLES] += 1.0
