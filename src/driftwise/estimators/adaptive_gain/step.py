"""One sample of the adaptive gain: predict, project, correct, bound, detect, respond, forget."""

import math

import numpy as np

from ...detect.gate import admit, count_rejections
from ...detect.watch import SINCE, STATISTIC, WHICH, watch
from ...engine.dense import dot
from ...engine.dispatch import advance, kernel, listens
from ...engine.elementary import log
from ...engine.status import BAD_VALUE, EXACT, LOST, MISSING_INPUT, MISSING_OUTPUT, PROJECTED, REJECTED, SKIPPED
from ...engine.ud import entry, predicted_variance
from ...memory.questions import Alarm, View, adapt, begin, count, found_jump, on_alarm, time_update
from ...models.stability import is_inside
from ..arx.row import CHI2, COUNT, HUGE, IN_A_ROW, LOGDET, OBSERVED, SAMPLES, SCORE, STATUS, WEIGHT
from ..arx.step import project
from .row import COLUMNS, INNOVATION, PROBES, PULL, GainForm

HALVINGS, LOG_2PI = 30, math.log(2.0 * math.pi)


@kernel
def move(form, x, u, spare):
    """x <- Phi x + B u."""
    n, k = x.size, u.size
    for i in range(n):
        spare[i] = dot(form.Phi[i * n : (i + 1) * n], x) + dot(form.B[i * k : (i + 1) * k], u)
    for i in range(n):
        x[i] = spare[i]


@kernel
def take_inputs(state, u, t):
    """Take the inputs of sample t, a missing one at its last value; return a status."""
    status = 0
    for l in range(state.held.size):
        if abs(u[t, l]) < HUGE:
            state.held[l] = u[t, l]
        else:
            status |= MISSING_INPUT if u[t, l] != u[t, l] else MISSING_INPUT | BAD_VALUE
    return status


@kernel
def find_again(state):
    """Start again from x = 0 where a gap, or a filter left unstable, let x or its gradient go; return a status."""
    most = 0.0
    for i in range(state.x.size):
        most = max(most, abs(state.x[i]))
        for j in range(state.x.size):
            most = max(most, abs(state.W[i, j]))
        for m in range(state.probes.shape[0]):
            most = max(most, abs(state.probes[m, i]))
    if most < HUGE:
        return 0
    for i in range(state.x.size):
        state.x[i] = 0.0
        for j in range(state.x.size):
            state.W[i, j] = 0.0
        for m in range(state.probes.shape[0]):
            state.probes[m, i] = 0.0
    return LOST


@kernel
def bound(form, K, old, scratch):
    """Keep the filter stable: clip H K (scalar state), or halve the step until its poles lie inside."""
    if form.radius == 0.0:
        gain = form.H[0] * K[0]
        if form.low <= gain <= form.high or form.low == -np.inf:  # no quotient is waited for
            return 0
        K[0] = min(max(gain, form.low), form.high) / form.H[0]
        return PROJECTED
    n = K.size
    for turn in range(HALVINGS):
        for i in range(n):
            scratch.polynomial[i] = form.poles[i] + dot(form.moves[i * n : (i + 1) * n], K)
        if is_inside(scratch.polynomial, form.radius, scratch.p, scratch.q):
            return PROJECTED if turn > 0 else 0
        for i in range(n):
            K[i] = 0.5 * (K[i] + old[i])
    for i in range(n):
        K[i] = old[i]
    return PROJECTED


@kernel
def view_of(form, state, scratch, s, surprise, strength):
    """Return what the memory sees; ``strength`` is how far an alarm lets K move again."""
    return View(
        0, state.theta, state.U, state.D, scratch.psi, scratch.f, scratch.b, scratch.c,
        s, state.head[WEIGHT], surprise, strength, form.cap, scratch.psi, math.nan, form.cap[:0], 0.0,
    )  # fmt: skip


@kernel
def compare(form, state, z, e, c, ratios):
    """Fill in the log likelihood ratio of each probe against the filter, whose innovation is e."""
    for m in range(ratios.size):
        other = z - dot(form.H, state.probes[m])
        ratios[m] = (e * e - other * other) / (2.0 * c)


@kernel
def filter_probes(form, state, z, is_used, is_starting, scratch):
    """Let every probe take y in with its own gain, and predict."""
    n = state.x.size
    for m in range(state.probes.shape[0]):
        x = state.probes[m]
        if is_used:
            K = form.dead_beat if is_starting else form.probes[m * n : (m + 1) * n]
            e = z - dot(form.H, x)
            for i in range(n):
                x[i] += K[i] * e
        move(form, x, state.held, scratch.c)


@kernel
def differentiate(form, state, e, is_used, scratch):
    """Carry W = dx/dK over the correction: W <- (I - K H) W + e I; only its last term for the pseudo-linear method."""
    K, W, n = state.theta, state.W, state.x.size
    if form.score == 0.0:
        for i in range(n):
            for j in range(n):
                W[i, j] = e if is_used and i == j else 0.0
    elif is_used:
        for j in range(n):
            h = 0.0
            for i in range(n):
                h += form.H[i] * W[i, j]
            for i in range(n):
                W[i, j] -= K[i] * h
            W[j, j] += e


@kernel
def push_gradient(form, W, scratch):
    """W <- Phi W."""
    n = W.shape[0]
    for j in range(n):
        for i in range(n):
            scratch.c[i] = 0.0
            for l in range(n):
                scratch.c[i] += form.Phi[i * n + l] * W[l, j]
        for i in range(n):
            W[i, j] = scratch.c[i]


@kernel
def joint(state, scratch, i, j, s, c, share):
    """Return the covariance of elements i <= j of [x; K]; ``share`` is 1/(H K) - 1, ``scratch.G`` = W U."""
    n, D = state.x.size, state.D
    p = 0.0
    if j < n:
        for k in range(n):
            p += scratch.G[i, k] * scratch.G[j, k] * D[k]
        return s * p + c * share * state.theta[i] * state.theta[j]
    for k in range(j - n, n):
        left = scratch.G[i, k] if i < n else entry(state.U, i - n, k) if k >= i - n else 0.0
        p += left * entry(state.U, j - n, k) * D[k]
    return s * p


@kernel
def write(form, out, t, state, scratch, s, c):
    """Write x, K, and their spread or covariance, behind the columns of the trace; ``s`` is the unit of P."""
    n, C = state.x.size, out.shape[1]
    N = 2 * n
    if C >= COLUMNS + N:
        for i in range(n):
            out[t, COLUMNS + i], out[t, COLUMNS + n + i] = state.x[i], state.theta[i]
    if C > COLUMNS + N:
        hk = dot(form.H, state.theta)
        share = 1.0 / hk - 1.0 if 0.0 < hk < 1.0 else 0.0
        for i in range(n):
            for k in range(n):
                scratch.G[i, k] = 0.0
                for l in range(k + 1):
                    scratch.G[i, k] += state.W[i, l] * entry(state.U, l, k)
        at = COLUMNS + N
        for j in range(N):
            if C == COLUMNS + 2 * N:
                out[t, at + j] = math.sqrt(max(joint(state, scratch, j, j, s, c, share), 0.0))
            else:
                for i in range(j + 1):
                    out[t, at] = joint(state, scratch, i, j, s, c, share)
                    at += 1


@advance.on(GainForm)
def advance_gain_form(form, method, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, x, K, U, D, psi = state.head, state.x, state.theta, state.U, state.D, scratch.psi
    n = x.size
    status = take_inputs(state, u, t)
    z = y[t, 0]
    is_used = abs(z) < HUGE
    if not is_used:
        status |= MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE
    is_starting = head[OBSERVED] < form.start
    if head[SAMPLES] == 0.0:
        begin(memory, state.memory_state, view_of(form, state, scratch, 1.0, np.nan, 0.0))

    # predict: y = H x, its gradient psi = H W
    status |= find_again(state)
    yhat = dot(form.H, x)
    e = z - yhat if is_used else np.nan
    for j in range(n):
        psi[j] = 0.0
        for i in range(n):
            psi[j] += form.H[i] * state.W[i, j]

    # project: c is the innovation variance, s the unit of P, unit R the noise's: T is the variance of the prediction
    c = head[CHI2] / head[COUNT] if head[COUNT] > 0.0 else form.unit
    R, s, unit, deviation = (1.0, c, c, 1.0) if form.absolute == 0.0 else (c, 1.0, 1.0, 1.0)
    if form.whitened > 0.0:  # a regression in noise of variance s, near 1
        R, s, deviation = 1.0, state.relative[1] / state.relative[0], math.sqrt(c) if c > 0.0 else 1.0
        unit = s * c
        for i in range(n):
            psi[i] /= deviation
    project(U, psi, scratch.f)
    T = unit * predicted_variance(scratch.f, D, R)
    if is_used and not is_starting:
        is_used = admit(gate, e, scratch.f, D, R, unit, head[IN_A_ROW], head[OBSERVED])
        head[IN_A_ROW] = count_rejections(gate, head[IN_A_ROW], not is_used)
        status |= 0 if is_used else REJECTED
    is_scored = is_used and state.input_missed[0] == 0.0
    is_known = is_scored and not is_starting
    status |= SKIPPED if is_used and not is_scored else 0

    # correct K, and keep the filter stable
    for i in range(n):
        scratch.old[i] = K[i]
    surprise, z_pull, jumped = np.nan, 0.0, 0.0
    if is_known and head[COUNT] >= form.wait and dot(psi, psi) > 0.0 and (form.whitened == 0.0 or c > 0.0):
        view = view_of(form, state, scratch, s, np.nan, 0.0)
        if adapt(memory, state.memory_state, e / deviation, R, view) > 0.0:
            surprise = e * e / T if T > 0.0 else 0.0
            if form.whitened > 0.0:
                state.relative[0], state.relative[1], head[WEIGHT] = count(
                    memory, state.memory_state, state.relative[0], state.relative[1], head[WEIGHT], s * surprise
                )
                jumped = found_jump(memory, state.memory_state, state.detector_state)
                s = state.relative[1] / state.relative[0]
            else:
                head[WEIGHT] += 1.0
            z_pull = head[WEIGHT] * (K[0] - scratch.old[0])
            status |= bound(form, K, scratch.old, scratch)

    # detect
    alarm = 0.0
    if listens(detector) and is_known and head[OBSERVED] > form.settle and T > 0.0 and c > 0.0:
        spread = math.sqrt(T)
        if form.signal == PROBES:
            compare(form, state, z, e, c, scratch.ratios)
            alarm = watch(detector, state.detector_state, e / spread, scratch.ratios)
            if alarm != 0.0:
                best, step = int(state.detector_state[WHICH]), 0.0
                for i in range(n):
                    step += form.H[i] * (form.probes[best * n + i] - scratch.old[i])
                alarm = 1.0 if step > 0.0 else -1.0
        else:
            for i in range(n):
                scratch.slope[i] = psi[i] * deviation / spread
            alarm = watch(detector, state.detector_state, z_pull if form.signal == PULL else e / spread, scratch.slope)
        if alarm != 0.0 and form.signal != INNOVATION:  # it is about K; with several states, no single entry
            state.detector_state[WHICH] = 0.0 if n == 1 else -1.0
    alarm += jumped

    # the innovation variance: a mean over the last `samples`, taken in after use
    if is_known:
        if head[COUNT] > form.samples - 1.0:
            head[CHI2] *= (form.samples - 1.0) / head[COUNT]
            head[COUNT] = form.samples - 1.0
        head[COUNT] += 1.0
        head[CHI2] += e * e
        if T > 0.0:
            logdet = log(T)
            head[LOGDET] += logdet
            head[SCORE] -= 0.5 * (LOG_2PI + logdet + e * e / T)
        else:
            status |= EXACT
    head[OBSERVED] += 1.0 if is_scored and status & EXACT == 0 else 0.0

    # correct x, and its gradient
    if is_used:
        for i in range(n):
            x[i] += (form.dead_beat[i] if is_starting else K[i]) * e
        state.input_missed[0] = 0.0
    if status & MISSING_INPUT:
        state.input_missed[0] = 1.0
    if not is_starting:
        differentiate(form, state, e, is_used, scratch)
    filter_probes(form, state, z, is_used, is_starting, scratch)

    out[t, 0], out[t, 1], out[t, 2] = yhat, e, T
    if out.shape[1] >= COLUMNS:
        out[t, 4], out[t, 5] = head[WEIGHT], state.detector_state[STATISTIC]
        out[t, 6], out[t, 7] = alarm * state.detector_state[SINCE], state.detector_state[WHICH]
        c = head[CHI2] / head[COUNT] if head[COUNT] > 0.0 else form.unit
        write(form, out, t, state, scratch, s if form.absolute > 0.0 else c, c)

    # respond, forget, move on
    if alarm != 0.0:
        view = view_of(form, state, scratch, s, surprise, form.reopen[0 if alarm > 0.0 else 1])
        found = Alarm(alarm, state.detector_state[WHICH])
        head[WEIGHT], moved = on_alarm(memory, state.memory_state, found, view)
        status |= moved
    lam, moved = time_update(memory, state.memory_state, 1.0, view_of(form, state, scratch, s, surprise, 0.0))
    if lam < 1.0:
        head[WEIGHT] *= lam
        for i in range(state.relative.size):
            state.relative[i] *= lam
    status |= moved
    move(form, x, state.held, scratch.c)
    push_gradient(form, state.W, scratch)
    out[t, 3] = status
    head[STATUS] = status
    head[SAMPLES] += 1.0
