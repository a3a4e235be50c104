"""The answer of `identify` as a paragraph an engineer reads first."""

from __future__ import annotations

import cmath
import math

from ..results.numbers import capital, ordinal
from ..results.sentences import NO_JUMP, gain_words, pole_words
from ..results.stable import NEAR, is_integrator, swings
from ..tables.table_words import taken_words
from .change_log import surest
from .change_monitor import FALSE

FAST, MODES = 0.05, 3  # a pole below that is over within a sample; modes that are named
SHOWN = 3  # changes that are named, the surest


def words(found) -> str:
    """Return the paragraph of an `Identification`: the plant, its changes, the trust, the columns."""
    return f"{answer(found)} {found.table.words}"


def answer(found) -> str:
    """Return the same without the columns."""
    parts = _reading(found), _plant(found), _changes(found), _trust(found), _beware(found), _choice(found)
    return " ".join(part for part in (parts if found.summary.is_enough else parts[:2]) if part)


def brief(found) -> str:
    """Return the answer without what to beware of."""
    parts = _reading(found), _plant(found), _changes(found), _trust(found), _choice(found)
    return " ".join(part for part in (parts if found.summary.is_enough else parts[:2]) if part)


def _reading(found) -> str:
    """Say that the columns can be read in another way, too."""
    return taken_words(found.table) if found.is_ambiguous else ""


def _plant(found) -> str:
    """Say what the chosen model is: order, modes, gains."""
    s, table = found.summary, found.table
    if not s.is_enough:
        measured = "1 measured output is" if s.observed == 1 else f"{s.observed} measured outputs are"
        return f"{measured} too few to say anything: record more, some ten samples for each parameter at least."
    if not found.is_judged:
        return f"{s.observed} measured outputs are too few to compare models: the numbers are first guesses."
    if not found.is_useful:
        chosen, quoted = found.chosen, found.quoted
        name, error = min(found.judged.items(), key=lambda pair: pair[1])
        if error <= min(rival.rmse for rival in found.rivals):
            return f"{table.output} is best predicted by its {name}: no model of it does better."
        if error <= chosen.rmse:
            return (
                f"No model of {table.output} can be relied on: the most likely, {chosen.name}, is "
                f"{chosen.rmse:.3g} off (rms), the {name} {error:.3g}."
            )
        name, error = min(found.naive.items(), key=lambda pair: pair[1])
        who = f"{chosen.name} alone is" if found.is_alone else "all models together are"
        return (
            f"No forecast of {table.output} can be relied on: one step ahead {who} {quoted.rmse:.3g} off (rms), "
            f"the {name} {error:.3g}."
        )
    poles = [(p, std) for p, std in s.moduli if abs(p) > FAST]
    modes = list(dict.fromkeys(_mode(p, std, table) for p, std in poles if p.imag >= 0))[:MODES]
    n = len(poles)
    text = f"{capital(ordinal(n))} order: {', '.join(modes)}." if n else "No memory of its own."
    gains = gain_words(found.model) if table.inputs and all(abs(p) < 1 for p, _ in s.poles) else []
    known = [f"{gain} from {name}" for gain, name in zip(gains, table.inputs) if gain]
    return _warning(found) + text + (f" Gain {', '.join(known)}." if known else "")


def _warning(found) -> str:
    """Say that the forecast of all models is worse than a naive one, where it is."""
    if not found.is_alone:
        return ""
    name, error = min(found.naive.items(), key=lambda pair: pair[1])
    together, alone = found.forecast_summary.rmse, found.quoted.rmse
    return (
        f"All models together forecast worse than the {name}, {together:.3g} off against {error:.3g} (rms); "
        f"{found.chosen.name} alone is {alone:.3g} off and is what is told here. "
    )


def _mode(p: complex, std: float, table) -> str:
    """Say what a pole means in time."""
    r, dt = abs(p), table.dt
    if not 0 < r < 1 or (p.real < 0 and not p.imag) or is_integrator(p, std):
        return pole_words(p, std, dt)
    tau = table.lasting(-dt / math.log(r))
    if not swings(p):
        return f"time constant {tau}" + " (a pair of poles)" * bool(p.imag)
    period = table.lasting(2 * math.pi * dt / abs(cmath.phase(p)))
    dies = f"that dies out with time constant {tau}" if 1 - r > min(2 * std, NEAR) else "that hardly dies out"
    return f"oscillation of period {period} {dies}"


def _choice(found) -> str:
    chosen, best = found.chosen, found.rivals[0]
    if not found.is_judged:
        return ""
    text = f"Of {len(found.rivals)} models, {chosen.name}"
    if chosen.name == best.name:
        return f"{text} is the most likely."
    return f"{text} is the simplest that predicts as well as the best, {best.name}."


def _trust(found) -> str:
    f = found.quoted
    if not f.count:
        return ""
    held = f"{100 * f.coverage:.0f} % of the samples lie in their 95 % band."
    if not f.fit > 0:  # NaN too
        mean = f" ({f.rmse:.3g} off against {f.spread:.3g}, rms, but nobody knew that mean before)" if f.spread else ""
        return f"One step ahead it is predicted no better than by the mean of the record{mean}; {held}"
    return f"One step ahead, {f.fit:.1f} % of the movement is predicted and {held}"


def _beware(found) -> str:
    advice = "; ".join(v.advice for v in found.diagnosis.not_fine)
    return f"Beware: {advice}." if advice else ""


def _changes(found) -> str:
    if not found.is_useful and not found.changes:
        return ""
    if not found.changes:
        return NO_JUMP
    sure = [change for change in found.changes if change.is_sure]
    chance = math.ceil(found.summary.samples / FALSE)
    if not sure and found.alarms <= chance:
        return _doubtful(found, chance)
    shown = surest(sure or found.changes, SHOWN)
    rest = found.alarms - len(shown)
    more = f"; and {rest} more change{'s' * (rest > 1)}" if rest else ""
    text = "; ".join(map(found.phrase, shown))
    return f"{text[0].upper()}{text[1:]}{more}. One false alarm in {FALSE} samples is allowed, here up to {chance}."


def _doubtful(found, chance: int) -> str:
    """Say that no more was noticed than what the promised rate of false alarms lets through."""
    (best,) = surest(found.changes, 1)
    allowed = f"no more than the false alarms allowed in so many samples ({chance}): nothing need have changed"
    if found.alarms == 1:
        return f"Perhaps, {found.phrase(best)}; but that is {allowed}."
    return f"{found.alarms} changes were noticed, {allowed}. The surest: {found.phrase(best)}."
