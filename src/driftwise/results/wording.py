"""A run in plain words."""

from __future__ import annotations

import cmath
import math

from ..models.polynomial import PolynomialModel
from .numbers import SECONDS, chance, instant, plain
from .stable import NEAR
from .whiteness import Nis

PRIOR_COUNTS = 0.01  # a share of the prior in what was learnt that is worth a word


def is_integrator(p: complex, std: float) -> bool:
    """Say whether a pole cannot be told from one, and is near it: far away that only says how little is known."""
    return abs(p - 1) < min(max(2 * std, 1e-6), NEAR) if math.isfinite(std) else False


def swings(p: complex) -> bool:
    """Say whether a mode is seen to swing: a twentieth is left of it, at least, half a period later."""
    return abs(p.imag) > 1e-9 and abs(p) ** (math.pi / abs(math.atan2(p.imag, p.real))) > 0.05


def pole_words(p: complex, std: float, dt: float, unit: str = SECONDS) -> str:
    """Return what a discrete pole means in time."""
    r = abs(p)
    if is_integrator(p, std):
        return f"an integrator (pole {p.real:.4f} ± {std:.2g})"
    if r < 1e-6:
        return "a pure delay"
    if r >= 1:
        return f"an unstable mode (|p| = {r:.4f} ± {std:.2g})"
    tau = -dt / math.log(r)
    if swings(p):
        period = 2 * math.pi * dt / abs(math.atan2(p.imag, p.real))
        return f"an oscillation of period {period:.3g} {unit} that decays with time constant {tau:.3g} {unit}"
    if p.real < 0 and abs(p.imag) <= 1e-9:
        return f"an alternating mode (pole {p.real:.2f})"
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


def size_words(nis: Nis) -> str:
    """Return how far the error bars of the predictions are off; nothing where NIS lies in its interval."""
    if nis.is_consistent:
        return ""
    way = "narrow" if nis.value > 1 else "wide"
    return f"about right, slightly too {way}" if 0.8 <= nis.value <= 1.25 else f"too {way}"


def caveat(s, model) -> str:
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
    return f"assume {' and '.join(assumed)}" if assumed else ""


def bars_words(s, model) -> str:
    """Say how far the error bars of a `Summary` can be believed."""
    size, but = size_words(s.nis_interval), caveat(s, model)
    if size.startswith("too"):
        return f"The error bars are {size}"
    if but:
        return f"The bands of the predictions {f'are {size}' if size else 'hold'}, but the bars of the parameters {but}"
    return f"The error bars {f'are {size}' if size else 'can be believed'}"


def fit_words(s) -> str:
    """Say how well the next sample is explained; no fit is to be had of an output that stood still."""
    if not math.isfinite(s.rmse):
        return "no error yet"
    if not math.isfinite(s.fit):
        return f"an error of {s.rmse:.3g} (y stood still, so a fit means nothing)"
    worse = "" if s.fit > 0 else ", no better than the mean of the output"
    return f"a fit of {plain(s.fit, 1)} % (error {s.rmse:.3g}{worse})"


def times(count: int, last: float, origin: str | None = None, unit: str = SECONDS) -> str:
    """Return how often something happened, and when."""
    many = "once" if count == 1 else "twice" if count == 2 else f"{count} times"
    return f"{many}, {'at' if count == 1 else 'the last time at'} {instant(last, origin, unit)}"


def lost_words(s, origin: str | None = None) -> list[str]:
    """Return how many samples of an output were outliers, and how many found the plant at rest."""
    outliers, when = s.happened["outliers"]
    count, found = s.rejected + outliers, []
    if count:
        last = f" (the last at {instant(when, origin, s.unit)})" if outliers and not s.rejected else ""
        found.append(f"{count} outlier{'s' * (count > 1)} ignored{last}")
    rests, when = s.happened["at_rest"]
    if rests:
        found.append(f"{rests} at rest (the last at {instant(when, origin, s.unit)})")
    return found


def paragraph(s) -> str:
    """Return the sentences of a `Summary`."""
    est, model = s.estimator, s.model
    if not s.is_enough:
        return f"{s.observed} measured outputs are too few for {est.model.N} unknowns: nothing can be said yet."
    n = getattr(est.model, "order", est.model.n)
    order = {1: "first", 2: "second", 3: "third"}.get(n, f"{n}th")
    poles = s.moduli
    if getattr(model, "is_continuous", False):  # as seen at the usual step
        poles = [(cmath.exp(p * est.dt), std) for p, std in poles]
    modes = dict.fromkeys(pole_words(p, std, est.dt, s.unit) for p, std in poles if p.imag >= 0)  # delays are said once
    kind = f"A {order}-order model with {', '.join(modes)}" if n else "The regression"
    text = f"{kind} "
    if math.isfinite(s.rmse):
        text += f"predicts the next sample with {fit_words(s)}."
    else:
        text += f"was estimated; {s.observed} measured outputs are too few to say how well it predicts."
    if est.model.inputs and not s.is_static:
        settles = all(abs(p) < 1 for p, _ in poles)
        gains = gain_words(model)
        if settles and all(gains) and not s.unlearned:
            text += f" Steady-state gain {', '.join(gains)}."
    if math.isfinite(s.nis):
        text += f" {bars_words(s, model)} (NIS {plain(s.nis, 2)}, {100 * s.coverage:.0f} % inside the 95 % band)."
    if s.prior_share > PRIOR_COUNTS:
        text += (
            f" But the default prior, which should be wide, still makes up {100 * s.prior_share:.2g} % of a parameter: "
            "the data are far from y_scale and u_scale. Use est.scaled_to(y, u), or give P0."
        )
    w = s.whiteness
    if math.isfinite(w.p_value):
        if w.is_white:
            text += " The innovations are white: nothing predictable is left."
        elif s.jumps:
            text += (
                f" The innovations are not white ({chance(w.p_value)}); right after jumps they never are, otherwise "
                "try a higher order or another noise."
            )
        else:
            more = " or another noise" if s.drift else ", another noise, or parameters that walk or jump"
            text += (
                f" The innovations are not white ({chance(w.p_value)}): something predictable is left; try "
                f"{getattr(est, 'remedy', 'a higher order' + more)}."
            )
    if s.drift:
        text += f" Drift: {s.drift.words}."
    if s.jumps:
        moved = f" ({s.last_moved})" if s.last_moved else ""
        when = times(s.jumps, s.last_jump, s.origin, s.unit)
        text += f" The parameters jumped {when}{moved}; their values are those since."
    rises, when = s.happened["noise_rises"]
    if rises:
        text += f" The noise level rose {times(rises, when, s.origin, s.unit)}."
    if s.unlearned:
        text += f" The data did not teach {'; '.join(d for d, _ in s.unlearned)}: the inputs do not excite them."
    lost = [
        f"{count} {what}"
        for count, what in (
            (s.missing_outputs, "outputs missing"),
            (s.missing_inputs, "inputs missing"),
            (s.bad_values, "absurd values"),
        )
        if count
    ]
    lost += lost_words(s, s.origin)
    return text + (f" Of {s.samples} samples: {', '.join(lost)}." if lost else "")
