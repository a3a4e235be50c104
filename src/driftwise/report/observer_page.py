"""The page of an observer: states, disturbances, derived outputs, and how well its predictions fit."""

from __future__ import annotations

from math import inf
from pathlib import Path

from driftwise.report import plots
from driftwise.report.axes import Timeline
from driftwise.report.figure import LINES
from driftwise.report.marks import marks
from driftwise.report.page import Card, Page, Panel, group, named, stack, table
from driftwise.report.panels import change_table, event_panel, fit_cards, zoom_words
from driftwise.report.run_page import input_figures, named_axes, scaled
from driftwise.results.numbers import grouped, interval, number, percent, plus_minus
from driftwise.results.sentences import nis_words

OUTPUTS_SHOWN = 4


def write(trace, path, summary=None, title=None, labels=None, events=None) -> Path:
    """Write the page of a run and return its path.

    Parameters
    ----------
    trace : an ObserverTrace, perhaps thinned out
    path : file to write
    summary : an ObserverSummary of the whole run; taken from the trace if omitted
    title : headline of the page
    labels : dict with "outputs" and "inputs" (one name with unit for each) and "time"; "origin": the time stamp of
        second 0, for an axis of dates
    events : list of Event of the whole run; taken from the trace if omitted
    """
    summary, events, labels, each, line, found = shown(trace, summary, events, labels)
    panels = [
        outputs(trace, line, labels, events, each, found),
        _estimates(trace, summary),
        *_estimated(trace, line, found),
        _parity(trace, line, found),
        innovations(trace, summary, line, each, found),
        event_panel(events, line),
    ]
    title = title or "State and disturbances of a known plant"
    return Page(title, panels, summary.words, _facts(trace, summary), cards(summary)).write(path)


def shown(trace, summary, events, labels):
    """Return summary, events and labels, made where omitted; the outputs that are shown, the time axis, the marks."""
    form = trace.estimator.model
    usual = {"outputs": form.output_names, "inputs": form.input_names}
    summary, events, labels = named_axes(trace, summary, events, usual, labels)
    line = Timeline(trace.time, labels["time"], labels.get("origin"), getattr(trace, "rows", None))
    return summary, events, labels, trace.outputs[:OUTPUTS_SHOWN], line, marks(events)


def outputs(trace, line, labels, events, each, found) -> Panel:
    """Return each output with its predictions, and the inputs."""
    figures = [
        plots.output(line, one.y, one.prediction, one.band(0.95), label, marks=found)
        for one, label in zip(each, labels["outputs"])
    ]
    words = "Each sample is predicted from the ones before it; the band should hold 95 % of them."
    body = *named("output", figures), *input_figures(line, trace, labels), zoom_words(line), change_table(events, line)
    return Panel("prediction", "Measured and predicted", words, body)


def _estimated(trace, line, found):
    """Yield derived outputs, states and disturbances, each with its band."""
    form, names = trace.estimator.model, trace.state_names + trace.names
    n, m = form.n, form.m
    for kind, name, title, first, last, color in (
        ("derived", "derived", "Derived outputs", m, form.N, LINES[2]),
        ("state", "states", "State", 0, n, LINES[0]),
        ("disturbance", "disturbances", "Disturbances", n, m, LINES[1]),
    ):
        if first < last:
            columns = names[first:last], trace.estimates[:, first:last], trace.std[:, first:last]
            figures = named(kind, plots.panels(line, *columns, colors=[color], marks=found))
            yield Panel(name, title, "", tuple(stack(figures)))


def _parity(trace, line, found) -> Panel | None:
    if not trace.statistic.any():
        return None
    words = (
        "Two windows side by side, the older one carried forward: the squared distance of their estimates over its "
        "threshold. Above one the plant changed, or something acts that was not stated."
    )
    return Panel("parity", "Does the plant still fit?", words, (plots.statistic(line, trace.statistic, found),))


def innovations(trace, summary, line, each, found) -> Panel:
    """Return the standardised innovations of each output."""
    names = trace.estimator.model.output_names
    sizes = [f"{name}: their mean square (NIS) is {nis_words(nis)}" for name, nis in zip(names, summary.nis)]
    words = f"Divided by the standard deviation the observer itself predicted. {' '.join(sizes)}"
    figures = [plots.innovations(line, scaled(one), marks=found) for one in each]
    return Panel("innovations", "Innovations: what could not be predicted", words, tuple(named("innovation", figures)))


def _facts(trace, summary) -> list[str]:
    est = trace.estimator
    window = est.window
    return [
        f"{grouped(summary.samples)} samples",
        f"every {number(est.dt)} s" + (", irregular" if est.irregular else ""),
        f"{est.model.m} unknowns",
        "all samples so far" if window == inf else f"a window of {number(window)} s",
    ]


def _estimates(trace, summary) -> Panel:
    """Return what was stated beforehand, and the last estimates."""
    est = trace.estimator
    n, plant = est.plant.n, est.plant
    said = [f"The plant was given: {n} states"]
    for name, prior, walk in zip(plant.names[n:], plant.prior_std[n:], plant.walk[n:]):
        prior = "nothing known of it" if prior == inf else f"prior deviation {number(prior, 3)}"
        said.append(f"{name} ({prior}{f', walks {number(walk, 3)} in a second' if walk else ''})")
    noise = "learnt" if est.noise_std is None else ", ".join(number(value, 3) for value in est.noise_std)
    words = (
        f"{'; '.join(said)}; noise on the measurement {noise}. Bands: two standard deviations; blank where no estimate "
        "was ready."
    )
    head = ["", "last value \u00b1 standard deviation", "within two standard deviations"]
    shown = table(head, [[name, plus_minus(v, s), interval(v, s)] for name, v, s in summary.estimates])
    return Panel("estimates", "What is not measured", words, (shown,))


def cards(summary) -> list[str]:
    """Return when it was ready, and how well each output is predicted."""
    first = summary.settling
    ready, unit = ("never", "") if first != first else (f"{first:.3g}", "s")
    note = f"none in {percent(1 - summary.ready)} of the samples"
    groups = [group("When it is ready", [Card("First estimate after", ready, note, unit=unit)])]
    for name, part in zip(summary.estimator.model.output_names, summary.outputs[:2]):
        title = f"How well {name} is predicted" if len(summary.outputs) > 1 else "How sure"
        groups.append(group(title, fit_cards(part)))
    return groups
