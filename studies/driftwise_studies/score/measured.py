"""A memory over the records of one system: its error, its bars, the jumps it tells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwise import Status

from .told import SKIP, error, estimator
from .worlds import Records, System

BAR = 1.96
AFTER, HEARD = 15, 50  # samples after a jump in which bars are counted; within which a jump counts as told


class Measured(NamedTuple):
    """What came out on one system; NaN where there is nothing to count."""

    error: float  # root mean square, in deviations
    inside: float  # share of the parameters that the 95 % bars hold
    after: float  # the same within `AFTER` samples after a jump
    after_tellable: float  # and after those that could be told
    told: np.ndarray  # (S, J), whether each jump was
    false: float  # other jumps told, a record
    louder: float  # steps of the noise told, a record


def measure(system: System, r: Records, tellable, memory) -> Measured:
    """Run a memory over every record of a system, nothing told."""
    est = estimator(system, memory)
    est = est.scaled_to(r.y[0], r.u[0] if r.u.shape[2] else None)
    S, T, _ = r.theta.shape
    squares, inside, told, false, louder = [], np.empty(r.theta.shape, bool), np.zeros(r.jumps.shape, bool), [], []
    for s in range(S):
        trace = est.scan(r.y[s], r.u[s] if r.u.shape[2] else None)
        squares.append(error(system, trace.parameters, r.theta[s]))
        inside[s] = np.abs(trace.parameters - r.theta[s]) < BAR * trace.parameters_std
        jump = trace.status & int(Status.JUMP) != 0
        louder.append(np.sum(trace.status & int(Status.NOISE) != 0))
        for j, k in enumerate(r.jumps[s]):
            told[s, j] = jump[k : k + HEARD].any()
            jump[k : k + HEARD] = False
        false.append(jump.sum())
    near, tell = np.zeros((S, T), bool), np.zeros((S, T), bool)
    for s, j in np.ndindex(r.jumps.shape):
        k = r.jumps[s, j]
        near[s, k : k + AFTER] = True
        tell[s, k : k + AFTER] |= tellable[s, j]
    share = lambda where: float(inside[where].mean()) if where.any() else float("nan")  # noqa: E731
    return Measured(
        float(np.sqrt(np.mean(squares))), float(inside[:, SKIP:].mean()), share(near), share(tell), told,
        float(np.mean(false)), float(np.mean(louder)),
    )  # fmt: skip
