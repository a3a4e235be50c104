"""One self-contained HTML page about a run: opens anywhere, needs no network."""

from __future__ import annotations

from pathlib import Path

from driftwise.engine.errors import InputError
from driftwise.report import report_answer as answer
from driftwise.report import report_dynamics as parts_of
from driftwise.report import report_page as html
from driftwise.report import report_parts as common
from driftwise.report.wording import interval, plus_minus
from driftwise.results.whiteness import chance

__all__ = ["write"]

STATES_SHOWN = 6


def write(
    trace, path, summary=None, title=None, labels=None, events=None, *, smoothed=None, orders=None, study=None
) -> Path:
    """Write the report of a run and return its path.

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
    """
    from driftwise.report import report_figures, report_verdicts

    if not len(trace):
        raise InputError("the trace has no samples, so there is nothing to report. Was the record empty?")
    if smoothed is not None and len(smoothed) != len(trace):
        raise InputError(f"smoothed has {len(smoothed)} samples and the trace {len(trace)}: smooth the same record")
    summary = summary if summary is not None else trace.summary()
    events = list(trace.events() if events is None else events)
    labels = {
        "output": "output",
        "time": "time (s)",
        **(getattr(trace, "labels", None) or {}),
        **(labels or {}),
    }
    summary.origin = summary.origin or labels.get("origin")
    directions = parts_of.directions(summary)
    if study is None:
        from driftwise.analysis.study import study as made

        study = made(trace.estimator, summary.state, trace.y, trace.u)
    line, figures = report_figures.draw(trace, summary, labels, events, directions, smoothed, orders)
    script, parts = common.components(figures)
    sections = [
        html.section(
            "prediction",
            "Measured and predicted",
            "Each sample is predicted from the ones before it; the band should hold 95 % of them.",
            common.plot(parts["output"]),
            *map(common.plot, common.of(parts, "input")),
            common.zoom_words(line),
            common.change_table(events, line),
        ),
        html.section(
            "parameters",
            "Parameters",
            f"Model: {_equation(trace)}. {_bands(smoothed, summary)}",
            *common.stack(common.of(parts, "parameter")),
            _parameter_table(summary),
            parts_of.hindsight(smoothed),
        ),
        html.section(
            "innovations",
            "Innovations: what could not be predicted",
            "Divided by the standard deviation the estimator itself predicted. Their mean square (NIS) is "
            f"{common.nis_words(summary.nis_interval)} Shaded: two sigma.",
            common.plot(parts["innovations"]),
        ),
        report_verdicts.section(trace, summary, study),
    ]
    white = summary.whiteness
    folds = [
        _states(parts, smoothed),
        "" if "poles" not in parts else parts_of.roots(summary, trace.dt, parts["poles"] + parts.get("closeup", "")),
        parts_of.drift(summary.drift),
        parts_of.memory([common.plot(part) for part in common.of(parts, "adaptation")], trace.estimator),
        "" if orders is None else parts_of.order_evidence(orders, parts["orders"]),
        html.fold(
            "whiteness", "Is anything predictable left?",
            "too short to tell" if white.p_value != white.p_value else "no" if white.is_white else "yes",
            _white_words(summary), common.plot(parts["acf"]),
        ),
        parts_of.knowledge(directions, study, parts["excitation"]),
        html.fold("events", "Events", *common.event_words(events), common.event_table(events, line)),
    ]  # fmt: skip
    return common.write(
        path,
        title=title or "Recursive estimation of state and parameters",
        facts=answer.facts(trace, summary),
        lead=summary.words,
        cards=answer.cards(trace, summary, line),
        sections=sections,
        folds=folds,
        script=script,
    )


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


def _parameter_table(summary) -> str:
    head = [
        "",
        "value \u00b1 standard error",
        "within two standard errors",
        "relative error",
        "different from zero",
    ]
    rows = []
    for name, value, std in summary.parameters:
        clear, told = abs(value) > 2 * std, std < abs(value)
        tag = '<span class="tag good">clear</span>' if clear else '<span class="tag warn">zero is possible</span>'
        relative = f"{100 * std / abs(value):.2g} %" if told else "\u2013"
        rows.append([name, plus_minus(value, std), interval(value, std), relative, tag])
    return html.table(head, rows)


def _bands(smoothed, summary) -> str:
    """Return how to read the panels."""
    if smoothed is None:
        words = "Bands: two standard errors."
    else:
        given = "the whole record" if smoothed.lag is None else f"{smoothed.lag} later samples"
        words = (
            "Solid line and shade: from the samples so far, with two standard errors. "
            f"Dashed between dotted lines: smoothed, given {given}."
        )
    kinds = ["jumps (dashed)"] if summary.jumps else []
    kinds += ["rises of the noise (dotted)"] if summary.happened["noise_rises"][0] else []
    return words + (f" Vertical lines: {' and '.join(kinds)}." if kinds else "")


def _states(parts, smoothed) -> str:
    divs = common.of(parts, "state")
    if not divs:
        return ""
    n = smoothed.estimator.model.n
    words = f"Filtered and smoothed as above, offsets subtracted; x{n} is the measured one. Zoom in to tell them apart."
    return html.fold("states", "State", "filtered and smoothed", words, *common.stack(divs))


def _white_words(summary) -> str:
    statistic, lags, p_value, is_white = summary.whiteness
    bounds = "Shaded: where 95 % of the bars of white noise fall."
    if p_value != p_value:
        return f"The record is too short to tell. {bounds}"
    verdict = (
        "No: the innovations look white"
        if is_white
        else "Yes: the innovations are not white; a higher order, another input or another noise model "
        "would predict better"
    )
    if summary.jumps and not is_white:
        verdict = "Yes: the innovations are not white; right after jumps they never are"
    return f"{verdict} (Ljung-Box {statistic:.1f} over {lags} lags, {chance(p_value, 2)}). {bounds}"
