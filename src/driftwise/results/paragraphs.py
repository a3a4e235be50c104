"""A run in plain words: one paragraph, of one output or of several."""

from __future__ import annotations

import cmath
import math

from ..models.polynomial import PolynomialModel
from . import sentences as say
from .numbers import article, capital, chance, listed, ordinal, percent

PRIOR_COUNTS = 0.01  # a share of the prior in what was learnt that is worth a word


def of_run(s) -> str:
    """Return the sentences of a `Summary`."""
    est, model, white, poles = s.estimator, s.model, s.whiteness, s.moduli
    if not s.is_enough:
        return say.too_few_words(str(s.observed), str(s.unknowns))
    rmse, fit, nis, coverage, unlearned, drift = s.rmse, s.fit, s.nis, s.coverage, s.unlearned, s.drift
    prior, caveat = s.prior_share, _caveat(s, model)
    n = est.order
    if getattr(model, "is_continuous", False):  # as seen at the usual step
        poles = [(cmath.exp(p * est.dt), std) for p, std in poles]
    modes = dict.fromkeys(say.pole_words(p, std, est.dt, s.unit) for p, std in poles if p.imag >= 0)  # a delay once
    kind = f"{article(n)} {ordinal(n)}-order model with {', '.join(modes)}" if n else "The regression"
    if math.isfinite(rmse):
        said = [f"{kind} predicts the next sample with {say.fit_words(rmse, fit)}."]
    else:
        said = [f"{kind} was estimated; {s.observed} measured outputs are too few to say how well it predicts."]
    if est.model.inputs and n:
        gains = say.gain_words(model)
        if all(abs(p) < 1 for p, _ in poles) and all(gains) and not unlearned:
            said.append(f"Steady-state gain {', '.join(gains)}.")
    if math.isfinite(nis):
        said.append(f"{say.bars_words(s.nis_interval, caveat)} {say.inside_words(nis, coverage)}.")
    if prior > PRIOR_COUNTS:
        said.append(
            f"But the default prior, which should be wide, still makes up {percent(prior)} of a parameter: "
            "the data are far from y_scale and u_scale. Use est.scaled_to(y, u), or give P0."
        )
    if math.isfinite(white.p_value):
        usual = " or another noise" if drift else ", another noise, or parameters that walk or jump"
        remedy = est.remedy or f"a higher order{usual}"
        said.append(say.whiteness_words(white.p_value, white.is_white, bool(s.jumps), remedy))
    said += [f"Drift: {drift.words}."] if drift else []
    said += [say.jumps_words(s.jumps, s.last_jump, s.origin, s.unit, s.last_moved)] if s.jumps else []
    rises, when = s.happened["noise_rises"]
    said += [f"The noise level rose {say.when_words(rises, when, s.origin, s.unit)}."] if rises else []
    if unlearned:
        said.append(say.untaught_words([d for d, _ in unlearned], "the inputs do not excite them"))
    lost = _counted(
        (s.missing_outputs, "outputs missing"), (s.missing_inputs, "inputs missing"), (s.bad_values, "absurd values")
    )
    lost += say.lost_words(s.rejected, s.happened["outliers"], s.happened["at_rest"], s.origin, s.unit)
    return " ".join([*said, *([f"Of {s.samples} samples: {', '.join(lost)}."] if lost else [])])


def of_outputs(s) -> str:
    """Return the sentences of a `SummaryMIMO`."""
    est, model = s.estimator, s.model
    if not s.is_enough:
        return say.too_few_words(
            *(" and ".join(map(str, c)) for c in ([one.observed for one in s.outputs], est.unknowns))
        )
    modes = [say.pole_words(p, std, est.dt) for p, std in s.poles if p.imag >= 0]
    run = "one filter for each output" if est.is_split else "one filter for all outputs"
    said = [f"Structure {model.form.nu}, {run}: {', '.join(modes)}."]
    said += [_output(f"y{i}", one, s.samples) for i, one in enumerate(s.outputs, 1)]
    settles = all(abs(p) + 2 * std < 1 for p, std in s.poles)
    if s.gains and settles and all(math.isfinite(std) for *_, std in s.gains):
        gains = ", ".join(f"y{i} from u{l} {g:.3g} ± {std:.2g}" for i, l, g, std in s.gains)
        said.append(f"Steady-state gain: {gains}.")
    said += [f"{capital(note)}." for note in s.notes]
    if s.unlearned:
        said.append(say.untaught_words([d for d, _ in s.unlearned], "nothing in the record excites them"))
    said += [f"{s.missing_inputs} of {s.samples} samples lack an input."] if s.missing_inputs else []
    return " ".join(said)


def _output(name, one, samples) -> str:
    said = [f"{name}: the next sample is predicted with {say.fit_words(one.rmse, one.fit)}"]
    white = one.whiteness
    if math.isfinite(one.nis):
        size = say.size_words(one.nis_interval)
        is_white = white.is_white or not math.isfinite(white.p_value)
        good = "the error bars can be believed" if is_white else "the bands of the predictions hold"
        said.append(f"{f'the error bars are {size}' if size else good} {say.inside_words(one.nis, one.coverage)}")
    if math.isfinite(white.p_value):
        remedy = "try a larger index, another noise, or walking parameters"
        not_white = f"the innovations are not white ({chance(white.p_value)}): {remedy}"
        said.append("the innovations are white" if white.is_white else not_white)
    said += [f"drift: {one.drift.words}"] if one.drift else []
    said += [say.output_jumps_words(one.jumps)] if one.jumps else []
    rises, when = one.happened["noise_rises"]
    said += [f"its noise level rose {say.when_words(rises, when)}"] if rises else []
    lost = _counted((one.missing, "missing"), (one.bad_values, "absurd values"))
    lost += say.lost_words(one.rejected, one.happened["outliers"], one.happened["at_rest"])
    return "; ".join([*said, *([f"of {samples} samples {', '.join(lost)}"] if lost else [])]) + "."


def _counted(*counts: tuple[int, str]) -> list[str]:
    return [f"{count} {what}" for count, what in counts if count]


def _caveat(s, model) -> str:
    """Return what the bars of the parameters leave out, even where those of the predictions hold."""
    if getattr(model, "is_continuous", False):
        return (
            "leave out the bias of straight lines between the samples and of noise on y: compare with half and twice "
            "the observer rate"
        )
    assumed = []
    if math.isfinite(s.whiteness.p_value) and not s.whiteness.is_white:
        assumed.append("white innovations")
    if isinstance(model, PolynomialModel) and s.estimator.options["method"] == "plr":
        assumed.append("the exact gradient, which plr is not: it may spread twice as far")
    return f"assume {listed(assumed)}" if assumed else ""
