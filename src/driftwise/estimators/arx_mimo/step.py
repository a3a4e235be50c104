"""One sample of several outputs: each equation takes its own step, then all see what the outputs were."""

import math

import numpy as np

from ...engine.dispatch import advance, kernel, open_scratch, read, read_like
from ...models.scale import sigma2
from ..arx.gaps import is_clear
from ..arx.row import CHI2, COLUMNS, COUNT, OBSERVED, STATUS, Lags, push, regress
from ..arx.step import TINY, take_inputs, uncertain
from .gaps import Y_VARIANCE, Y, pass_gap, spread_over
from .row import Channel, Several, open_channel

advance.on(Channel)(advance.table[Lags])


@regress.on(Channel)
def regress_channel(form, state, scratch, s2):
    psi, added, at = scratch.psi, 0.0, 0
    for j in range(state.all_ys.shape[0]):
        for lag in range(int(form.past[j])):
            psi[at] = -state.all_ys[j, lag]
            at += 1
    if not is_clear(state.all_covariance, state.all_ys.size):
        added = max(spread_over(form, state, s2), TINY)
    for l in range(state.us.shape[0]):
        first = int(form.nk[l])
        for lag in range(first, first + int(form.nb[l])):
            psi[at] = state.us[l, lag]
            added += uncertain(state.us_variance[l, lag], state, at, s2)
            at += 1
    if form.offset != 0.0:
        psi[at] = form.offset
    yhat = 0.0
    for i in range(psi.size):
        yhat += psi[i] * state.theta[i]
    return yhat, added


@kernel
def columns_of(C, p, N, n):
    """Return how many columns an equation of n of the N parameters writes, where the trace has C."""
    if C < COLUMNS * p:
        return 4
    if C == COLUMNS * p:
        return COLUMNS
    if C == COLUMNS * p + N:
        return COLUMNS + n
    if C == COLUMNS * p + 2 * N:
        return COLUMNS + 2 * n
    return COLUMNS + n + n * (n + 1) // 2


@kernel
def spread_out(line, out, t, p, N, i, first, n):
    """Copy the trace of equation i, whose n parameters begin at ``first``, into that of all."""
    C = line.shape[1]
    for c in range(min(C, COLUMNS)):
        out[t, c * p + i] = line[0, c]
    at = COLUMNS * p
    if C >= COLUMNS + n:
        for c in range(n):
            out[t, at + first + c] = line[0, COLUMNS + c]
    at += N
    if C == COLUMNS + 2 * n and out.shape[1] == at + N:
        for c in range(n):
            out[t, at + first + c] = line[0, COLUMNS + n + c]
    elif C > COLUMNS + n:
        own = COLUMNS + n
        for j in range(first, first + n):
            column = at + j * (j + 1) // 2
            for c in range(first):
                out[t, column + c] = 0.0
            for c in range(first, j + 1):
                out[t, column + c] = line[0, own]
                own += 1


@kernel
def link(products, weights, e, T, lam):
    """Take the innovations of a sample into the sums that tell how they are linked: E e_i e_j is sought."""
    for i in range(e.size):
        for j in range(e.size):
            if abs(e[i]) >= 0.0 and abs(e[j]) >= 0.0:
                fade, weight = math.sqrt(lam[i] * lam[j]), 1.0 / (T[i] * T[j])
                products[i, j] = fade * (products[i, j] + weight * e[i] * e[j])
                weights[i, j] = fade * (weights[i, j] + weight)


@advance.on(Several)
def advance_several(form, method, memory, gate, scale, detector, state, scratch, y, u, out, t):
    p, N = state.heads.shape[1], state.theta.size
    taken = take_inputs(form, state, u, t)
    for i in range(p):
        channel, at = read(Channel, form.spec, int(form.spec_at[i]))
        own_method, at = read_like(method, form.spec, at)
        own_memory, at = read_like(memory, form.spec, at)
        own_gate, at = read_like(gate, form.spec, at)
        own_scale, at = read_like(scale, form.spec, at)
        own_detector, at = read_like(detector, form.spec, at)
        own, buffer = open_channel(form, state, scratch, i), open_scratch(channel, scratch.rest)
        n = own.theta.size
        C = columns_of(out.shape[1], p, N, n)
        line, head = scratch.line[:C].reshape(1, C), own.head
        s2, observed, count = sigma2(own_scale, head[COUNT], head[CHI2]), head[OBSERVED], head[COUNT]
        scratch.y[0, 0] = y[t, i]
        advance(
            channel,
            own_method,
            own_memory,
            own_gate,
            own_scale,
            own_detector,
            own,
            buffer,
            scratch.y,
            scratch.u,
            line,
            0,
        )
        status = int(line[0, 3]) | taken
        line[0, 3] = head[STATUS] = status
        spread_out(line, out, t, p, N, i, int(form.theta_at[i]), n)
        is_used = head[OBSERVED] > observed
        scratch.T[i] = line[0, 2] / (s2 * own_method.R)
        scratch.e[i] = line[0, 1] / math.sqrt(own_method.R) if is_used else np.nan
        lam = head[COUNT] / (count + 1.0) if is_used and count + 1.0 != 0.0 else 1.0
        scratch.lam[i] = min(max(lam, 0.0), 1.0)
    link(state.products, state.weights, scratch.e, scratch.T, scratch.lam)
    total = 0.0
    for i in range(p):
        total += scratch.fresh[i, Y_VARIANCE]
    if total != 0.0 or not is_clear(state.ys_covariance, state.ys.size):
        pass_gap(state.ys_covariance, state.ys, scratch.fresh, scratch.moved)
    for i in range(p):
        push(state.ys[i], scratch.fresh[i, Y])
    state.samples[0] += 1.0
