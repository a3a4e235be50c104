"""The kernel of the general family A(q) y = B(q)/F(q) u + C(q)/D(q) e: regressors that depend on the parameters.

With r the lags of e, -v and -w, phi = [-y.. ; u.. ; r ; offset] and

    w_l = B_l u_l - (F_l - 1) w_l        v = A y - sum w_l - offset        e = D v - (C - 1) e = y - phi' theta

the prediction is phi' theta and its gradient psi = phi + sum_m theta_m dr_m/dtheta, m over c, d, f: each r has a row
of such derivatives, which follows the same recursion (Ljung and Soderstrom 1983, chapter 3). r and its rows are
renewed with the *new* theta. "plr" takes psi = phi (extended least squares; Landau's output error).

What is unknown in phi, after a gap or while theta moves fast (`follow.py`), has a covariance S. It is zero otherwise,
and then costs nothing.
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Size, Vector, kernel, open_scratch
from ...engine.elementary import pow
from ...engine.layout import Field, Layout
from ...engine.status import PROJECTED
from ...engine.ud import variances
from ...engine.views import matrix
from ...memory.gauss_markov import widen_within
from ...memory.questions import Change, take_along
from ...memory.wind_up import hold_within
from ...models.stability import is_inside, shrink_inside
from ..arx import step as _step  # noqa: F401  (registers the step)
from ..arx.row import CHI2, COUNT, OBSERVED, WEIGHT, Work, push, regress, renew, tell
from ..arx.step import steps_like_lags
from .follow import fade
from .gaps import regressor_variance, revise

RADIUS = 1.0 - 1e-3  # poles of the predictor stay within it
HALVINGS = 30
FIRST, FADING, YOUNG = 0.05, 0.99, 600.0  # forgetting at first, its decay per sample, and how long it lasts


@steps_like_lags
class Polynomials(NamedTuple):
    """The general family: `Lags`, and what else it needs."""

    R: float  # variance of e, relative to the scale
    exact: Size  # 1: psi is the gradient; 0: psi = phi
    kept: Size  # nc + nd + sum of nf
    nc: Size
    nd: Size
    nf: Vector
    start: float  # learnt samples before the prior of c, d, f becomes what it is to be (inf: it is that already)
    cap: Vector  # prior variances
    a_priori: Size  # 1: residuals by the parameters before the correction, 0: by those after it
    follows: Size  # 1: the memory finds out how fast theta moves, and the registers follow


KEPT = Layout(
    Field("is_uncertain", ("1",), "whether any of them is"),
    Field("seen", ("1",), "measured outputs when c, d, f were last set free"),
    Field("r", ("kept",), "lags of e, -v, -w"),
    Field("dr", ("kept * is_exact", "N"), "their derivatives"),
    Field("S", ("N", "N"), "covariance of the errors of the regressors"),
    Field("variances", ("N * follows",), "of theta after the last sample, before it drifts"),
    given=("N", "kept", "is_exact", "follows"),
)
open_registers = kernel(KEPT.open)


class Room(NamedTuple):
    """Views of the scratch."""

    s2: np.ndarray
    changed: np.ndarray  # whether theta or P were, by more than the sample
    lam: np.ndarray  # as the next two, of a `Change`
    moved: np.ndarray
    freed: np.ndarray
    phi: np.ndarray
    old: np.ndarray
    g: np.ndarray
    h: np.ndarray
    p: np.ndarray
    q: np.ndarray
    M: np.ndarray
    MS: np.ndarray


def sizes(N: int, kept: int, is_exact: bool, follows: bool) -> tuple[int, int]:
    """Return how many numbers the registers and the scratch need."""
    return KEPT.size(N, kept, is_exact, follows), 3 + 8 * N + 2 * N * N


@kernel
def open_kept(form, state):
    """Return the named views of the registers."""
    return open_registers(state.registers, int(form.N), int(form.kept), int(form.exact > 0.0), int(form.follows))


@kernel
def open_room(form, scratch):
    """Return the named views of the scratch."""
    N, own = int(form.N), scratch.own
    v = own[3 : 3 + 8 * N].reshape(8, N)
    squares = own[3 + 8 * N : 3 + 8 * N + 2 * N * N].reshape(2, N, N)
    return Room(own[:1], own[1:2], own[2:3], v[6], v[7], v[0], v[1], v[2], v[3], v[4], v[5], squares[0], squares[1])


@open_scratch.on(Polynomials)
def open_scratch_polynomials(form, buffer):
    N = int(form.N)
    v, own = matrix(buffer[: 5 * N], 5, N), buffer[5 * N :]
    return Work(v[0], v[1], v[2], v[3], v[4], own[3 : 3 + N], own)


@regress.on(Polynomials)
def regress_polynomials(form, state, scratch, s2):
    kept, room, theta, psi = open_kept(form, state), open_room(form, scratch), state.theta, scratch.psi
    phi, at = room.phi, state.ys.size
    for i in range(at):
        phi[i] = -state.ys[i]
    for l in range(state.held.size):
        first = int(form.nk[l])
        for lag in range(first, first + int(form.nb[l])):
            phi[at] = state.us[l, lag]
            at += 1
    free = at
    for m in range(kept.r.size):
        phi[free + m] = kept.r[m]
    if form.offset != 0.0:
        phi[phi.size - 1] = form.offset
    room.s2[0] = s2
    if form.follows > 0.0:
        fade(form, state, kept, room, free, s2)
    yhat = 0.0
    for i in range(phi.size):
        yhat += phi[i] * theta[i]
        psi[i] = phi[i]
        room.old[i] = theta[i]
    add_derivatives(psi, theta, kept.dr, free, 0, kept.dr.shape[0])
    return yhat, regressor_variance(form, state, kept, s2)


@kernel
def add_derivatives(psi, theta, dr, free, first, end):
    """psi += sum of theta_m dr_m over first <= m < end, where theta_m stands at free + m."""
    for m in range(first, end):
        c = theta[free + m]
        for i in range(psi.size):
            psi[i] += c * dr[m, i]


@renew.on(Polynomials)
def renew_polynomials(form, state, scratch, y, y_variance, innovation, T):
    kept, room, theta = open_kept(form, state), open_room(form, scratch), state.theta
    phi, na, nc, nd = room.phi, state.ys.size, int(form.nc), int(form.nd)
    N, M = theta.size, kept.r.size
    free = N - M - (1 if form.offset != 0.0 else 0)
    room.changed[0], room.lam[0] = 0.0, 1.0
    for i in range(N):
        room.moved[i] = room.freed[i] = 0.0
    status = restrain(form, theta, room, free)
    if kept.is_uncertain[0] > 0.0 or y_variance > 0.0:
        revise(form, state, kept, room, y, y_variance, free)

    total = 0.0
    for i in range(N):
        total += phi[i] * (room.old[i] if form.a_priori > 0.0 else theta[i])
    coloured = 0.0
    for i in range(free, free + nc + nd):
        coloured += phi[i] * theta[i]
    e = 0.0 if y_variance > 0.0 else y - total
    if y_variance > 0.0 and y == 0.0:  # lost: begin again from rest
        coloured = 0.0
    is_exact = kept.dr.shape[0] > 0
    g, h = room.g, room.h
    if is_exact:  # g = d yhat, h = its part in c and d
        for i in range(N):
            g[i] = phi[i]
            h[i] = phi[i] if free <= i < free + nc + nd else 0.0
        add_derivatives(g, theta, kept.dr, free, 0, M)
        add_derivatives(h, theta, kept.dr, free, 0, nc + nd)
        push_row(kept.dr, 0, nc, g, -1.0)
        for i in range(N):
            h[i] -= g[i]
        push_row(kept.dr, nc, nd, h, -1.0)
    push(kept.r[:nc], e)
    push(kept.r[nc : nc + nd], -(e + coloured))

    b, f = na, nc + nd
    for l in range(state.held.size):
        nb, nf = int(form.nb[l]), int(form.nf[l])
        if nf > 0:
            w = 0.0
            for i in range(b, b + nb):
                w += phi[i] * theta[i]
            for i in range(free + f, free + f + nf):
                w += phi[i] * theta[i]
            if is_exact:
                for i in range(N):
                    h[i] = phi[i] if b <= i < b + nb or free + f <= i < free + f + nf else 0.0
                add_derivatives(h, theta, kept.dr, free, f, f + nf)
                push_row(kept.dr, f, nf, h, -1.0)
            push(kept.r[f : f + nf], -w)
        b += nb
        f += nf
    push(state.ys, y)
    begin(form, state, kept, scratch, room, free)
    if form.follows > 0.0:
        variances(state.U, state.D, kept.variances)
    return status


@tell.on(Polynomials)
def tell_polynomials(form, memory, state, scratch, view):
    room = open_room(form, scratch)
    if room.changed[0] > 0.0:
        take_along(memory, state.memory_state, Change(room.moved, room.freed, room.lam[0]), view)


@kernel
def begin(form, state, kept, scratch, room, free):
    """Free c, d, f to a standard deviation of one; forget the first samples, which knew too little of e, v and w.

    1 - lambda falls from FIRST by the factor FADING per sample (Ljung and Soderstrom 1983, chapter 5).
    """
    head = state.head
    n = head[OBSERVED] - form.start
    if head[OBSERVED] == kept.seen[0] or n < 0.0 or n > YOUNG:
        return
    kept.seen[0] = head[OBSERVED]
    if n == 0.0:
        for i in range(free, free + kept.r.size):
            room.freed[i] = 1.0 / room.s2[0] - 1.0
            widen_within(state.U, state.D, i, room.freed[i], form.cap[i], scratch.b)
    lam = 1.0 - FIRST * pow(FADING, n)
    room.changed[0], room.lam[0] = 1.0, lam
    for j in range(state.D.size):
        state.D[j] /= lam
    hold_within(state.U, state.D, form.cap, scratch.c, scratch.f, scratch.b)
    head[COUNT] *= lam * lam
    head[CHI2] *= lam * lam
    head[WEIGHT] *= lam


@kernel
def push_row(rows, first, count, new, sign):
    """Shift ``count`` rows by one and put ``sign`` times ``new`` first."""
    for m in range(first + count - 1, first, -1):
        for i in range(new.size):
            rows[m, i] = rows[m - 1, i]
    if count > 0:
        for i in range(new.size):
            rows[first, i] = sign * new[i]


# --- stability ---------------------------------------------------------------------------------------------


@kernel
def is_stable(form, theta, room, free):
    """Say whether C and every F have their zeros within RADIUS."""
    nc = int(form.nc)
    if not is_inside(theta[free : free + nc], RADIUS, room.p, room.q):
        return False
    at = free + nc + int(form.nd)
    for l in range(form.nf.size):
        nf = int(form.nf[l])
        if not is_inside(theta[at : at + nf], RADIUS, room.p, room.q):
            return False
        at += nf
    return True


@kernel
def restrain(form, theta, room, free):
    """Halve the step of theta until the predictor is stable (Perriot-Mathonna's projection); return status.

    Where it was not stable before that step either, its roots are drawn in.
    """
    moved = room.moved
    if is_stable(form, theta, room, free):
        return 0
    for i in range(theta.size):
        moved[i] = theta[i]
    if not halve(form, theta, room, free):
        shrink_inside(theta[free : free + int(form.nc)], RADIUS, room.p, room.q)
        at = free + int(form.nc) + int(form.nd)
        for l in range(form.nf.size):
            shrink_inside(theta[at : at + int(form.nf[l])], RADIUS, room.p, room.q)
            at += int(form.nf[l])
    for i in range(theta.size):
        moved[i] = theta[i] - moved[i]
    room.changed[0] = 1.0
    return PROJECTED


@kernel
def halve(form, theta, room, free):
    """Halve the step of theta until the predictor is stable, at last to nothing; say whether it is."""
    for _ in range(HALVINGS):
        for i in range(theta.size):
            theta[i] = 0.5 * (theta[i] + room.old[i])
        if is_stable(form, theta, room, free):
            return True
    for i in range(theta.size):
        theta[i] = room.old[i]
    return is_stable(form, theta, room, free)
