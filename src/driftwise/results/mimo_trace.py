"""The trace of an estimator with several outputs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..engine.validation import floats
from ..models.convert import ModelMIMO
from ..models.scale import KnownScale
from . import verbs
from .bands import quantile
from .events import events_of, jumps_of
from .trace import KEEP, UNUSED, Trace


class TraceMIMO(Trace):
    """Columns of one run of `JointMIMO` or `ARXMIMO`, time first: those of `Trace`, with one column per output.

    ``prediction``, ``innovation``, ``variance``, ``dof`` and ``status`` are (T, p). Those of y_i(t) are given the
    samples before t *and* y_1(t) .. y_{i-1}(t) where these tell about it (an output acting at once, or
    correlated noise), so innovations of different outputs are independent where the noise is as stated. ``x`` and
    ``parameters`` are given everything up to t.
    """

    def __init__(self, estimator, y, u, outs, keep, state, observed_before=0.0, time=None):
        self.estimator, self.keep, self.state = estimator, keep, state
        self.y, self.u = y.copy(), u.copy()
        self.table, self.observed_before = outs, np.asarray(observed_before, float)
        self.dt, self.begun = estimator.dt, None
        if time is None:
            time = self.dt * (float(state["samples"]) - len(y) + np.arange(len(y)))
        self.time = floats("time", time)
        if self.time.shape != (len(y),):
            raise InputError(f"time must be ({len(y)},), got shape {self.time.shape}")

    def _of_outputs(self, which):
        p = self.estimator.model.outputs
        return self.table[:, which * p : (which + 1) * p]

    @property
    def prediction(self) -> np.ndarray:
        """Prediction of y_i(t) from the samples before t and the outputs before i, (T, p)."""
        return self._of_outputs(0)

    @property
    def innovation(self) -> np.ndarray:
        """y(t) minus its prediction; NaN where y is missing, (T, p)."""
        return self._of_outputs(1)

    @property
    def variance(self) -> np.ndarray:
        """Squared scale of the prediction error (its variance where the noise is known), (T, p)."""
        return self._of_outputs(2)

    @property
    def status(self) -> np.ndarray:
        """Bits of `driftwise.Status`, (T, p)."""
        return self._of_outputs(3).astype(np.int64)

    def _extra(self, name):
        super()._extra(name)
        return self.table[:, self.estimator.columns[name]]

    @property
    def is_used(self) -> np.ndarray:
        """Whether each output of the sample taught the filter anything, (T, p)."""
        return (self.status & int(UNUSED)) == 0

    @property
    def dof(self) -> np.ndarray:
        """Degrees of freedom of the Student-t prediction; infinite where the noise is known, (T, p)."""
        est = self.estimator
        if "dof" in est.columns:
            return self._extra("dof")
        if isinstance(est.scale, KnownScale):
            return np.full(self.y.shape, np.inf)
        used, found = self.is_used, np.empty(self.y.shape)
        for g, group in enumerate(est.groups):
            mine = used[:, group]
            before = np.cumsum(mine).reshape(mine.shape) - mine + self.observed_before[group].sum()
            found[:, group] = est.scale.alpha + (before - est.spent[g]) / 2
        return 2 * np.maximum(found, 0.5)

    def model(self, at: int = -1) -> ModelMIMO:  # type: ignore[override]
        """Return the model at a sample (the last by default), with the covariance of its parameters.

        Sample -1 uses the final state; any other needs keep="covariance", or "std" for a diagonal one.
        """
        est, form = self.estimator, self.estimator.model
        if at in (-1, len(self) - 1):
            return est.model_of(self.state)
        is_full = self.keep == "covariance"
        P = self.covariance[at, form.n :, form.n :] if is_full else np.diag(self.parameters_std[at] ** 2)
        if hasattr(est, "model_at"):
            return est.model_at(self.parameters[at].copy(), P)
        return ModelMIMO(form, self.parameters[at].copy(), P, self.dt)

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns by name: those of an output end in its number (prediction.2), states in x{k}.{output}."""
        form = self.estimator.model

        def numbered(name, columns):
            return {f"{name}.{i + 1}" if columns.shape[1] > 1 else name: c for i, c in enumerate(columns.T)}

        u = {f"u{i + 1}" if self.u.shape[1] > 1 else "u": c for i, c in enumerate(self.u.T)}
        table = {"time": self.time, **numbered("y", self.y), **u}
        for name in ("prediction", "innovation", "variance", "dof", "status"):
            table |= numbered(name, getattr(self, name))
        if "weight" in self.estimator.columns:
            table |= {**numbered("weight", self.weight), **numbered("statistic", self.statistic)}
        names = (form.state_names if form.n else []) + form.names
        if KEEP.index(self.keep) >= KEEP.index("means"):
            table |= dict(zip(names, np.hstack([self.x, self.parameters]).T))
        if self.keep in ("std", "covariance"):
            table |= dict(zip([f"{name}_std" for name in names], np.hstack([self.x_std, self.parameters_std]).T))
        return {name: np.ascontiguousarray(c) for name, c in table.items()}

    def events(self, limit: int = 10_000):
        """Return what happened besides ordinary samples, in order; the text names the output."""
        return self._of_each(events_of, limit)

    def jumps(self, limit: int = 10_000):
        """Return an event for each alarm, in order; the text names the output."""
        return self._of_each(jumps_of, limit)

    def _of_each(self, told, limit):
        found = [_named(event, i) for i, one in enumerate(self.outputs) for event in told(one, limit)]
        return sorted(found, key=lambda event: event.sample)[:limit]

    # --- results -------------------------------------------------------------------------------------------

    @property
    def outputs(self) -> list[Output]:
        """The columns of each output, (T,) each, under the names that the trace of one output has."""
        names = ("y", "prediction", "innovation", "variance", "dof", "status", "is_used")
        columns = {name: getattr(self, name).T for name in names}
        each = [{name: c[i] for name, c in columns.items()} for i in range(self.y.shape[1])]
        p, at = self.y.shape[1], self.estimator.model.theta_at
        has_alarms = "which" in self.estimator.columns
        alarms = [self.table[:, 5 * p + i : 8 * p : p] if has_alarms else None for i in range(p)]

        def own(name, i):
            return getattr(self, name)[:, at[i] : at[i + 1]] if self.has_bars else None

        return [
            Output(
                time=self.time, state=self.state, names=self.estimator.names[at[i] : at[i + 1]], alarms=alarms[i],
                odds=self.odds, watches=self.watches, parameters=own("parameters", i),
                parameters_std=own("parameters_std", i), **one,
            )
            for i, one in enumerate(each)
        ]  # fmt: skip

    def summary(self):
        """Return the constant-memory `SummaryMIMO` of this trace."""
        from .mimo_summary import SummaryMIMO

        return SummaryMIMO(self.estimator).add(self)

    def diagnose(self):
        """Return a `Diagnosis`: NIS, coverage and whiteness of each output, as of one (`Trace.diagnose`)."""
        return verbs.call("diagnose", self)

    def plot(self, **options) -> Any:
        """Draw each output as measured and predicted, its innovations and its equation's parameters; return the Axes.

        Options: ``labels``, a dict with "outputs" (a name with unit for each) and "time"; ``figure`` to draw into.
        """
        return verbs.call("plot", self, **options)

    def report(self, path, **options) -> Any:
        """Refuse: the page is for one output; `summary` and `plot` say the same of several."""
        raise InputError(
            "report() is for one output. trace.summary().words says in sentences what it would say, trace.summary()"
            ".as_dict() in numbers, trace.plot()[0, 0].figure.savefig(path) keeps the picture"
        )


@dataclass(frozen=True)
class Output:
    """One output's columns of a trace."""

    time: np.ndarray
    y: np.ndarray
    prediction: np.ndarray
    innovation: np.ndarray
    variance: np.ndarray
    dof: np.ndarray
    status: np.ndarray
    is_used: np.ndarray
    state: np.ndarray  # of all outputs, after the last sample
    names: list[str]  # of the parameters of its equation
    alarms: np.ndarray | None  # statistic, since, which of its detector
    odds: float | None  # as in a `Trace`, and the next one
    watches: str
    parameters: np.ndarray | None  # of its equation, where the trace kept them with their deviations
    parameters_std: np.ndarray | None

    is_mixture = False  # a trace of several outputs has no columns for it

    def __len__(self):
        return len(self.y)

    @property
    def has_bars(self) -> bool:
        """Whether the trace kept parameters with their deviations."""
        return self.parameters is not None

    def band(self, level: float = 0.95) -> np.ndarray:
        """Half-width of the prediction interval at each sample, (T,)."""
        return quantile(0.5 + level / 2, self.dof) * np.sqrt(self.variance)

    def events(self, limit: int = 10_000):
        """Return what happened besides ordinary samples, in order."""
        return events_of(self, limit)

    def jumps(self, limit: int = 10_000):
        """Return an event for each alarm."""
        return jumps_of(self, limit)

    def alarm(self, k):
        """Return statistic, since and which of the detector, None where the estimator does not write them."""
        return None if self.alarms is None else self.alarms[k]


def _named(event, i):
    return replace(event, text=f"output {i + 1}: {event.text}")
