"""One scan of a manoeuvring target: the joint filter's step, and a free pole that takes the state along when it moves.

The state of the position form holds phi times old positions (A = (1 - phi q)(1 - q)^2 multiplies them into it):
whatever moves phi between scans, a walk or a limit, moves x with it, along

    j = d(x_3, x_2, x_1, a1, a2, a3)/d phi = (0, y_{t-1} - 2 y_t, y_t, -1, 2, -1)

for the state that awaits y_{t+1}. Then it is the same filter as the one of second differences, which has no such
memory. A position not seen stands here by its prediction.
"""

import math

import numpy as np

from ...engine.dispatch import advance, kernel
from ...engine.status import BAD_VALUE, CAPPED, LOST, MISSING_OUTPUT, PROJECTED, REJECTED, SKIPPED
from ...engine.ud import variance, widen_along
from ...models.scale import sigma2
from ..joint.row import CHI2, HUGE, OBSERVED, PEAK, SAMPLES, STATUS, TOP
from ..joint.step import step, write
from .row import BEFORE, ELAPSED, LAST, PLOTS, ManoeuvreForm

PHI = 5  # where the free pole stands in s, as a3 = -phi; a1 = a3 - 2, a2 = 1 - 2 a3


@kernel
def lean(track, a):
    """Fill ``a`` with j."""
    a[0], a[1], a[2] = 0.0, track[BEFORE] - 2.0 * track[LAST], track[LAST]
    a[3], a[4], a[5] = -1.0, 2.0, -1.0


@kernel
def place(form, R, s, U, D, track):
    """Set the state that two plots leave: x = (2 y - y', -y, 0) + phi j, each with a variance of its own."""
    now, before, phi = track[LAST], track[BEFORE], -s[PHI]
    s[0], s[1], s[2] = 2.0 * now - before, -now + phi * (before - 2.0 * now), phi * now
    for i in range(3):
        D[i] = form.spread * R
    for j in range(D.size):
        for i in range(min(j, 3)):
            U[j * (j - 1) // 2 + i] = 0.0
    at = PHI * (PHI - 1) // 2
    U[at + 1], U[at + 2] = 2.0 * now - before, -now


@kernel
def begin(form, noise, scale, state, scratch, z, out, t):
    """Take one of the two plots before which nothing is known; return a status."""
    head, track, s, s2 = state.head, state.track, state.s, sigma2(scale, state.head[OBSERVED], state.head[CHI2])
    seen = abs(z) < HUGE
    status = SKIPPED if seen else MISSING_OUTPUT if z != z else MISSING_OUTPUT | BAD_VALUE
    head[PEAK] *= 0.75
    widest = max(form.Px, 100.0 * head[TOP] * head[TOP] / s2)
    track[ELAPSED] += 1.0
    spread = widest if track[PLOTS] == 0.0 else track[ELAPSED] * track[ELAPSED] * form.Px + noise.R
    yhat = track[LAST]
    write(
        form, noise, scale, out, t, state, scratch, yhat, z - yhat if seen else np.nan, s2 * (spread + noise.R), status
    )
    if seen:
        head[PEAK], head[TOP] = max(head[PEAK], abs(z)), max(head[TOP], abs(z))
        track[LAST], track[BEFORE] = z, z if track[PLOTS] == 0.0 else z - (z - yhat) / track[ELAPSED]
        track[PLOTS] += 1.0
        track[ELAPSED] = 0.0
        s[0] = z
        if track[PLOTS] == 2.0:
            place(form, noise.R, s, state.U, state.D, track)
    head[SAMPLES] += 1.0
    return status


@kernel
def follow(form, state, scratch, z, yhat, status):
    """Hold two poles at one, the third within its limit, and let it walk; return the status."""
    track, s, U, D, j = state.track, state.s, state.U, state.D, scratch.c
    if status & LOST:
        track[PLOTS] = 0.0
        return status
    is_used = status & (MISSING_OUTPUT | REJECTED) == 0
    track[BEFORE], track[LAST] = track[LAST], z if is_used else yhat
    lean(track, j)
    beyond = -s[PHI] - math.copysign(form.limit, -s[PHI])
    if is_used and abs(s[PHI]) > form.limit:
        for i in range(s.size):
            s[i] -= beyond * j[i]
        status |= PROJECTED
    s[3], s[4] = s[PHI] - 2.0, 1.0 - 2.0 * s[PHI]
    if form.walk > 0.0:
        room = max(form.cap - variance(U, D, PHI), 0.0)
        widen_along(U, D, j, min(form.walk, room), PHI)
        status |= CAPPED if room < form.walk else 0
    return status


@advance.on(ManoeuvreForm)
def advance_manoeuvre_form(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    if state.track[PLOTS] < 2.0:
        status = begin(form, noise, scale, state, scratch, y[t, 0], out, t)
    else:
        step(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t)
        status = follow(form, state, scratch, y[t, 0], out[t, 0], int(out[t, 3]))
    out[t, 3] = status
    state.head[STATUS] = status
