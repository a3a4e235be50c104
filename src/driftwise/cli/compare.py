"""`driftwise compare`: several estimators on the same table, one table of results and one page."""

from __future__ import annotations

import os
from typing import Any

from driftwise.cli import specs
from driftwise.cli.notes import clock_notes, labels
from driftwise.cli.options import Plan
from driftwise.cli.runner import look_of, no_row, progress, time_of, window
from driftwise.cli.targets import check_targets
from driftwise.engine.errors import CommandError, InputError
from driftwise.results.numbers import number
from driftwise.tables.table import Record, open_record

__all__ = ["execute"]


def execute(plan: Plan, texts: list[str]) -> None:
    """Compare the estimators that the SPECs name on the table of the plan; save, report, print."""
    check_targets(plan)
    try:
        specs.estimators(texts, plan.inputs, 1.0)
    except InputError as error:
        raise CommandError(str(error)) from None
    record = open_record(plan.file, plan.output, plan.inputs, plan.time, plan.chunk, plan.raw, look_of(plan))
    found, offsets = _compared(plan, texts, record)
    said = _notes(plan, record, offsets)
    title = "standard input" if plan.file == "-" else plan.file
    facts = [f"{found.samples} samples", f"output {plan.output}", *(f"input {name}" for name in plan.inputs)]
    if plan.report:
        from driftwise.report.comparison_page import write

        write(found, plan.report, f"{os.path.basename(title)}: {record.output}", facts, labels(record, plan))
    if plan.json:
        from driftwise.cli.results import write as write_json
        from driftwise.version import __version__

        columns = {"output": plan.output, "inputs": list(plan.inputs), "time": plan.time}
        content = {"driftwise": __version__, "file": plan.file, "columns": columns, "notes": said}
        write_json(content | found.as_dict(), plan.json)
    _show(found, title, facts, said, plan)


def _compared(plan: Plan, texts: list[str], record: Record) -> tuple[Any, Any]:
    """Return the comparison over the whole table, and the offsets that were subtracted."""
    from driftwise.analysis.comparison import Comparison
    from driftwise.cli.downsample import Offsets

    found: Any = None
    offsets: Any = None
    with progress(record, "comparing") as advance:
        for chunk in record:
            chunk = window(chunk, record, plan)
            if not chunk.rows:
                continue
            dt = (record.clock.dt or 1.0) if plan.dt is None else plan.dt
            if found is None:
                offsets = Offsets.of(chunk, record, plan.center)
                y, u = offsets.taken_from(chunk)
                made = specs.estimators(texts, plan.inputs, dt)
                scaled = {name: _scaled(name, est, y, u) for name, est in made.items()}
                found = Comparison(scaled)
            else:
                y, u = offsets.taken_from(chunk)
            found.add(y, u, time_of(chunk, record, dt))
            advance()
    if found is None:
        raise no_row(record)
    return found, offsets


def _scaled(name: str, est, y, u):
    """Return an estimator in units of the data; one that goes by a fixed prior stays as it is."""
    return est if est.options.get("theta0") is not None else est.scaled_to(y, u if est.model.inputs else None)


def _notes(plan: Plan, record: Record, offsets) -> list[str]:
    said = []
    if record.bad:
        where = f" (first: {record.first_bad})" if record.first_bad else ""
        said.append(f"{record.bad} cells are not finite numbers and were taken as missing{where}.")
    said += record.code_notes()
    if offsets.values:
        values = ", ".join(f"{name} {number(value)}" for name, value in offsets.values.items())
        said.append(f"means of the first chunk were subtracted, for all alike: {values}.")
    return [*clock_notes(record), *said, *record.clock.notes()]


def _show(found, title: str, facts: list[str], said: list[str], plan: Plan) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from driftwise.report.comparison_page import HEAD, cells
    from driftwise.report.terminal import console, foot, head

    out = console(stderr=plan.json == "-")
    head(out, title, facts)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for k, name in enumerate(HEAD):
        table.add_column(
            name, header_style="dim", justify="right" if k else "left", overflow="fold" if not k else "ellipsis"
        )
    for line in cells(found):
        table.add_row(*map(Text, line))
    out.print(table)
    out.print()
    out.print(Text(found.words))
    foot(out, beware=said)
    out.print()
    written = [f"{what} in {path}" for what, path in (("report", plan.report), ("results", plan.json)) if path]
    if written and plan.json != "-":
        print(", ".join(written))
