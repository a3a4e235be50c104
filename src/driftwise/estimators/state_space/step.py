"""One sample of a Kalman filter in U D U': predict, project, correct output by output, detect.

The noises of a sample's outputs may be correlated. Each output is taken given those before it that were taken:
R = L diag(d) L' is built row by row, so what is missing or rejected leaves the covariance of the others as it is.
"""

import math

from ...detect.gate import admit, count_rejections
from ...detect.watch import STATISTIC as OVER
from ...engine.dense import at
from ...engine.dispatch import advance, kernel, rare, watch
from ...engine.elementary import exp, lgamma, log
from ...engine.expm import exponential
from ...engine.status import BAD_VALUE, EXACT, JUMP, LOST, MISSING_OUTPUT, REJECTED
from ...engine.ud import entry, factor_within, measurement_update, orthogonalise, predicted_variance, project, variances
from ...engine.van_loan import noise as added
from ...models.scale import freedom, sigma2
from ..adaptive_gain.step import take_inputs
from ..joint.row import HUGE
from .noise_factor import carry_derivatives, factor_of, learn_factor
from .row import CHI2, OBSERVED, READY, SAMPLES, SCORE, STATUS, TIME, StateSpaceForm


@kernel
def along(M, at, x):
    """Return the product of M[at : at + x.size] and x."""
    s = 0.0
    for i in range(x.size):
        s += M[at + i] * x[i]
    return s


@kernel
def move(form, memory, F, G, Uq, Dq, fade, state, scratch):
    """x <- F x + G u(t-1), U D U' <- F U D U' F' / fade + Q, times its factor (Thornton)."""
    n, k, x, U, Y = state.x.size, state.held.size, state.x, state.U, scratch.Y
    carry_derivatives(memory, state.memory_state, F, Uq, Dq, fade, 0.0, Y)
    factor = factor_of(memory, state.memory_state)
    for i in range(n):
        scratch.a[i] = along(F, i * n, x) + along(G, i * k, state.held)
    for i in range(n):
        x[i] = scratch.a[i]
        scratch.before[i] = state.D[i]
        scratch.weight[i] = state.D[i] / fade
        scratch.weight[n + i] = factor * Dq[i]
        at = 0
        for j in range(n):
            Y[i, j] = F[i * n + j]
            for l in range(j):
                Y[i, j] += F[i * n + l] * U[at + l]
            at += j
            scratch.FU[i * n + j] = Y[i, j]
            Y[i, n + j] = entry(Uq, i, j) if i <= j else 0.0
    orthogonalise(Y, scratch.weight, scratch.g, n, 2 * n, U, state.D, form.exact > 0.0)
    for i in range(n):
        scratch.D1[i] = state.D[i]
    for i in range(U.size):
        scratch.U1[i] = U[i]


@rare
def discretise(form, scratch, seconds):
    """Fill the step of so many seconds into scratch.F, G, Uq and Dq: exact, inputs held (Van Loan, 1978)."""
    n, k = int(form.n), int(form.inputs)
    exponential(form.A, form.B, n, k, seconds, scratch.F, scratch.G, scratch.slope, scratch.powers)
    added(form.A, form.W, n, seconds, scratch.Q, scratch.M, scratch.E, scratch.powers)
    for j in range(n):
        for i in range(j + 1):
            scratch.E[at(i, j)] = scratch.Q[i * n + j]
    factor_within(scratch.E, scratch.Uq, scratch.Dq)


@rare
def restart(form, state):
    """Begin with the prior again where a gap let an unstable state leave every bound; return a status."""
    most = 0.0
    for i in range(state.x.size):
        most += abs(state.x[i]) + state.D[i]
    for i in range(state.U.size):
        most += abs(state.U[i])
    if most < HUGE:
        return 0
    for i in range(state.x.size):
        state.x[i], state.D[i] = form.mean[i], form.D0[i]
    for i in range(state.U.size):
        state.U[i] = form.U0[i]
    return LOST


@kernel
def given_others(H, D, R, state, scratch, y, t, i, taken):
    """Fill row i of scratch with what output i says beyond those taken before: z_i = h_i' x + noise of variance d_i."""
    n, k, p, L = state.x.size, state.held.size, scratch.z.size, scratch.L
    h = scratch.rows[i * n : (i + 1) * n]
    z, d = y[t, i] - along(D, i * k, state.held), R[i * p + i]
    for l in range(n):
        h[l] = H[i * n + l]
    for j in range(i):
        L[i, j] = 0.0
        if scratch.d[j] > 0.0 and taken > 0.0:
            share = R[i * p + j]
            for l in range(j):
                if scratch.d[l] > 0.0:
                    share -= L[i, l] * L[j, l] * scratch.d[l]
            share /= scratch.d[j]
            if share != 0.0:
                L[i, j] = share
                d -= share * share * scratch.d[j]
                z -= share * scratch.z[j]
                for l in range(n):
                    h[l] -= share * scratch.rows[j * n + l]
    scratch.z[i], scratch.d[i] = z, max(d, 0.0)


@kernel
def log_density(scale, observed, chi2, e, T):
    """Return log p(e) of a normal variable, or of Student's where sigma^2 is learnt (s2 T its squared scale)."""
    squared, dof = sigma2(scale, observed, chi2) * T, freedom(scale, observed)
    if dof < HUGE:
        head = lgamma(0.5 * (dof + 1.0)) - lgamma(0.5 * dof) - 0.5 * log(math.pi * dof * squared)
        return head - 0.5 * (dof + 1.0) * log(1.0 + e * e / (dof * squared))
    return -0.5 * (log(2.0 * math.pi * squared) + e * e / squared)


@kernel
def predict_outputs(form, scale, H, D, R, state, scratch, y, out, t):
    """Write each output's prediction by the samples before, the innovation, its variance, and what is missing."""
    n, k, p = state.x.size, state.held.size, scratch.z.size
    s2 = sigma2(scale, state.head[OBSERVED], state.head[CHI2])
    for i in range(p):
        h = H[i * n : (i + 1) * n]
        yhat, value, status = along(H, i * n, state.x) + along(D, i * k, state.held), y[t, i], 0.0
        project(state.U, h, scratch.f)
        if not abs(value) < HUGE:
            status = MISSING_OUTPUT if value != value else MISSING_OUTPUT | BAD_VALUE
            value = math.nan
        out[t, i], out[t, p + i] = yhat, value - yhat
        out[t, 2 * p + i] = s2 * predicted_variance(scratch.f, state.D, R[i * p + i])
        out[t, 3 * p + i] = status


@kernel
def correct_by(form, memory, gate, scale, detector, H, D, R, state, scratch, y, out, t):
    """Take the outputs of a sample in, one after the other; return 1 where a detector alarms, else 0."""
    head, p, alarm, statistic, nis, density, taken = state.head, scratch.z.size, 0.0, 0.0, 0.0, 0.0, 0.0
    n = state.x.size
    for i in range(p):
        if int(out[t, 3 * p + i]) & MISSING_OUTPUT:
            scratch.d[i] = -1.0  # not there
            continue
        given_others(H, D, R, state, scratch, y, t, i, taken)
        h, noise = scratch.rows[i * n : (i + 1) * n], scratch.d[i]
        e, s2 = scratch.z[i] - along(h, 0, state.x), sigma2(scale, head[OBSERVED], head[CHI2])
        scratch.e[i] = e
        project(state.U, h, scratch.f)
        is_believed = admit(gate, e, scratch.f, state.D, noise, s2, state.in_a_row[i], head[OBSERVED])
        state.in_a_row[i] = count_rejections(gate, state.in_a_row[i], not is_believed)
        if not is_believed:
            out[t, 3 * p + i] = REJECTED
            scratch.d[i] = -1.0
            continue
        taken = 1.0
        T = measurement_update(state.x, state.U, state.D, scratch.f, e, noise, scratch.b)
        if not T > 0.0:
            out[t, 3 * p + i] = EXACT
            continue
        learn_factor(memory, state.memory_state, h, scratch.b, e, T, s2, head[OBSERVED], scratch.a)
        density += log_density(scale, head[OBSERVED], head[CHI2], e, T)
        nis += e * e / (s2 * T)
        head[OBSERVED] += 1.0
        head[CHI2] += e * e / T
        if head[OBSERVED] > form.settle:
            found = watch(detector, state.detector_state, e / math.sqrt(s2 * T), state.detector_state[:0])
            alarm = 1.0 if found != 0.0 else alarm
            statistic = max(statistic, state.detector_state[OVER])
    head[SCORE] += density
    out_of = 4 * p
    if out.shape[1] > out_of:
        out[t, out_of], out[t, out_of + 1], out[t, out_of + 2] = nis, density, statistic
    return alarm


@kernel
def write(form, scale, state, scratch, out, t):
    """Write x(t | t) behind the columns, and its deviations."""
    n, C, at = state.x.size, out.shape[1], 4 * scratch.z.size + 3
    if C < at + n:
        return
    s2 = sigma2(scale, state.head[OBSERVED], state.head[CHI2])
    for i in range(n):
        out[t, at + i] = state.x[i]
    if C > at + n:
        variances(state.U, state.D, scratch.a)
        for i in range(n):
            out[t, at + n + i] = math.sqrt(s2 * scratch.a[i])


@advance.on(StateSpaceForm)
def advance_state_space(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, n, k, p, status = state.head, state.x.size, state.held.size, scratch.z.size, 0
    stamp = u[t, k] if u.shape[1] > k else math.nan
    own = u[t, min(k + 1, u.shape[1]) :]
    F = own[: n * n] if own.size > 0 else form.F
    G = own[n * n : n * n + n * k] if own.size > 0 else form.G
    first = n * n + n * k
    H = own[first : first + p * n] if own.size > 0 else form.H
    D = own[first + p * n : first + p * n + p * k] if own.size > 0 else form.D
    first += p * n + p * k
    Uq = own[first : first + state.U.size] if own.size > 0 else form.Uq
    Dq = own[first + state.U.size : first + state.U.size + n] if own.size > 0 else form.Dq
    R = own[first + state.U.size + n :] if own.size > 0 else form.R

    # predict
    head[OBSERVED], head[CHI2] = form.scale_fade * head[OBSERVED], form.scale_fade * head[CHI2]
    if head[SAMPLES] > 0.0:
        seconds = form.dt if stamp != stamp else stamp - head[TIME]
        head[TIME] = head[TIME] + form.dt if stamp != stamp else stamp
        if form.A.size > 0 and own.size == 0 and seconds != form.dt:
            discretise(form, scratch, seconds)
            fade = exp(log(form.fade) * seconds / form.dt)
            move(form, memory, scratch.F, scratch.G, scratch.Uq, scratch.Dq, fade, state, scratch)
        else:
            move(form, memory, F, G, Uq, Dq, form.fade, state, scratch)
        status |= restart(form, state)
        if status != 0:
            carry_derivatives(memory, state.memory_state, F, Uq, Dq, form.fade, 1.0, scratch.Y)
        scratch.is_moved[0] = 1.0 if status == 0 else 0.0
    else:
        scratch.is_moved[0] = 0.0
        head[TIME] = 0.0 if stamp != stamp else stamp
    status |= take_inputs(state, u, t)

    # project, correct and detect
    predict_outputs(form, scale, H, D, R, state, scratch, y, out, t)
    if correct_by(form, memory, gate, scale, detector, H, D, R, state, scratch, y, out, t) != 0.0:
        status |= JUMP
    for i in range(p):
        out[t, 3 * p + i] = int(out[t, 3 * p + i]) | status
        head[STATUS] = out[t, 3 * p + i]
    write(form, scale, state, scratch, out, t)
    head[READY] = 1.0
    head[SAMPLES] += 1.0
