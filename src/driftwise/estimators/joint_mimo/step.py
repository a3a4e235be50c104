"""One sample of several outputs: project, detect and correct in order, group by group, then predict."""

import math

import numpy as np

from ...detect.gate import admit, count_rejections
from ...engine.dispatch import advance, kernel, rare, read_like, watch
from ...engine.elementary import log, square
from ...engine.status import BAD_VALUE, EXACT, FLOORED, LOST, MISSING_OUTPUT, REJECTED
from ...engine.ud import entry, measurement_update, predicted_variance, variances
from ...memory.questions import Alarm, View, count, found_jump, on_alarm, outlier_probability, time_update
from ...models.scale import sigma2
from ..common.given_state import (
    COUNT,
    COUNTS,
    SCORE,
    WEIGHT,
    adapt_given_state,
    begin_given_state,
    open_room,
    pass_time_given_state,
    sigma2_of_few,
)
from ..joint.row import HUGE
from ..joint.step import DOUBTED, LIMIT, SURE, take_inputs
from .predict import propagate
from .row import MimoForm, add_row, covariance, gather, make_room, open_group, place, scatter


@kernel
def take_outputs(state, scratch, y, t):
    """Note what is measured at sample t in ``state.status``, with the size of each output."""
    for i in range(state.peak.size):
        value = abs(y[t, i])
        state.peak[i] *= 0.75
        state.status[i] = 0.0
        scratch.z[i] = scratch.spread[i] = 0.0
        if value < HUGE:
            state.peak[i] = max(state.peak[i], value)
            state.top[i] = max(state.top[i], value)
            scratch.z[i] = -y[t, i]
        else:
            state.status[i] = MISSING_OUTPUT if y[t, i] != y[t, i] else MISSING_OUTPUT | BAD_VALUE


@rare
def restart_states(form, state, group, s2):
    """Forget the group's x but not theta: x = 0 with ten times the range of the data as its standard deviation."""
    for j in range(group.first, group.last):
        top = state.top[j]
        for i in range(int(form.x_at[j]), int(form.x_at[j + 1])):
            state.s[i] = 0.0
            state.D[i] = 100.0 * top * top / s2 if top > 0.0 else form.Px[j]
    for c in range(group.N):
        for i in range(min(c, group.n)):
            group.U[c * (c - 1) // 2 + i] = 0.0


@kernel
def check_lost(form, state, scratch, group, s2):
    """A gap so long that the model has lost the state restarts it."""
    for i in range(group.first, group.last):
        if int(state.status[i]) & MISSING_OUTPUT:
            # (still in the row: nothing has been gathered)
            at, p = int(form.x_at[i]) - group.x0, 0.0
            for c in range(at, group.N):
                w = entry(group.U, at, c)
                p += w * w * state.D[group.x0 + c if c < group.n else group.theta0 + c - group.n]
            if not p < LIMIT * (square(state.top[i]) / s2 + form.Px[i] + scratch.R[i]):
                restart_states(form, state, group, s2)
                state.status[i] = int(state.status[i]) | LOST


@rare
def widen_front(form, scratch, group, g, front):
    """Let ``front`` unknowns stand in front of the group's: v alone, or the data in front of v."""
    q, p = int(scratch.q[g]), group.last - group.first
    if q == 0:
        make_room(group.U, group.A, group.s, group.D, group.N, front)
        for i in range(p):
            group.D[front - p + i] = scratch.R[group.first + i]
    else:
        make_room(group.A, group.A, group.s, group.D, q + group.N, front - q)
    scratch.q[g] = front
    if front > p:  # data that other groups or nobody will correct
        for src in range(scratch.z.size):
            if src < group.first or src >= form.outputs:
                set_datum(form, scratch, group, g, src)


@kernel
def set_datum(form, scratch, group, g, src):
    """Let the error of a datum from outside the group stand in its place in front."""
    if scratch.spread[src] > 0.0:
        group.D[place(form, src)] = scratch.spread[src] / scratch.s2[g]


@kernel
def project(form, noise, scratch, group, g, U, i):
    """Fill f = U'h for output i; return its prediction and the variance that products of errors add."""
    q = int(scratch.q[g])
    size = q + group.N
    s, D, f = group.s, group.D, scratch.f
    for c in range(size):
        f[c] = 0.0
    at = q + int(form.x_at[i]) - group.x0
    add_row(U, size, at, 1.0, f)
    yhat, extra = s[at], 0.0
    for b in range(group.blocks.size // 4):
        if group.blocks[4 * b + 2] == -(1.0 + i):
            m, src = q + int(group.blocks[4 * b]), int(group.blocks[4 * b + 3])
            z = scratch.z[src]
            if scratch.spread[src] > 0.0:
                at = place(form, src)
                z += s[at]
                add_row(U, size, at, s[m], f)
                yhat += scratch.s2[g] * covariance(U, D, size, m, at)
                extra += product_variance(form, scratch, group, g, U, i, m, at)
            add_row(U, size, m, z, f)
            yhat += z * s[m]
    if q > 0:
        p = int(form.outputs)
        v = q - (group.last - group.first)
        for j in range(i, group.last):
            weight = noise.W[i * p + j]
            yhat += weight * s[v + j - group.first]
            if weight != 0.0:
                add_row(U, size, v + j - group.first, weight, f)
    return yhat, extra


@rare
def product_variance(form, scratch, group, g, U, i, m, at):
    """Return the covariance of (parameter m) (datum at) with all such products in output i: Isserlis."""
    q = int(scratch.q[g])
    size = q + group.N
    total = 0.0
    for b in range(group.blocks.size // 4):
        src = int(group.blocks[4 * b + 3])
        if group.blocks[4 * b + 2] == -(1.0 + i) and scratch.spread[src] > 0.0:
            other, there = q + int(group.blocks[4 * b]), place(form, src)
            P_mm, P_zz = covariance(U, group.D, size, m, other), covariance(U, group.D, size, at, there)
            P_mz, P_zm = covariance(U, group.D, size, m, there), covariance(U, group.D, size, at, other)
            total += P_mm * P_zz + P_mz * P_zm
    return scratch.s2[g] * total


@kernel
def seen(form, state, group, g):
    """Return how many samples have taught the group's scale."""
    count = -form.spent[g]
    for i in range(group.first, group.last):
        count += state.observed[i]
    return count


@kernel
def known_so_far(form, scale, state, group, g):
    """Return the group's sigma^2; where samples fade and few are left, it may be anything up to the data's own."""
    if form.fades == 0.0:
        return sigma2(scale, seen(form, state, group, g), state.chi2[g])
    return sigma2_of_few(scale, state.counts[COUNTS * g + COUNT], state.chi2[g])


@rare
def begin_memory(form, memory, memory_state, scratch, group):
    """Let the group's memory begin with the prior of its parameters."""
    N = group.N
    room = open_room(scratch.room, group.n, N - group.n)
    begin_given_state(memory, memory_state, group.s[:N], group.U, group.D[:N], room)


@kernel
def take_in(form, memory, memory_state, state, scratch, group, g, U, e, R, usual, s2):
    """Take the innovation e into the group's unknowns, and those in front; return its expected variance."""
    size = int(scratch.q[g]) + group.N
    s, D, f = group.s[:size], group.D[:size], scratch.f[:size]
    if form.learns > 0.0:
        N, weight = group.N - group.n, state.counts[COUNTS * g + WEIGHT]
        room = open_room(scratch.room, size - N, N)
        return adapt_given_state(memory, memory_state, e, R, usual, s, U, D, f, room, s2, weight, math.nan, s[:0], 0.0)
    return measurement_update(s, U, D, f, e, R, scratch.b)


@kernel
def tally(form, memory, memory_state, state, g, i, e, T, s2):
    """Count the sample just taken in; say whether the memory found a jump."""
    gain = e * e / T
    if form.fades == 0.0:
        state.chi2[g] += gain
        return 0.0
    counts = state.counts[COUNTS * g :]
    counts[COUNT], state.chi2[g], counts[WEIGHT] = count(
        memory, memory_state, counts[COUNT], state.chi2[g], counts[WEIGHT], gain
    )
    counts[SCORE] -= 0.5 * (log(2.0 * math.pi * s2 * T) + gain / s2)
    return found_jump(memory, memory_state, state.detector_state[i])


@kernel
def correct_group(form, noise, memory, memory_state, gate, scale, detector, state, scratch, y, out, t, g):
    """Take the group's outputs of sample t, in order."""
    group = open_group(form, state, scratch, g)
    outputs, p = int(form.outputs), group.last - group.first
    front = scratch.z.size + p
    s2 = known_so_far(form, scale, state, group, g)
    scratch.s2[g] = s2
    is_whole = True
    for i in range(group.first, group.last):
        R = noise.R[i]
        if R > 0.0:
            rounding = square(form.floor * state.peak[i]) / s2
            if rounding > R:
                state.status[i] = int(state.status[i]) | FLOORED
            R += rounding
        scratch.R[i] = R
        is_whole = is_whole and not int(state.status[i]) & MISSING_OUTPUT
    for src in range(scratch.z.size):
        is_whole = is_whole and scratch.spread[src] == 0.0
    if not is_whole:
        check_lost(form, state, scratch, group, s2)
    gather(state, group)
    scratch.q[g] = 0.0
    if form.learns > 0.0 and state.samples[0] == 0.0:
        begin_memory(form, memory, memory_state, scratch, group)
    if not is_whole:
        widen_front(form, scratch, group, g, front)
    elif form.light == 0.0:
        widen_front(form, scratch, group, g, p)

    taught = surprise = scratch.alarm[g] = 0.0
    for i in range(group.first, group.last):
        status = int(state.status[i])
        U = group.U if scratch.q[g] == 0.0 else group.A
        yhat, R = project(form, noise, scratch, group, g, U, i)
        q = int(scratch.q[g])
        D, f = group.D[: q + group.N], scratch.f[: q + group.N]
        R += scratch.R[i] if q == 0 else 0.0
        s2 = known_so_far(form, scale, state, group, g)
        is_measured = not status & MISSING_OUTPUT
        e = y[t, i] - yhat if is_measured else np.nan
        if is_measured:
            is_measured = admit(gate, e, f, D, R, s2, state.in_a_row[i], state.observed[i])
            state.in_a_row[i] = count_rejections(gate, state.in_a_row[i], not is_measured)
            status |= 0 if is_measured else REJECTED
        if is_measured:
            T = take_in(form, memory, memory_state, state, scratch, group, g, U, e, R, noise.R[i], s2)
            if T > 0.0:
                taught += 1.0
                surprise += e * e / (s2 * T)
                state.observed[i] += 1.0
                state.logdet[g] += log(T)
                jumped = tally(form, memory, memory_state, state, g, i, e, T, s2)
                scratch.alarm[g] = jumped if jumped != 0.0 else scratch.alarm[g]
                if state.observed[i] > form.settle:
                    alarm = watch(detector, state.detector_state[i], e / math.sqrt(s2 * T), state.detector_state[i, :0])
                    scratch.alarm[g] = alarm if alarm != 0.0 else scratch.alarm[g]
            else:
                status |= EXACT
        else:
            T = predicted_variance(f, D, R)
        state.status[i] = status
        out[t, i], out[t, outputs + i], out[t, 2 * outputs + i] = yhat, e, s2 * T
        rho = outlier_probability(memory, memory_state) if form.learns > 0.0 and is_measured and T > 0.0 else 0.0
        if not is_measured or rho > SURE:
            scratch.spread[i] = s2 * T
            set_output(form, noise, scratch, group, g, i, front)
        elif rho > DOUBTED:
            scratch.z[i], scratch.spread[i] = rho * e - y[t, i], rho * (1.0 - rho) * e * e
            if int(scratch.q[g]) < front:
                widen_front(form, scratch, group, g, front)
            set_datum(form, scratch, group, g, i)
    scratch.surprise[g] = surprise / taught if taught > 0.0 else np.nan


@rare
def set_output(form, noise, scratch, group, g, i, front):
    """Let the error of a missing output stand in its place in front: what it is made of, and its own part."""
    if int(scratch.q[g]) < front:  # the decision of the gate, or the memory, came late
        widen_front(form, scratch, group, g, front)
    yhat, extra = project(form, noise, scratch, group, g, group.A, i)
    at = place(form, i)
    for c in range(at + 1, int(scratch.q[g]) + group.N):
        group.A[c * (c - 1) // 2 + at] = -scratch.f[c]
    group.D[at] = extra
    group.s[at] = 0.0
    scratch.z[i] = -yhat


@kernel
def write(form, scale, state, scratch, out, t):
    """Write the rest of a row of the trace: s(t | t), its spread or P."""
    p, N, C = int(form.outputs), state.D.size, out.shape[1]
    at = 4 * p
    if C == at:
        return
    if C > at + N and C != at + 2 * N:
        for j in range(at + N, C):
            out[t, j] = 0.0
    for g in range(int(form.groups)):
        group = open_group(form, state, scratch, g)
        q = int(scratch.q[g])
        U = group.U if q == 0 else group.A
        D = group.D[: q + group.N]
        s2 = known_so_far(form, scale, state, group, g)
        if C == at + 2 * N:
            variances(U, D, scratch.c)
        for i in range(group.N):
            there = group.x0 + i if i < group.n else group.theta0 + i - group.n
            out[t, at + there] = group.s[q + i]
            if C == at + 2 * N:
                out[t, at + N + there] = math.sqrt(s2 * scratch.c[q + i])
            elif C > at + N:
                for j in range(i + 1):
                    other = group.x0 + j if j < group.n else group.theta0 + j - group.n
                    cov = s2 * covariance(U, D, D.size, q + i, q + j)
                    out[t, at + N + there * (there + 1) // 2 + other] = cov


@kernel
def view_of(form, state, scratch, group, g, D):
    """Return what the group's memory sees between two samples."""
    nothing = D[:0]
    weight = state.counts[COUNTS * g + WEIGHT] if form.fades > 0.0 else seen(form, state, group, g) + form.spent[g]
    return View(
        group.n, group.s, group.U, D, nothing, scratch.f, scratch.c, scratch.b,
        scratch.s2[g], weight, scratch.surprise[g], 0.0, nothing, nothing, math.nan, nothing, 0.0,
    )  # fmt: skip


@kernel
def pass_time(form, memory, memory_state, state, scratch, group, g, D):
    """Answer an alarm, and forget; return status bits."""
    status = 0
    if scratch.alarm[g] != 0.0:
        alarm = Alarm(scratch.alarm[g], -1.0)
        weight, status = on_alarm(memory, memory_state, alarm, view_of(form, state, scratch, group, g, D))
        if form.fades > 0.0:
            state.counts[COUNTS * g + WEIGHT] = weight
    if form.learns > 0.0:
        room, weight = open_room(scratch.room, group.n, group.N - group.n), state.counts[COUNTS * g + WEIGHT]
        s, s2, surprise = group.s[: group.N], scratch.s2[g], scratch.surprise[g]
        lam, moved = pass_time_given_state(memory, memory_state, s, group.U, D, room, s2, weight, surprise)
    else:
        lam, moved = time_update(memory, memory_state, 1.0, view_of(form, state, scratch, group, g, D))
    if form.fades > 0.0 and lam < 1.0:
        state.counts[COUNTS * g + COUNT] *= lam
        state.counts[COUNTS * g + WEIGHT] *= lam
        state.chi2[g] *= lam
        if form.forgets_state > 0.0:
            for i in range(group.n):
                D[i] /= lam
    return status | moved


@advance.on(MimoForm)
def advance_mimo_form(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    p, k, groups = int(form.outputs), int(form.inputs), int(form.groups)
    held = take_inputs(state, k, u, t)
    take_outputs(state, scratch, y, t)
    for l in range(k):
        scratch.z[p + l] = state.held[l]
        scratch.spread[p + l] = state.input_variance[l]
    for g in range(groups):
        own, _ = read_like(memory, form.spec, int(form.spec_at[g]))
        kept = state.memory_state[int(form.memory_at[g]) : int(form.memory_at[g + 1])]
        correct_group(form, noise, own, kept, gate, scale, detector, state, scratch, y, out, t, g)
    write(form, scale, state, scratch, out, t)
    for g in range(groups):
        group = open_group(form, state, scratch, g)
        is_known = True
        for src in range(p + k):
            is_known = is_known and scratch.spread[src] == 0.0
        if not is_known:
            if int(scratch.q[g]) < p + k + group.last - group.first:
                widen_front(form, scratch, group, g, p + k + group.last - group.first)
            for src in range(group.last, p):
                set_datum(form, scratch, group, g, src)
        propagate(form, noise, scratch, group, g)
        D = group.D[: group.N]
        own, _ = read_like(memory, form.spec, int(form.spec_at[g]))
        kept = state.memory_state[int(form.memory_at[g]) : int(form.memory_at[g + 1])]
        moved = pass_time(form, own, kept, state, scratch, group, g, D)
        scatter(state, group)
        for i in range(group.first, group.last):
            state.status[i] = int(state.status[i]) | held | moved
            out[t, 3 * p + i] = state.status[i]
    state.samples[0] += 1.0
