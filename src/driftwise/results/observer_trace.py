"""The trace of an observer of a known plant: state, disturbances and derived outputs, each with its deviation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..engine.status import MEANING, Status
from . import verbs
from .events import Event, Events, runs
from .output import Output, split
from .parameter_trace import ParameterTrace
from .sentences import alarm_words, contradiction_words
from .trace import KEEP as KEPT

KEEP = KEPT[:3]  # no covariances


class ObserverTrace(ParameterTrace):
    """Columns of one run of an observer, time first.

    ``prediction``, ``innovation``, ``variance`` and ``status`` are (T,), with several outputs (T, p), and belong to
    y(t) given the samples before it: NaN, the variance infinite, while nothing is determined. Estimates are given the
    samples up to t, NaN (deviation: infinite) until ready.

    Examples
    --------
    >>> import driftwise as dw
    >>> cart = dw.Plant([[0, 1], [0, 0]], states=("position", "speed"))
    >>> trace = dw.WindowObserver(cart, 1.0, noise_std=0.1, dt=0.1).scan([0.1 * k for k in range(30)])
    >>> speed, std = trace.of("speed")
    >>> round(float(speed[-1]), 3), round(float(std[-1]), 3)
    (1.0, 0.11)
    """

    # --- columns -------------------------------------------------------------------------------------------

    @property
    def statistic(self) -> np.ndarray:
        """The detector's statistic relative to its threshold: 1 and more is an alarm, (T,)."""
        return self.table[:, self.estimator.columns["statistic"].start]

    @property
    def is_used(self) -> np.ndarray:
        """Whether each output of the sample was there, and predicted."""
        return ~np.isnan(self.innovation)

    @property
    def ready(self) -> np.ndarray:
        """Whether there is an estimate within the tolerance, (T,)."""
        status = self.status if self.status.ndim == 1 else self.status[:, 0]
        return (status & int(Status.NOT_READY)) == 0

    @property
    def estimates(self) -> np.ndarray:
        """Plant states, disturbances and derived outputs, (T, N), in the order of ``state_names`` and ``names``."""
        return self._kept(0, self.estimator.model.N, "means")

    @property
    def std(self) -> np.ndarray:
        """Standard deviations of ``estimates``, (T, N)."""
        return self._std

    @property
    def disturbances(self) -> np.ndarray:
        """Estimates of the disturbances, (T, m - n)."""
        return self.estimates[:, self.estimator.model.n : self.estimator.model.m]

    @property
    def disturbances_std(self) -> np.ndarray:
        """Standard deviations of ``disturbances``."""
        return self.std[:, self.estimator.model.n : self.estimator.model.m]

    def of(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return one state, disturbance or derived output by name, and its deviation, (T,) each."""
        names = self.state_names + self.names
        if name not in names:
            raise InputError(f"there is no {name!r}: {', '.join(names)}")
        return self.estimates[:, names.index(name)], self.std[:, names.index(name)]

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name, under the plant's own names; with several outputs prediction.name and so on.

        An output called like a state is NAME_measured.
        """
        form = self.estimator.model
        table = {"time": self.time}
        table |= dict(zip(form.measured_names, self.y.reshape(len(self), form.outputs).T))
        table |= dict(zip(form.input_names, self.u.T))
        for what in ("prediction", "innovation", "variance", "status"):
            column = getattr(self, what)
            ends = [""] if column.ndim == 1 else [f".{name}" for name in form.output_names]
            table |= {f"{what}{end}": c for end, c in zip(ends, column.reshape(len(self), len(form.output_names)).T)}
        table |= {"statistic": self.statistic, "ready": self.ready}
        names = self.state_names + self.names
        if self.keep != "innovations":
            table |= dict(zip(names, self.estimates.T))
        if self.keep == "std":
            table |= {f"{name}_std": c for name, c in zip(names, self.std.T)}
        return {name: np.ascontiguousarray(c) for name, c in table.items()}

    # --- what happened -------------------------------------------------------------------------------------

    def events(self, limit: int = 10_000) -> list[Event]:
        """Return when it became ready and when it no longer was, alarms, and what was missing, in order."""
        names = self.estimator.model.output_names
        each, many = self.status.reshape(len(self), len(names)).T, len(names) > 1
        found = self._turns() + self.jumps(limit)
        for bit, text in (MEANING | {Status.MISSING_INPUT: "input missing, held at its last value"}).items():
            if bit in (Status.JUMP, Status.NOT_READY):
                continue
            for i, status in enumerate(each if bit in OF_OUTPUTS else each[:1]):
                name = f"{names[i]}: " if many and bit in OF_OUTPUTS else ""
                for k, end in runs(status, bit)[:limit].tolist():
                    more = f" ({end - k + 1} samples)" if end > k else ""
                    found.append(Event(k, float(self.time[k]), str(bit.name), name + text + more))
        return Events(sorted(found, key=lambda event: event.sample)[:limit])

    def _turns(self) -> list[Event]:
        ready, kind = self.ready, str(Status.NOT_READY.name)
        turns = np.flatnonzero(np.diff(ready.astype(int), prepend=0))
        words = {True: "ready at", False: "no longer ready at"}
        return [
            Event(
                int(k),
                float(self.time[k]),
                "READY" if ready[k] else kind,
                f"{words[bool(ready[k])]} {self.time[k]:g} s",
            )
            for k in turns
        ]

    def jumps(self, limit: int = 10_000) -> list[Event]:
        """Return an event for each alarm of the detector; one that lasts is one."""
        status = self.status.reshape(len(self), self.estimator.model.outputs)[:, 0]
        statistic, kind = self.statistic, str(Status.JUMP.name)
        has_parity, found = self.estimator.parity is not None, []
        what = contradiction_words(self.estimator.length * self.estimator.dt if has_parity else None)
        for k, end in runs(status, Status.JUMP)[:limit].tolist():
            level = float(statistic[k : end + 1].max())
            text = alarm_words(what, level, samples=end - k + 1)
            found.append(Event(k, float(self.time[k]), kind, text, level, k))
        return found

    # --- results -------------------------------------------------------------------------------------------

    def summary(self):
        """Return the constant-memory `ObserverSummary` of this trace, of the estimator's own kind."""
        return self.estimator.summary().add(self)

    @property
    def outputs(self) -> list[Output]:
        """The columns of each output, (T,) each; an alarm is that of the first."""
        found = [Output(time=self.time, state=self.state, names=[], **columns) for columns in split(self)]
        jump = ~int(Status.JUMP)
        return [*found[:1], *(replace(one, status=one.status & jump) for one in found[1:])]

    def plot(self, **options) -> Any:
        """Draw the outputs and every estimate with its 2-sigma band; return the Axes.

        Options: ``labels``, a dict of names with what to write at their axes; ``figure`` to draw into.
        """
        return verbs.call("plot", self, **options)

    @property
    def covariance(self) -> np.ndarray:
        """Refuse: an observer's trace keeps deviations."""
        raise InputError("an observer's trace keeps deviations (std), not covariances")

    def what_changed(self, event, samples: int = 100):
        """Refuse: it asks which parameter changed."""
        raise InputError("what_changed is about parameters, and an observer's plant is given")

    def model(self, at: int = -1) -> Any:
        """Refuse: the plant is what the observer was given."""
        raise InputError("an observer estimates no model: its plant is trace.estimator.plant")

    def report(self, path, **options) -> Any:
        """Write one self-contained HTML page that opens without a network."""
        return verbs.call("report", self, path, **options)


OF_OUTPUTS = (Status.MISSING_OUTPUT, Status.BAD_VALUE)
