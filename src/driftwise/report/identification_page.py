"""The page of an identification: the answer, forecast, changes, parameters, who was believed, verdicts, columns."""

from __future__ import annotations

from pathlib import Path

from driftwise.analysis.forecast_summary import Own
from driftwise.analysis.validation import can_be_validated
from driftwise.report import plots
from driftwise.report.axes import Timeline
from driftwise.report.marks import Mark
from driftwise.report.page import Card, Page, Panel, group, say, stack, table, tag
from driftwise.report.panels import event_panel, grade, held_card, verdict_panel, zoom_words
from driftwise.report.run_page import facts, input_figures, parameter_figures, plant_cards
from driftwise.report.terminal import SO_FAR
from driftwise.report.validation_page import validation_panel
from driftwise.results.numbers import fixed, number, odds_words
from driftwise.results.sentences import NOTHING_JUMPED


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
    trace, columns = found.trace, found.table
    trace.diagnosis = found.diagnosis
    events = list(trace.events() if events is None else events)
    clock = "time (s)" if columns.timed else "sample" if columns.sampling.kind == "none" else columns.time
    origin = None if found.breaks else found.origin  # a clock that starts again shows each date more than once
    line = Timeline(trace.time, clock, origin, getattr(trace, "rows", None))
    marks = [Mark(change.time, "jump", found.phrase(change)) for change in found.changes]
    shares, names = by_structure(found.forecast)
    panels = [
        _output(found, line, marks),
        Panel(
            "parameters", "Parameters",
            f"Model {found.chosen.name} about the means of the first samples; shaded: two standard deviations.",
            tuple(stack(parameter_figures(line, trace, None, marks))),
        ),
        Panel(
            "innovations", "What could not be forecast",
            "Where each sample lies in its forecast, as a standard normal deviate. Shaded: two sigma.",
            (plots.innovations(line, (Own(trace) if found.is_alone else found.forecast).normal_score, marks=marks),),
        ),
        verdict_panel(trace, found.summary),
        Panel(
            "models", "Which model",
            "How well each predicted, with the memory that suited it best; odds are those against the best.",
            (_models(found), plots.weights(line, shares, names, marks)), found.chosen.name,
        ),
        Panel("columns", "The table", found.table_words, (_columns(columns), *map(say, notes)),
              f"{len(columns.columns)} columns"),
        validation_panel(trace, found.validate() if can_be_validated(trace) and found.summary.is_enough else None),
        event_panel(events, line),
    ]  # fmt: skip
    title, size = title or columns.output, facts(trace, found.summary, columns.step)
    return Page(title, panels, found.answer, size, _cards(found, line)).write(path)


def _output(found, line, marks) -> Panel:
    trace, columns = found.trace, found.table
    shown = trace if found.is_alone else found.forecast
    labels = {"inputs": [_label(columns[name]) for name in columns.inputs]}
    below = input_figures(line, trace, labels) if columns.inputs else []
    drawn = trace.y, shown.prediction, shown.band(0.95)
    above = plots.output(line, *drawn, _label(columns[columns.output]), marks=marks, is_named=not below)
    by = found.chosen.name if found.is_alone else "all models together"
    words = f"Each sample is forecast from the ones before it, by {by}; the band should hold 95 %."
    body = above, *below, zoom_words(line), _changes(found, line)
    return Panel("prediction", "Measured and forecast", words, body)


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
    what = f"last {_when(found, line, last)}: {last.moved}" if last else NOTHING_JUMPED
    changes = Card("Changes", str(found.alarms or "none"), what)
    if not last and found.visible is None:
        changes = Card("Changes", "not known", "there are too few samples", "warn")
    naive = f"last value: {number(found.naive['last value'], 3)} rms"
    held = grade(found.diagnosis.find("coverage").is_fine, f.coverage >= 0.85)
    return [
        group("The plant", _plant(found)),
        group("Changes", [changes]),
        group("How sure", [Card("One-step fit", fixed(f.fit, 1), naive, "", "%"), held_card(f.coverage, held)]),
    ]


def _plant(found) -> list[Card]:
    """Return the cards of what the words claim of the first input that they know; of no input, the model's own."""
    lasting = found.table.lasting
    if not found.table.inputs:
        mode, *rest = plant_cards(found.summary, found.trace.dt, lasting, found.quoted.rmse)
        is_told = any(claim.kind in ("time constant", "pole") for claim in found.claims)
        return [mode if is_told else Card("Slowest mode", "not known", "none stands out", "warn"), *rest]
    known = {claim.kind: claim for claim in reversed(found.claims) if claim.interval is not None}
    cards, open_ = [], "may integrate" if found.effects.is_endless else "the data leave it open"
    if one := known.get("time constant"):
        value, _, unit = lasting(one.value).partition(" ")
        low, high = (lasting(end) for end in one.interval)
        cards.append(Card("63 % of a step", value, f"{one.subject}: {low} to {high}", unit=unit))
    else:
        cards.append(Card("63 % of a step", "not known", open_, "warn"))
    if one := known.get("gain"):
        bar = number((one.interval[1] - one.interval[0]) / 2, 2)
        cards.append(Card("Steady-state gain", number(one.value, 3), f"{one.subject}: 95 %", unit=f"\u00b1 {bar}"))
    else:
        cards.append(Card("Steady-state gain", "not known", open_, "warn"))
    return cards


def _when(found, line, change) -> str:
    """Return when a change was, as the axis has it; where its clock starts again, as the table has it."""
    return f"{found.when(change.time).removeprefix('at ')} run" if found.breaks else line.words(change.time)[0]


def _changes(found, line) -> str:
    rows = [[_when(found, line, c), c.beside, odds_words(c.odds)] for c in found.changes]
    what = f"what changed: the surest {len(rows)} of {found.alarms}" if found.alarms > len(rows) else "what changed"
    return table([line.label, what, "odds"], rows, text=(0, 1))


def _models(found) -> str:
    rows = [
        [r.name, r.unknowns, fixed(r.evidence, 1), number(r.rmse, 3), tag("shown", "good") * (r is found.chosen)]
        for r in found.rivals
    ]
    rows += [[SO_FAR.get(name, name), 0, "", number(error, 3), ""] for name, error in found.judged.items()]
    return table(["model", "unknowns", "log odds", "error (rms)", ""], rows, text=(0,))


def _columns(columns) -> str:
    rows = [[c.name, c.role, c.unit, f"{100 * c.missing:.3g} %", c.why] for c in columns.columns]
    return table(["column", "part", "unit", "missing", "why"], rows, text=(0, 1, 2, 4))


def _label(column) -> str:
    return f"{column.name} ({column.unit})" if column.unit else column.name
