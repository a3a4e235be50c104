"""What an alarm does to the covariance: everything is known less, or some parameters are."""

import math
from typing import NamedTuple

from ..engine.dispatch import Vector, kernel
from ..engine.status import JUMP
from .adapt import on_alarm, plain, stay, time_update
from .drift import widen_within
from .hold import hold_within


class GainReset(NamedTuple):
    """After an alarm the gain is 1/``samples`` again, and falls from there: P grows by one factor, nothing moves.

    The best value for jumps of size d is 1 + (noise of the estimate/d)^2, that of a single sample; more than 1.
    Source: Perriot-Mathonna (1981), section 4. Bad at: jumps of one parameter among many (all are freed).
    """

    samples: float = 10.0


class Jolt(NamedTuple):
    """What the kernel sees of `CovarianceInflation`: variances q, absolute; ``is_named``: for the parameter named."""

    q: Vector
    is_named: float
    cap: Vector


class Reset(NamedTuple):
    """What the kernel sees of `GainReset`."""

    samples: float
    cap: Vector


plain(Jolt, Reset)
time_update.on(Jolt, Reset)(stay)


@kernel
def log_volume(D):
    """Return log |P| of P = U D U', exactly known directions left out."""
    total = 0.0
    for i in range(D.size):
        if D[i] > 0.0:
            total += math.log(D[i])
    return total


@on_alarm.on(Jolt)
def on_alarm_jolt(memory, way, which, memory_state, weight, s2, U, D, scratch):
    known = log_volume(D)
    for i in range(D.size):
        if memory.is_named == 0.0 or which < 0.0 or which == i:
            widen_within(U, D, i, memory.q[i] / s2, memory.cap[i], scratch.b)
    # as many samples as would be left had all of P grown by one factor: |P'| = c^N |P|
    return weight * math.exp(min((known - log_volume(D)) / D.size, 0.0)), JUMP


@on_alarm.on(Reset)
def on_alarm_reset(memory, way, which, memory_state, weight, s2, U, D, scratch):
    left = memory.samples - 1.0
    if weight <= left:
        return weight, JUMP
    for j in range(D.size):
        D[j] *= weight / left
    hold_within(U, D, memory.cap, scratch.c, scratch.f, scratch.b)
    return left, JUMP
