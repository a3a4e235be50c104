"""One sample of a recursive estimator: predict, project, detect, correct, respond, forget."""

import math

import numpy as np

from ...detect.gate import admit, count_rejections
from ...detect.watch import SINCE, STATISTIC, WHICH, watch
from ...engine.dispatch import abreast, advance, kernel, listens, open_scratch
from ...engine.elementary import log
from ...engine.status import BAD_VALUE, EXACT, FILLED, LOST, MISSING_INPUT, MISSING_OUTPUT, REJECTED, SKIPPED
from ...engine.ud import entry, predicted_variance, project, variance, variances
from ...memory.questions import (
    LIKELY,
    Alarm,
    additive_share,
    begin,
    count,
    doubted_output,
    found_jump,
    mixture,
    on_alarm,
    outlier_probability,
    time_update,
)
from ...models.scale import freedom, sigma2
from ..joint.step import DOUBTED, hold_input, predict_input
from .gaps import is_clear, pass_gap, spread, tell_kind_of_last
from .methods import correct_by, view_of
from .row import (
    CHI2,
    COLUMNS,
    COUNT,
    HOLD,
    HUGE,
    IN_A_ROW,
    LAGS,
    LOGDET,
    OBSERVED,
    PAST,
    PREDICT,
    SAMPLES,
    SCORE,
    SKIP,
    STATUS,
    TOP,
    WEIGHT,
    Lags,
    push,
    regress,
    renew,
    tell,
    tell_kind,
    with_lags,
)

TINY = 1e-300  # marks a predicted number that nothing is known about
GLITCH = 0.3  # of the squared error: variance of a doubted one, which may be right; weighed so it biases no parameter
RANGE = 100.0  # variance of an output that is lost: ten times the largest one, squared


@kernel
def take_inputs(form, state, u, t):
    """Take the inputs of sample t into their registers, a missing one as predicted or held; return a status."""
    status = 0
    for l in range(state.held.size):
        value = u[t, l]
        if abs(value) < HUGE:
            hold_input(state, l, value)
        else:
            status |= MISSING_INPUT if value != value else MISSING_INPUT | BAD_VALUE
            if form.missing != HOLD:
                predict_input(state, l)
        push(state.us[l], state.held[l])
        is_known = abs(value) < HUGE or form.missing == HOLD
        push(state.us_variance[l], 0.0 if is_known else max(state.input_variance[l], TINY))
    return status


@kernel
def uncertain(q, state, i, s2):
    """Return what an error of variance q in regressor i adds to the variance of y."""
    if q == 0.0:
        return 0.0
    return q * (state.theta[i] * state.theta[i] + s2 * variance(state.U, state.D, i))


@kernel
def fill_lags(form, state, psi, s2):
    """Fill psi with past outputs and inputs; return the prediction and what predicted ones add to its variance."""
    added, at = 0.0, state.ys.size
    for i in range(at):
        psi[i] = -state.ys[i]
    if not is_clear(state.ys_covariance, at):
        added = max(spread(state.ys_covariance, state.theta[:at], state.U, state.D, 0, s2), TINY)
    for l in range(state.held.size):
        first = int(form.nk[l])
        for lag in range(first, first + int(form.nb[l])):
            psi[at] = state.us[l, lag]
            added += uncertain(state.us_variance[l, lag], state, at, s2)
            at += 1
    while at < psi.size:
        psi[at] = form.offset
        at += 1
    yhat = 0.0
    for i in range(psi.size):
        yhat += psi[i] * state.theta[i]
    return yhat, added


@regress.on(Lags)
def regress_lags(form, state, scratch, s2):
    return fill_lags(form, state, scratch.psi, s2)


@tell_kind.on(Lags)
def tell_kind_lags(form, method, memory, state, scratch, y, s2):
    if form.missing != PREDICT:
        return False
    measured, usual = doubted_output(memory, state.memory_state)
    return tell_kind_of_last(
        state.ys_covariance, state.ys, measured, usual, y, state.theta, state.U, state.D, scratch.psi, scratch.f,
        scratch.b, method.R, s2,
    )  # fmt: skip


@kernel
def take_output(state, scratch, y, y_variance, e, T):
    """Take y into the past outputs."""
    na = state.ys.size
    if na > 0 and (y_variance != 0.0 or not is_clear(state.ys_covariance, na)):
        pass_gap(state.ys_covariance, state.ys, state.theta, scratch.b, y, y_variance, e, T)
    push(state.ys, y)


@renew.on(Lags)
def renew_lags(form, state, scratch, y, y_variance, e, T):
    take_output(state, scratch, y, y_variance, e, T)
    return 0


@kernel
def write(out, t, state, scratch, s2, first):
    """Write theta, and its spread or covariance, from column ``first`` on; no D: nobody knows (infinite)."""
    N, C = state.theta.size, out.shape[1]
    if C >= first + N:
        for i in range(N):
            out[t, first + i] = state.theta[i]
    if state.D.size < N:
        for at in range(first + N, C):
            out[t, at] = np.inf
    elif C == first + 2 * N:
        variances(state.U, state.D, scratch.c)
        for i in range(N):
            out[t, first + N + i] = math.sqrt(s2 * scratch.c[i])
    elif C > first + N:
        at = first + N
        for j in range(N):
            for i in range(j + 1):
                p = 0.0
                for k in range(j, N):
                    p += entry(state.U, i, k) * entry(state.U, j, k) * state.D[k]
                out[t, at] = s2 * p
                at += 1


@kernel
def known_so_far(scale, head):
    """Return sigma^2; after fewer samples than parameters it may be anything up to the data's own."""
    s2 = sigma2(scale, head[COUNT], head[CHI2])
    return s2 if head[COUNT] >= 1.0 else max(s2, 1.0)


@advance.on(Lags)
def advance_lags(form, method, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, theta, U, D, psi = state.head, state.theta, state.U, state.D, scratch.psi
    if head[SAMPLES] == 0.0:
        begin(memory, state.memory_state, view_of(state, scratch, 1.0, math.nan))
    status = take_inputs(form, state, u, t)
    z = y[t, 0]
    is_used = abs(z) < HUGE
    if not is_used:
        status |= MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE

    # predict
    s2 = known_so_far(scale, head)
    yhat, regressor_variance = regress(form, state, scratch, s2)
    e = z - yhat if is_used else np.nan
    if regressor_variance > 0.0:
        status |= SKIPPED if form.missing == SKIP else FILLED
        is_used = is_used and form.missing != SKIP
    if head[PAST] < form.fill:  # some regressor belongs to the time before the record
        is_used, status = False, status | SKIPPED
    if head[PAST] > 0.0 or abs(z) < HUGE:
        head[PAST] += 1.0
    R = method.R + regressor_variance / s2 if regressor_variance > 0.0 else method.R  # T need not wait for s2

    if out.shape[1] >= COLUMNS:
        out[t, 8] = freedom(scale, head[COUNT])
        if form.mixture_columns > 0.0:
            mixture(memory, state.memory_state, R, view_of(state, scratch, s2, math.nan), out[t, COLUMNS:])

    # project
    project(U, psi, scratch.f)
    T = predicted_variance(scratch.f, D, R)

    # detect
    alarm = 0.0
    if is_used:
        is_used = admit(gate, e, scratch.f, D, R, s2, head[IN_A_ROW], head[OBSERVED])
        head[IN_A_ROW] = count_rejections(gate, head[IN_A_ROW], not is_used)
        status |= 0 if is_used else REJECTED
    if listens(detector) and is_used and head[OBSERVED] > form.settle and T > 0.0:
        spread = math.sqrt(s2 * T)
        for i in abreast(psi.size):
            scratch.slope[i] = psi[i] / spread
        alarm = watch(detector, state.detector_state, e / spread, scratch.slope)

    # correct
    surprise, foreseen, variance_foreseen = np.nan, e, 0.0
    if is_used and regressor_variance > 0.0 and tell_kind(form, method, memory, state, scratch, z, s2):
        said, regressor_variance = regress(form, state, scratch, s2)
        e, R, variance_foreseen = z - said, method.R + regressor_variance / s2, s2 * T
        project(U, psi, scratch.f)
        T = predicted_variance(scratch.f, D, R)
    if is_used:
        T = correct_by(method, memory, state, e, R, s2, z, scratch)
        if T > 0.0:
            surprise = e * e / (s2 * T)
            head[OBSERVED] += 1.0
            head[COUNT], head[CHI2], head[WEIGHT] = count(
                memory, state.memory_state, head[COUNT], head[CHI2], head[WEIGHT], e * e / T
            )
            alarm += found_jump(memory, state.memory_state, state.detector_state)
            head[LOGDET] += log(T) if T != 1.0 else 0.0  # one: of a gain that knows no covariance
            if variance_foreseen > 0.0:
                head[SCORE] -= 0.5 * (log(2.0 * math.pi * variance_foreseen) + foreseen * foreseen / variance_foreseen)
            else:
                head[SCORE] -= 0.5 * (log(2.0 * math.pi * s2 * T) + surprise)
        else:
            status |= EXACT if T == 0.0 else SKIPPED
            T = -T
    y_variance, seen = 0.0, e
    if status & (MISSING_OUTPUT | REJECTED):
        z, seen = yhat, np.nan
        y_variance = max(s2 * T, TINY)
        if form.missing == HOLD:
            z, y_variance = state.ys[0] if state.ys.size else yhat, 0.0
        elif head[OBSERVED] == 0.0 or y_variance > RANGE * max(head[TOP] * head[TOP], s2 * method.R):
            z, y_variance = (
                0.0,
                max(RANGE * head[TOP] * head[TOP], TINY),
            )  # nothing like the data so far, or no model yet
            status |= LOST if head[OBSERVED] > theta.size else 0
    else:
        head[TOP] = max(head[TOP], abs(z))
        if form.missing == PREDICT and surprise >= 0.0:
            rho = outlier_probability(memory, state.memory_state)
            if rho > LIKELY:  # mean and variance of what y would have been
                share = additive_share(memory, state.memory_state)
                wrong = share * rho
                z, y_variance = z - wrong * e, wrong * ((1.0 - wrong) * e * e + s2 * T)
                seen = e if share == 1.0 else np.nan  # what comes next tells of which kind it was
            elif rho > DOUBTED:
                y_variance = GLITCH * e * e
    status |= renew(form, state, scratch, z, y_variance, seen, s2 * T)
    tell(form, memory, state, scratch, view_of(state, scratch, s2, surprise))

    out[t, 0], out[t, 1], out[t, 2] = yhat, foreseen, variance_foreseen if variance_foreseen > 0.0 else s2 * T
    if out.shape[1] >= COLUMNS:
        out[t, 4], out[t, 5] = head[WEIGHT], state.detector_state[STATISTIC]
        out[t, 6], out[t, 7] = alarm * state.detector_state[SINCE], state.detector_state[WHICH]
        write(out, t, state, scratch, known_so_far(scale, head), COLUMNS + int(form.mixture_columns))

    # respond, forget
    if alarm != 0.0:
        found = Alarm(alarm, state.detector_state[WHICH])
        head[WEIGHT], moved = on_alarm(memory, state.memory_state, found, view_of(state, scratch, s2, surprise))
        status |= moved
    lam, moved = time_update(memory, state.memory_state, 1.0, view_of(state, scratch, s2, surprise))
    if lam < 1.0:
        head[WEIGHT] *= lam
        head[COUNT] *= lam
        head[CHI2] *= lam
    status |= moved
    out[t, 3] = status
    head[STATUS] = status
    head[SAMPLES] += 1.0


@tell.on(Lags)
def tell_nothing(form, memory, state, scratch, view):
    """Regressors that are data leave theta and P alone."""


def steps_like_lags(kind):
    """Let forms of this type take the step of `Lags` in all that `regress`, `renew` and `tell` do not say of them.

    A named tuple that has none of the fields of `Lags` gets them, before its own.
    """
    kind = kind if set(Lags._fields) & set(kind._fields) else with_lags(kind)
    LAGS.on(kind)
    for question in (open_scratch, advance, regress, renew, tell):
        question.on(kind)(question.table[Lags])
    return kind
