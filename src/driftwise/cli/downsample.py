"""Traces of long runs, downsampled for the report: the extremes of every bucket of rows, offsets, the first events."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from driftwise.engine.status import Status
from driftwise.report.thin import extremes
from driftwise.results.parameter_trace import ParameterTrace

ROWS = 20_000
WATCHED = 6  # inputs and parameters whose extremes are kept
EVENTS = 10_000


def _extreme(name: str, values, first_row: int) -> list[tuple[str, float, int]]:
    """Return the wildest value of a column, if it is ten thousand times farther out than nearly all others."""
    far = np.abs(values - np.nanmedian(values))
    row = int(np.nanargmax(far))
    usual = np.nanpercentile(far, 99)
    return [(name, float(values[row]), first_row + row)] if usual > 0 and far[row] > 1e4 * usual else []


@dataclass
class Offsets:
    """Means or medians of the first chunk, to be subtracted from every sample; `constants`: inputs that stood still."""

    output: str
    inputs: tuple[str, ...]
    values: dict[str, float] = field(default_factory=dict)
    constants: list[tuple[str, float]] = field(default_factory=list)
    extremes: list[tuple[str, float, int]] = field(default_factory=list)

    @classmethod
    def of(cls, chunk, record, center: str = "mean") -> Offsets:
        found = cls(record.output, record.inputs)
        for name in (record.output, *record.inputs):
            seen = chunk.columns[name][np.isfinite(chunk.columns[name])]
            if not len(seen):
                continue
            if seen.min() == seen.max() and name != record.output:
                found.constants.append((name, float(seen[0])))
            found.extremes += _extreme(name, chunk.columns[name], chunk.first_row)
            if center != "none":
                found.values[name] = float(np.median(seen) if center == "median" else np.mean(seen))
        return found

    def taken_from(self, chunk):
        """Return (y, u) of a chunk with the offsets subtracted; u is None without inputs."""
        y = chunk.columns[self.output] - self.values.get(self.output, 0.0)
        if not self.inputs:
            return y, None
        return y, np.stack([chunk.columns[name] - self.values.get(name, 0.0) for name in self.inputs], axis=1)

    def given_back(self, y, u, prediction):
        """Return output, inputs and prediction as they were measured."""
        shift = self.values.get(self.output, 0.0)
        return (
            y + shift,
            u + np.array([self.values.get(name, 0.0) for name in self.inputs]),
            prediction + shift,
        )


@dataclass(frozen=True)
class ThinSmoothed:
    """Some rows of a smoothed record, as the report draws it; x and words are None where there are none."""

    estimator: Any
    lag: int | None
    parameters: np.ndarray
    parameters_std: np.ndarray
    x: np.ndarray | None = None
    x_std: np.ndarray | None = None
    words: str | None = None

    def __len__(self):
        return len(self.parameters)


class ThinTrace(ParameterTrace):
    """Some rows of a trace (``rows`` are their numbers); the degrees of freedom are those of the whole run."""

    diagnosis: Any = None  # the verdicts on the whole run

    def __init__(self, *args, dof, rows, **options):
        super().__init__(*args, **options)
        self._dof, self.rows = dof, rows

    @property
    def dof(self):
        return self._dof


class Downsampler:
    """Takes columns part by part and keeps at most 20 000 rows: the extremes of what is watched in every bucket.

    A bucket is 2^k rows; it keeps those where a watched column is lowest or highest, so that spikes of one sample and
    alarms survive. Which rows are kept does not depend on how the record is cut into parts.
    """

    def __init__(self):
        self.samples, self.width = 0, 1
        self._parts: list[tuple[np.ndarray, ...]] = []
        self._end: tuple[np.ndarray, ...] = ()

    def keep(self, watched: list[np.ndarray], *columns: np.ndarray) -> None:
        """Take in the next part; ``columns`` are kept where one of ``watched`` is extreme."""
        rows = self.samples + np.arange(len(columns[0]))
        part = (rows, np.column_stack(watched), *columns)
        self.samples += len(rows)
        most, old = 2 * len(watched), self.width
        while self.samples * min(self.width, most) > ROWS * self.width:
            self.width *= 2
        if self._parts and (self.width > old or sum(len(part[0]) for part in self._parts) > 2 * ROWS):
            self._parts = [self._thin(self._joined())]
        self._parts.append(self._thin(part))
        self._end = tuple(column[-1:].copy() for column in part)

    def kept(self) -> tuple[np.ndarray, ...]:
        """Return their row numbers and the columns at the rows that are kept; the last row is one of them."""
        found = self._thin(self._joined())
        if found[0][-1] < self._end[0][0]:
            found = tuple(map(np.concatenate, zip(found, self._end)))
        return found[0], *found[2:]

    def _joined(self):
        return tuple(map(np.concatenate, zip(*self._parts)))

    def _thin(self, columns):
        rows, watched, *_ = columns
        chosen = extremes(rows // self.width, *watched.T) if self.width > 1 else slice(None)
        return tuple(column[chosen].copy() for column in columns)


def severity(status) -> np.ndarray:
    """Return a number that is highest where an alarm must not be lost."""
    found = np.zeros(len(status))
    for level, bits in enumerate((Status.REJECTED | Status.OUTLIER, Status.NOISE, Status.JUMP), 1):
        found[(status & int(bits)) != 0] = level
    return found


def scores(trace) -> np.ndarray:
    """Return the outputs and their innovations over their predicted deviations, one row each."""
    with np.errstate(divide="ignore", invalid="ignore"):
        z = trace.innovation / np.sqrt(trace.variance)
    return np.column_stack([trace.y, z]).T


class TraceDownsampler(Downsampler):
    """Takes one trace after the other, thinned out, and what happened."""

    def __init__(self, estimator, offsets: Offsets):
        super().__init__()
        self.estimator, self.offsets = estimator, offsets
        self.jumps: list[Any] = []
        self._events: list[Any] = []
        self.state: Any = None

    def add(self, trace: ParameterTrace) -> None:
        """Take in the next part of the run, in the units it was estimated in."""
        status = trace.status
        if len(self._events) < EVENTS and status.any():
            found = [event for event in trace.events(EVENTS - len(self._events)) if event.kind != Status.JUMP.name]
            self._events += [replace(event, sample=event.sample + self.samples) for event in found]
        if (status & int(Status.JUMP)).any():
            jumps = trace.jumps(EVENTS - len(self.jumps))
            self.jumps += [replace(event, sample=event.sample + self.samples) for event in jumps]
        self.state = trace.state
        alarm = severity(status)
        watched = [*scores(trace), alarm, *trace.u.T[:WATCHED], *trace.parameters.T[:WATCHED]]
        self.keep(watched, trace.time, trace.y, trace.u, trace.table, trace.dof)

    @property
    def events(self) -> list[Any]:
        """What happened, in order; jumps are all there however much else did."""
        return sorted([*self._events, *self.jumps], key=lambda event: event.sample)

    def thinned(self, smoothed):
        """Return the smoothed record at the samples that are kept."""
        names, rows = ("x", "x_std") if smoothed.estimator.model.n else (), self.kept()[0]
        columns = {name: getattr(smoothed, name)[rows] for name in ("parameters", "parameters_std", *names)}
        more: dict[str, Any] = {} if names else {"words": smoothed.words}
        return ThinSmoothed(smoothed.estimator, smoothed.lag, **columns, **more)

    def trace(self) -> ThinTrace:
        """Return what was kept as a trace in the units of the file."""
        rows, time, y, u, outs, dof = self.kept()
        y, u, outs[:, 0] = self.offsets.given_back(y, u, outs[:, 0])
        return ThinTrace(self.estimator, y, u, outs, "std", self.state, time=time, dof=dof, rows=rows)

    def columns(self, trace: ParameterTrace) -> dict[str, Any]:
        """Return the columns of a part of the run, in the units of the file."""
        columns = trace.columns()
        y, u, columns["prediction"] = self.offsets.given_back(trace.y, trace.u, trace.prediction)
        columns["y"] = y
        return columns | {"u" if u.shape[1] == 1 else f"u{i + 1}": column for i, column in enumerate(u.T)}


class PairDownsampler(TraceDownsampler):
    """Takes traces of a chosen model and forecasts of the same samples, thinned out alike."""

    def __init__(self, estimator):
        super().__init__(estimator, Offsets("", ()))
        self.forecast: Any = None

    def join(self, trace, forecast) -> None:
        """Take in the next part of both."""
        self.forecast = self.forecast or forecast
        self._last = forecast
        self.add(trace)

    def keep(self, watched, *columns):
        from driftwise.analysis.identifier import widened

        super().keep([*watched, self._last.innovation], *columns, widened(self._last, self.forecast.names))

    def traces(self):
        """Return what was kept: a trace and a forecast."""
        from driftwise.estimators.model_average.trace import AverageTrace

        rows, time, y, u, outs, dof, wide = self.kept()
        trace = ThinTrace(self.estimator, y, u, outs, "std", self.state, time=time, dof=dof, rows=rows)
        return trace, AverageTrace(self.forecast.estimator, y, u, wide, "std", self._last.state, time=time)


class ObserverDownsampler(Downsampler):
    """Takes one trace of an observer after the other, thinned out, and its first events."""

    def __init__(self):
        super().__init__()
        self.events: list[Any] = []
        self._last: Any = None

    def add(self, trace) -> None:
        """Take in the next part of the run."""
        found = trace.events(EVENTS - len(self.events)) if len(self.events) < EVENTS else []
        if self.samples and trace.ready[0] and self._last.ready[-1]:
            found = [event for event in found if event.kind != "READY" or event.sample]
        self.events += [replace(event, sample=event.sample + self.samples) for event in found]
        alarms = severity(trace.status.reshape(len(trace), -1)[:, 0])
        watched = [*scores(trace), alarms, *trace.u.T[:WATCHED], trace.statistic, *trace.estimates.T[:WATCHED]]
        self.keep(watched, trace.time, trace.y, trace.u, trace.table)
        self._last = trace

    def trace(self):
        """Return what was kept as a trace."""
        rows, time, y, u, outs = self.kept()
        last = self._last
        found = type(last)(last.estimator, y, u, outs, last.keep, last.state, last.observed_before, time)
        found.rows = rows
        return found
