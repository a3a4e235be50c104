"""A memory over the records of one system: its error, its bars, the jumps it tells."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from driftwise import Status

from .simulation import Records
from .system import System
from .told import SKIP, Told, error, estimator

BAR = 1.96
AFTER, HEARD = 15, 50  # samples after a jump in which bars are counted; within which a jump counts as told


class Measured(NamedTuple):
    """What came out on one system; NaN where there is nothing to count."""

    error: float  # root mean square, in deviations
    ratio: float  # over the reference
    over_oracle: float  # over the filter that is told the jumps
    inside: float  # share of the parameters that the 95 % bars hold
    after: float  # the same within `AFTER` samples after a jump
    after_tellable: float  # after those that could be told
    after_told: float  # and once one is told
    told: np.ndarray  # (S, J), whether each jump was
    false: float  # other jumps told, a record
    steps: float  # steps of the noise told, a record
    ns: float  # of processor time, a sample


def measure(system: System, r: Records, told: Told, memory) -> Measured:
    """Run a memory over every record of a system; the estimator is told nothing."""
    inputs = [u if u.shape[1] else None for u in r.u]
    est = estimator(system, memory)
    est.scan(r.y[0, :20], inputs[0] if inputs[0] is None else inputs[0][:20])  # compiles
    squares, inside, heard_at, false, steps = [], np.empty(r.theta.shape, bool), np.zeros(r.jumps.shape, int), [], []
    began = time.thread_time()
    traces = [est.scan(y, u) for y, u in zip(r.y, inputs)]
    ns = 1e9 * (time.thread_time() - began) / r.y.size
    for s, trace in enumerate(traces):
        squares.append(error(system, trace.parameters, r.theta[s]))
        inside[s] = np.abs(trace.parameters - r.theta[s]) < BAR * trace.parameters_std
        jump = trace.status & int(Status.JUMP) != 0
        steps.append(np.sum(trace.status & int(Status.NOISE) != 0))
        for j, k in enumerate(r.jumps[s]):
            soon = np.flatnonzero(jump[k : k + HEARD])
            heard_at[s, j] = k + soon[0] if len(soon) else 0
            jump[k : k + HEARD] = False
        false.append(jump.sum())
    rms = float(np.sqrt(np.mean(squares)))
    every = np.ones_like(told.tellable)
    return Measured(
        rms,
        rms / told.reference,
        rms / told.oracle,
        float(inside[:, SKIP:].mean()),
        held_after(inside, r.jumps, every),
        held_after(inside, r.jumps, told.tellable),
        held_after(inside, heard_at, heard_at > 0),
        heard_at > 0,
        float(np.mean(false)),
        float(np.mean(steps)),
        ns,
    )


def held_after(inside, jumps, counted) -> float:
    """Return the share of the parameters that bars hold soon after the jumps that are ``counted``."""
    near = np.zeros(inside.shape[:2], bool)
    for s, j in zip(*np.nonzero(counted)):
        near[s, jumps[s, j] : jumps[s, j] + AFTER] = True
    return float(inside[near].mean()) if near.any() else float("nan")
