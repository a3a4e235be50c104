"""The trace of an observer of a known plant: state, disturbances and derived outputs, each with its deviation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..engine.status import MEANING, Status
from ..engine.validation import floats
from . import verbs
from .events import Event, runs
from .trace import Trace

KEEP = ("innovations", "means", "std")


def width(keep: str, N: int, head: int) -> int:
    """Return the number of columns the driver writes for each sample."""
    if keep not in KEEP:
        raise InputError(f"keep must be one of {', '.join(KEEP)}, got {keep!r}")
    return head + N * KEEP.index(keep)


class ObserverTrace(Trace):
    """Columns of one run of an observer, time first.

    ``prediction``, ``innovation``, ``variance`` and ``status`` are (T,), with several outputs (T, p), and belong to
    y(t) given the samples before it; estimates are given the samples up to t, NaN (deviation: infinite) until ready.
    """

    is_mixture, odds = False, None

    def __init__(self, estimator, y, u, outs, keep, state, observed_before=0.0, time=None):
        p = estimator.model.outputs
        self.estimator, self.keep, self.state = estimator, keep, state
        self.y, self.u = (y[:, 0] if p == 1 and y.ndim == 2 else y).copy(), u.copy()
        self.table, self.observed_before = outs, float(observed_before)
        self.dt, self.begun = estimator.dt, None
        if time is None:
            time = float(state["time"]) - self.dt * np.arange(len(y))[::-1]
        self.time = floats("time", time)
        if self.time.shape != (len(y),):
            raise InputError(f"time must be ({len(y)},), got shape {self.time.shape}")

    # --- columns -------------------------------------------------------------------------------------------

    def _of_outputs(self, which):
        p = self.estimator.model.outputs
        return self.table[:, which] if p == 1 else self.table[:, which * p : (which + 1) * p]

    @property
    def prediction(self) -> np.ndarray:
        """Prediction of y(t) from the samples before it; NaN while nothing is determined."""
        return self._of_outputs(0)

    @property
    def innovation(self) -> np.ndarray:
        """y(t) minus its prediction; NaN where either is."""
        return self._of_outputs(1)

    @property
    def variance(self) -> np.ndarray:
        """Variance of the prediction error; infinite while nothing is determined."""
        return self._of_outputs(2)

    @property
    def status(self) -> np.ndarray:
        """Bits of `driftwise.Status`."""
        return self._of_outputs(3).astype(np.int64)

    @property
    def statistic(self) -> np.ndarray:
        """The detector's statistic relative to its threshold: 1 and more is an alarm, (T,)."""
        return self.table[:, self.estimator.columns["statistic"].start]

    @property
    def is_used(self) -> np.ndarray:
        """Whether each output of the sample was there, and predicted."""
        return ~np.isnan(self.innovation)

    @property
    def dof(self) -> np.ndarray:
        """Degrees of freedom of the prediction: infinite where the noise is known, else innovations before it."""
        if self.estimator.noise_std is not None:
            return np.full(self.prediction.shape, np.inf)
        used = self.is_used.reshape(len(self), self.estimator.model.outputs)
        before = np.cumsum(used).reshape(used.shape) - used
        return np.maximum(self.observed_before + before, 1.0).reshape(self.prediction.shape)

    @property
    def ready(self) -> np.ndarray:
        """Whether there is an estimate within the tolerance, (T,)."""
        status = self.status if self.status.ndim == 1 else self.status[:, 0]
        return (status & int(Status.NOT_READY)) == 0

    @property
    def estimates(self) -> np.ndarray:
        """Plant states, disturbances and derived outputs, (T, N), in the order of ``state_names`` and ``names``."""
        return self._kept(0, "means")

    @property
    def std(self) -> np.ndarray:
        """Standard deviations of ``estimates``, (T, N)."""
        return self._kept(1, "std")

    def _kept(self, which, least):
        if KEEP.index(self.keep) < KEEP.index(least):
            raise InputError(f"this trace kept {self.keep!r} only; run scan(..., keep={least!r})")
        N, first = self.estimator.model.N, self.estimator.n_columns
        return self.table[:, first + which * N : first + (which + 1) * N]

    @property
    def _std(self):
        return self.std

    @property
    def x(self) -> np.ndarray:
        """State of the plant, (T, n)."""
        return self.estimates[:, : self.estimator.model.n]

    @property
    def parameters(self) -> np.ndarray:
        """Disturbances and derived outputs in the order of ``names``, (T, N - n)."""
        return self.estimates[:, self.estimator.model.n :]

    @property
    def disturbances(self) -> np.ndarray:
        """What is told of the disturbances, (T, m - n)."""
        return self.estimates[:, self.estimator.model.n : self.estimator.model.m]

    @property
    def disturbances_std(self) -> np.ndarray:
        """Standard deviations of ``disturbances``."""
        return self.std[:, self.estimator.model.n : self.estimator.model.m]

    @property
    def state_names(self) -> list[str]:
        """Names of the columns of ``x``."""
        return self.estimator.model.state_names

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
        return sorted(found, key=lambda event: event.sample)[:limit]

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
        what, found = "the innovations no longer fit the plant", []
        if getattr(self.estimator, "parity", None) is not None:
            window = self.estimator.length * self.estimator.dt
            what = f"the last {window:g} s contradict the {window:g} s before: another plant, or another disturbance"
        for k, end in runs(status, Status.JUMP)[:limit].tolist():
            level = float(statistic[k : end + 1].max())
            more = f", for {end - k + 1} samples" if end > k else ""
            text = f"jump: {what} (statistic {level:.2f} times its threshold{more})"
            found.append(Event(k, float(self.time[k]), kind, text, level, k))
        return found

    # --- results -------------------------------------------------------------------------------------------

    def summary(self):
        """Return the constant-memory `ObserverSummary` of this trace."""
        from .observer_summary import ObserverSummary

        return ObserverSummary(self.estimator).add(self)

    def diagnose(self):
        """Return a `Diagnosis`: NIS and coverage of each output; innovations of a window are not white anyway."""
        return verbs.call("diagnose", self)

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

    @classmethod
    def load(cls, path) -> ObserverTrace:
        """Return a saved trace."""
        found = Trace.load(Path(path))
        if not isinstance(found, ObserverTrace):
            raise InputError(f"{path} holds the trace of {found.estimator!r}, which is no observer: use Trace.load")
        return found


OF_OUTPUTS = (Status.MISSING_OUTPUT, Status.BAD_VALUE)
