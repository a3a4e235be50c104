"""The page of a filter with the user's matrices: its outputs, its state, and whether the matrices fit."""

from __future__ import annotations

from pathlib import Path

from driftwise.report import plots
from driftwise.report.figure import LINES
from driftwise.report.observer_page import cards, innovations, outputs, shown
from driftwise.report.page import Page, Panel, named, stack, table
from driftwise.report.panels import event_panel
from driftwise.results.numbers import grouped, interval, number, plus_minus


def write(trace, path, summary=None, title=None, labels=None, events=None) -> Path:
    """Write the page of a run and return its path.

    Parameters
    ----------
    trace : a StateTrace, perhaps thinned out
    path : file to write
    summary : a StateSummary of the whole run; taken from the trace if omitted
    title : headline of the page
    labels : dict with "outputs" and "inputs" (one name with unit for each) and "time"; "origin": the time stamp of
        second 0, for an axis of dates
    events : list of Event of the whole run; taken from the trace if omitted
    """
    est, form = trace.estimator, trace.estimator.model
    summary, events, labels, each, line, found = shown(trace, summary, events, labels)
    panels = [
        outputs(trace, line, labels, events, each, found),
        _states(trace, summary, line, found),
        _watched(trace, line, found),
        innovations(trace, summary, line, each, found),
        event_panel(events, line),
    ]
    facts = [
        f"{grouped(summary.samples)} samples", f"every {number(est.dt)} s" + (", irregular" if est.irregular else ""),
        f"{form.n} states", f"log evidence {number(summary.loglik, 6)}",
    ]  # fmt: skip
    title = title or "State of a system whose matrices are known"
    return Page(title, panels, summary.words, facts, cards(summary)).write(path)


def _states(trace, summary, line, found) -> Panel:
    """Return the last estimates and the course of each state."""
    head = ["", "last value \u00b1 standard deviation", "within two standard deviations"]
    rows = [[name, plus_minus(v, s), interval(v, s)] for name, v, s in summary.estimates]
    columns = trace.state_names, trace.estimates, trace.std
    figures = named("state", plots.panels(line, *columns, colors=[LINES[0]], marks=found))
    words = " ".join(["Bands: two standard deviations either side.", *summary.learnt, *trace.estimator.notes])
    return Panel("states", "State", words, (table(head, rows), *stack(figures)))


def _watched(trace, line, found) -> Panel | None:
    """Return the detector's statistic, if one watched."""
    if not trace.statistic.any():
        return None
    words = (
        "The detector's statistic over its threshold: above one the innovations no longer are what the matrices say."
    )
    return Panel("parity", "Do the matrices still fit?", words, (plots.statistic(line, trace.statistic, found),))
