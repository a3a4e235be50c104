"""`GreyBox` on a drawn record, beside the batch fit and the truth."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import lru_cache
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

import driftwise as dw

from .batch import Batch
from .drawing import Drawn, draw
from .simulation import simulate
from .told import is_tellable, window


class Found(NamedTuple):
    """What came of a record, and of the same one with a jump."""

    name: str
    number: int
    gap: float  # log posterior of the batch fit less that of the parameters at the end
    error: np.ndarray  # (m,) of the logarithms, over the Cramer-Rao bound
    batch_error: np.ndarray
    bound: np.ndarray  # (m,) that bound
    bar: np.ndarray  # (m,) error over the filter's own deviation
    false: int  # jumps told where there is none
    is_tellable: bool
    is_found: bool  # the jump: an alarm after it ..
    is_named: bool  # .. that names its parameter
    is_dated: bool  # .. and dates it within two time constants
    others: int  # jumps of other parameters, or before it
    jumped: str  # its parameter
    at: float  # and when, s
    words: str  # of what was told


@lru_cache
def estimator(name: str, jumps: str):
    """Return the estimator, with its defaults, and looking for jumps or not."""
    return dw.GreyBox(name, jumps=jumps or None)


def one(task: tuple[int, str, int]) -> Found:
    """Return what is found of one record."""
    drawn = draw(*task)
    (y, noise), (jumped, _) = simulate(drawn), simulate(drawn, jumps=True)
    batch, true = Batch(drawn, y), np.log(drawn.theta)
    state = scan(drawn, y, "").state
    est = estimator(drawn.name, "")
    eta = np.asarray(state["theta"])
    bars = np.sqrt(np.diag(est.covariance(state)))[-len(eta) :]
    bound, fit = batch.bound(noise), batch.fit([true])
    before = scan(drawn, y, "fit", slice(drawn.at))
    after = [scan(drawn, one, "fit", slice(drawn.at, None), before.state).jumps() for one in (y, jumped)]
    quiet, events = (before.jumps() + [later(e, drawn.at) for e in some] for some in after)
    mine = [e for e in events if e.sample >= drawn.at]
    named = [e for e in mine if e.parameter == drawn.names[drawn.which]]
    dated = [e for e in named if abs(e.since - drawn.at) <= window(drawn)]
    return Found(
        drawn.name, task[2], fit.value - batch.posterior(eta).value, (eta - true) / bound, (fit.eta - true) / bound,
        bound, (eta - true) / bars, len(quiet), is_tellable(drawn, jumped, noise),
        bool(mine), bool(named), bool(dated), len(events) - len(named),
        drawn.names[drawn.which], float(drawn.t[drawn.at]), "; ".join(e.text for e in events),
    )  # fmt: skip


def scan(drawn: Drawn, y, jumps: str, part=slice(None), state=None):
    """Return the trace of a part of a record, from a state."""
    y = (y if y.shape[1] > 1 else y[:, 0])[part]
    return estimator(drawn.name, jumps).scan(y, drawn.u[part], time=drawn.t[part], state=state)


def later(event, by: int):
    """Return an event of a part that begins at a sample."""
    return replace(event, sample=event.sample + by, since=(event.since or 0) + by)


def play(seed: int, names, records: int, processes: int | None = 1) -> list[Found]:
    """Return what is found of every record of each plant; on all cores where ``processes`` is None."""
    tasks = [(seed, name, number) for name in names for number in range(records)]
    processes = processes or os.cpu_count() or 1
    if processes == 1:
        return [one(task) for task in tasks]
    with ProcessPoolExecutor(processes, mp_context=get_context("forkserver")) as pool:
        return list(pool.map(one, tasks, chunksize=5))
