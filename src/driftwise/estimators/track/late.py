"""Plots of one object in the order in which they come, taken as if they had come in order of time."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...engine.portable import Portable
from ...results.snapshot import register
from ..common.late import COUNTS, LateBuffer
from . import former
from .estimator import TrackEstimator, TrackStep


@register
class LatePlots(Portable):
    """A `TrackEstimator` for plots that come late, of several sensors say: each is put in its place.

    The estimator's state is then bit for bit that of the plots in order of time. A plot that cannot be placed any more
    is refused and counted: more than ``lag`` before the newest, before all that are kept, or at the very time of
    another one.

    Parameters
    ----------
    estimator : TrackEstimator, float or str
        Or a speed or class, as there.
    lag : float
        How late a plot may be, in seconds before the newest.
    plots : int
        How many are kept. They must reach over the lag: what is older than all of them is refused too.

    Notes
    -----
    A late plot costs as many updates as there are plots after it, 10 us each; a state is ``plots`` times as long as the
    estimator's. `Tracker` does the same for many objects: ``delay=lag``, and ``tracker.now()``. Bad at: whoever acted
    on the estimate meanwhile.

    Examples
    --------
    >>> import driftwise as dw
    >>> from driftwise.estimators.track.late import LatePlots
    >>> late = LatePlots("boat", lag=10.0)
    >>> state = late.start()
    >>> for time in (0.0, 4.0, 12.0, 8.0, 1.0):
    ...     state, step = late.update(state, time, (3 * time, 50 - time))
    >>> in_order = late.estimator.scan([0.0, 4.0, 8.0, 12.0], [(0, 50), (12, 46), (24, 42), (36, 38)]).state
    >>> print(late.state_of(state).tobytes() == in_order.tobytes(), state["late"], state["refused"], step)
    True 2.0 1.0 None
    """

    policies = members = ()
    unknown_parts = ("row", "before", "sample")  # of a state, where NaN says what is not known

    def __init__(self, estimator: TrackEstimator | float | str, lag: float, *, plots: int = 64):
        self.estimator = estimator if isinstance(estimator, TrackEstimator) else TrackEstimator(estimator)
        self.lag, self.plots = validation.positive("lag", lag), validation.count("plots", plots, least=1)
        self.options: dict[str, Any] = dict(estimator=self.estimator, lag=self.lag, plots=self.plots)

    def __repr__(self):
        return f"LatePlots({self.estimator!r}, lag={self.lag:g}, plots={self.plots})"

    @cached_property
    def buffer(self) -> LateBuffer:
        """How plots are kept and run again."""
        C = self.estimator.coordinates
        return LateBuffer(self._run, self.estimator.dtype.itemsize // 8, 1 + 2 * C, self.lag, self.plots)

    @property
    def dtype(self) -> np.dtype:
        """The type of a state."""
        return self.buffer.dtype

    def carried_over(self, rows) -> np.ndarray:
        """Return rows of states, whose estimator's are of a former layout, as they are laid out now."""
        counts = len(COUNTS)
        for was in former.sizes(self.estimator.coordinates):
            end = counts + (1 + self.plots) * was
            if rows.ndim and rows.shape[-1] == end + self.plots * self.buffer.numbers:
                kept = rows[..., counts:end].reshape(*rows.shape[:-1], 1 + self.plots, was)
                kept = self.estimator.carried_over(kept).reshape(*rows.shape[:-1], -1)
                return np.concatenate([rows[..., :counts], kept, rows[..., end:]], axis=-1)
        return rows

    def start(self) -> np.ndarray:
        """Return a fresh state."""
        state = np.zeros((), self.dtype)
        state["row"] = self.estimator.start().reshape(1).view(float)
        return state

    def update(self, state, time, position, covariance=None) -> tuple[np.ndarray, TrackStep | None]:
        """Return the next state, and what this plot showed in its place; None where it was refused.

        Parameters
        ----------
        state : from `start` or `update`
        time, position, covariance
            As in `TrackEstimator.update`.
        """
        if getattr(state, "dtype", None) != self.dtype:
            raise InputError("the state belongs to another estimator: start one with start()")
        stated = None if covariance is None else [covariance]
        time, position, R = self.estimator._door([time], [position], stated)
        return self.buffer.put(state, np.concatenate([time, position[0], R[0]]))

    def state_of(self, state) -> np.ndarray:
        """Return the estimator's own state: that of the plots so far, in order."""
        return np.array(state["row"]).view(self.estimator.dtype).reshape(())

    def predict(self, state, time) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (C,) and covariance (C, C) of a plot at ``time``, later than the newest."""
        return self.estimator.predict(self.state_of(state), time)

    def _run(self, row, sample) -> tuple[np.ndarray, TrackStep]:
        """Take one plot in order of time."""
        C, row = self.estimator.coordinates, np.array(row)
        out = self.estimator.run(row, sample[:1], sample[None, 1 : 1 + C], sample[None, 1 + C :])[0]
        return row, self.estimator.shown(out)
