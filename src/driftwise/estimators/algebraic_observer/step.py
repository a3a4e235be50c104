"""One sample of the algebraic observer: integrate, read out, and what the noise makes of both.

Time is t = k samples; z = (y, y', ..) in units of samples, without the direct terms of u. With chi = xi/(-t)^N,
q = 1/(k+1), r = k q, F = r^N e^Ao, w0 = sum_e r^e q^(N-e) Y0_e, w1 likewise, and v the same sums of u (`filter`):

    chi(k+1) = F chi(k) + w0 y(k) + w1 y(k+1) + v                   y a straight line, (-t)^(N-j) integrated exactly
    z_mu = Co Ao^mu chi - sum_{h < mu} alpha[mu,h]/(-t)^N z_h       the theorem; in matrices z = T chi
    y(k+2|k+1) = (first row of the transition of D1) z + (part of u)

No derivative of u is needed: the terms beta u^(h) of the theorem and M of the read-out (4) cancel in the state, in the
disturbance sum a_i y^(i) - sum b_i u^(i) and in the prediction, which are continuous in t where u is not. Only y^(mu)
itself has direct terms, g_0 u^(mu-1) + g_1 u^(mu-2) + .. (g: Markov parameters, to which the beta add up), and there
the derivatives of u are those of its hold: "zoh" u' = 0, "foh" u' = the last slope, u'' = 0.

Errors: chi's has covariance P, that of y(k) variance s, both have the covariance c. White noise of variance R on y(k+1)
makes P(k+1) = F P F' + F c w0' + w0 c' F' + s w0 w0' + R w1 w1'. A missing y(k+1) is taken as predicted, h chi + ..:
its error is then h times that of chi, nothing else.
"""

import math

import numpy as np

from ...engine.dispatch import advance, kernel
from ...engine.status import BAD_VALUE, FILLED, MISSING_INPUT, MISSING_OUTPUT, NOT_READY
from ..arx.row import HUGE
from ..window_observer.row import CHI2, DETERMINED, OBSERVED, READY, SAMPLES, STATUS, along, elapse, unit
from .row import COLUMNS, Algebraic


@kernel
def weigh(table, N, p, w):
    """Fill w = sum_e p[e] table[e]."""
    for i in range(N):
        w[i] = 0.0
    for e in range(table.size // N):
        for i in range(N):
            w[i] += p[e] * table[e * N + i]


@kernel
def integrate(form, state, scratch, now, y):
    """Advance chi to the instant ``now``; leave w0 and w1 in work, and r^N behind p."""
    N, k, chi, p = state.chi.size, state.held.size, state.chi, scratch.p
    q, r = 1.0 / now, (now - 1.0) / now
    p[0] = 1.0
    for e in range(N):
        p[e + 1] = p[e] * r
    power = q
    for e in range(N - 1, -1, -1):
        p[e] *= power
        power *= q
    weigh(form.Y0, N, p, scratch.w0)
    weigh(form.Y1, N, p, scratch.w1)
    for i in range(N):
        scratch.chi[i] = p[N] * along(form.Phi, i * N, chi) + scratch.w0[i] * state.last[0] + scratch.w1[i] * y
    for j in range(k):
        weigh(form.U0, N, p, scratch.f)
        weigh(form.U1, N, p, scratch.g)
        for i in range(N):
            scratch.chi[i] += scratch.f[i] * state.held[j] + scratch.g[i] * scratch.now[j]
    for i in range(N):
        chi[i] = scratch.chi[i]


@kernel
def spread(form, state, scratch, is_filled):
    """Advance the covariance of the errors of chi and of the newest y; work has w0, w1, and r^N behind p."""
    N, P, M, c, s = state.chi.size, state.P, scratch.M, state.link, state.last[1]
    size, w0, w1, f, g, h = scratch.p[state.chi.size], scratch.w0, scratch.w1, scratch.f, scratch.g, state.h
    for i in range(N):
        f[i] = size * along(form.Phi, i * N, c)
        for j in range(N):
            total = 0.0
            for l in range(N):
                total += form.Phi[i * N + l] * P[l, j]
            M[i, j] = size * total
    fresh = form.R
    if is_filled:
        fresh, shared = 0.0, 0.0
        for i in range(N):
            shared += c[i] * h[i]
            for j in range(N):
                fresh += h[i] * P[i, j] * h[j]
        for i in range(N):
            g[i] = shared * w0[i]
            for j in range(N):
                g[i] += M[i, j] * h[j]
    else:
        for i in range(N):
            g[i] = 0.0
    for i in range(N):
        for j in range(i + 1):
            total = f[i] * w0[j] + w0[i] * f[j] + s * w0[i] * w0[j]
            total += g[i] * w1[j] + w1[i] * g[j] + fresh * w1[i] * w1[j]
            for l in range(N):
                total += M[i, l] * size * form.Phi[j * N + l]
            P[i, j] = P[j, i] = total
    for i in range(N):
        c[i] = g[i] + fresh * w1[i]
    state.last[1] = fresh


@kernel
def read_out(form, state, scratch, q):
    """Fill T and z at the instant 1/q, and what the next sample is predicted from."""
    N, T, z, at = state.chi.size, scratch.T, scratch.z, 0
    for mu in range(N):
        for i in range(mu + 1):
            T[mu, i] = form.powers[mu * N + i]
        for h in range(mu):
            alpha = 0.0
            for i in range(mu - h - 1, -1, -1):
                alpha = (alpha + form.alpha[at + i]) * q
            at += mu - h
            for i in range(h + 1):
                T[mu, i] -= alpha * T[h, i]
        z[mu] = 0.0
        for i in range(mu + 1):
            z[mu] += T[mu, i] * state.chi[i]
    state.last[2] = 0.0
    for i in range(N):
        state.h[i] = 0.0
        for mu in range(i, N):
            state.h[i] += form.reach[mu] * T[mu, i]
        state.last[2] += form.reach[i] * z[i]


@kernel
def estimate(form, state, scratch, sigma):
    """Fill the estimates and their deviations, relative to sigma; say whether these meet the tolerance."""
    N, E, T, M, C = state.chi.size, state.estimates.size, scratch.T, scratch.M, scratch.C
    d, k, slope, is_met = form.rows.size // state.estimates.size, state.held.size, 0.0, True
    for j in range(k):
        slope += (scratch.now[j] - state.held[j]) / form.dt
    for mu in range(d):
        for j in range(N):
            M[mu, j] = 0.0
            for l in range(mu + 1):
                M[mu, j] += T[mu, l] * state.P[l, j]
        for h in range(mu + 1):
            total = 0.0
            for j in range(h + 1):
                total += M[mu, j] * T[h, j]
            C[mu, h] = C[h, mu] = total
    for i in range(E):
        value, total = form.slopes[i] * slope, 0.0
        for j in range(k):
            value += form.feeds[i] * scratch.now[j]
        for mu in range(d):
            value += form.rows[i * d + mu] * scratch.z[mu]
            for h in range(d):
                total += form.rows[i * d + mu] * C[mu, h] * form.rows[i * d + h]
        state.estimates[i], state.std[i] = value, math.sqrt(max(total, 0.0))
        if not sigma * state.std[i] <= form.tolerance[i]:
            is_met = False
    return is_met


@advance.on(Algebraic)
def advance_algebraic(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    head, N, k, E = state.head, state.chi.size, state.held.size, state.estimates.size
    elapse(form, state, u, t)
    value, status, yhat, relative = y[t, 0], 0, np.nan, np.inf
    if not abs(value) < HUGE:
        status = MISSING_OUTPUT if value != value else MISSING_OUTPUT | BAD_VALUE
        value = np.nan
    for j in range(k):
        scratch.now[j] = u[t, j]
        if not abs(scratch.now[j]) < HUGE:
            status |= MISSING_INPUT
            scratch.now[j] = state.held[j]
    is_known, is_ready, is_filled, s2 = head[DETERMINED] > 0.0, False, False, unit(scale, head)
    if is_known:
        yhat, relative = state.last[2], form.R
        for j in range(k):
            yhat += form.ahead[0] * state.held[j] + form.ahead[1] * scratch.now[j]
        for i in range(N):
            relative += state.h[i] * along(state.P[i], 0, state.h)
    out[t, 0], out[t, 1], out[t, 2], out[t, 4] = yhat, value - yhat, s2 * relative, 0.0
    if value != value and is_known:
        value, is_filled = yhat, True
        status |= FILLED
    elif is_known:
        head[OBSERVED] += 1.0
        head[CHI2] += (value - yhat) * (value - yhat) / relative
        s2 = unit(scale, head)
    if value != value:  # nothing was determined yet: the integrals begin anew at the next sample
        state.clock[0] = 0.0
    elif state.clock[0] == 0.0:
        for i in range(N):
            state.chi[i] = state.link[i] = 0.0
            for j in range(N):
                state.P[i, j] = 0.0
        state.last[0], state.last[1], state.clock[0] = value, form.R, 1.0
    else:
        now = state.clock[0]
        integrate(form, state, scratch, now, value)
        spread(form, state, scratch, is_filled)
        state.last[0], state.clock[0] = value, now + 1.0
        if state.clock[0] >= form.least:
            read_out(form, state, scratch, 1.0 / now)
            is_met = estimate(form, state, scratch, math.sqrt(s2))
            is_ready = is_met and state.clock[0] > form.wait and s2 < np.inf
            head[DETERMINED] = 1.0
    for j in range(k):
        state.held[j] = scratch.now[j]
    status |= 0 if is_ready else NOT_READY
    head[SAMPLES] += 1.0
    head[STATUS], head[READY], out[t, 3] = status, 1.0 if is_ready else 0.0, status
    if out.shape[1] >= COLUMNS + E:
        for i in range(E):
            out[t, COLUMNS + i] = state.estimates[i] if is_ready else np.nan
    if out.shape[1] >= COLUMNS + 2 * E:
        for i in range(E):
            out[t, COLUMNS + E + i] = math.sqrt(s2) * state.std[i] if is_ready else np.inf
