"""The page of a run: the answer, the output, parameters, innovations, verdicts; below them what unfolds."""

from __future__ import annotations

from math import atan2, isfinite, log, nan, pi
from pathlib import Path
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.engine.status import Status
from driftwise.report import bars, plots
from driftwise.report.axes import Timeline
from driftwise.report.figure import LINES
from driftwise.report.marks import marks
from driftwise.report.page import Card, Page, Panel, group, named, say, stack, table, tag
from driftwise.report.panels import (
    change_table,
    drift_panel,
    event_panel,
    fit_cards,
    grade,
    knowledge_panel,
    order_panel,
    roots_panel,
    verdict_panel,
    zoom_words,
)
from driftwise.report.validation_page import validation_panel
from driftwise.results.numbers import SAMPLES, chance, count_of, grouped, interval, lasting, number, percent, plus_minus
from driftwise.results.sentences import nis_words, predictable_words
from driftwise.results.stable import is_integrator, runs_away, swings

STATES_SHOWN = 6
INPUTS_SHOWN = 4
UNUSED = int(Status.REJECTED | Status.OUTLIER)


def write(
    trace, path, summary=None, title=None, labels=None, events=None, *, smoothed=None, orders=None, study=None,
    validation=None, words="",
) -> Path:  # fmt: skip
    """Write the page of a run and return its path.

    Parameters
    ----------
    trace : a Trace, perhaps thinned out
    path : file to write
    summary : a Summary of the whole run; taken from the trace if omitted
    title : headline of the page
    labels : dict with "output", "inputs" (a list), "time": names with units for the axes; "origin": the time stamp
        (ISO 8601) of second 0, for an axis of dates
    events : list of Event of the whole run; taken from the trace if omitted
    smoothed : what `Joint.smooth` or `ARX.smooth` returned for the same samples, drawn over what the filter said
    orders : `OrderEvidence` of the record, shown as a table and bars
    study : a `Study` of the record; made from the trace if omitted
    validation : a `Validation` of the run; made from the trace if omitted and nothing was left out of it
    words : said before what the summary says
    """
    if smoothed is not None and len(smoothed) != len(trace):
        raise InputError(f"smoothed has {len(smoothed)} samples and the trace {len(trace)}: smooth the same record")
    summary, events, labels = named_axes(trace, summary, events, {"output": "output"}, labels)
    summary.origin = summary.origin or labels.get("origin")
    if study is None:
        from driftwise.analysis.study import study as made

        study = made(trace.estimator, summary.state, trace.y, trace.u)
    line = Timeline(trace.time, labels["time"], labels.get("origin"), getattr(trace, "rows", None))
    status = trace.status
    found = marks(events, trace.time, status)
    look = {"outlier": (status & UNUSED) != 0, "marks": found}
    panels = [
        _output(trace, line, labels, events, look),
        _parameters(trace, summary, line, smoothed, found),
        _innovations(trace, summary, line, look),
        verdict_panel(trace, summary, study),
        _states(trace, line, smoothed, found),
        roots_panel(summary, trace.dt),
        drift_panel(summary.drift),
        _memory(trace, line, found),
        order_panel(orders),
        _whiteness(summary),
        knowledge_panel(summary, study),
        validation_panel(trace, validation, labels),
        event_panel(events, line),
    ]
    title = title or "Recursive estimation of state and parameters"
    return Page(
        title, panels, f"{words} {summary.words}".strip(), facts(trace, summary), _cards(trace, summary, line)
    ).write(path)


def named_axes(trace, summary, events, usual, labels):
    """Return summary, events and names of the axes, taken from the trace where they are not given."""
    if not len(trace):
        raise InputError("the trace has no samples, so there is nothing to report. Was the record empty?")
    names = {"time": "time (s)", **usual, **(getattr(trace, "labels", None) or {}), **(labels or {})}
    events = list(trace.events() if events is None else events)
    return summary if summary is not None else trace.summary(), events, names


# --- the answer ----------------------------------------------------------------------------------------------


def facts(trace, summary, step: str = "") -> list[str]:
    """Return the size of the record; ``step`` says how often a sample comes."""
    inputs = 0 if trace.u is None else (1 if trace.u.ndim == 1 else trace.u.shape[1])
    lost = {
        ("output missing", "outputs missing"): summary.missing_outputs,
        ("input missing", "inputs missing"): summary.missing_inputs,
        ("outlier", "outliers"): summary.rejected + summary.happened["outliers"][0],
        ("unreadable", "unreadable"): summary.bad_values,
    }
    return [
        f"{grouped(summary.samples)} samples",
        step or ("no clock" if summary.unit == SAMPLES else f"every {lasting(trace.dt)}"),
        {0: "no input", 1: "one input"}.get(inputs, f"{inputs} inputs"),
        count_of(len(trace.names), "parameter"),
        *(f"{count} {one if count == 1 else several}" for (one, several), count in lost.items() if count),
    ]


def _cards(trace, summary, line) -> list[str]:
    """Return the numbers that an engineer looks for first, in three groups."""
    plant = plant_cards(summary, trace.dt, lambda span: lasting(span, summary.unit))
    changes, sure, white = [_changes(trace, summary, line)], fit_cards(summary), summary.whiteness
    if white.p_value != white.p_value:
        sure.append(Card("Innovations", "?", "too short to tell"))
    else:
        value = "white" if white.is_white else "not white"
        sure.append(Card("Innovations", value, f"Ljung-Box {chance(white.p_value, 2)}", grade(white.is_white, True)))
    return [group("The plant", plant), group("Changes", changes), group("How sure", sure)]


def plant_cards(summary, dt: float, lasting=lasting, rmse: float | None = None) -> list[Card]:
    """Return the cards of the slowest mode and the gain; ``rmse`` is of the forecast that stands beside them."""
    found = [] if summary.is_static else [_slowest(summary, dt, lasting)]
    found += [one for one in (_gain(summary),) if one]
    if len(found) < 2:
        std, error = summary.noise_std, summary.rmse if rmse is None else rmse
        found.append(Card("Noise (std)", number(std, 3), f"one-step error {number(error, 3)} rms"))
    return found


def _slowest(summary, dt: float, lasting) -> Card:
    """Return the card of the slowest mode."""
    pole, std = summary.moduli[0] if summary.poles else (0j, nan)
    size, bar = abs(pole), f"pole {number(abs(pole), 4)} \u00b1 {number(std, 2)}" if isfinite(std) else ""
    if is_integrator(pole, std):
        return Card("Slowest mode", "integrator", bar)
    if runs_away(size, std):
        return Card("Slowest mode", "unstable", bar, "bad")
    if size >= 1:
        return Card("Slowest mode", "hardly ends", bar)
    if size < 1e-6:
        return Card("Slowest mode", "pure delay")
    period = 2 * pi * dt / abs(atan2(pole.imag, pole.real)) if swings(pole) else 0.0
    alternates = pole.real < 0 and abs(pole.imag) <= 1e-9
    note = f"swings with period {lasting(period)}" if period else "alternates" if alternates else bar
    value, _, unit = lasting(-dt / log(size)).partition(" ")
    return Card("Time constant", value, note, unit=unit)


def _gain(summary) -> Card | None:
    """Return the card of the steady-state gain from the first input, or nothing."""
    model = summary.model
    if summary.is_static or not summary.is_enough or not model.form.inputs:
        return None
    if not model.is_stable:
        return Card("Steady-state gain", "none", "an integrator has none")
    if not isfinite(model.dc_gain_std[0]):
        return Card("Steady-state gain", "no bound", "the data leave it open", "warn")
    shown = [plus_minus(float(gain), float(std)) for gain, std in zip(model.dc_gain[:4], model.dc_gain_std)]
    more = "; ".join(f"u{k}: {one}" for k, one in enumerate(shown[1:], 2))
    value, bar = shown[0].split(" \u00b1 ")
    return Card("Steady-state gain", value, more or "\u00b1 one standard error", unit=f"\u00b1 {bar}")


def _changes(trace, summary, line) -> Card:
    """Return the card of the jumps, and of what else moved."""
    est = trace.estimator
    if summary.jumps:
        moved = f": {summary.last_moved}" if summary.last_moved else ""
        return Card("Jumps", str(summary.jumps), f"last {line.words(summary.last_jump)[0]}{moved}")
    rises, when = summary.happened["noise_rises"]
    louder = f"; noise rose {'once,' if rises == 1 else f'{rises} times, last'} {line.words(when)[0]}" if rises else ""
    if est.detector is None and est.odds is None:
        return Card("Jumps", "\u2013", "not looked for" + louder)
    drift = summary.drift.words.partition(", or else")[0] if summary.drift else "none found"
    return Card("Jumps", "none", drift + louder)


# --- panels that are open ------------------------------------------------------------------------------------


def _output(trace, line, labels, events, look) -> Panel:
    below = input_figures(line, trace, labels)
    columns = trace.y, trace.prediction, trace.band(0.95)
    above = plots.output(line, *columns, labels["output"], **look, is_named=not below)
    words = "Each sample is predicted from the ones before it; the band should hold 95 % of them."
    body = above, *below, zoom_words(line), change_table(events, line)
    return Panel("prediction", "Measured and predicted", words, body)


def input_figures(line, trace, labels) -> list:
    """Return a low panel for each of the first inputs."""
    if trace.u is None or not trace.u.size:
        return []
    columns = trace.u.reshape(len(trace), -1).T[:INPUTS_SHOWN]
    names = labels.get("inputs") or ([labels["input"]] if "input" in labels else [])
    names = [*names, *(f"input {k + 1}" if len(columns) > 1 else "input" for k in range(len(names), len(columns)))]
    return plots.inputs(line, columns, names)


def _parameters(trace, summary, line, smoothed, found) -> Panel:
    figures = [] if getattr(trace, "keep", "std") == "innovations" else parameter_figures(line, trace, smoothed, found)
    head = ["", "value \u00b1 standard error", "within two standard errors", "relative error", "different from zero"]
    clear, unclear, rows = tag("clear", "good"), tag("zero is possible", "warn"), []
    for name, value, std in summary.parameters:
        relative = percent(std / abs(value)) if std < abs(value) else "\u2013"
        mark = clear if abs(value) > 2 * std else unclear
        rows.append([name, plus_minus(value, std), interval(value, std), relative, mark])
    has_told = smoothed is not None and not smoothed.estimator.model.n
    words = f"Model: {_equation(trace)}. {_bands(smoothed, summary)}"
    return Panel(
        "parameters", "Parameters", words, (*stack(figures), table(head, rows), say(smoothed.words) if has_told else "")
    )


def parameter_figures(line, trace, smoothed, found) -> list:
    """Return a panel for each parameter, with its band where the trace kept one."""
    import numpy as np

    values = np.asarray(trace.parameters, float)
    has_band = getattr(trace, "keep", "std") != "means"
    stds = np.asarray(trace.parameters_std, float) if has_band else np.zeros_like(values)
    more = None if smoothed is None else (smoothed.parameters, smoothed.parameters_std)
    colors = [LINES["abcdefgh".find(name[0]) % len(LINES)] for name in trace.names]
    drawn = plots.panels(line, trace.names, values, stds, smoothed=more, colors=colors, marks=found)
    return named("parameter", drawn)


def _equation(trace) -> str:
    """Return the difference equation these parameters belong to."""
    names, form = trace.names, trace.estimator.model
    if hasattr(form, "words"):
        return form.words
    orders = [name for name in names if name.startswith("a")]
    several = any("." in name for name in names)
    inputs = [name for name in names if name.startswith("b")]
    terms = [f"{name} y(t\u2212{name[1:]})" for name in orders]
    left = "y(t) + " + " + ".join(terms) if len(terms) <= 3 else f"y(t) + {terms[0]} + \u2026 + {terms[-1]}"

    def term(name):
        lag, _, which = name[1:].partition(".")
        past = "" if lag == "0" else f"\u2212{lag}"
        return f"{name} u{which if several else ''}(t{past})"

    right = [term(name) for name in inputs]
    right = right if len(right) <= 4 else [right[0], "\u2026", right[-1]]
    colour = [f"{name} v(t\u2212{name[1:]})" for name in names if name.startswith("c")]
    colour = colour if len(colour) <= 3 else [colour[0], "\u2026", colour[-1]]
    return left + " = " + " + ".join([*right, *(["v(t)", *colour] if colour else ["noise"])])


def _bands(smoothed, summary) -> str:
    """Return how to read the panels."""
    words = "Bands: two standard errors."
    if smoothed is not None:
        given = "the whole record" if smoothed.lag is None else f"{smoothed.lag} later samples"
        words = (
            "Solid line and shade: from the samples so far, with two standard errors. "
            f"Dashed between dotted lines: smoothed, given {given}."
        )
    kinds = ["jumps (dashed)"] if summary.jumps else []
    kinds += ["rises of the noise (dotted)"] if summary.happened["noise_rises"][0] else []
    return words + (f" Vertical lines: {' and '.join(kinds)}." if kinds else "")


def _innovations(trace, summary, line, look) -> Panel:
    words = (
        "Divided by the standard deviation the estimator itself predicted. Their mean square (NIS) is "
        f"{nis_words(summary.nis_interval)} Shaded: two sigma."
    )
    drawn = plots.innovations(line, scaled(trace), **look)
    return Panel("innovations", "Innovations: what could not be predicted", words, (drawn,))


def scaled(trace) -> Any:
    """Return the innovations over their predicted deviation."""
    import numpy as np

    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(trace.innovation, float) / np.sqrt(np.asarray(trace.variance, float))


# --- panels that are folded ----------------------------------------------------------------------------------


def _states(trace, line, smoothed, found) -> Panel | None:
    """Return a panel for each of the first states, filtered and smoothed."""
    n = 0 if smoothed is None or getattr(trace, "keep", "std") == "innovations" else trace.estimator.model.n
    if not n:
        return None
    names, more = [f"x{n - i}" for i in range(n)][:STATES_SHOWN], (smoothed.x, smoothed.x_std)
    drawn = plots.panels(line, names, trace.x, trace.x_std, smoothed=more, colors=[LINES[5]], marks=found)
    words = f"Filtered and smoothed as above, offsets subtracted; x{n} is the measured one. Zoom in to tell them apart."
    return Panel("states", "State", words, tuple(stack(named("state", drawn))), "filtered and smoothed")


def _memory(trace, line, found) -> Panel | None:
    """Return the memory in samples, and the detector's statistic where there is a detector; nothing without both."""
    import numpy as np

    from driftwise.memory.random_walk import RandomWalk

    if "weight" not in trace.estimator.columns:
        return None
    memory, detector, figures, said = trace.estimator.memory, trace.estimator.detector, [], []
    name = type(memory).__name__
    if not isinstance(memory, RandomWalk):  # which counts no samples: it adds a variance at every one
        figures.append(plots.weight(line, trace.weight, found))
        said.append("how many samples the estimate rests on (it grows until the past is forgotten)")
    if np.nanmax(trace.statistic, initial=0.0) > 0:
        figures.append(plots.statistic(line, trace.statistic, found))
    if not figures:
        return None
    if detector is not None:
        said.append("how near the detector came to an alarm (1)")
    elif len(figures) > len(said):
        said.append("how near a jump came to being told (1)")
    words = f"{name}: {', and '.join(said)}."
    if detector is not None:
        words += f" {type(detector).__name__} promises {getattr(detector, 'words', 'nothing')}."
    return Panel("adaptation", "Memory", words, tuple(named("adaptation", figures)), name)


def _whiteness(summary) -> Panel:
    """Return the autocorrelation of the innovations, and what it says."""
    hint, said = predictable_words(summary.whiteness, bool(summary.jumps))
    words = f"{said}. Shaded: where 95 % of the bars of white noise fall."
    drawn = bars.autocorrelations(summary.correlations[1:], summary.observed)
    return Panel("whiteness", "Is anything predictable left?", words, (drawn,), hint)
