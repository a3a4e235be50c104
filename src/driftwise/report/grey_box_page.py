"""The page of a grey box: physical parameters in their units, when they moved, the state, and how well it predicts."""

from __future__ import annotations

from pathlib import Path

from driftwise.report import plots
from driftwise.report.figure import LINES
from driftwise.report.observer_page import cards, innovations, outputs, shown
from driftwise.report.page import Page, Panel, named, stack, table
from driftwise.report.panels import event_panel
from driftwise.results.numbers import grouped, number, plus_minus, with_unit


def write(trace, path, summary=None, title=None, labels=None, events=None) -> Path:
    """Write the page of a run and return its path.

    Parameters
    ----------
    trace : a GreyBoxTrace, perhaps thinned out
    path : file to write
    summary : a GreyBoxSummary of the whole run; taken from the trace if omitted
    title : headline of the page
    labels : dict with "outputs" and "inputs" (one name with unit for each) and "time"; "origin": the time stamp of
        second 0, for an axis of dates
    events : list of Event of the whole run; taken from the trace if omitted
    """
    est = trace.estimator
    summary, events, labels, each, line, found = shown(trace, summary, events, labels)
    panels = [
        _parameters(trace, summary, line, found),
        outputs(trace, line, labels, events, each, found),
        _states(trace, line, found),
        innovations(trace, summary, line, each, found),
        event_panel(events, line),
    ]
    facts = [f"{grouped(summary.samples)} samples", f"plant {est.formulas.name}", f"{len(est.names)} parameters"]
    title = title or f"Physical parameters: {est.formulas.name}"
    return Page(title, panels, summary.words, facts, cards(summary)).write(path)


def _parameters(trace, summary, line, found) -> Panel:
    """Return the parameters with their intervals, what was believed of them beforehand, and their course."""
    est = trace.estimator
    plant, now, before = est.formulas, est.intervals(summary.state), est.intervals(est.start())
    rows = [
        [name, plus_minus(v, s), " … ".join(number(end, 4) for end in now[name]), plant.units[name] or "1",
         " … ".join(number(end, 3) for end in before[name])]
        for name, v, s in summary.parameters
    ]  # fmt: skip
    head = ["", "value ± standard deviation", "within, with 95 %", "unit", "believed beforehand"]
    n = est.model.n
    names = [with_unit(name, plant.units[name]) for name in est.names]
    columns = names, trace.estimates[:, n:], trace.std[:, n:]
    figures = named("parameter", plots.panels(line, *columns, colors=[LINES[1]], marks=found))
    words = " ".join([plant.about, *summary.notes])
    return Panel("parameters", "Parameters", words, (table(head, rows), *stack(figures)))


def _states(trace, line, found) -> Panel:
    n = trace.estimator.model.n
    names = [with_unit(name, trace.estimator.formulas.units[name]) for name in trace.state_names]
    columns = names, trace.estimates[:, :n], trace.std[:, :n]
    figures = named("state", plots.panels(line, *columns, colors=[LINES[0]], marks=found))
    return Panel("states", "State", "Two standard deviations either side.", tuple(stack(figures)))
