"""One self-contained HTML page about a run: opens anywhere, needs no network."""

from __future__ import annotations

from pathlib import Path

from driftwise.edge import report_page as html
from driftwise.edge.wording import fixed, interval, number, plus_minus

__all__ = ["write"]

UNLEARNED = 0.5  # a direction that keeps more than this share of its prior variance is not learned
EVENTS_SHOWN = 200


def write(trace, path, summary=None, title=None, labels=None, events=None) -> Path:
    """Write the report of a run and return its path.

    Parameters
    ----------
    trace : a Trace, perhaps thinned out
    path : file to write
    summary : a Summary of the whole run; taken from the trace if omitted
    title : headline of the page
    labels : dict with "output", "input", "time": names with units for the axes
    events : list of Event of the whole run; taken from the trace if omitted
    """
    try:
        from bokeh.embed import components
        from bokeh.resources import Resources
    except ImportError:
        raise ImportError("the report is drawn with Bokeh, which is not installed: pip install bokeh") from None
    from driftwise.edge import report_plots as draw

    summary = summary if summary is not None else trace.summary()
    events = list(trace.events() if events is None else events)
    labels = {
        "output": "output",
        "time": "time (s)",
        **(getattr(trace, "labels", None) or {}),
        **(labels or {}),
    }
    found = _poles(summary)
    directions = _directions(summary)

    figures = {"output": draw.output(trace, labels, events[:EVENTS_SHOWN])}
    span = figures["output"].x_range
    if getattr(trace, "keep", "std") != "innovations":
        figures |= {f"parameter{j}": fig for j, fig in enumerate(draw.parameters(trace, span))}
    figures["innovations"] = draw.innovations(trace, labels, span)
    figures["acf"] = draw.autocorrelations(summary.correlations[1:], summary.observed)
    if found:
        figures["poles"] = draw.poles(found, summary.model.poles_covariance)
    if directions:
        figures["excitation"] = draw.excitation(directions, UNLEARNED)
    script, parts = components(figures)

    sections = [
        html.section(
            "prediction",
            "Measured and predicted",
            "Each sample is predicted from the ones before it; the band should hold 95 % of them. Drag to "
            "pan, "
            "scroll to zoom: all time axes move together.",
            _plot(parts["output"]),
        ),
        html.section(
            "parameters",
            "Parameters",
            f"Model: {_equation(trace.names)}. Bands: two standard errors.",
            _parameter_table(summary),
            *_grid([part for name, part in parts.items() if name.startswith("parameter")]),
        ),
        _dynamics(parts, found, directions, trace, summary),
        html.section(
            "innovations",
            "Innovations: what could not be predicted",
            "Divided by the standard deviation the estimator itself predicted; their mean square (NIS) is "
            f"{fixed(summary.nis, 2)}, ideally 1. Shaded: two sigma.",
            _plot(parts["innovations"]),
        ),
        '<div class="pair">',
        html.section("whiteness", "Is anything predictable left?", _white_words(summary), _plot(parts["acf"])),
        html.section("events", "Events", _event_words(events), _event_table(events)),
        "</div>",
    ]
    text = html.page(
        title=title or "Recursive estimation of state and parameters",
        facts=_facts(trace, summary),
        lead=summary.words,
        cards=_cards(summary),
        sections=sections,
        footer="Made by driftwise. The page is self-contained: nothing is loaded from the network.",
        library=Resources(mode="inline", components=["bokeh"], minified=True).render_js(),
        script=script,
    )
    path = Path(path)
    path.write_text(text, encoding="utf-8")
    return path


def _plot(div: str) -> str:
    return f'<div class="plot">{div}</div>'


def _facts(trace, summary) -> str:
    inputs = 0 if trace.u is None else (1 if trace.u.ndim == 1 else trace.u.shape[1])
    known = {0: "no input", 1: "one input"}.get(inputs, f"{inputs} inputs")
    facts = [
        f"{summary.samples:,} samples".replace(",", "\u2009"),
        f"every {number(trace.dt)} s",
        known,
        f"{len(trace.names)} parameters",
    ]
    return " \u00b7 ".join(facts)


def _cards(summary) -> list[str]:
    white, nis, coverage = summary.whiteness, float(summary.nis), float(summary.coverage)
    lost = summary.missing_outputs + summary.missing_inputs
    p_value = "too short to tell" if white.p_value != white.p_value else f"Ljung-Box p = {white.p_value:.2g}"
    size = _grade(0.8 <= nis <= 1.25, 0.5 <= nis <= 2)
    held = _grade(0.92 <= coverage <= 0.975, coverage >= 0.85)
    unused = f"{lost} missing, {summary.rejected} rejected, {summary.bad_values} unreadable"
    return [
        html.card("One-step fit", fixed(summary.fit, 1), "100 = perfect, 0 = no better than the mean", unit="%"),
        html.card("Noise (std)", number(summary.noise_std, 3), f"one-step error {number(summary.rmse, 3)} rms"),
        html.card("NIS", fixed(nis, 2), "1 = error bars of the right size", size),
        html.card("Held by 95 % bands", f"{100 * coverage:.1f}", "should be about 95", held, "%"),
        html.card("Innovations", "white" if white.is_white else "not white", p_value, _grade(white.is_white, True)),
        html.card("Samples unused", f"{summary.samples - summary.observed}", unused),
    ]


def _grade(good: bool, fair: bool) -> str:
    return "good" if good else "warn" if fair else "bad"


def _equation(names) -> str:
    """Return the difference equation these parameters belong to."""
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
    return left + " = " + " + ".join([*right, "noise"])


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


def _grid(divs: list[str]) -> list[str]:
    """Return the figures in a grid with the number of columns that leaves the fewest holes."""
    if not divs:
        return []
    columns = len(divs) if len(divs) <= 3 else min((3, 2), key=lambda c: (-len(divs) % c, -c))
    return [
        f'<div class="many" style="--columns:{columns}">',
        *[f"<div>{div}</div>" for div in divs],
        "</div>",
    ]


def _poles(summary) -> list:
    return [(complex(pole), float(std)) for pole, std in summary.poles]


def _dynamics(parts, found, directions, trace, summary) -> str:
    boxes = []
    if found:
        outside = sum(abs(p) >= 1 for p, _ in found)
        near = sum(abs(p) < 1 <= abs(p) + 2 * s for p, s in found)
        words = "All inside: stable."
        if outside or near:
            words = (
                f"{outside} on or outside the circle, {near} within two standard errors of it: integrating or unstable."
            )
        rows = [[_complex(p), f"{abs(p):.4f}", number(s, 2), _time_constant(p, s, trace.dt)] for p, s in _once(found)]
        boxes.append(
            html.section(
                "poles",
                "Poles",
                words + " Shaded: two standard errors.",
                f'<div class="center">{parts["poles"]}</div>',
                html.table(["pole", "size", "standard error", "time constant (s)"], rows),
            )
        )
    if directions:
        lost = sum(ratio > UNLEARNED for _, ratio in directions)
        words = (
            f"{lost} direction{'s' if lost > 1 else ''} of the parameters stayed close to the first "
            "guess: the data "
            "did not excite them, and what is said about them is the prior's."
            if lost
            else "The data taught every direction of the parameters. Right of the dashed line the first "
            "guess would "
            "still rule."
        )
        boxes.append(html.section("excitation", "What was learned", words, _plot(parts["excitation"]), _gains(summary)))
    return '<div class="pair">' + "".join(boxes) + "</div>" if boxes else ""


def _gains(summary) -> str:
    """Return the table of steady-state gains, one row per input, or nothing."""
    model = summary.model
    gains = list(zip(model.dc_gain, model.dc_gain_std))
    if not gains or any(abs(p) + 2 * s >= 1 or s != s for p, s in summary.poles):  # perhaps an integrator
        return ""
    rows = [["u" if len(gains) == 1 else f"u{k + 1}", plus_minus(float(g), float(s))] for k, (g, s) in enumerate(gains)]
    return html.table(["input", "steady-state gain"], rows)


def _once(found):
    """Drop the lower half of conjugate pairs."""
    return [(p, s) for p, s in found if p.imag >= -1e-12]


def _complex(pole: complex) -> str:
    return f"{pole.real:.4f}" if abs(pole.imag) < 1e-12 else f"{pole.real:.4f} \u00b1 {abs(pole.imag):.4f} j"


def _time_constant(pole: complex, std: float, dt: float) -> str:
    """Return the time constant, a dash where the pole cannot be told from one that never decays."""
    from math import log

    size = abs(pole)
    return number(-dt / log(size), 3) if 0 < size and size + 2 * std < 1 else "\u2013"


def _directions(summary) -> list[tuple[str, float]]:
    """Return (direction, share of the prior variance that is left), the least learned first."""
    from driftwise.workflow.summary import _words

    est = summary.estimator
    return [
        (_words(vector, est.names).replace("-", "\u2212"), float(ratio))
        for ratio, vector in est.excitation(summary.state)
    ]


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
    return f"{verdict} (Ljung-Box {statistic:.1f} over {lags} lags, p = {p_value:.2g}). {bounds}"


def _event_words(events) -> str:
    if not events:
        return "Nothing to report: no sample was rejected and no guard had to act."
    shown = f", the first {EVENTS_SHOWN} shown" if len(events) > EVENTS_SHOWN else ""
    return f"{len(events)} event{'s' if len(events) > 1 else ''}{shown}."


def _event_table(events) -> str:
    if not events:
        return ""
    rows = [[event.sample, number(event.time), event.text] for event in events[:EVENTS_SHOWN]]
    return html.table(["sample", "time", "what happened"], rows, text=(2,))
