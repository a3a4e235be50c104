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
from driftwise.report.wording import number
from driftwise.tables.table import Record, open_record

__all__ = ["execute", "write"]

HEAD = ("estimator", "fit %", "rmse", "-log p", "behind best", "NIS", "in 95 %", "alarms", "µs/sample", "unknowns")


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
    inputs = est.inputs if hasattr(est, "members") else est.model.inputs
    return est if est.options.get("theta0") is not None else est.scaled_to(y, u if inputs else None)


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


def cells(found) -> list[list[str]]:
    """Return the rows of the table, best first; ``=`` marks those that are not clearly worse than the best."""
    rows = []
    for row in found.rows:
        behind = (
            "" if not row.difference else f"{row.difference:.3f} \u00b1 {row.difference_std:.3f}{' =' * row.is_tied}"
        )
        rows.append(
            [
                row.name, f"{row.fit:.1f}", number(row.rmse, 4), f"{row.nlpd:.3f}", behind, f"{row.nis:.2f}",
                f"{100 * row.coverage:.1f}", str(row.alarms), number(row.us_per_sample, 2), str(row.unknowns),
            ]
        )  # fmt: skip
    return rows


def _show(found, title: str, facts: list[str], said: list[str], plan: Plan) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from driftwise.report.terminal import console

    out = console(stderr=plan.json == "-")
    out.print()
    out.print(Text(title, style="bold"))
    out.print(Text(" \u00b7 ".join(facts), style="dim"))
    out.print()
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for k, head in enumerate(HEAD):
        table.add_column(
            head, header_style="dim", justify="right" if k else "left", overflow="fold" if not k else "ellipsis"
        )
    for line in cells(found):
        table.add_row(*map(Text, line))
    out.print(table)
    out.print()
    out.print(Text(found.words))
    for note in said:
        out.print(Text("note: ", style="yellow") + Text(note))
    out.print()
    written = [f"{what} in {path}" for what, path in (("report", plan.report), ("results", plan.json)) if path]
    if written and plan.json != "-":
        print(", ".join(written))


# --- the page ------------------------------------------------------------------------------------------------


def write(found, path, title: str = "Comparison of estimators", facts=(), labels=None):
    """Write one page about a `Comparison`: the table, and when each estimator was ahead; return its path."""
    from driftwise.report import report_page as html
    from driftwise.report import report_parts as common

    rows = found.rows
    line, figure = _lead(found, labels or {})
    script, parts = common.components({"lead": figure})
    best = rows[0]
    cards = [
        html.group("Which predicts best?", [html.card("Best", best.name, "by log predictive density")]),
        html.group(
            "How well?",
            [
                html.card("One-step fit", f"{best.fit:.1f}", "100 = perfect, 0 = the mean", unit="%"),
                html.card("NIS", f"{best.nis:.2f}", "1 = right error bars"),
                html.card("Held by 95 % bands", f"{100 * best.coverage:.1f}", "should be about 95", unit="%"),
            ],
        ),
    ]
    words = (
        "One step ahead, in one pass, on the same samples. -log p: mean negative log density given to what came, lower "
        "is better. Behind best: the difference and its deviation; = marks those not clearly worse. Unknowns: numbers "
        "that are estimated."
    )
    told = (
        "Log density given to the samples so far, less that of the best: where a line falls, that estimator loses; "
        "where it rises, it wins. Those far behind fall out of the window."
    )
    sections = [
        html.section("table", "Best first", words, html.table(list(HEAD), cells(found))),
        html.section("lead", "Who was ahead when?", told, common.plot(parts["lead"]), common.zoom_words(line)),
    ]
    return common.write(
        path, title=title, facts=" \u00b7 ".join(facts), lead=found.words, cards=cards, sections=sections, script=script
    )


def _lead(found, labels):
    """Return the time axis, and the log densities so far less that of the best over it."""
    import numpy as np

    from driftwise.report.figure import LINES
    from driftwise.report.report_axes import Timeline, legend

    time, log = found.path
    line = Timeline(time, labels.get("time", "time (s)"), labels.get("origin"))
    order = [found.names.index(row.name) for row in found.rows]
    behind = log[:, order] - log[:, [order[0]]]
    columns = {f"lead{k}": behind[:, k] for k in range(len(order))}
    source = line.source(np.arange(len(time)), **columns)
    shown = behind[:, : (len(order) + 1) // 2 + 1]  # the others may fall out of the window
    low, high = 1.1 * float(shown.min(initial=-1.0)), float(max(behind.max(initial=0.0), 0.0))
    fig = line.figure(340, "nats behind the best", y_range=(low, high - 0.05 * low))
    drawn = [
        fig.line("t", f"lead{k}", source=source, line_width=1.8, color=LINES[k % len(LINES)],
                 line_dash="solid" if k < len(LINES) else "dashed")
        for k in range(len(order))
    ]  # fmt: skip
    names = [found.names[i] for i in order]
    line.hover(fig, drawn[:1], *((name, f"lead{k}") for k, name in enumerate(names)))
    legend(fig, [(name, [mark]) for name, mark in zip(names, drawn)])
    return line, fig
