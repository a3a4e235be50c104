"""The answer of `identify` as a paragraph an engineer reads first."""

from __future__ import annotations

import cmath
import math

from .wording import gain_words, instant, is_integrator, lasting, pole_words

FAST, MODES = 0.05, 3  # a pole below that is over within a sample; modes that are named
ORDINAL = {1: "First", 2: "Second", 3: "Third"}


def words(found) -> str:
    """Return the paragraph of an `Identification`: the plant, its changes, the trust, the columns."""
    return f"{answer(found)} {found.table.words}"


def answer(found) -> str:
    """Return the same without the columns."""
    return " ".join(part for part in (_plant(found), _changes(found), _trust(found), _choice(found)) if part)


def span(table, seconds: float) -> str:
    """Write a length of time in the unit of the clock; in samples where it has none."""
    return lasting(seconds) if table.timed else f"{seconds / table.dt:.3g} samples"


def when(found, time: float) -> str:
    """Write an instant of the record: a date, seconds, a value of its clock, or a sample."""
    table = found.table
    if table.timed:
        text = instant(time, found.origin)
        return text.partition(".")[0] if found.origin and table.dt >= 1 else text
    return f"sample {time:.0f}" if table.time is None else f"{table.time} {time:.6g}"


def _plant(found) -> str:
    """Say what the chosen model is: order, modes, gains."""
    s, table, dt = found.summary, found.table, found.estimator.dt
    if not s.is_enough:
        return f"{s.observed} measured outputs are too few to say anything."
    if not found.is_useful:
        name = min(found.naive, key=lambda n: found.naive[n])
        return f"{table.output} is best predicted by its {name}: no model of it does better."
    poles = [(p, std) for p, std in s.poles if abs(p) > FAST]
    modes = list(dict.fromkeys(_mode(p, std, table, dt) for p, std in poles if p.imag >= 0))[:MODES]
    n = len(poles)
    text = f"{ORDINAL.get(n, f'{n}th')} order: {', '.join(modes)}." if n else "No memory of its own."
    gains = gain_words(found.model) if table.inputs and all(abs(p) < 1 for p, _ in s.poles) else []
    told = [f"{gain} from {name}" for gain, name in zip(gains, table.inputs) if gain]
    return text + (f" Gain {', '.join(told)}." if told else "")


def _mode(p: complex, std: float, table, dt: float) -> str:
    """Say what a pole means in time."""
    r = abs(p)
    if not 0 < r < 1 or (p.real < 0 and not p.imag) or is_integrator(p, std):
        return pole_words(p, std, dt)
    tau = span(table, -dt / math.log(r))
    if not p.imag:
        return f"time constant {tau}"
    return f"oscillation of period {span(table, 2 * math.pi * dt / abs(cmath.phase(p)))}, decay {tau}"


def _choice(found) -> str:
    chosen, best = found.chosen, found.rivals[0]
    text = f"Of {len(found.rivals)} models, {chosen.name}"
    if chosen.name == best.name:
        return f"{text} predicts best."
    return f"{text} is the simplest that predicts as well as the best, {best.name}."


def _trust(found) -> str:
    f = found.forecast_summary
    text = f"One step ahead, {f.fit:.1f} % of the movement is predicted" if math.isfinite(f.fit) else "It is forecast"
    text += f" and {100 * f.coverage:.0f} % of the samples lie in their 95 % band." if f.count else "."
    advice = "; ".join(v.advice for v in found.diagnosis.not_fine)
    return text + (f" Beware: {advice}." if advice else "")


def _changes(found) -> str:
    if not found.is_useful and not found.changes:
        return ""
    if not found.changes:
        return "Nothing jumped."
    shown = found.changes[:3]
    more = f"; and {len(found.changes) - 3} more changes" if len(found.changes) > 3 else ""
    text = "; ".join(change.words(when(found, change.time)) for change in shown)
    return f"{text[0].upper()}{text[1:]}{more}."
