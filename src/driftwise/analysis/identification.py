"""What identification found: the model, the forecast, the changes, and how far all of it can be trusted."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..estimators.model_average.trace import AverageTrace
from ..models.markup import markup
from ..results import verbs
from ..results.claims import Claim, told
from ..results.frames import as_frame
from ..results.numbers import SAMPLES, SECONDS, ordinal
from ..results.parameter_trace import ParameterTrace
from ..results.stable import runs_away
from ..results.summary import Summary
from ..results.verdicts import Diagnosis
from ..tables.recognise import Reading, Table
from .change_log import Change, ChangeLog, where_known
from .claims import TABLE, claims
from .diagnose import diagnose
from .effects import Effects, of_model, of_response
from .forecast_summary import ForecastSummary, Own
from .forecast_verdicts import whiteness_verdict
from .growing_noise import STEADY, Growth
from .identifier import Identifier, Rival
from .seasons import of_table
from .segmentation import Visible
from .table_together import apart
from .together import Together

CLEARLY = 0.98  # of the error of all models together: so much less, and the chosen one's own forecast is quoted
WORSE = 1.1  # times the error of the chosen model: a response that is further off does not explain the record


@dataclass(frozen=True)
class Identification:
    """The answer of `identify`; print it for the answer in words.

    Attributes
    ----------
    table : Table
        What was recognised of the columns.
    trace : ParameterTrace
        The chosen model along the record: parameters with their deviations, state to go on from.
    forecast : AverageTrace
        One step ahead, made from all candidates and from the samples before only.
    summary, forecast_summary : Summary, ForecastSummary
        Both runs in numbers.
    own_summary : ForecastSummary
        The chosen model's own forecast, in the same numbers; ``quoted`` is the one of the two that the words are about.
    changes : list of Change
        What jumped in the plant, and when: the surest.
    diagnosis : Diagnosis
        Verdicts: those on calibration are those of the forecast that is quoted, the others the chosen model's.
    rivals : list of Rival
        How well each candidate predicted, best first: ``evidence()`` is the table.
    chosen : Rival
        The one with the fewest parameters among the best.
    naive : dict
        Root mean square errors of last value and mean so far, in all samples.
    judged : dict
        The same in the samples by which models were compared, the first piece of a long file.
    center : (1 + k,)
        What was subtracted from y and from each input before the model saw them: its offset is about there.
    origin : str
        Time stamp (ISO 8601) of second 0, None where the clock has none.
    alarms : int
        Changes that were found; the surest of them are ``changes``.
    last : Change
        The last of them; None where there was none.
    losses : tuple of str
        What could not be read of the table, a sentence each.
    breaks : tuple of (float, float)
        Where the clock of the table started again, on the clock of the trace, and what that is ahead of it since.
    effects : Effects
        What the inputs do, at the end: gains, and answers to a step, by a response that is fitted in hindsight; by the
        chosen model at the end of the run where that explains the record better.
    visible : Visible
        The smallest jumps of level, gains and noise that would have been told; None where none would.
    growth : Growth
        How the noise grows with the level: as which power of it (0: it does not), and what share of it the noise is.
    together : tuple of Together
        What several columns of the table, inputs or not, have in common and changed at one date.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> found = dw.identify({"heater": u, "temperature": y})
    >>> found.table.inputs, [found.trace.names[0], found.trace.parameters[-1, 0].round(1)]
    (('heater',), ['a1', np.float64(-0.8)])
    """

    table: Table
    trace: ParameterTrace
    forecast: AverageTrace
    summary: Summary
    forecast_summary: ForecastSummary
    own_summary: ForecastSummary
    changes: list[Change]
    diagnosis: Diagnosis
    rivals: list[Rival]
    chosen: Rival
    naive: dict[str, float]
    judged: dict[str, float]
    center: np.ndarray
    origin: str | None = None
    alarms: int = 0
    last: Change | None = None
    losses: tuple[str, ...] = ()
    breaks: tuple[tuple[float, float], ...] = ()
    effects: Effects | None = None
    visible: Visible | None = None
    growth: Growth = STEADY
    together: tuple[Together, ...] = ()

    @property
    def alternatives(self) -> tuple[Reading, ...]:
        """Ways to read the columns that the evidence leaves open, the likelier first; () where it decides."""
        return self.table.alternatives

    @property
    def is_ambiguous(self) -> bool:
        """Whether two readings of the columns are about as likely; this is the answer of the likelier."""
        return self.table.is_ambiguous

    @property
    def estimator(self) -> Any:
        """The estimator of the chosen model, of samples about their ``center``: `update` takes them as they come."""
        return self.trace.estimator

    @cached_property
    def model(self) -> Any:
        """The chosen model as it is at the end, with the covariance of its parameters."""
        return self.estimator.model_of(self.summary.state)

    def update(self, state, y, u=None):
        """Return the next state of the chosen model and what this sample showed: ``trace.state`` goes on."""
        u = None if u is None else np.asarray(u, float) - self.center[1:]
        state, step = self.estimator.update(state, y - self.center[0], u)
        return state, step._replace(prediction=step.prediction + self.center[0])

    def predict(self, u=None, horizon: int | None = None):
        """Return mean (h,) and standard deviation (h,) of the outputs that follow, given the inputs to come."""
        u = None if u is None else np.asarray(u, float).reshape(-1, len(self.center) - 1) - self.center[1:]
        mean, std = self.estimator.predict(self.summary.state, u, horizon)
        return mean + self.center[0], std

    @property
    def is_judged(self) -> bool:
        """Whether there were samples enough to compare models by."""
        return all(map(math.isfinite, self.judged.values()))

    @property
    def is_useful(self) -> bool:
        """Whether the chosen model, and the forecast that is quoted, predict better than last value and mean."""
        return self.chosen.rmse < min(self.judged.values()) and self.quoted.rmse < min(self.naive.values())

    @property
    def quoted(self) -> ForecastSummary:
        """The forecast that the words are about: of all models, or of the chosen one where that is clearly better."""
        return quoted(self.forecast_summary, self.own_summary, self.naive)

    @property
    def is_alone(self) -> bool:
        """Whether that is the chosen model's own."""
        return self.quoted is self.own_summary

    @cached_property
    def claims(self) -> tuple[Claim, ...]:
        """All that is claimed, in the order it is said: the words are the texts of these and nothing else."""
        return claims(self)

    @cached_property
    def words(self) -> str:
        """The answer in plain words."""
        return told(claim for claim in self.claims if claim.kind != "table")

    @cached_property
    def answer(self) -> str:
        """The same without how the columns were taken."""
        return told(claim for claim in self.claims if claim.kind not in TABLE)

    @cached_property
    def table_words(self) -> str:
        """How the columns were taken."""
        return told(claim for claim in self.claims if claim.kind in ("column", "clock"))

    @property
    def notes(self) -> list[str]:
        """What is odd in the table, a sentence each."""
        return [claim.text for claim in self.claims if claim.kind == "table"]

    def validate(self) -> Any:
        """Hold the chosen model against what an engineer asks before it is used: a `Validation`, to be printed."""
        from .validation import validate

        trace = copy(self.trace)
        trace.begun = self.estimator.start() if trace.begun is None else trace.begun
        trace.y, trace.u, trace.table = trace.y - self.center[0], trace.u - self.center[1:], trace.table.copy()
        trace.table[:, 0] -= self.center[0]
        return validate(trace, self.table.inputs, SECONDS if self.table.timed else SAMPLES)

    def phrase(self, change: Change) -> str:
        """Return a change as a phrase, with its time on the clock of the table."""
        run = self._run(change.time) if self.breaks else 0
        when, *ends = (self.when(time, run) for time in (change.time, *change.times))
        between = "" if ends == [when, when] else f" ({' to '.join(end.removeprefix('at ') for end in ends)})"
        of_run = f" of the {ordinal(run)} run of the clock" if run else ""
        return f"{when}{of_run}{between} {change.what}"

    def _run(self, time: float) -> int:
        """Return which run of the clock an instant lies in, from 1: it may have started again."""
        return 1 + sum(begin <= time for begin, _ in self.breaks)

    def when(self, time: float, known: int = 0) -> str:
        """Return an instant as a phrase, as it stands in the table; with the run of its clock unless that is known."""
        run = self._run(time)
        at = self.table.at(time - self.breaks[run - 2][1] if run > 1 else time, self.origin)
        return at if run == known or not self.breaks else f"{at} of the {ordinal(run)}"

    def report(self, path, title: str | None = None) -> Any:
        """Write one self-contained HTML page that opens without a network."""
        return verbs.call("report", self, path, title, notes=self.notes)

    def __str__(self):
        return self.words

    def _repr_html_(self):
        return markup(self.words, parameters=self.summary.parameters)

    def __repr__(self):
        return f"Identification({self.chosen.name} of {self.table.output!r}, {len(self.changes)} changes)"

    def evidence(self) -> dict[str, list]:
        """Return a table by column: model, memory, unknowns, log_odds against the best, rmse one step ahead, and
        whether it ran away: its errors are ten times those of the mean, and it forecasts no more."""
        r = self.rivals
        return {
            "model": [x.name for x in r], "memory": [repr(x.memory) for x in r], "unknowns": [x.unknowns for x in r],
            "log_odds": [x.evidence for x in r], "rmse": [x.rmse for x in r],
            "ran_away": [x.ran_away for x in r],
        }  # fmt: skip

    def to_frame(self, backend: str = "pandas") -> Any:
        """Return forecast and parameters, sample by sample, as a data frame of that library."""
        return as_frame(all_columns(self.forecast, self.trace), backend)


def quoted(forecast: ForecastSummary, own: ForecastSummary, naive: dict[str, float]) -> ForecastSummary:
    """Return the forecast; where the chosen model's own is clearly better, that.

    Better is enough where the forecast is worse than last value or mean.
    """
    is_bad = forecast.rmse > min(naive.values())
    return own if own.rmse < forecast.rmse * (1.0 if is_bad else CLEARLY) else forecast


def all_columns(forecast: AverageTrace, trace: ParameterTrace) -> dict[str, np.ndarray]:
    """Return the columns of a forecast and, beside them, the parameters of the model with their deviations."""
    own = trace.columns()
    return forecast.columns() | {name: own[name] for name in own if name.removesuffix("_std") in trace.names}


class Finder:
    """Identifies a record that comes in pieces; memory does not grow with it.

    Parameters
    ----------
    table : Table
        What the columns are.
    origin : str, optional
        Time stamp (ISO 8601) of second 0, so that changes have dates.
    seasons : tuple of int, optional
        Samples of each season that the output may have; those that the clock suggests, if omitted.
    events : tuple of Event, optional
        What the table says that was done.
    """

    def __init__(self, table: Table, origin: str | None = None, seasons: tuple[int, ...] | None = None, events=()):
        self.table, self.origin = table, origin
        seasons = of_table(table) if seasons is None else seasons
        self.identifier = Identifier(len(table.inputs), table.dt, seasons)
        self.summary: Any = None
        self.forecast_summary: Any = None
        self.own_summary: Any = None
        self.log = ChangeLog(table.inputs, table.sampling.kind == "irregular", seasons, table, events)

    def add(self, time, y, u) -> tuple[AverageTrace, ParameterTrace]:
        """Take in the next piece; return its forecast and the trace of the chosen model."""
        u = u if self.table.inputs else None
        forecast = self.identifier.add(y, u, time)
        is_first = self.summary is None
        if is_first:
            self.estimator = self.identifier.estimator
            most = max(rival.unknowns for rival in self.identifier.rivals)
            self.summary = Summary(self.estimator)
            settle = min(2 * most, len(y) // 4)
            self.forecast_summary, self.own_summary = ForecastSummary(settle), ForecastSummary(settle)
        center = self.identifier.center
        trace = self.estimator.scan(
            y - center[0], None if u is None else u - center[1:],
            state=None if is_first else self.summary.state, time=time,
        )  # fmt: skip
        self.summary.add(trace)
        self.forecast_summary.add(forecast)
        self.own_summary.add(Own(trace))
        trace.y += center[0]
        trace.u += center[1:]
        trace.table[:, 0] += center[0]
        self.log.add(trace.y, trace.u, trace.time)
        return forecast, trace

    def effects(self) -> Effects:
        """Return what the inputs do: by the response in hindsight, or by the chosen model where that is much closer.

        Between irregular rows nobody knows when an input moved. Of a model whose errors are not white neither the
        parameters nor their bars hold, so no gain is known, then; nor of an output that has a season, which its inputs
        may share, where only the season's model is too far off to say more.
        """
        has_season = bool(self.identifier.chosen.candidate.seasons)
        if self.log.hindsight is not None:
            found = of_response(self.log.hindsight)
            if self.table.sampling.kind == "irregular":
                found = found.held(self.log.waits)
            useless = self.identifier.chosen.rmse >= min(self.identifier.naive.values())
            is_close = not found.error > WORSE * self.identifier.chosen.rmse
            says_more = not has_season if useless else is_close
            if says_more:
                return found
        found = of_model(self.estimator.model_of(self.summary.state), len(self.table.inputs), self.summary.observed)
        white = whiteness_verdict(self.summary.whiteness, self.summary.observed)
        return found.unknown() if has_season or not white.is_fine else found  # a season's is of deviations from it

    def found(self, trace: ParameterTrace, forecast: AverageTrace, losses=(), breaks=(), together=()) -> Identification:
        """Return the answer; trace and forecast may be thinned out, the rest is what reading the table brought up."""
        naive = self.identifier.baselines
        own, effects = quoted(self.forecast_summary, self.own_summary, naive).verdicts, self.effects()
        names = {verdict.name for verdict in own}
        rest = [v for v in diagnose(trace, self.summary, are_reported=True) if v.name not in names]
        if self.table.sampling.kind == "irregular":  # a tick without a row is no loss
            rest = [v for v in rest if v.name != "missing"]
        if effects.of and any(runs_away(abs(p), std) for p, std in self.summary.moduli):
            effects = effects.unending()
        elif effects.of and effects.is_hindsight and not effects.is_endless:  # the whole record tells a pole from one
            rest = [v for v in rest if v.name != "stability"]
        seams = [begin for begin, _ in breaks] if self.table.stacked else []  # of recordings one below the other
        known = [where_known(change, effects.of) for change in self.log.changes]
        changes = [change for change in known if not change.spans_any(seams)]
        last = self.log.last and where_known(self.log.last, effects.of)
        if last and last.spans_any(seams):
            last = changes[-1] if changes else None
        return Identification(
            self.table, trace, forecast, self.summary, self.forecast_summary, self.own_summary, changes,
            Diagnosis([*own, *rest]), self.identifier.rivals, self.identifier.chosen, naive, self.identifier.naive,
            self.identifier.center, self.origin, self.log.count - len(known) + len(changes), last, tuple(losses),
            tuple(breaks), effects, self.log.visible, self.log.growth,
            apart(together, changes, self.table.output, grows=self.log.growth.power > 0),
        )  # fmt: skip
