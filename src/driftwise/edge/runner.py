"""`driftwise run`: a table in, a summary out, chunk by chunk in constant memory."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager
from time import perf_counter
from typing import Any

from driftwise.edge.options import Plan
from driftwise.edge.saving import Saver
from driftwise.edge.tables import Chunk, Record, open_record
from driftwise.edge.wording import number
from driftwise.errors import InputError

__all__ = ["execute"]


def execute(plan: Plan) -> None:
    """Run the plan: estimate, save, report, print."""
    plan.check_targets()
    plan.estimator(1.0 if plan.dt is None else plan.dt)  # a wrong option is told before the table is read
    record = open_record(plan.file, plan.output, plan.inputs, plan.time, plan.chunk)
    start = perf_counter()
    summary, keeper, offsets, stopped = _estimate(plan, record)
    taken = perf_counter() - start
    notes = _notes(plan, record, summary, offsets, stopped)
    title = "standard input" if plan.file == "-" else plan.file
    if plan.report:
        from driftwise.edge.report import write

        write(
            keeper.trace(),
            plan.report,
            summary,
            f"{os.path.basename(title)}: {record.output}",
            _labels(record),
            keeper.events,
        )
    if plan.json:
        from driftwise.edge.results import write_json

        write_json(plan, record, keeper.estimator, summary, offsets, notes)
    from driftwise.edge.terminal import console, show

    facts = [f"{summary.samples} samples", *_described(plan, keeper.estimator.dt), f"{taken:.2f} s"]
    written = [
        f"{what} in {path}"
        for what, path in (("trace", plan.save), ("report", plan.report), ("results", plan.json))
        if path
    ]
    show(summary, title=title, facts=facts, notes=notes, out=console(stderr=plan.json == "-"))
    if written and plan.json != "-":
        print(", ".join(written))


def _estimate(plan: Plan, record: Record):
    import numpy as np

    from driftwise.edge.keep import Keeper, Offsets
    from driftwise.kernel.status import Status
    from driftwise.workflow.summary import Summary

    summary: Any = None
    keeper: Any = None
    offsets: Any = None
    estimator = state = None
    saver = Saver(plan.save) if plan.save else None
    stopped = False
    with _progress(record) as advance:
        try:
            for chunk in record:
                chunk = _window(chunk, record, plan)
                if not chunk.rows:
                    continue
                if estimator is None:
                    _refuse_short(plan, record, chunk)
                    dt = (record.clock.dt or 1.0) if plan.dt is None else plan.dt
                    offsets = Offsets.of(chunk, record, plan.center)
                    y, u = offsets.taken_from(chunk)
                    estimator = plan.estimator(dt).scaled_to(y, u)
                    summary, keeper = Summary(estimator), Keeper(estimator, offsets)
                else:
                    y, u = offsets.taken_from(chunk)
                trace = estimator.scan(y, u, state=state, time=_time(chunk, record, estimator.dt))
                state = trace.state
                if chunk.bad:
                    lost = np.logical_or.reduce([chunk.bad_cells[c] for c in (record.output, *record.inputs)])
                    trace.outs[lost, 3] = trace.status[lost] | int(Status.BAD_VALUE)
                summary.add(trace)
                keeper.add(trace)
                if saver:
                    saver.add(keeper.table(trace))
                advance()
        except KeyboardInterrupt:
            if state is None:
                raise
            stopped = True
        finally:
            if saver:
                saver.close()
    if estimator is None:
        raise InputError(f"{record.path}: no row lies between --from and --to; what are the units of the time?")
    return summary, keeper, offsets, stopped


def _window(chunk: Chunk, record: Record, plan: Plan) -> Chunk:
    """Return the rows between --from and --to."""
    if plan.start is None and plan.stop is None:
        return chunk
    import numpy as np

    time = _time(chunk, record, plan.dt or 1.0)
    low = -np.inf if plan.start is None else plan.start
    high = np.inf if plan.stop is None else plan.stop
    inside = (time >= low) & (time <= high)
    columns = {name: values[inside] for name, values in chunk.columns.items()}
    bad_cells = {name: cells[inside] for name, cells in chunk.bad_cells.items()}
    first = chunk.first_row + int(np.argmax(inside)) if inside.any() else chunk.first_row
    return Chunk(columns, bad_cells, first, int(sum(c.sum() for c in bad_cells.values())))


def _described(plan: Plan, dt: float) -> list[str]:
    """Return what kind of model was estimated, in a few words."""
    inputs = len(plan.inputs)
    found = [
        f"order {plan.order}",
        "no input" if not inputs else "1 input" if inputs == 1 else f"{inputs} inputs",
    ]
    found += ["direct term"] if plan.direct else []
    found += [plan.noise, "constant parameters" if plan.memory == "never" else plan.memory]
    return [*found, *([f"gate {plan.gate:g}"] if plan.gate else []), f"dt {number(dt, 4)} s"]


def _refuse_short(plan: Plan, record: Record, chunk: Chunk) -> None:
    import numpy as np

    from driftwise.models.canonical import Canonical

    unknowns = Canonical(plan.order, len(record.inputs), plan.direct).N
    seen = int(np.isfinite(chunk.columns[record.output]).sum())
    if chunk.rows < record.chunk_rows and seen <= unknowns:
        raise InputError(
            f"{record.path}: {seen} measured outputs are too few for {unknowns} unknowns (order {plan.order}, "
            f"{len(record.inputs)} inputs). Take a smaller --order, or is this the right column?"
        )


def _time(chunk: Chunk, record: Record, dt: float):
    import numpy as np

    if record.time:
        return chunk.columns[record.time]
    return (chunk.first_row + np.arange(chunk.rows)) * dt


def _labels(record: Record) -> dict:
    def named(name):
        unit = record.units.get(name)
        return f"{name} ({unit})" if unit else name

    if record.time is None:
        time = "time (s)"
    else:
        time = f"time since {record.clock.origin} (s)" if record.clock.origin else named(record.time)
    return {"output": named(record.output), "inputs": [named(name) for name in record.inputs], "time": time}


def _notes(plan: Plan, record: Record, summary, offsets, stopped: bool) -> list[str]:
    notes = ["stopped early; the results are those of the rows read so far."] if stopped else []
    if record.ragged:
        notes.append(f"{record.ragged} rows have too many or too few cells; each was counted as a missing sample.")
    cells = record.bad - record.ragged * len(record.columns)
    if cells > 0:
        where = f" (first: {record.first_bad})" if record.first_bad else ""
        notes.append(f"{cells} cells are not finite numbers and were taken as missing{where}.")
    for name, value, row in offsets.extremes:
        notes.append(
            f"{name!r} is {value:g} in row {row + 1}, ten thousand times farther out than the rest: an error code? "
            "Blank it, or the results are about that row."
        )
    for name, value in offsets.constants:
        notes.append(f"input {name!r} stayed at {value:g} in the first chunk: its effect cannot be learned there.")
    if offsets.values:
        values = ", ".join(f"{name} {number(value)}" for name, value in offsets.values.items())
        notes.append(f"{plan.center}s of the first chunk were subtracted: {values} (--center none keeps the data).")
    notes += record.clock.notes()
    if offsets.values and not summary.whiteness.is_white:
        notes.append(
            "the innovations are not white: a mean is not always an operating point, so try --center none (or median) "
            "before a higher order."
        )
    return notes


@contextmanager
def _progress(record: Record):
    """Show a bar on standard error while a long file is read; nothing where it is no terminal."""
    if not sys.stderr.isatty() or record.fraction == 1.0:
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("estimating", total=1.0 if record.fraction is not None else None)
        yield lambda: bar.update(task, completed=record.fraction)
