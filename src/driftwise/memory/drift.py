"""How the parameters may move between samples: not at all, or as a random walk."""

from typing import NamedTuple

from ..kernel.compose import Vector, choice
from ..kernel.status import CAPPED
from ..kernel.ud import variance, widen


class Never(NamedTuple):
    """Nothing is forgotten: constant parameters, gain 1/n. Bad at plants that change."""


class Walk(NamedTuple):
    """Each parameter takes a random step of variance ``q`` per sample, never wider than its prior.

    ``q`` is one number or one per parameter (order of ``state["theta"]``), in the units of `y_scale` and `u_scale`,
    and relative to sigma^2 where the scale is unknown. ``cap`` is filled in from the prior: without excitation the
    covariance stays bounded.
    Bad at rare jumps: a q that follows them quickly is noisy in between.
    """

    q: Vector
    cap: Vector = ()


@choice
def drift(memory, U, D, n, scratch):
    """Widen U D U' by one sample's drift and return a status bit."""


@drift.on(Never)
def _(memory, U, D, n, scratch):
    return 0


@drift.on(Walk)
def _(memory, U, D, n, scratch):
    status = 0
    for i in range(memory.q.size):
        q = memory.q[i]
        if q > 0.0:
            room = memory.cap[i] - variance(U, D, n + i)
            if room < q:
                q = max(room, 0.0)
                status = CAPPED
            widen(U, D, n + i, q, scratch)
    return status
