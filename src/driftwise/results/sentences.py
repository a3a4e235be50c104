"""The catalogue of sentences: what is said of jumps, error bars, whiteness, poles, lost samples, given the numbers."""

from __future__ import annotations

import math

from .numbers import SECONDS, chance, instant, near_one, odds_words, often, percent, plain
from .numbers import fixed as shown
from .stable import is_integrator, runs_away, swings
from .whiteness import Nis, Whiteness

# --- jumps ---------------------------------------------------------------------------------------------------

SOMETHING = "parameters jumped"  # of a jump that names none
NOTHING_JUMPED = "nothing jumped"
CHANGES_UNKNOWN = "Whether anything jumped cannot be said: there are too few samples for that."
COUNT_JUMPED = "{} jumped"  # series of a fleet
SERIES_JUMPED, WHEN_JUMPED = "series that jumped", "When they jumped"  # an axis, and what stands above it
NOTHING = "Nothing jumped, drifts or differs by more than chance explains."  # in a fleet
AFTER_JUMPS = "right after jumps they never are"  # innovations: white
BETWEEN_JUMPS = "between them the parameters stay"
VERBS = {"width": ("widened", "narrowed"), "level": ("rose", "fell")}  # what a detector watches: up, down
HOW_JUMPS_COUNT = (
    "Each series counts where it jumped last, as the jump was noticed: some samples after it happened. Where many "
    "jump within 20 samples, and chance does not explain it (1 in 1000), look for what they have in common."
)


def direction_words(watches: str, since: float, name: str | None, parameters: int) -> str:
    """Return what a detector of ``watches`` ("width", "level") saw go up (since > 0) or down, in a parameter or not."""
    way = VERBS[watches][0 if since > 0 else 1]
    if name and abs(since) < parameters:
        return f"a parameter changed, perhaps {name}, which then {way}"
    return f"{name or 'the innovations'} {way}"


def alarm_words(what: str, statistic: float, since: float = 0.0, samples: int = 1) -> str:
    """Return an alarm: what it says, since how many samples, how far over its threshold, for how many samples."""
    when = f", it began about {abs(since):.0f} samples ago" if abs(since) > 1 else ""
    more = f", for {samples} samples" if samples > 1 else ""
    return f"jump: {what}{when} (statistic {statistic:.2f} times its threshold{more})"


def contradiction_words(window: float | None) -> str:
    """Return what an alarm of an observer means; of `Parity`, given its window in seconds."""
    if window is None:
        return "the innovations no longer fit the plant"
    return f"the last {window:g} s contradict the {window:g} s before: another plant, or another disturbance"


def step_words(name: str, before: float, after: float, others: int) -> str:
    """Return which parameter jumped, from where to where, and how many others did."""
    more = f" (and {others} more)" if others else ""
    return f"{name} jumped from {before:.3g} to {after:.3g}{more}"


def weighed_words(moved: str, since: float, odds: float) -> str:
    """Return a jump that won against other explanations."""
    ago = f"it began about {int(since)} samples ago" if since > 1 else "it began just then"
    return f"{moved}, {ago} (odds {odds_words(odds)})"


def hindsight_jump_words(name: str, size: float, std: float, sample: int, others, odds: str) -> str:
    """Return a jump of a record in hindsight; ``others`` are (name, size) of what jumped with it."""
    first = f"{name} jumped by {size:+.3g} (\u00b1{std:.2g}) at sample {sample}"
    return ", ".join([first, *(f"{other} {step:+.3g}" for other, step in others)]) + f"; odds {odds}"


def jumps_words(count: int, last: float, origin: str | None, unit: str, moved: str = "") -> str:
    """Return how often parameters jumped, when the last time, and what that moved."""
    what = f" ({moved})" if moved else ""
    return f"The parameters jumped {when_words(count, last, origin, unit)}{what}; their values are those since."


def output_jumps_words(count: int) -> str:
    """Return how often the parameters of one output of several jumped."""
    return f"its parameters jumped {count} time{'s' * (count > 1)}"


def jump_count_words(count: int, last: float, origin: str | None, unit: str) -> str:
    """Return how many jumps there were, and when the last was."""
    return f"{count} jump{'s' * (count != 1)}" + (f", the last at {instant(last, origin, unit)}" if count else "")


def explained_by_jump(what: str, odds: str) -> str:
    """Return that a jump explains a record best."""
    return f"the {SOMETHING}, {what} ({odds})"


def series_jump_words(count: float, last: str) -> str:
    """Return how often a series of a fleet jumped."""
    return f"jumped at {last}" if count == 1 else f"jumped {count:.0f} times, the last time at {last}"


def burst_words(count: str, start: str, end: str) -> str:
    """Return that many series jumped at one time."""
    when = f"between {start} and {end}" if end != start else f"at {start}"
    return f"{count} series jumped {when}: look for a common cause."


def false_jumps_words(count: str) -> str:
    """Return how many jumps of a fleet may be none."""
    return f"Up to {count} jumps may be false alarms (1 in 100\u202f000 samples)."


# --- error bars and fit --------------------------------------------------------------------------------------


def size_words(nis: Nis) -> str:
    """Return how far the error bars of the predictions are off; nothing where NIS lies in its interval."""
    if nis.is_consistent:
        return ""
    way = "narrow" if nis.value > 1 else "wide"
    return f"about right, slightly too {way}" if 0.8 <= nis.value <= 1.25 else f"too {way}"


def off(nis: float) -> str:
    """Return how far off error bars are, by their mean normalised square."""
    size, way = math.sqrt(nis), "narrow" if nis > 1 else "wide"
    if size < 10:
        return f"{100 * abs(size - 1):.0f} % too {way}"
    return f"too {way} by a factor {f'of {size:.0f}' if size < 1e6 else 'beyond a million'}"


def nis_words(nis: Nis) -> str:
    """Return what the mean square of the innovations says of the error bars."""
    if not nis.samples:
        return "not known yet."
    found = f"{shown(nis.value, 3)}; under the right model it lies between {near_one(nis.low, nis.high, ' and ')} "
    found += "in 95 of 100 records"
    return found + (", and so it does." if nis.is_consistent else f". The error bars are {off(nis.value)}.")


def bars_words(nis: Nis, but: str = "") -> str:
    """Return how far the error bars can be believed; ``but`` is what those of the parameters leave out."""
    size = size_words(nis)
    if size.startswith("too"):
        return f"The error bars are {size}"
    if but:
        return f"The bands of the predictions {f'are {size}' if size else 'hold'}, but the bars of the parameters {but}"
    return f"The error bars {f'are {size}' if size else 'can be believed'}"


def inside_words(nis: float, coverage: float) -> str:
    """Return NIS and the share of samples inside their bands."""
    return f"(NIS {plain(nis, 2)}, {100 * coverage:.0f} % inside the 95 % band)"


def fit_words(rmse: float, fit: float) -> str:
    """Return how well the next sample is explained; no fit is to be had of an output that stood still."""
    if not math.isfinite(rmse):
        return "no error yet"
    if not math.isfinite(fit):
        return f"an error of {rmse:.3g} (y stood still, so a fit means nothing)"
    worse = "" if fit > 0 else ", no better than the mean of the output"
    return f"a fit of {plain(fit, 1)} % (error {rmse:.3g}{worse})"


def too_few_words(measured: str, unknowns: str) -> str:
    """Return that there are fewer outputs than unknowns."""
    return f"{measured} measured outputs are too few for {unknowns} unknowns: nothing can be said yet."


def untaught_words(directions: list[str], why: str) -> str:
    """Return which combinations of parameters the data left open."""
    return f"The data did not teach {'; '.join(directions)}: {why}."


# --- whiteness -----------------------------------------------------------------------------------------------


def whiteness_words(p_value: float, is_white: bool, has_jumps: bool, remedy: str) -> str:
    """Return whether anything predictable is left in the innovations, and what to try."""
    if is_white:
        return "The innovations are white: nothing predictable is left."
    said = f"The innovations are not white ({chance(p_value)})"
    if has_jumps:
        return f"{said}; {AFTER_JUMPS}, otherwise try a higher order or another noise."
    return f"{said}: something predictable is left; try {remedy}."


def predictable_words(found: Whiteness, has_jumps: bool) -> tuple[str, str]:
    """Return the answer to "is anything predictable left?" in a word, and in a sentence without a full stop."""
    statistic, lags, p_value, is_white = found
    if p_value != p_value:
        return "too short to tell", "The record is too short to tell"
    said = "No: the innovations look white" if is_white else "Yes: the innovations are not white; "
    if not is_white:
        better = "a higher order, another input or another noise model would predict better"
        said += AFTER_JUMPS if has_jumps else better
    test = f"Ljung-Box {statistic:.1f} over {lags} lags, {chance(p_value, 2)}"
    return "no" if is_white else "yes", f"{said} ({test})"


# --- what happened, and what was lost ------------------------------------------------------------------------


def when_words(count: int, last: float, origin: str | None = None, unit: str = SECONDS) -> str:
    """Return how often something happened, and when."""
    return f"{often(count)}, {'at' if count == 1 else 'the last time at'} {instant(last, origin, unit)}"


def lost_words(rejected: int, outliers, rests, origin: str | None = None, unit: str = SECONDS) -> list[str]:
    """Return how many samples were outliers, and how many found the plant at rest: (how many, when the last)."""
    count, found = rejected + outliers[0], []
    if count:
        last = f" (the last at {instant(outliers[1], origin, unit)})" if outliers[0] and not rejected else ""
        found.append(f"{count} outlier{'s' * (count > 1)} ignored{last}")
    if rests[0]:
        found.append(f"{rests[0]} at rest (the last at {instant(rests[1], origin, unit)})")
    return found


# --- the plant -----------------------------------------------------------------------------------------------


def pole_words(p: complex, std: float, dt: float, unit: str = SECONDS) -> str:
    """Return what a discrete pole means in time."""
    r = abs(p)
    if is_integrator(p, std):
        return f"an integrator (pole {p.real:.4f} ± {std:.2g})"
    if r < 1e-6:
        return "a pure delay"
    if runs_away(r, std):
        return f"an unstable mode (|p| = {r:.4f} ± {std:.2g})"
    tau = -dt / math.log(r) if r < 1 else math.inf
    if swings(p):
        period = 2 * math.pi * dt / abs(math.atan2(p.imag, p.real))
        end = f"decays with time constant {tau:.3g} {unit}" if r < 1 else f"hardly dies out (|p| = {r:.4f} ± {std:.2g})"
        return f"an oscillation of period {period:.3g} {unit} that {end}"
    if p.real < 0 and abs(p.imag) <= 1e-9:
        return f"an alternating mode (pole {p.real:.2f})"
    if r >= 1:
        return f"a mode that cannot be told from an integrator (pole {p.real:.4f} ± {std:.2g})"
    return f"time constant {tau:.3g} {unit}" + " (a pair of poles)" * (abs(p.imag) > 1e-9)


def gain_words(model) -> list[str]:
    """Return each input's steady-state gain with what is known of it; nothing where it has no bound."""
    found = []
    for gain, std, (low, high) in zip(model.dc_gain, model.dc_gain_std, model.dc_gain_interval()):
        if math.isfinite(std):
            found.append(f"{gain:.3g} ± {std:.2g}")
        else:
            found.append(f"{low:.3g} to {high:.3g} (95 %)" if math.isfinite(low) else "")
    return found


# --- validation ----------------------------------------------------------------------------------------------


def colour_words(p_value: float, others: list[str], remedy: str) -> str:
    """Return that the innovations are not white, which ``others``, verdicts that ask for something, may explain."""
    if others:
        why = "what else is wrong may explain it: see to that first"
    else:
        why = f"try {remedy}"
    return f"the innovations are not white ({chance(p_value)}): {why}"


def delay_words(name: str, said: int, better: int, odds: float, is_fine: bool) -> str:
    """Return whether the delay of an input is that of the model; ``odds`` are log odds of the better one."""
    if is_fine:
        return f"no delay of {name} explains the record clearly better than nk = {said}"
    sure = odds_words(math.exp(min(odds, 50.0)))
    return (
        f"wrong delay: {name} acts after {better} samples, and the model says {said} (odds {sure}): take nk = {better}"
    )


def loop_words(name: str) -> str:
    """Return why innovations may go with an input at once."""
    return f"the innovations go with {name} at once: the feedback explains it"


def missing_lag_words(name: str, at: int, is_fine: bool, nk: int, nb: int, is_late: bool) -> str:
    """Return whether the innovations owe anything to an input, the most at lag ``at``, and what to do."""
    if is_fine:
        return f"the innovations owe nothing to {name}"
    said = f"the innovations go with {name} {at} samples before" if at else f"the innovations go with {name} at once"
    if is_late:
        return f"{said}: the wrong delay explains it"
    if not nb:
        return f"{said}: a missing lag"
    if at < nk:
        return f"{said}, earlier than the model's delay: take nk = {at}"
    if at >= nk + nb:
        return f"{said}, a lag that the model does not have: take nb = {at - nk + 1}, or a higher order"
    return f"{said}, a lag that the model has: a higher order, or a gain that changes"


def feedback_words(name: str, at: int, is_past: bool, is_fine: bool) -> str:
    """Return whether an input follows what was new in the output, the most ``at`` samples later; or the same sample."""
    if is_fine:
        return f"{name} owes nothing to what was new in the output: no feedback"
    if not is_past:
        return (
            f"feedback: {name} follows the output within the sample (or it acts at once: then take nk = 0); keep "
            "nk >= 1, a noise model that fits, and move the set point"
        )
    when = f"after {at} sample{'s' * (at > 1)}" if at else "within the sample"
    return (
        f"feedback: {name} follows the output, most of all {when}; a model without delay is the controller's: keep "
        "nk >= 1, a noise model that fits, and move the set point"
    )


def echo_words(name: str) -> str:
    """Return that an input answers all of the output, although nothing of its noise is heard in it."""
    return (
        f"feedback: {name} answers the output of one or two samples ago, though hardly any noise comes back that way; "
        "keep nk >= 1, a noise model that fits, and move the set point"
    )


def computed_words(name: str) -> str:
    """Return that an input is computed from the output."""
    return (
        f"feedback: {name} is computed from the output, digit by digit: the controller is in the record, and the plant "
        "only where the set point moves; keep nk >= 1, and move the set point"
    )


def squares_words(is_fine: bool, share: float) -> str:
    """Return whether squares explain what a linear model leaves; ``share`` of the variance of the innovations."""
    if is_fine:
        return "no square explains what the linear model leaves"
    return (
        f"not linear: squares of inputs and output explain {percent(share)} of what the linear model leaves: it "
        "holds near one working point; take the square of the input as an input more, or a model for each range"
    )


def named_model_words(name: str, offset: str, why: str) -> str:
    """Return which model a run had, what of an offset, and why this one."""
    kept = {"estimated": "with an offset", "none": "without an offset"}.get(offset, f"about the {offset}s")
    return f"The model is {name} {kept}: {why}."
