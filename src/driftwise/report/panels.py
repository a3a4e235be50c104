"""The panels that pages of several results share: figures over time, events, verdicts, what was learned."""

from __future__ import annotations

from math import isfinite, log

from driftwise.report.page import Card, Panel, say, table, tag
from driftwise.report.plots import POINTS
from driftwise.report.roots import FAR, own_zeros, plane, smallest_window
from driftwise.results.numbers import (
    bound,
    capital,
    complex_number,
    count_of,
    fixed,
    grouped,
    near_one,
    number,
    plus_minus,
    probable,
)  # fmt: skip

EVENTS_SHOWN = 200
CHANGES_SHOWN = 8
UNLEARNED = 0.5  # a direction that keeps more than this share of its prior variance is not learned
MEANT = {
    "still": "nothing drifts", "fast": "everything drifts fast", "learnt": "drift at these speeds", "jump": "a jump",
}  # fmt: skip


def zoom_words(line) -> str:
    """Return how to look closer at the panels over a `Timeline`, and what was left out of them; this is markup."""
    words = (
        "Drag to zoom, Ctrl and wheel to zoom at the pointer, double click for the whole record: all time axes move "
        "together."
    )
    thinned = (
        " A long record: of every stretch the lowest and the highest sample are drawn and joined. No spike is lost, "
        "but what lies between them is not here to zoom into."
    )
    return f'<p class="say howto">{words}{thinned if line.rows[-1] >= POINTS else ""}</p>'


# --- how sure ------------------------------------------------------------------------------------------------


def grade(good: bool, fair: bool) -> str:
    return "good" if good else "warn" if fair else "bad"


def fit_cards(summary) -> list[Card]:
    """Return how well one output is predicted, on cards: fit, NIS and coverage."""
    nis, coverage, found, fit = float(summary.nis), float(summary.coverage), summary.nis_interval, summary.fit
    bars = f"right error bars: {near_one(found.low, found.high, ' to ')}" if found.samples else "1: right error bars"
    fitted, size = fixed(fit, 1), fixed(nis, 2)
    return [
        Card("One-step fit", fitted, "100 perfect, 0 as good as the mean", "bad" if fit < 0 else "", "%"),
        Card("NIS", size, bars, grade(0.8 <= nis <= 1.25, 0.5 <= nis <= 2)),
        held_card(coverage, grade(0.92 <= coverage <= 0.975, coverage >= 0.85), "95 % bands hold"),
    ]


def held_card(coverage: float, verdict: str, name: str = "Held by 95 % bands") -> Card:
    """Return the card of how many samples lay in their bands."""
    return Card(name, fixed(100 * coverage, 1), "about 95 is right", verdict, "%")


def verdict_panel(trace, summary, study=None) -> Panel:
    """Return the verdicts on a run, those that ask for something first.

    They are those of the whole run where they come with the trace (``trace.diagnosis``), which may be thinned out.
    """
    from driftwise.analysis.diagnose import diagnose

    found = getattr(trace, "diagnosis", None)
    if found is None:
        identifiable = None if study is None else study.identifiability
        found = diagnose(trace, summary, record=(trace.y, trace.u), identifiable=identifiable)
    asked = len(found.not_fine)
    words = "Nothing asks for attention." if not asked else f"{asked} of {len(found)} ask for attention."
    return Panel("verdicts", "Can this run be trusted?", words, (verdict_table(found),))


def verdict_table(found) -> str:
    """Return the table of some verdicts, those that ask for something first."""
    found = sorted(found, key=lambda one: one.is_fine)
    known = [(v.name, v.shown, v.limits, v.advice) for v in found]
    marks = [tag("fine", "good") if v.is_fine else tag("look", "warn") for v in found]
    rows = [[name, mark, *others] for mark, (name, *others) in zip(marks, known)]
    return table(["", "", "value", "fine where", "what it means"], rows, text=(1, 4))


# --- what happened -------------------------------------------------------------------------------------------


def event_panel(events, line) -> Panel:
    """Return what happened, jumps first and then the others while there is room; the `Timeline` says when."""
    if not events:
        return Panel(
            "events", "Events", "Nothing to report: no sample was rejected and no guard had to act.", (), "none"
        )
    jumps = [event for event in events if event.kind == "JUMP"]
    others = [event for event in events if event.kind != "JUMP"]
    shown = [*jumps[:EVENTS_SHOWN], *others[: max(EVENTS_SHOWN - len(jumps), 0)]]
    shown.sort(key=lambda event: (event.kind != "JUMP", event.sample))
    when = line.words(*(event.time for event in shown))
    rows = [[event.sample, instant, event.text] for event, instant in zip(shown, when)]
    count = count_of(len(events), "event")
    first = f", the {f'{len(jumps)} jumps' if len(jumps) > 1 else 'jump'} of the parameters first" if jumps else ""
    some = f", {EVENTS_SHOWN} shown" if len(events) > EVENTS_SHOWN else ""
    body = table(["sample", line.label, "what happened"], rows, text=(1, 2))
    return Panel("events", "Events", f"{count}{first}{some}.", (body,), count)


def change_table(events, line) -> str:
    """Return the table of the jumps, the last ones where they are many; nothing without any."""
    jumps = [event for event in events if event.kind == "JUMP"]
    shown = jumps[-CHANGES_SHOWN:]
    rows = [[instant, event.text] for event, instant in zip(shown, line.words(*(event.time for event in shown)))]
    more = f"the last {CHANGES_SHOWN} of {len(jumps)} jumps" if len(jumps) > CHANGES_SHOWN else "what changed"
    return table([line.label, more], rows, text=(0, 1))


def drift_panel(found) -> Panel | None:
    """Return the table of how fast each parameter drifts (`Speeds`), or nothing."""
    if found is None:
        return None
    rows = [
        [name, number(nvr, 2), number(memory, 2), tag("stands still", "good") if is_still else ""]
        for name, nvr, memory, is_still in zip(found.names, found.nvr, found.memory, found.is_still)
    ]
    weights = (found.weights or {}).items()
    odds = [f"{MEANT.get(name, f'NVR {name}')} {probable(weight)}" for name, weight in weights]
    likely = say(f"Probabilities: {', '.join(odds)}.") if odds else ""
    shown = table(["", "NVR (variance of a step / noise)", "memory (samples)", ""], rows)
    hint = found.words.partition(", or else")[0]
    return Panel("drift", "How fast each parameter drifts", "", (shown, likely), hint)


# --- poles and zeros -----------------------------------------------------------------------------------------


def roots_panel(summary, dt: float) -> Panel | None:
    """Return poles, zeros and steady-state gains; nothing of a regression, or where too little was measured."""
    if summary.is_static or not summary.is_enough:
        return None
    found, model = summary.moduli, summary.model
    outside = sum(abs(p) >= 1 for p, _ in found)
    near = sum(abs(p) < 1 <= abs(p) + 2 * s for p, s in found)
    words, hint = "All poles lie inside the circle: stable.", "stable"
    if outside or near:
        hint = f"{outside + near} on, outside or near the circle"
        words = f"{outside} on or outside the circle, {near} within two standard errors of it: integrating or unstable."
    words += " Shaded: 95 % ellipses (a bar for a root that stays real); drag to zoom in."
    inputs = range(model.form.inputs)
    if "sampled" in model.method or any("sampled" in model.zeros_method(i) for i in inputs):
        words += " Dots: draws from the posterior, where an ellipse would mislead."
    shown = [(p, s, _time_constant(p, s, dt)) for p, s in found if p.imag >= -1e-12]
    rows = [[complex_number(p), f"{abs(p):.4f}", bound(s), number(t, 3) if t else "\u2013"] for p, s, t in shown]
    window, (zeros, left) = smallest_window(model), _zeros(model)
    body = (
        (plane(model), *(() if window is None else (plane(model, window),))),
        table(["pole", "size", "standard error", f"time constant ({summary.unit})"], rows),
        table(["zero", "size", "standard error"], zeros), left,
        _gains(model),
        *[say(f"{note}.") for note in summary.notes],
    )  # fmt: skip
    title = "Poles and zeros" if any(own_zeros(model, i) for i in inputs) else "Poles"
    return Panel("poles", title, words, body, hint)


def _zeros(model) -> tuple[list[list[str]], str]:
    """Return the rows of the zeros, and how many of them lie outside the figure."""
    rows, far, k = [], 0, model.form.inputs
    for i in range(k):
        for z, std in own_zeros(model, i):
            if z.imag < -1e-12:
                continue
            name = "" if k == 1 else f" (u{i + 1})"
            far += int(abs(z) > FAR)
            size = f"{abs(z):.4f}" if abs(z) < 1e4 else number(abs(z), 2)
            rows.append([complex_number(z) + name, size, bound(std)])
    return rows, say(f"{far} zero{'s lie' if far > 1 else ' lies'} outside the figure.") if far else ""


def _gains(model) -> str:
    """Return the table of steady-state gains, one row per input, or nothing."""
    if not model.form.inputs or not model.is_stable:  # perhaps an integrator
        return ""
    rows = []
    for k, (gain, std, (low, high)) in enumerate(zip(model.dc_gain, model.dc_gain_std, model.dc_gain_interval())):
        shown = plus_minus(float(gain), float(std))
        if not isfinite(std):
            shown = f"{number(low, 3)} \u2026 {number(high, 3)} (95 %, Fieller)" if isfinite(low) else "no bound"
        rows.append(["u" if model.form.inputs == 1 else f"u{k + 1}", shown])
    return table(["input", "steady-state gain"], rows)


def _time_constant(pole: complex, std: float, dt: float) -> float | None:
    """Return the time constant, None where the pole cannot be told from one that never decays."""
    size = abs(pole)
    return -dt / log(size) if 0 < size and size + 2 * std < 1 else None


# --- what was learned ----------------------------------------------------------------------------------------


def knowledge_panel(summary, study) -> Panel:
    """Return what the data taught: each direction of the parameters, the least learned first; a `Study` beside it."""
    from driftwise.report.bars import excitation
    from driftwise.results.summary import combination

    est = summary.estimator
    ratios = summary.directions
    found = [(combination(vector, est.names).replace("-", "\u2212"), float(ratio)) for ratio, vector in ratios]
    lost = sum(ratio > UNLEARNED for _, ratio in found)
    words, hint = (
        "The data taught every direction of the parameters. Right of the dashed line the first guess would still rule.",
        "every direction",
    )
    if lost:
        hint = f"{count_of(lost, 'direction')} not excited"
        words = (
            f"{count_of(lost, 'direction')} of the parameters stayed close to the first guess: the data "
            "did not excite them, and what is said about them is the prior's."
        )
    said = [] if study is None else _told_apart(study)
    return Panel("excitation", "What was learned", words, (excitation(found, UNLEARNED), *said), hint)


def _told_apart(study) -> list[str]:
    """Return what the record can tell apart, in words and in a table."""
    words, trust, found = study.words, study.trust, study.identifiability
    if found is None:
        return [say(words), say(trust)]
    rows = [
        ["rows looked at", grouped(study.rows)],
        ["rank of the Gramian", f"{found.rank} of {found.unknowns}"],
        ["weakest combination of parameters (0: unseen; white input: 0.1)", number(found.worst, 2)],
    ]
    if study.bound is not None:
        ratio = float(max(study.bound.ratio))
        rows.append(["error of a, noise colour unknown / known", number(ratio, 3) if isfinite(ratio) else "infinite"])
    return [say(words), table(["identifiability of the record", ""], rows), say(trust)]


def order_panel(evidence) -> Panel | None:
    """Return the orders that were compared, or nothing."""
    if evidence is None:
        return None
    from driftwise.report.bars import orders

    rows = [
        [order, fixed(log_evidence, 1), probable(p), f"{fixed(fit, 1)} %", fixed(nis, 2)]
        for order, log_evidence, p, fit, _, nis in zip(*evidence.columns().values())
    ]
    shown = table(["order", "log evidence", "probability", "one-step fit", "NIS"], rows)
    text = f"{capital(evidence.words)}. Every order saw the same samples; all were equally probable."
    body = f'<div class="pair"><div>{shown}</div>', orders(evidence.orders, evidence.probability), "</div>"
    return Panel("orders", "Order", text, body, f"{evidence.best}, probability {probable(max(evidence.probability))}")
