"""`driftwise run` with a model named: read, compare orders, estimate, smooth, chunk by chunk in constant memory."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from driftwise.cli import specs
from driftwise.cli.asking import recognised
from driftwise.cli.job import RecordJob, undivided
from driftwise.cli.run_options import AUTO, USUAL, RunOptions
from driftwise.cli.saving import Saver
from driftwise.engine.errors import CommandError, InputError
from driftwise.tables.source import is_stream, title_of

MANY = 60  # unknowns; beyond it roots and their bars take longer than the filter


class EstimateJob(RunOptions, RecordJob):
    """Estimates state and parameters of one output, with the joint filter or a recursive model."""

    writes = (("trace", "save"), ("report", "report"), ("results", "json"))
    is_chosen = False  # whether the order was chosen by its evidence
    smoothing_note = ""
    table: Any = None  # the `Table`, where columns were recognised
    made: Any = None  # the estimator that was asked for, not yet in units of the data
    estimator: Any = None
    summary: Any = None
    keeper: Any = None
    offsets: Any = None
    early: Any = None  # the first rows, whole
    evidence: Any = None
    study: Any = None
    smoothed: Any = None
    trace: Any = None  # thinned out
    notes: Any = ()
    words = ""  # which columns, which model, and why

    def check(self) -> None:
        """Refuse wrong options, in the words of the options, before the table is read."""
        try:
            self._check()
        except InputError as error:
            order = self.order if "--order" in self.changed else None
            given = dict(model=self.model, order=order, memory=self.memory, jumps=self.jumps, dt=self.dt)
            raise specs.refusal(error, **given) from None

    def _check(self) -> None:
        if self.order is None:
            self.changed, self.order = self.changed, USUAL  # what was given stays what it was
        if is_stream(self.file):  # which is read only once
            self.need_output()
        if len(self.outputs) > 1:
            raise CommandError(
                f"--output was given {len(self.outputs)} times ({', '.join(self.outputs)}), and one output is "
                "estimated at a time: run once for each, the other perhaps as an --input. Together: driftwise.ARX or "
                "driftwise.Joint, in Python, or an observer of a known plant (--plant)."
            )
        super().check()
        if self.model is not None:
            self.check_model()
        self.lag  # noqa: B018  (it raises)
        if not self.is_open:
            self._check_estimator()

    @property
    def is_open(self) -> bool:
        """Whether columns are to be recognised: the output, or the inputs of a model that has some."""
        takes = self.model is not None and not self.model.startswith(specs.ALONE)
        return not is_stream(self.file) and (not self.output or (self.input is None and takes))

    def _check_estimator(self) -> None:
        """Make what was asked for, once its inputs are known."""
        if self.order == "auto" and is_stream(self.file):
            raise InputError(
                f"--order auto reads the table twice, and {title_of(self.file)} can be read only once: put it into a "
                f"file, or look at --orders {self.orders or AUTO} first and then give --order."
            )
        dt = 1.0 if self.dt is None else self.dt
        if self.candidates:
            self.make_evidence(dt)
        for order in self.candidates:
            replace(self, order=order).make_estimator(dt)
        if self.order != "auto":
            self.made = self.make_estimator(dt)

    # --- estimating ----------------------------------------------------------------------------------------------

    def estimate(self) -> None:
        """Run the estimator over the table, then do what needs the rows themselves."""
        if self.is_open:
            self._recognise()
        if self.order == "auto":
            self._choose()
        self.open(self.outputs[0])
        state = None
        with Saver(self.save) as saver:
            try:
                for chunk in self.chunks("estimating"):
                    if self.estimator is None:
                        self._begin(chunk)
                    y, u = self.offsets.taken_from(chunk)
                    trace = self.estimator.scan(y, u, state=state, time=self.time_of(chunk, self.estimator.dt))
                    with undivided():
                        self._take(trace, chunk, y, u)
                        if self.save:
                            saver.add(self.keeper.columns(trace))
                        state = trace.state
            except KeyboardInterrupt:
                if state is None or not saver.has_begun:
                    raise
                self.is_stopped = True
        self.summary.origin = self.record.clock.origin if self.record.time else None
        self._look_again()

    def _recognise(self) -> None:
        """Name the columns that were not named."""
        output, inputs = self.output[0] if self.output else None, None if self.input is None else self.inputs
        if self.model is not None and self.model.startswith(specs.ALONE):
            inputs = ()
        table, _ = recognised(self, output, inputs)
        self.table, self.output, self.input = table, [table.output], list(table.inputs)
        if self.dt is None:
            self.time = table.time
        self.check()

    def _choose(self) -> None:
        """Take the order that the evidence of the whole table speaks for."""
        from driftwise.cli.downsample import Offsets

        evidence: Any = None
        record = self.open(self.outputs[0], find_clock=False)
        for chunk in self.chunks("comparing orders"):
            if evidence is None:
                evidence, offsets = self.make_evidence(self.step), Offsets.of(chunk, record, self.center)
            evidence.add(*offsets.taken_from(chunk))
        largest = evidence.summaries[max(evidence.orders)]
        if not largest.rmse >= 0:  # not one sample after those that the summaries leave to the prior
            raise InputError(
                f"{record.path}: {largest.observed} measured outputs are too few to choose among orders "
                f"{self.orders or AUTO}: order {max(evidence.orders)} has {largest.estimator.model.N} unknowns and "
                f"takes more than {largest.settle}. Give lower --orders, or the --order itself."
            )
        self.evidence, self.order, self.is_chosen = evidence, evidence.best, True

    def _begin(self, chunk) -> None:
        """Make the estimator, in units of the first chunk, and what takes its traces."""
        from driftwise.analysis import study
        from driftwise.cli.downsample import Offsets, TraceDownsampler
        from driftwise.cli.early_samples import EarlySamples, smoothing_rows
        from driftwise.results.numbers import SAMPLES, SECONDS
        from driftwise.results.summary import Summary

        made = self.made or self.make_estimator(self.step)
        self._refuse_short(chunk, made.model.N)
        self.offsets = Offsets.of(chunk, self.record, self.center)
        y, u = self.offsets.taken_from(chunk)
        dt, unit = self.step, SECONDS if self.has_clock else SAMPLES
        est = self.estimator = made.replace(dt=dt, **made.scales(y, u))
        self.summary, self.keeper = Summary(est), TraceDownsampler(est, self.offsets)
        self.summary.unit = unit
        self.early = EarlySamples(max(study.ROWS, smoothing_rows(est) if self.smooth else 0))
        if self.candidates and not self.is_chosen:
            self.evidence = self.make_evidence(est.dt)

    def _refuse_short(self, chunk, unknowns: int) -> None:
        import numpy as np

        from driftwise.report.printed import say

        record = self.record
        what = f"--model {self.model}" if self.model else f"order {self.order}"
        seen = int(np.isfinite(chunk.columns[record.output]).sum())
        if chunk.rows < record.chunk_rows and seen <= unknowns:
            raise InputError(
                f"{record.path}: {seen} measured outputs are too few for {unknowns} unknowns ({what}, "
                f"{len(record.inputs)} inputs). Take a smaller one, or is this the right column?"
            )
        if unknowns > MANY:
            say(
                f"driftwise: {what} has {unknowns} unknowns, which takes long, and "
                f"{record.source.rows or seen} rows may be too few for so many: was a smaller one meant?",
                stderr=True,
            )

    def _take(self, trace, chunk, y, u) -> None:
        """Count and keep what a chunk brought."""
        self._flag(trace, chunk)
        for taker in (self.summary, self.keeper, self.early):
            taker.add(trace)
        if self.evidence is not None and not self.is_chosen:
            self.evidence.add(y, u)

    def _flag(self, trace, chunk) -> None:
        """Flag the samples of which a cell was bad."""
        import numpy as np

        from driftwise.engine.status import Status

        if chunk.bad:
            lost = np.logical_or.reduce([chunk.bad_cells[c] for c in (self.record.output, *self.record.inputs)])
            trace.table[lost, 3] = trace.status[lost] | int(Status.BAD_VALUE)

    def _look_again(self) -> None:
        """Do what needs the rows themselves: what they can teach, and smoothing."""
        from driftwise.analysis.diagnose import diagnose
        from driftwise.analysis.study import ROWS, study
        from driftwise.report.advice_translation import spoken_verdicts

        center = self.center if self.offsets.values else "none"
        y, u = self.early.record(ROWS)
        self.study = study(self.estimator, self.summary.state, y, u, center)
        self.trace = self.keeper.trace()
        record = (y, u) if self.early.rows == len(y) else None
        found = diagnose(self.trace, self.summary, record=record, identifiable=self.study.identifiability)
        self.trace.diagnosis = spoken_verdicts(found)
        if self.smooth:
            self._smooth()

    def _smooth(self) -> None:
        from driftwise.cli.early_samples import smoothing_rows
        from driftwise.cli.saving import smoothed_columns, widen

        if not self.early.is_whole:
            self.smoothing_note = (
                f"not smoothed: it needs the record in memory, and {self.early.rows} rows are more than the "
                f"{smoothing_rows(self.estimator)} that may be held for this model; cut a stretch out with --from and "
                "--to."
            )
            return
        y, u = self.early.record()
        try:
            self.smoothed = self.estimator.smooth(y, u if self.inputs else None, lag=self.lag)
        except InputError as error:  # the record itself does not allow it
            self.smoothing_note = f"not smoothed: {error}."
            return
        if self.save:
            widen(self.save, smoothed_columns(self.smoothed))

    # --- telling -------------------------------------------------------------------------------------------------

    def summarise(self) -> None:
        """Say what to beware of."""
        from driftwise.cli.notes import model_words, notes, verdicts

        self.words = model_words(self)
        self.notes = notes(self) + verdicts(self.trace.diagnosis)

    def draw(self, path: str) -> None:
        from driftwise.cli.notes import labels
        from driftwise.report.run_page import write

        smoothed = None if self.smoothed is None else self.keeper.thinned(self.smoothed)
        title = f"{self.short_title}: {self.record.output}"
        more = dict(
            smoothed=smoothed, orders=self.evidence, study=self.study, validation=self._validation(), words=self.words
        )
        write(self.trace, path, self.summary, title, labels(self), self.keeper.events, **more)

    def _validation(self) -> Any:
        """Return the `Validation` of the run, where its rows were held; None where they are too many."""
        from driftwise.analysis.validation import can_be_validated, validate

        if not self.early.is_whole:
            return None
        y, u = self.early.record()
        trace = self.estimator.scan(y, u if self.inputs else None)
        return validate(trace, self.inputs, self.summary.unit) if can_be_validated(trace) else None

    def content(self) -> dict[str, Any]:
        from driftwise.cli.results import content

        return content(self)

    def show(self, out) -> None:
        from driftwise.cli.notes import described
        from driftwise.report.terminal import show_run

        facts = [f"{self.summary.samples} samples", *described(self), f"took {self.took:.2f} s"]
        show_run(self, title=self.title, facts=facts, notes=self.notes, out=out)
