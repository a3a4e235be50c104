"""Directional forgetting: only what the new sample speaks about is forgotten."""

import math
from typing import NamedTuple

from ..engine.dispatch import Vector
from ..engine.ud import covariances, predicted_variance, project, widen_along
from .adapt import adapt, by_least_squares, plain, time_update
from .hold import shrink


class DirectionalForgetting(NamedTuple):
    """Forget by the factor ``lam`` what the regressors psi of the new sample speak about; all else is kept as it is.

    Before each correction P <- P + (1/lam - 1) d d', d = P psi/sqrt(psi' P psi): the prediction's variance psi' P psi
    grows by 1/lam. In terms of information R <- R - (1 - lam) psi psi'/(psi' P psi), which cannot lose positivity, and
    knows no units. One direction of N is forgotten per sample, so the memory is N/(1 - lam) samples, N times that of
    `ExponentialForgetting`, even where all are excited; directions that never are, are never forgotten.

    Source: Kulhavy (1987), Automatica 23, 589-600. Bad at: following jumps and drift (unless lam makes up for N; after
    a jump the bars are too narrow for two or three memories); a regressor hundreds of times larger than the others,
    whose direction then stays put for long; and regressors that shrink to noise, which forget as much as large ones and
    teach nothing (held as in `ExponentialForgetting`). On constant parameters bars are too wide, as there.
    """

    lam: float


class Along(NamedTuple):
    """What the kernel sees of `DirectionalForgetting`."""

    lam: float
    horizon: float
    cap: Vector


plain(Along)


@adapt.on(Along)
def adapt_along(memory, memory_state, e, R, s2, theta, U, D, scratch):
    known = predicted_variance(scratch.f, D, 0.0)
    if memory.lam < 1.0 and known > 0.0:
        covariances(U, D, scratch.f, scratch.c)
        for i in range(D.size):
            scratch.c[i] /= math.sqrt(known)
        widen_along(U, D, scratch.c, 1.0 / memory.lam - 1.0, D.size - 1)
        project(U, scratch.psi, scratch.f)
    return by_least_squares(memory, memory_state, e, R, s2, theta, U, D, scratch)


@time_update.on(Along)
def time_update_along(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    if not (surprise >= 0.0 and memory.lam < 1.0):
        return 1.0, 0
    return memory.lam, shrink(U, D, 1.0, weight, memory.horizon, memory.cap, memory_state, scratch)
