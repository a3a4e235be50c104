"""Directional forgetting: only what the new sample speaks about is forgotten."""

from typing import NamedTuple

from ..kernel.compose import Vector
from ..kernel.ud import project, quadratic, widen_along
from .adapt import age, by_least_squares, learn, plain
from .hold import shrink


class DirectionalForgetting(NamedTuple):
    """Forget by the factor ``p``, along the regressors of the new sample only; all else is kept as it is.

    Before each correction P <- P + (1 - p)/p d d'/(d' P^-1 d), which cannot lose positivity; d are the regressors
    times the prior variances, so that units do not matter. Directions that are never excited are never forgotten.
    Source: Cao and Schwartz (2000), who have d = psi (equal prior variances). Bad at:
    regressors that shrink to noise, which forget as much as large ones and teach nothing (held as in `Weighted`), and
    at following a drift in directions that are excited rarely.
    """

    p: float


class Along(NamedTuple):
    """What the kernel sees of `DirectionalForgetting`."""

    p: float
    horizon: float
    cap: Vector


plain(Along)


@learn.on(Along)
def _(memory, cells, e, R, s2, theta, U, D, work):
    for i in range(D.size):
        work.c[i] = memory.cap[i] * work.psi[i]
    known = quadratic(U, D, work.c, work.b)
    if memory.p < 1.0 and known > 0.0:
        widen_along(U, D, work.c, (1.0 - memory.p) / (memory.p * known), D.size - 1)
        project(U, work.psi, work.f)
    return by_least_squares(memory, cells, e, R, s2, theta, U, D, work)


@age.on(Along)
def _(memory, cells, weight, surprise, share, s2, theta, U, D, work):
    if not (surprise >= 0.0 and memory.p < 1.0):
        return 1.0, 0
    return memory.p, shrink(U, D, 1.0, weight, memory.horizon, memory.cap, cells, work)
