"""The answer on top of the report: what is the plant, when did it change, how sure is it."""

from __future__ import annotations

from math import atan2, isfinite, log, nan, pi

from driftwise.report import report_page as html
from driftwise.report import report_parts as common
from driftwise.report.wording import number, plus_minus
from driftwise.results.clock_words import SAMPLES, lasting
from driftwise.results.whiteness import chance
from driftwise.results.wording import is_integrator, swings

__all__ = ["cards", "facts", "plant"]


def facts(trace, summary, step: str = "") -> str:
    """Return the size of the record in one line; ``step`` says how often a sample comes."""
    inputs = 0 if trace.u is None else (1 if trace.u.ndim == 1 else trace.u.shape[1])
    known = {0: "no input", 1: "one input"}.get(inputs, f"{inputs} inputs")
    lost = {
        ("output missing", "outputs missing"): summary.missing_outputs,
        ("input missing", "inputs missing"): summary.missing_inputs,
        ("outlier", "outliers"): summary.rejected + summary.happened["outliers"][0],
        ("unreadable", "unreadable"): summary.bad_values,
    }
    told = [
        f"{summary.samples:,} samples".replace(",", "\u2009"),
        step or ("no clock" if summary.unit == SAMPLES else f"every {lasting(trace.dt)}"),
        known,
    ]
    told += [
        f"{len(trace.names)} parameter{'s' * (len(trace.names) != 1)}",
        *(f"{count} {one if count == 1 else several}" for (one, several), count in lost.items() if count),
    ]
    return " \u00b7 ".join(told)


def cards(trace, summary, line) -> list[str]:
    """Return the numbers that an engineer looks for first, in three groups; ``line`` is the `Timeline`."""
    return [
        html.group("The plant", plant(summary, trace.dt, lambda span: lasting(span, summary.unit))),
        html.group("Changes", [_changes(trace, summary, line)]),
        html.group("How sure", [*common.fit_cards(summary), _white(summary.whiteness)]),
    ]


def plant(summary, dt: float, lasting=lasting, rmse: float | None = None) -> list[str]:
    """Return the cards of the slowest mode and the gain; ``rmse`` is of the forecast that is told beside them."""
    found = [] if summary.is_static else [_slowest(summary, dt, lasting)]
    gain = _gain(summary)
    if gain:
        found.append(gain)
    if len(found) < 2:
        note = f"one-step error {number(summary.rmse if rmse is None else rmse, 3)} rms"
        found.append(html.card("Noise (std)", number(summary.noise_std, 3), note))
    return found


def _slowest(summary, dt: float, lasting) -> str:
    """Return the card of the slowest mode."""
    pole, std = summary.moduli[0] if summary.poles else (0j, nan)
    size, bar = abs(pole), f"pole {number(abs(pole), 4)} \u00b1 {number(std, 2)}" if isfinite(std) else ""
    if is_integrator(pole, std):
        return html.card("Slowest mode", "integrator", bar)
    if size >= 1:
        return html.card("Slowest mode", "unstable", bar, "bad")
    if size < 1e-6:
        return html.card("Slowest mode", "pure delay")
    tau, period = -dt / log(size), 2 * pi * dt / abs(atan2(pole.imag, pole.real)) if swings(pole) else 0.0
    alternates = pole.real < 0 and abs(pole.imag) <= 1e-9
    note = f"swings with period {lasting(period)}" if period else "alternates" if alternates else bar
    value, _, unit = lasting(tau).partition(" ")
    return html.card("Time constant", value, note, unit=unit)


def _gain(summary) -> str:
    """Return the card of the steady-state gain from the first input, or nothing."""
    model = summary.model
    if summary.is_static or not summary.is_enough or not model.form.inputs:
        return ""
    if not model.is_stable:
        return html.card("Steady-state gain", "none", "an integrator has none")
    gains = list(zip(model.dc_gain, model.dc_gain_std))
    shown = [plus_minus(float(gain), float(std)).split(" \u00b1 ") for gain, std in gains]
    more = "; ".join(f"u{k}: {value} \u00b1 {bar}" for k, (value, bar) in enumerate(shown[1:4], 2))
    if not isfinite(gains[0][1]):
        return html.card("Steady-state gain", "no bound", "the data leave it open", "warn")
    return html.card(
        "Steady-state gain", shown[0][0], more or "\u00b1 one standard error", unit=f"\u00b1 {shown[0][1]}"
    )


def _changes(trace, summary, line) -> str:
    """Return the card of the jumps, and of what else moved."""
    memory = getattr(trace.estimator, "options", {}).get("memory")
    if summary.jumps:
        moved = f": {summary.last_moved}" if summary.last_moved else ""
        last = f"last {line.words(summary.last_jump)}{moved}"
        return html.card("Jumps", str(summary.jumps), last)
    rises, when = summary.happened["noise_rises"]
    louder = f"; noise rose {'once,' if rises == 1 else f'{rises} times, last'} {line.words(when)}" if rises else ""
    if not (trace.watches or trace.odds is not None or hasattr(memory, "detector")):
        return html.card("Jumps", "\u2013", "not looked for" + louder)
    drift = summary.drift.words.partition(", or else")[0] if summary.drift else "none found"
    return html.card("Jumps", "none", drift + louder)


def _white(white) -> str:
    if white.p_value != white.p_value:
        return html.card("Innovations", "?", "too short to tell")
    note = f"Ljung-Box {chance(white.p_value, 2)}"
    value = "white" if white.is_white else "not white"
    return html.card("Innovations", value, note, common.grade(white.is_white, True))
