"""`driftwise run`: a table in, a summary out, chunk by chunk in constant memory."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from driftwise.cli.notes import counted_in, described, labels, notes, verdicts
from driftwise.cli.options import AUTO, Plan
from driftwise.cli.saving import Saver, smoothed_columns, widen
from driftwise.cli.specs import refusal
from driftwise.engine.errors import InputError
from driftwise.report.advice_translation import spoken_verdicts
from driftwise.results.numbers import SAMPLES
from driftwise.tables.table import Chunk, Record, open_record

__all__ = ["Run", "execute", "no_row", "progress", "time_of", "window"]

LOOK = 1000  # rows by which a clock is known
MANY = 60  # unknowns; beyond it roots and their bars take longer than the filter


@dataclass
class Run:
    """What a run brings."""

    estimator: Any = None
    summary: Any = None
    keeper: Any = None
    offsets: Any = None
    held: Any = None
    evidence: Any = None
    study: Any = None
    smoothed: Any = None
    smoothing_note: str = ""
    stopped: bool = False
    kept: Any = None  # the trace, thinned out


def execute(plan: Plan) -> None:
    """Run the plan: estimate, save, report, print."""
    try:
        plan.check()
    except InputError as error:
        order = None if plan.order == Plan._field_defaults["order"] else plan.order
        given = dict(model=plan.model, order=order, memory=plan.memory, jumps=plan.jumps, dt=plan.dt)
        raise refusal(error, **given) from None
    start = perf_counter()
    evidence = _choose(plan) if plan.is_auto else None
    if evidence is not None:
        plan = plan._replace(order=evidence.best, chosen=True)
    record = open_record(plan.file, plan.output, plan.inputs, plan.time, plan.chunk, plan.raw, look_of(plan))
    run = _estimate(plan, record, evidence)
    _look_again(plan, run)
    taken = perf_counter() - start
    said = notes(plan, record, run) + verdicts(run.kept.diagnosis)
    title = "standard input" if plan.file == "-" else plan.file
    if plan.report:
        from driftwise.report.run_page import write

        write(
            run.kept,
            plan.report,
            run.summary,
            f"{os.path.basename(title)}: {record.output}",
            labels(record, plan),
            run.keeper.events,
            smoothed=None if run.smoothed is None else run.keeper.thinned(run.smoothed),
            orders=run.evidence,
            study=run.study,
        )
    if plan.json:
        from driftwise.cli.results import write_json

        write_json(plan, record, run, said)
    from driftwise.report.terminal import console, show_run

    facts = [f"{run.summary.samples} samples", *described(plan, run.estimator.dt), f"took {taken:.2f} s"]
    written = [
        f"{what} in {path}"
        for what, path in (("trace", plan.save), ("report", plan.report), ("results", plan.json))
        if path
    ]
    show_run(run, title=title, facts=facts, notes=said, out=console(stderr=plan.json == "-"))
    if written and plan.json != "-":
        print(", ".join(written))


def _choose(plan: Plan):
    """Return the evidence of the orders, read from the whole table."""
    record = open_record(plan.file, plan.output, plan.inputs, plan.time, plan.chunk, plan.raw)
    from driftwise.cli.downsample import Offsets

    evidence: Any = None
    offsets: Any = None
    with progress(record, "comparing orders") as advance:
        for chunk in record:
            chunk = window(chunk, record, plan)
            if not chunk.rows:
                continue
            if evidence is None:
                evidence, offsets = plan.evidence(_dt(plan, record)), Offsets.of(chunk, record, plan.center)
            evidence.add(*offsets.taken_from(chunk))
            advance()
    if evidence is None:
        raise no_row(record)
    largest = evidence.summaries[max(evidence.orders)]
    if not largest.rmse >= 0:  # not one sample after those that the summaries leave to the prior
        raise InputError(
            f"{record.path}: {largest.observed} measured outputs are too few to choose among orders "
            f"{plan.orders or AUTO}: order {max(evidence.orders)} has {largest.estimator.model.N} unknowns and takes "
            f"more than {largest.settle}. Give lower --orders, or the --order itself."
        )
    return evidence


def _estimate(plan: Plan, record: Record, evidence) -> Run:
    import numpy as np

    from driftwise.analysis import study
    from driftwise.cli.downsample import Keeper, Offsets
    from driftwise.cli.early_samples import Held, smoothing_rows
    from driftwise.engine.status import Status
    from driftwise.results.summary import Summary

    run, state = Run(evidence=evidence), None
    saver = Saver(plan.save) if plan.save else None
    with progress(record, "estimating") as advance:
        try:
            for chunk in record:
                chunk = window(chunk, record, plan)
                if not chunk.rows:
                    continue
                if run.estimator is None:
                    made = plan.estimator(_dt(plan, record))
                    _refuse_short(plan, record, chunk, made.model.N)
                    run.offsets = Offsets.of(chunk, record, plan.center)
                    y, u = run.offsets.taken_from(chunk)
                    run.estimator = made.scaled_to(y, u)
                    run.summary, run.keeper = Summary(run.estimator), Keeper(run.estimator, run.offsets)
                    run.summary.unit = counted_in(plan)
                    run.held = Held(max(study.ROWS, smoothing_rows(run.estimator) if plan.smooth else 0))
                    if plan.candidates and evidence is None:
                        run.evidence = plan.evidence(run.estimator.dt)
                else:
                    y, u = run.offsets.taken_from(chunk)
                trace = run.estimator.scan(y, u, state=state, time=time_of(chunk, record, run.estimator.dt))
                state = trace.state
                if chunk.bad:
                    lost = np.logical_or.reduce([chunk.bad_cells[c] for c in (record.output, *record.inputs)])
                    trace.table[lost, 3] = trace.status[lost] | int(Status.BAD_VALUE)
                run.summary.add(trace)
                run.keeper.add(trace)
                run.held.add(trace.y, trace.u)
                if run.evidence is not None and evidence is None:
                    run.evidence.add(y, u)
                if saver:
                    saver.add(run.keeper.table(trace))
                advance()
        except KeyboardInterrupt:
            if state is None:
                raise
            run.stopped = True
        finally:
            if saver:
                saver.close()
    if run.estimator is None:
        raise no_row(record)
    run.summary.origin = record.clock.origin if record.time else None
    return run


def _look_again(plan: Plan, run: Run) -> None:
    """Do what needs the rows themselves: what they can teach, and smoothing."""
    from driftwise.analysis.diagnose import diagnose
    from driftwise.analysis.study import ROWS, study
    from driftwise.cli.early_samples import smoothing_rows

    center = plan.center if run.offsets.values else "none"
    y, u = run.held.record(ROWS)
    run.study = study(run.estimator, run.summary.state, y, u, center)
    run.kept = run.keeper.trace()
    record = (y, u) if run.held.rows == len(y) else None
    found = diagnose(run.kept, run.summary, record=record, identifiable=run.study.identifiability)
    run.kept.diagnosis = spoken_verdicts(found)
    if not plan.smooth:
        return
    most = smoothing_rows(run.estimator)
    if not run.held.is_whole:
        run.smoothing_note = (
            f"not smoothed: it needs the record in memory, and {run.held.rows} rows are more than the {most} that may "
            "be held for this model; cut a stretch out with --from and --to."
        )
        return
    y, u = run.held.record()
    try:
        run.smoothed = run.estimator.smooth(y, u if plan.inputs else None, lag=plan.lag)
    except InputError as error:  # the record itself does not allow it
        run.smoothing_note = f"not smoothed: {error}."
        return
    if plan.save:
        widen(plan.save, smoothed_columns(run.smoothed))


def window(chunk: Chunk, record: Record, plan: Plan) -> Chunk:
    """Return the rows between --from and --to."""
    if plan.start is None and plan.stop is None:
        return chunk
    import numpy as np

    time = time_of(chunk, record, plan.dt or 1.0)
    low = -np.inf if plan.start is None else record.moment("--from", plan.start)
    high = np.inf if plan.stop is None else record.moment("--to", plan.stop, is_end=True)
    inside = (time >= low) & (time <= high)
    columns = {name: values[inside] for name, values in chunk.columns.items()}
    bad_cells = {name: cells[inside] for name, cells in chunk.bad_cells.items()}
    first = chunk.first_row + int(np.argmax(inside)) if inside.any() else chunk.first_row
    return Chunk(columns, bad_cells, first, int(sum(c.sum() for c in bad_cells.values())))


def no_row(record: Record) -> InputError:
    """Return the error for a record of which nothing is left between --from and --to."""
    clock = record.clock
    why = (
        "what are the units of the time?"
        if clock.origin is None
        else f"its stamps run from {clock.origin} to {clock.end}."
    )
    return InputError(f"{record.path}: no row lies between --from and --to; {why}")


def _refuse_short(plan: Plan, record: Record, chunk: Chunk, unknowns: int) -> None:
    import numpy as np

    what = f"--model {plan.model}" if plan.model else f"order {plan.order}"
    seen = int(np.isfinite(chunk.columns[record.output]).sum())
    if chunk.rows < record.chunk_rows and seen <= unknowns:
        raise InputError(
            f"{record.path}: {seen} measured outputs are too few for {unknowns} unknowns ({what}, "
            f"{len(record.inputs)} inputs). Take a smaller one, or is this the right column?"
        )
    if unknowns > MANY:
        print(
            f"driftwise: {what} has {unknowns} unknowns, which takes long, and "
            f"{record.source.rows or seen} rows may be too few for so many: was a smaller one meant?",
            file=sys.stderr,
        )


def look_of(plan: Plan) -> int:
    """Return by how many rows the columns that were not named are looked at: none where the clock is known."""
    return LOOK if counted_in(plan) == SAMPLES and plan.file != "-" else 0


def _dt(plan: Plan, record: Record) -> float:
    return (record.clock.dt or 1.0) if plan.dt is None else plan.dt


def time_of(chunk: Chunk, record: Record, dt: float):
    """Return the time of each row of a chunk: the time column, or rows times dt."""
    import numpy as np

    if record.time:
        return chunk.columns[record.time]
    return (chunk.first_row + np.arange(chunk.rows)) * dt


@contextmanager
def progress(record: Record, what: str):
    """Show a bar on standard error while a long file is read; nothing where it is no terminal."""
    if not sys.stderr.isatty() or record.source.fraction == 1.0:
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=1.0 if record.source.fraction is not None else None)
        yield lambda: bar.update(task, completed=record.source.fraction)
