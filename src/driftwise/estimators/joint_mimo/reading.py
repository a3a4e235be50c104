"""Running an estimator of several outputs: sample, record, fleet."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine import validation
from ...results.mimo_trace import TraceMIMO
from ...results.trace import width
from ..base import Rows, Step


class ReadingMIMO(Rows):
    """What estimators of several outputs have in common: y is (p,) where that of one output is a number."""

    scale: Any
    groups: list[list[int]]  # outputs that share a scale
    spent: np.ndarray  # (groups,) unknowns on which the reference prior of a learnt scale spends one half each
    is_split: bool
    unknowns: Any
    prior_covariance: np.ndarray
    trace_kind = TraceMIMO
    link_words = "estimate them together with NoiseCovariance"  # what to do where innovations are correlated

    def update(self, state, y, u=None) -> tuple[np.ndarray, Step]:
        """Return the next state and what this sample showed, (p,) each; NaN means missing.

        Parameters
        ----------
        state : from `start`, `update`, or a trace
        y : (p,) the outputs
        u : the input, or a sequence of k inputs
        """
        rows, p = self._rows(state), self.model.outputs
        ys, us = validation.sample(y, u, self.model.inputs, p)
        outs = np.empty((1, 1, 4 * p))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        prediction, innovation, variance, status = outs.reshape(4, p)
        return np.ndarray((), self.dtype, rows), Step(prediction, innovation, variance, status.astype(int))

    def scan(self, y, u=None, *, state=None, keep: str = "std", time=None):
        """Run over a record and return its trace; ``trace.state`` continues where it ended.

        Parameters
        ----------
        y : (T, p) outputs; NaN where missing
        u : (T,) or (T, k) inputs; NaN where missing
        state : state to start from; a fresh one if omitted
        keep : "innovations", "means", "std" or "covariance": how much of each sample the trace holds
        time : (T,) instants in seconds; multiples of dt if omitted
        """
        p = self.model.outputs
        y, u = validation.record(y, u, self.model.inputs, p)
        start = self.start() if state is None else state
        rows = self._rows(start)
        outs = np.empty((1, len(y), width(keep, self.model.N, self.columns * p)))
        self.drive(rows, y[None], u[None], outs, self.spec, self.scratch())
        before = np.array(np.asarray(start)["observed"])
        trace = TraceMIMO(self, y, u, outs[0], keep, rows.view(self.dtype).reshape(()), before, time)
        trace.begun = np.array(start)
        return trace

    def update_batch(self, states, y, u=None):
        """Advance a fleet: one state, and one sample or a stretch of samples, per series.

        Parameters
        ----------
        states : (S,) states
        y : (S, p) or (S, T, p) outputs
        u : (S,), (S, k) or (S, T, k) inputs

        Returns
        -------
        states : (S,) new states
        steps : Step of arrays shaped like y
        """
        rows, p = self._rows(states, is_one=False), self.model.outputs
        ys, us, shape = validation.fleet(y, u, len(rows), self.model.inputs, p)
        outs = np.empty((*ys.shape[:2], 4 * p))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        prediction, innovation, variance, status = (outs[..., p * i : p * i + p].reshape(shape) for i in range(4))
        step = Step(prediction, innovation, variance, status.astype(int))
        return rows.view(self.dtype).reshape(np.shape(states)), step
