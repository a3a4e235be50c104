"""Q up to a factor that is learnt as samples come: a step up the likelihood at each output, by exact derivatives.

With eta = log of the factor, and x, P relative to sigma^2 where that is learnt (`driftwise.memory.sensitivity`):

    dx <- F dx,   dP <- F dP F' + factor Q      over time;      both through the correction of each output
"""

import math
from typing import NamedTuple

import numpy as np

from ...engine import validation
from ...engine.dense import at
from ...engine.elementary import exp
from ...engine.errors import InputError
from ...engine.ud import entry
from ...memory.likelihood_drift import (
    LikelihoodDrift,
    begin_again,
    climb,
    derivatives,
    follow,
    learner_size,
    open_learner,
)
from ...memory.questions import question
from ...memory.settings import more_than_one


class NoiseFactor(NamedTuple):
    """What the kernel sees of a `LikelihoodDrift`: logarithms of the factor's start and limits, how it is learnt."""

    learns: float  # whether sigma^2 is learnt
    has_state: float  # 0: what another sigma^2 explains as well has its part in the score
    start: float
    least: float
    most: float
    samples: float
    tau: float
    prior: float
    home: float

    def state_size(self, states: int) -> int:
        """Return how many numbers it keeps."""
        return learner_size(states, 1)


def noise_factor(memory: LikelihoodDrift, is_relative: bool) -> NoiseFactor:
    """Return how Q's factor is learnt: it begins at 1; the settings' limits are relative to their start."""
    least, start, most = (validation.positive(name, getattr(memory, name)) for name in ("least", "start", "most"))
    if not least <= start <= most:
        raise InputError(f"start lies between least and most, got {start!r}, {least!r} and {most!r}")
    if np.any(np.asarray(memory.phi) != 1.0):
        raise InputError(
            f"phi is about parameters that return to their mean: here F says how the state moves, got {memory.phi!r}"
        )
    return NoiseFactor(
        float(is_relative), 0.0, 0.0, math.log(least / start), math.log(most / start),
        more_than_one("samples", memory.samples), 1.0, validation.positive("prior", memory.prior), 0.0,
    )  # fmt: skip


# --- what a step asks -------------------------------------------------------------------------------------------


@question
def factor_of(memory, memory_state):
    """Return what multiplies Q. Plain: 1."""
    return 1.0


@question
def carry_derivatives(memory, memory_state, F, Uq, Dq, fade, is_lost, Y):
    """Take what is learnt of the factor over the time between samples; ``Y`` (n, 2 n) is scratch. Plain: nothing."""


@question
def learn_factor(memory, memory_state, h, b, e, T, s2, observed, v):
    """Take in one output that was taken: row h, b = P h, innovation, T. Plain: nothing is learnt."""


@factor_of.on(NoiseFactor)
def factor_of_noise(memory, memory_state):
    return exp(memory_state[0])


@carry_derivatives.on(NoiseFactor)
def carry_derivatives_noise(memory, memory_state, F, Uq, Dq, fade, is_lost, Y):
    n = Dq.size
    learner = open_learner(memory_state, n, 1)
    if is_lost > 0.0:
        begin_again(learner, 0)
        return
    dx, dP = derivatives(learner, 0)
    factor = exp(learner.eta[0])
    for i in range(n):
        Y[i, n] = 0.0
        for j in range(n):
            Y[i, n] += F[i * n + j] * dx[j]
            Y[i, j] = 0.0
            for l in range(n):
                Y[i, j] += F[i * n + l] * dP[at(min(l, j), max(l, j))]
    for j in range(n):
        dx[j] = Y[j, n]
        for i in range(j + 1):
            moved = q = 0.0
            for l in range(n):
                moved += Y[i, l] * F[j * n + l]
            for l in range(j, n):
                q += entry(Uq, i, l) * Dq[l] * entry(Uq, j, l)
            dP[at(i, j)] = moved / fade + factor * q


@learn_factor.on(NoiseFactor)
def learn_factor_noise(memory, memory_state, h, b, e, T, s2, observed, v):
    learner = open_learner(memory_state, h.size, 1)
    follow(learner, h, b, e, T, s2, 1.0, v)
    if observed > 2.0 * h.size:
        climb(memory, learner, e / math.sqrt(s2 * T), 1.0)


# --- reading ----------------------------------------------------------------------------------------------------


def learnt(memory: NoiseFactor, numbers, states: int) -> tuple[float, float]:
    """Return the factor, and the deviation of its logarithm by the information so far."""
    learner = open_learner(np.array(numbers), states, 1)
    loose, known = 1.0 / memory.prior**2, float(learner.known[0])
    shared = float(learner.shares[0]) ** 2 / (known + loose) if memory.learns else 0.0
    return math.exp(learner.eta[0]), 1.0 / math.sqrt(float(learner.J[0]) - shared + loose)
