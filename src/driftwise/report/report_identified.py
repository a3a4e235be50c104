"""The page of an identification: the answer, forecast, changes, parameters, who was believed, verdicts, columns."""

from __future__ import annotations

from pathlib import Path

from driftwise.analysis.change_log import MISFIT
from driftwise.analysis.forecast_summary import Own
from driftwise.report import report_answer as answer
from driftwise.report import report_figures, report_plots, report_verdicts
from driftwise.report import report_page as html
from driftwise.report import report_parts as common
from driftwise.report.report_axes import Timeline
from driftwise.report.report_marks import Mark
from driftwise.report.terminal_identified import SO_FAR
from driftwise.report.wording import fixed, number

__all__ = ["write"]


def write(found, path, title: str | None = None, events=None, notes=()) -> Path:
    """Write the page of an `Identification` and return its path.

    Parameters
    ----------
    found : Identification
        Its traces perhaps thinned out.
    path : file to write
    title : headline; the output's name if omitted
    events : list of Event of the whole run
    notes : sentences about the table
    """
    trace, forecast, table, summary = found.trace, found.forecast, found.table, found.summary
    quoted = Own(trace) if found.is_alone else forecast
    trace.diagnosis = found.diagnosis
    events = list(trace.events() if events is None else events)
    clock = "time (s)" if table.timed else "sample" if table.sampling.kind == "none" else table.time
    line = Timeline(trace.time, clock, found.origin, getattr(trace, "rows", None))
    marks = [Mark(change.time, "jump", found.told(change)) for change in found.changes]
    labels = {"inputs": [_named(table[name]) for name in table.inputs]}
    below = report_figures.inputs(line, trace, labels) if table.inputs else []
    shares, names = by_structure(forecast)
    shown = trace if found.is_alone else forecast
    columns = trace.y, shown.prediction, shown.band(0.95)
    figures = {
        "output": report_plots.output(line, *columns, _named(table[table.output]), marks=marks, is_named=not below),
        **common.named("input", below),
        **common.named("parameter", report_figures.parameters(line, trace, None, marks)),
        "weights": report_plots.weights(line, shares, names, marks),
        "innovations": report_plots.innovations(line, quoted.normal_score, marks=marks),
    }
    script, parts = common.components(figures)
    by = found.chosen.name if found.is_alone else "all models together"
    sections = [
        html.section(
            "prediction",
            "Measured and forecast",
            f"Each sample is forecast from the ones before it, by {by}; the band should hold 95 %.",
            common.plot(parts["output"]),
            *map(common.plot, common.of(parts, "input")),
            common.zoom_words(line),
            _changes(found, line),
        ),
        html.section(
            "parameters",
            "Parameters",
            f"Model {found.chosen.name} about the means of the first samples; shaded: two standard deviations.",
            *common.stack(common.of(parts, "parameter")),
        ),
        html.section(
            "innovations",
            "What could not be forecast",
            "Where each sample lies in its forecast, as a standard normal deviate. Shaded: two sigma.",
            common.plot(parts["innovations"]),
        ),
        report_verdicts.section(trace, summary),
    ]
    folds = [
        html.fold(
            "models", "Which model", found.chosen.name,
            "How well each predicted, with the memory that suited it best; odds are those against the best.",
            _models(found), common.plot(parts["weights"]),
        ),
        html.fold("columns", "The table", f"{len(table.columns)} columns", table.words, _columns(table), _list(notes)),
        html.fold("events", "Events", *common.event_words(events), common.event_table(events, line)),
    ]  # fmt: skip
    return common.write(
        path,
        title=title or table.output,
        facts=answer.facts(trace, summary, table.step),
        lead=found.answer,
        cards=_cards(found, line),
        sections=sections,
        folds=folds,
        script=script,
    )


def by_structure(forecast):
    """Return the weights of a forecast added up over the memories of each model, (T, S), and the models' names."""
    import numpy as np

    owners = [name.partition(", ")[0] for name in forecast.names]
    names = list(dict.fromkeys(owners))
    shares = np.zeros((len(forecast), len(names)))
    for owner, column in zip(owners, forecast.weights.T):
        shares[:, names.index(owner)] += column
    return shares, names


def _cards(found, line) -> list[str]:
    f, last = found.quoted, found.last
    what = f"last {line.words(last.time)}: {' and '.join(last.moved) or MISFIT}" if last else "nothing jumped"
    sure = [
        html.card("One-step fit", fixed(f.fit, 1), f"last value: {number(found.naive['last value'], 3)} rms", "", "%"),
        html.card("Held by 95 % bands", fixed(100 * f.coverage, 1), "about 95 is right",
                  common.grade(found.diagnosis.find("coverage").is_fine, f.coverage >= 0.85), "%"),
    ]  # fmt: skip
    return [
        html.group("The plant", answer.plant(found.summary, found.trace.dt, found.table.lasting, f.rmse)),
        html.group("Changes", [html.card("Changes", str(found.alarms or "none"), what)]),
        html.group("How sure", sure),
    ]


def _changes(found, line) -> str:
    rows = [[line.words(c.time), " and ".join(c.moved) or MISFIT, f"{c.delay}"] for c in found.changes]
    what = f"what changed: the surest {len(rows)} of {found.alarms}" if found.alarms > len(rows) else "what changed"
    return html.table([line.label, what, "samples until noticed"], rows, text=(0, 1)) if rows else ""


def _models(found) -> str:
    rows = [
        [r.name, r.unknowns, fixed(r.evidence, 1), number(r.rmse, 3), html.tag("shown", "good") * (r is found.chosen)]
        for r in found.rivals
    ]
    rows += [[SO_FAR.get(name, name), 0, "", number(error, 3), ""] for name, error in found.judged.items()]
    return html.table(["model", "unknowns", "log odds", "error (rms)", ""], rows, text=(0,))


def _columns(table) -> str:
    rows = [[c.name, c.role, c.unit, f"{100 * c.missing:.3g} %", c.why] for c in table.columns]
    return html.table(["column", "part", "unit", "missing", "why"], rows, text=(0, 1, 2, 4))


def _list(notes) -> str:
    return "".join(html.say(note) for note in notes)


def _named(column) -> str:
    return f"{column.name} ({column.unit})" if column.unit else column.name
