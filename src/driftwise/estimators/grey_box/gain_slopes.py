"""What is missing of a joint filter to the exact gradient of its likelihood: how its gain depends on the parameters.

A joint Gaussian is p(theta) p(x | theta), and in U D U' it is written so (`common.given_state`): the filter's state
moves with the parameters by A = dx/dtheta, and p(x | theta) has the covariance P of a filter that knows them. The
extended Kalman filter carries A as if the gain K of that filter did not depend on theta, so that its estimate is that
of no likelihood (Ljung, 1979). With dP the slopes of P by one parameter, F, H, Q and R as usual, and d their slopes,

    dP <- dF P F' + F P dF' + F dP F' + dQ                                             from one sample to the next,
    dS = 2 dh'P h + h'dP h,    dK = (dP h + P dh - K dS)/S,    A <- A - K psi' + dK e       at an output h,
    dP <- dP - (g h'P + P h g')/S + P h h'P dS/S^2,            g = dP h + P dh

and the log density of e, -log(S)/2 - e^2/2S, says something of theta by S as well: the row dS/S, of which e^2/S - 1
is a measurement of variance 2. This is recursive prediction error identification (Ljung and Soderstrom, 1983,
section 3.7; Moore and Weiss, 1979, Automatica 15, 301-314). F, h and Q are exact; their slopes, in the direction
in which the state moves along, are central differences. Where sigma^2 is learnt, a dS/S that all samples share would be
taken for it: it is the deviation from their mean that counts.
"""

import math

from ...engine.dense import at
from ...engine.dispatch import kernel
from ...engine.ud import covariances, expand, marginal, measurement_update, project
from ...models.formula_kernels import show
from ..common.given_state import put_together, slopes
from ..joint.row import HUGE
from .transform import in_units
from .transition import step_plant

STEP = 1e-4  # of central differences, in deviations of the prior


@kernel
def is_wanted(form, D):
    """Return 1 where these slopes are: of some parameter that is not known."""
    wanted = 0.0
    for j in range(int(form.m)):
        wanted = form.exact if D[int(form.n) + j] > 0.0 else wanted
    return wanted


@kernel
def find_slopes(form, state, room):
    """Fill A, the slopes of the state by the parameters."""
    marginal(state.U, int(form.n), int(form.m), room.U)
    slopes(state.U, room)


@kernel
def step_aside(form, j, h, s, room, scratch):
    """Fill point and values: parameter j larger by h, and the state where it then were."""
    n = int(form.n)
    for l in range(s.size):
        scratch.point[l] = s[l] + (h * room.A[l, j] if l < n else 0.0)
    scratch.point[n + j] += h
    in_units(form, scratch.point[n:], scratch.values, scratch.rates)


@kernel
def differentiate_step(form, plant, seconds, s, state, room, scratch):
    """Fill the slopes of F and of Q by each parameter, (m, n n) each."""
    n = int(form.n)
    for j in range(int(form.m)):
        h = STEP * form.spread[j]
        for turn in range(2):
            way = 1.0 if turn == 0 else -1.0
            step_aside(form, j, way * h, s, room, scratch)
            step_plant(form, plant, scratch.point[:n], state.held, seconds, 0, scratch)
            for i in range(n):
                for l in range(n):
                    F, Q = way * scratch.J[i, l] / (2.0 * h), way * scratch.Q[i, l] / (2.0 * h)
                    scratch.dF[j, i * n + l] = F if turn == 0 else scratch.dF[j, i * n + l] + F
                    scratch.dQ[j, i * n + l] = Q if turn == 0 else scratch.dQ[j, i * n + l] + Q


@kernel
def differentiate_outputs(form, plant, s, state, room, scratch):
    """Fill the slopes of what each output's slopes by the state are, (m, p n)."""
    n, p = int(form.n), int(form.outputs)
    for j in range(int(form.m)):
        h = STEP * form.spread[j]
        for turn in range(2):
            way = 1.0 if turn == 0 else -1.0
            step_aside(form, j, way * h, s, room, scratch)
            show(plant, scratch.point[:n], state.held, scratch.values, scratch.y, scratch.rows)
            for i in range(p):
                for l in range(n):
                    slope = way * scratch.rows[i, l] / (2.0 * h)
                    scratch.dH[j, i * n + l] = slope if turn == 0 else scratch.dH[j, i * n + l] + slope


@kernel
def pass_slopes(form, state, scratch):
    """Take the slopes of P to the next sample; ``J`` begins with F, and P is what it was before."""
    n, P, J, half = int(form.n), scratch.P, scratch.J, scratch.half
    expand(state.U, state.D[:n], scratch.packed)
    for i in range(n):
        for l in range(i, n):
            P[i, l] = P[l, i] = scratch.packed[at(i, l)]
    for j in range(int(form.m)):
        own, dF = state.dP[j], scratch.dF[j]
        for i in range(n):  # (dF P + F dP/2) F' and its transpose
            for l in range(n):
                half[i, l] = 0.0
                for r in range(n):
                    half[i, l] += dF[i * n + r] * P[r, l] + 0.5 * J[i, r] * own[r * n + l]
        for i in range(n):
            for l in range(n):
                total = scratch.dQ[j, i * n + l]
                for r in range(n):
                    total += half[i, r] * J[l, r] + J[i, r] * half[l, r]
                own[i * n + l] = total


@kernel
def differentiate_gain(form, state, scratch, i, S):
    """Fill dK and dS/S of output i, whose row is psi and f = U'psi, and take dP on behind it; S is that given theta."""
    n, b = int(form.n), scratch.b
    covariances(state.U, state.D[:n], scratch.f[:n], b)  # P h
    for j in range(int(form.m)):
        own, g = state.dP[j], scratch.dK[j]
        for l in range(n):
            scratch.dx[l] = scratch.dH[j, i * n + l] / state.noise[i]
        project(state.U, scratch.dx, scratch.next)
        covariances(state.U, state.D[:n], scratch.next, g)  # P dh
        slope = 0.0
        for l in range(n):
            for r in range(n):
                g[l] += own[l * n + r] * scratch.psi[r]
            slope += g[l] * scratch.psi[l] + scratch.dx[l] * b[l]
        is_number = 1.0 if abs(slope) < HUGE else 0.0
        scratch.of_S[j] = slope / S if is_number > 0.0 else 0.0
        for l in range(n):
            for r in range(n):
                less = (g[l] * b[r] + b[l] * g[r] - b[l] * b[r] * scratch.of_S[j]) / S
                own[l * n + r] = own[l * n + r] - less if is_number > 0.0 else 0.0
        for l in range(n):
            g[l] = (g[l] - b[l] * scratch.of_S[j]) / S if is_number > 0.0 else 0.0


@kernel
def move_with_gain(form, s, state, room, scratch, e, S, T, s2, nu):
    """Let the state move with the parameters as its gain does, and take in what the size of e says of them.

    ``nu``: degrees of freedom of sigma^2; of the density of Student that e then has the slope by log S is bounded.
    """
    n, m, share = int(form.n), int(form.m), 1.0
    find_slopes(form, state, room)
    for j in range(m):
        for l in range(n):
            room.A[l, j] += scratch.dK[j, l] * (e * S / T)  # what is left of e at the new estimate
    put_together(state.U, room)
    z2 = e * e / (s2 * T)
    if nu < HUGE:
        z2, share = z2 * (nu + 1.0) / (nu + z2), nu / (nu + 3.0)  # of the information of a normal density
    state.sizes[m] += 1.0
    for j in range(m):
        state.sizes[j] += (scratch.of_S[j] - state.sizes[j]) / state.sizes[m]
        own = scratch.of_S[j] - (state.sizes[j] if nu < HUGE else 0.0)
        scratch.psi[n + j] = math.sqrt(0.5 * share * s2) * own
    for l in range(n):
        scratch.psi[l] = 0.0
    project(state.U, scratch.psi, scratch.f)
    innovation = math.sqrt(0.5 * s2 / share) * (z2 - 1.0)
    measurement_update(s, state.U, state.D, scratch.f, innovation, 1.0, scratch.b)
