"""Samples in the order in which they come, taken as if they had come in order of time."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...engine.portable import Portable
from ...engine.status import Status
from ...results.snapshot import register
from ..base import Step, is_estimator
from ..common.late import LateBuffer

MEASURED = ("H", "D", "R")  # matrices that are of one sample, whatever came before it
SLACK = 0.01  # of dt: by how much an instant of a regular estimator may miss its place


@register
class OutOfOrder(Portable):
    """An estimator for samples that come late: each is put in its place, and those after it are run again.

    The estimator's state is then bit for bit that of the record in order. A sample that cannot be placed any more is
    refused and counted (status `LATE`), and changes nothing.

    Parameters
    ----------
    estimator : any that goes by instants
        `StateSpace`, `GreyBox`, `WindowObserver`, `ContinuousJoint`. Where its samples are regular a late one fills in
        what was missing in its place (``update(state, nan, time=3.0)``, and later ``update(state, 1.2, time=3.0)``).
    lag : float
        How late a sample may be, in seconds before the newest.
    samples : int
        How many are kept. It must reach over the lag: what is older than all of them is refused too.
    matrices : names, optional
        Those of H, D and R of a `StateSpace` that are handed over with each sample: which sensor it is of.

    Notes
    -----
    A late sample costs as many updates as there are samples after it; a state is ``samples`` times as long. Bad at:
    data that are late by more samples than one wants to keep, whose record is better sorted and scanned; and whoever
    acted on the estimate meanwhile.

    Examples
    --------
    >>> import driftwise as dw
    >>> est = dw.StateSpace(0.0, Q=0.1, R=1.0, P0=10.0, dt=1.0, continuous=True)
    >>> late = dw.estimators.OutOfOrder(est, lag=5.0)
    >>> state = late.start()
    >>> for time, y in ((0.0, 1.0), (3.0, 2.0), (1.5, 1.2), (9.0, 2.5), (3.5, 0.0)):
    ...     state, step = late.update(state, y, time=time)
    >>> in_order = est.scan([1.0, 1.2, 2.0, 2.5], time=[0.0, 1.5, 3.0, 9.0]).state
    >>> print(late.state_of(state) == in_order, state["late"], state["refused"], dw.Status(step.status).name)
    True 2.0 1.0 LATE
    """

    def __init__(self, estimator: Any, lag: float, *, samples: int = 64, matrices: tuple[str, ...] = ()):
        if not is_estimator(estimator) or not estimator.takes_instants:
            raise InputError(
                f"estimator must be one that goes by instants, as StateSpace, got {estimator!r}: others count their "
                "samples, and one that is late has no place among them"
            )
        self.estimator, self.lag = estimator, validation.positive("lag", lag)
        self.samples = validation.count("samples", samples, least=1)
        self.matrices = tuple(matrices)
        self.options = dict(estimator=estimator, lag=self.lag, samples=self.samples, matrices=list(self.matrices))
        has_own = hasattr(estimator, "system")
        if wrong := [name for name in self.matrices if name not in MEASURED or not has_own]:
            raise InputError(
                f"matrices are those of H, D and R of a StateSpace that say what a sample measures, got {wrong[0]!r}. "
                "What F, G and Q do between two samples changes when one comes in between: let them be functions of "
                "dt, or continuous=True"
            )
        if self.matrices and not estimator.irregular:
            raise InputError(
                "a regular StateSpace has one sample for each instant, of all its outputs, NaN where one is missing: "
                "matrices are for one of instants of its own (F and Q functions of dt, or continuous=True)"
            )

    def __repr__(self):
        return f"OutOfOrder({self.estimator!r}, lag={self.lag:g}, samples={self.samples})"

    @cached_property
    def buffer(self) -> LateBuffer:
        """How samples are kept and run again."""
        est, p = self.estimator, self.estimator.outputs or 1
        numbers = 1 + p + est.model.inputs + sum(getattr(est.system, name).size for name in self.matrices)
        irregular = getattr(est, "irregular", None)  # None: at any instants, and none of them twice
        slack = SLACK * est.dt if irregular is False else 0.0
        kind = irregular is True, irregular is False, slack
        return LateBuffer(self._run, est.width, numbers, self.lag, self.samples, *kind)

    @cached_property
    def dtype(self) -> np.dtype:
        """The type of a state."""
        return self.buffer.dtype

    unknown_parts = ("row", "before", "sample")  # of a state, where NaN says what is missing
    policies = members = ()

    def start(self) -> np.ndarray:
        """Return a fresh state."""
        state = np.zeros((), self.dtype)
        state["row"] = self.estimator.start().reshape(1).view(float)
        return state

    def update(self, state, y, u=None, *, time: float, **matrices) -> tuple[np.ndarray, Step]:
        """Return the next state and what this sample showed in its place; NaN means missing.

        Parameters
        ----------
        state : from `start` or `update`
        y : the output; with several (p,)
        u : the input, or a sequence of k inputs
        time : its instant in seconds, before or after those that came
        **matrices : those of ``matrices``; of the constructor where not given
        """
        est, p = self.estimator, self.estimator.outputs
        if getattr(state, "dtype", None) != self.dtype:
            raise InputError("the state belongs to another estimator: start one with start()")
        ys, us = validation.sample(y, u, est.model.inputs, p)
        stamp = validation.floats("time", time)
        if stamp.ndim or not np.isfinite(stamp):
            raise InputError(f"time must be one finite instant in seconds, got {time!r}")
        own = self._own(matrices)
        state, step = self.buffer.put(state, np.concatenate([[stamp], ys.ravel(), us.ravel(), *own]))
        if step is None:
            late, none = int(Status.LATE), np.full(p or 1, np.nan)
            step = Step(none, none, none + np.inf, np.full(p, late)) if p else Step(np.nan, np.nan, np.inf, late)
        return state, step

    def state_of(self, state) -> np.ndarray:
        """Return the estimator's own state: that of the samples so far, in order."""
        return np.array(state["row"]).view(self.estimator.dtype).reshape(())

    def estimate(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return what the estimator says of its state, and standard deviations."""
        return self.estimator.estimate(self.state_of(state))

    def _own(self, matrices) -> list[np.ndarray]:
        """Return the numbers of the matrices of a sample."""
        if wrong := [name for name in matrices if name not in self.matrices]:
            raise InputError(f"{wrong[0]!r} is no matrix of a sample here: OutOfOrder(.., matrices=({wrong[0]!r},))")
        found = []
        for name in self.matrices:
            usual = getattr(self.estimator.system, name)
            given = validation.floats(name, matrices.get(name, usual))
            if given.size != usual.size or not np.isfinite(given).all():
                raise InputError(f"{name} must have {usual.shape} finite numbers, got {given.tolist()}")
            found.append(given.ravel())
        return found

    def _run(self, row, sample):
        """Take one sample in order of time."""
        est, p = self.estimator, self.estimator.outputs
        at = 1 + (p or 1)
        y, u = sample[1:at] if p else sample[1], sample[at : at + est.model.inputs]
        at += est.model.inputs
        own = {}
        for name in self.matrices:
            usual = getattr(est.system, name)
            own[name], at = sample[at : at + usual.size].reshape(usual.shape), at + usual.size
        state = np.array(row).view(est.dtype).reshape(())
        state, step = est.update(state, y, u if est.model.inputs else None, time=float(sample[0]), **own)
        return np.ascontiguousarray(state).reshape(1).view(float), step
