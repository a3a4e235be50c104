"""One self-contained HTML page about a run of an observer: states, disturbances, derived outputs, how well they fit."""

from __future__ import annotations

from math import inf
from pathlib import Path

from driftwise.engine.errors import InputError
from driftwise.report import report_page as html
from driftwise.report import report_parts as common
from driftwise.report.figure import LINES
from driftwise.report.wording import interval, number, plus_minus
from driftwise.results.observer_summary import views

__all__ = ["write"]

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
    from driftwise.report import report_plots as draw
    from driftwise.report.report_axes import Timeline
    from driftwise.report.report_figures import inputs, scaled
    from driftwise.report.report_marks import marks

    if not len(trace):
        raise InputError("the trace has no samples, so there is nothing to report. Was the record empty?")
    summary = summary if summary is not None else trace.summary()
    events = list(trace.events() if events is None else events)
    form = trace.estimator.model
    labels = {"outputs": form.output_names, "inputs": form.input_names, "time": "time (s)", **(labels or {})}
    each = views(trace)[:OUTPUTS_SHOWN]
    line = Timeline(trace.time, labels["time"], labels.get("origin"), getattr(trace, "rows", None))
    found = marks(events)

    figures: dict = {}
    for i, one in enumerate(each):
        drawn = draw.output(line, one.y, one.prediction, one.band(0.95), labels["outputs"][i], marks=found)
        figures[f"output{i}"] = drawn
    figures |= common.named("input", inputs(line, trace, labels))
    n, m = form.n, form.m
    kinds = (("state", 0, n), ("disturbance", n, m), ("derived", m, form.N))
    names = trace.state_names + trace.names
    for color, (kind, first, last) in zip(LINES, kinds):
        at = slice(first, last)
        panels = draw.panels(line, names[at], trace.estimates[:, at], trace.std[:, at], colors=[color], marks=found)
        figures |= common.named(kind, panels)
    if trace.statistic.any():
        figures["statistic"] = draw.statistic(line, trace.statistic, found)
    for i, one in enumerate(each):
        figures[f"innovation{i}"] = draw.innovations(line, scaled(one), marks=found)
    script, parts = common.components(figures)

    def of(kind):
        return common.of(parts, kind)

    sections = [
        html.section(
            "prediction", "Measured and predicted",
            "Each sample is predicted from the ones before it; the band should hold 95 % of them.",
            *map(common.plot, of("output")), *map(common.plot, of("input")), common.zoom_words(line),
            common.change_table(events, line),
        ),
        html.section(
            "estimates", "What is not measured",
            f"{_known(trace)} Bands: two standard deviations; blank where no estimate was ready.",
            _estimates(summary),
        ),
        _part("derived", "Derived outputs", of("derived")),
        _part("states", "State", of("state")),
        _part("disturbances", "Disturbances", of("disturbance")),
        html.section(
            "parity", "Does the plant still fit?",
            "Two windows side by side, the older one carried forward: the squared distance of their estimates over its "
            "threshold. Above one the plant changed, or something acts that was not stated.",
            *map(common.plot, of("statistic")),
        ) if "statistic" in figures else "",
        html.section(
            "innovations", "Innovations: what could not be predicted",
            "Divided by the standard deviation the observer itself predicted. " + " ".join(_sizes(trace, summary)),
            *map(common.plot, of("innovation")),
        ),
    ]  # fmt: skip
    folds = [html.fold("events", "Events", *common.event_words(events), common.event_table(events, line))]
    return common.write(
        path,
        title=title or "State and disturbances of a known plant",
        facts=_facts(trace, summary),
        lead=summary.words,
        cards=_cards(summary),
        sections=sections,
        folds=folds,
        script=script,
    )


def _part(name, title, divs) -> str:
    return html.section(name, title, "", *common.stack(divs)) if divs else ""


def _facts(trace, summary) -> str:
    est = trace.estimator
    window = getattr(est, "window", inf)
    memory = "all samples so far" if window == inf else f"a window of {number(window)} s"
    facts = [
        f"{summary.samples:,} samples".replace(",", "\u2009"),
        f"every {number(est.dt)} s" + (", irregular" if est.irregular else ""),
        f"{est.model.m} unknowns",
        memory,
    ]
    return " \u00b7 ".join(facts)


def _known(trace) -> str:
    """Return what was stated beforehand."""
    est = trace.estimator
    said = [f"The plant was given: {est.plant.n} states"]
    for name, prior, walk in zip(est.plant.names[est.plant.n :], est.plant.prior_std[est.plant.n :], _walks(est)):
        prior = "nothing known of it" if prior == inf else f"prior deviation {number(prior, 3)}"
        said.append(f"{name} ({prior}{f', walks {number(walk, 3)} in a second' if walk else ''})")
    noise = "learnt" if est.noise_std is None else ", ".join(number(value, 3) for value in est.noise_std)
    return f"{'; '.join(said)}; noise on the measurement {noise}."


def _walks(est):
    return est.plant.walk[est.plant.n :]


def _estimates(summary) -> str:
    head = ["", "last value \u00b1 standard deviation", "within two standard deviations"]
    return html.table(head, [[n, plus_minus(v, s), interval(v, s)] for n, v, s in summary.estimates])


def _sizes(trace, summary) -> list[str]:
    names = trace.estimator.model.output_names
    return [f"{name}: their mean square (NIS) is {common.nis_words(nis)}" for name, nis in zip(names, summary.nis)]


def _cards(summary) -> list[str]:
    first = summary.settling
    ready = "never" if first != first else f"{first:.3g}"
    share = 100 * (1 - summary.ready)
    note, unit = f"none in {share:.2g} % of the samples", "" if first != first else "s"
    groups = [html.group("When it is ready", [html.card("First estimate after", ready, note, unit=unit)])]
    for name, part in zip(summary.estimator.model.output_names, summary.outputs[:2]):
        title = f"How well {name} is predicted" if len(summary.outputs) > 1 else "How sure"
        groups.append(html.group(title, common.fit_cards(part)))
    return groups
