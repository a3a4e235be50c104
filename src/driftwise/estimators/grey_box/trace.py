"""The trace of a grey box: state and physical parameters in their units, and when these moved."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from ...engine.status import Status
from ...models.formula_values import undefined
from ...results.events import MOVED, Event, Events
from ...results.observer_trace import ObserverTrace
from ...results.physical_sentences import jump_at_words, moved_words, unclear_jump_words
from ...results.trace import Trace
from .transform import NORMAL_95, to_units

LATER = 20  # samples for each parameter, until a jump is judged by what it did to the estimates


class GreyBoxTrace(ObserverTrace):
    """Columns of one run, time first: predictions given the samples before, estimates given those up to t."""

    is_used = Trace.is_used

    @cached_property
    def _in_units(self) -> tuple[np.ndarray, np.ndarray]:
        """State and parameters in their units, and the slopes of the latter by what is estimated."""
        n = self.estimator.model.n
        s = self._kept(0, self.estimator.model.N, "means")
        values, rates = to_units(self.estimator.formulas.free, s[:, n:])
        return np.hstack([s[:, :n], values]), rates

    @property
    def transformed(self) -> tuple[np.ndarray, np.ndarray]:
        """Parameters as they are estimated, logarithms of positive ones, and their deviations, (T, m) each."""
        n, N = self.estimator.model.n, self.estimator.model.N
        return self._kept(n, N - n, "means"), self._kept(N + n, N - n, "std")

    @property
    def estimates(self) -> np.ndarray:
        """State and parameters in their units, (T, N); NaN until ready."""
        return np.where(self.ready[:, None], self._in_units[0], np.nan)

    @property
    def std(self) -> np.ndarray:
        """Standard deviations of ``estimates``, those of parameters by slopes, (T, N); infinite until ready."""
        n = self.estimator.model.n
        std = self._kept(self.estimator.model.N, self.estimator.model.N, "std").copy()
        std[:, n:] *= self._in_units[1]
        return np.where(self.ready[:, None], std, np.inf)

    @property
    def x(self) -> np.ndarray:
        """State, (T, n)."""
        return self.estimates[:, : self.estimator.model.n]

    @property
    def x_std(self) -> np.ndarray:
        """Standard deviations of ``x``, (T, n)."""
        return self.std[:, : self.estimator.model.n]

    @property
    def parameters(self) -> np.ndarray:
        """Parameters in their units, (T, m)."""
        return self.estimates[:, self.estimator.model.n :]

    @property
    def parameters_std(self) -> np.ndarray:
        """Standard deviations of ``parameters``, by slopes, (T, m)."""
        return self.std[:, self.estimator.model.n :]

    def interval(self, name: str, deviations: float = NORMAL_95) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper end of a parameter's interval, 95 % by default, (T,) each: positive where it must be.

        Parameters
        ----------
        name : of the parameter
        deviations : standard deviations of the transformed parameter to either side
        """
        j, (theta, std) = self.estimator.names.index(name), self.transformed
        ends = (theta[:, j] + way * std[:, j] for way in (-deviations, deviations))
        low, high = (to_units(self.estimator.formulas.free[j : j + 1], end[:, None])[0][:, 0] for end in ends)
        return np.where(self.ready, low, np.nan), np.where(self.ready, high, np.nan)

    @property
    def log_density(self) -> np.ndarray:
        """Log density of what was taken in, given the samples before, (T,)."""
        return self.table[:, self.estimator.columns["density"].start]

    def events(self, limit: int = 10_000) -> list[Event]:
        """Return what happened, in order; a formula that gave no number is named, with what it was given."""
        found = super().events(limit)
        kind = str(Status.UNDEFINED.name)
        return Events(replace(e, text=self._undefined(e.sample) or e.text) if e.kind == kind else e for e in found)

    def _undefined(self, sample: int) -> str:
        n, before = self.estimator.model.n, max(sample - 1, 0)
        if self.keep == "innovations":
            return ""
        at, s = self._in_units[0][before], self.u
        for row in (s[before], s[sample]):
            if found := undefined(self.estimator.formulas, at[:n], row, at[n:]):
                return found
        return ""

    def jumps(self, limit: int = 10_000) -> list[Event]:
        """Return an event for each alarm: which parameter moved, by how much, and since when.

        The estimate some samples later (before the next alarm) is held against that before the jump. Where fits look
        for jumps they name the parameter; else it is the one for which the two are furthest apart, three of their
        deviations at least.
        """
        status = self.status.reshape(len(self), -1)[:, 0]
        where = np.flatnonzero(status & int(Status.JUMP))[:limit]
        return [self._jump(int(k), int(end)) for k, end in zip(where, [*where[1:], len(self)])]

    def _jump(self, sample: int, end: int) -> Event:
        at = self.estimator.n_columns - 4 - 2 * self.estimator.model.outputs
        statistic, since, which = self.table[sample, at : at + 3]
        first = max(sample + 1 - max(int(abs(since)), 1), 0)
        name, way, moved = None, 0, unclear_jump_words()
        if self.keep == "std":
            (theta, std), values = self.transformed, self._in_units[0][:, self.estimator.model.n :]
            before, later = max(first - 1, 0), min(sample + LATER * len(self.names), end - 1)
            change, spread = theta[later] - theta[before], np.hypot(std[later], std[before])
            z = np.divide(change, spread, out=np.zeros(len(change)), where=spread > 0)
            most = int(which) if which >= 0 else int(np.argmax(abs(z)))
            is_named = which >= 0 and self.estimator.jumping is not None  # by its likelihood
            if is_named or abs(z[most]) > MOVED:
                one = self.estimator.formulas.free[most]
                name, way = one.name, int(np.sign(change[most]))
                is_positive = values[before, most] > 0 and one.kind != "linear" and one.origin >= 0
                moved = moved_words(name, values[before, most], values[later, most], one.unit, is_positive)
        time = float(self.time[first])
        return Event(
            sample, time, str(Status.JUMP.name), jump_at_words(moved, time), float(statistic), first, name, way, moved
        )

    def summary(self):
        """Return the constant-memory `GreyBoxSummary` of this trace."""
        return self.estimator.summary().add(self)
