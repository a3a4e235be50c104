"""One output's columns of a trace that has several, under the names that the trace of one output has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .bands import quantile
from .events import Event, events_of, jumps_of

COLUMNS = "y", "prediction", "innovation", "variance", "dof", "status", "is_used"


@dataclass(frozen=True)
class Output:
    """One output's columns of a trace, (T,) each."""

    time: np.ndarray
    y: np.ndarray
    prediction: np.ndarray
    innovation: np.ndarray
    variance: np.ndarray
    dof: np.ndarray
    status: np.ndarray
    is_used: np.ndarray
    state: Any  # of all outputs, after the last sample
    names: list[str]  # of the parameters of its equation
    odds: float | None = None  # as in a `Trace`, and the next one
    watches: str = ""
    alarms: np.ndarray | None = None  # statistic, since, which of its detector
    parameters: np.ndarray | None = None  # of its equation, where the trace kept them with their deviations
    parameters_std: np.ndarray | None = None

    is_mixture = False  # a trace of several outputs has no columns for it

    def __len__(self):
        return len(self.y)

    @property
    def has_bars(self) -> bool:
        """Whether the trace kept parameters with their deviations."""
        return self.parameters is not None

    def band(self, level: float = 0.95) -> np.ndarray:
        """Half-width of the prediction interval at each sample, NaN where it has none, (T,)."""
        std = np.where(np.isfinite(self.variance), np.sqrt(self.variance), np.nan)
        return quantile(0.5 + level / 2, self.dof) * std

    def events(self, limit: int = 10_000) -> list[Event]:
        """Return what happened besides ordinary samples, in order."""
        return events_of(self, limit)

    def jumps(self, limit: int = 10_000) -> list[Event]:
        """Return an event for each alarm."""
        return jumps_of(self, limit)

    def alarm(self, k):
        """Return statistic, since and which of the detector, None where the estimator does not write them."""
        return None if self.alarms is None else self.alarms[k]


def split(trace) -> list[dict[str, Any]]:
    """Return the columns of each output by name, (T,) each."""
    columns = [np.reshape(getattr(trace, name), (len(trace), -1)).T for name in COLUMNS]
    return [dict(zip(COLUMNS, one)) for one in zip(*columns)]


def outputs_of(trace) -> list[Output]:
    """Return each output of a `ParameterTrace`, with the parameters of its equation."""
    est, at = trace.estimator, trace.estimator.model.theta_at
    alarms = [trace.table[:, est.columns[name]] for name in ("statistic", "since", "which") if "which" in est.columns]

    def own(name, i):
        return getattr(trace, name)[:, at[i] : at[i + 1]] if trace.has_bars else None

    return [
        Output(
            time=trace.time, state=trace.state, names=trace.names[at[i] : at[i + 1]], odds=trace.odds,
            watches=trace.watches, alarms=np.stack([a[:, i] for a in alarms], axis=1) if alarms else None,
            parameters=own("parameters", i), parameters_std=own("parameters_std", i), **columns,
        )
        for i, columns in enumerate(split(trace))
    ]  # fmt: skip
