"""The sentences of the answer of `identify`, given the numbers."""

from __future__ import annotations

import math

from ..results.numbers import count_of, listed, percent

FIRST_GUESSES = "measured outputs are too few to compare models: the numbers are first guesses."


def too_few_words(observed: int) -> str:
    """Return that so many outputs tell nothing."""
    measured = "1 measured output is" if observed == 1 else f"{observed} measured outputs are"
    return f"{measured} too few to say anything: record more, some ten samples for each parameter at least."


def no_model_words(output: str, name: str, error: float, count: int, best: float) -> str:
    """Return that none of so many models is better than the naive forecast ``name``."""
    if error <= best:
        return (
            f"None of {count} models predicts {output} better than its {name} ({error:.3g} off, rms): none is to be "
            "relied on."
        )
    return (
        f"No model of {output} can be relied on: the most likely is further off than its {name} ({error:.3g}, rms), "
        f"though one of {count} is not ({best:.3g})."
    )


def together_words(model: str, count: int, own: float, name: str, error: float, together, naive, least) -> str:
    """Return that the forecast of all models is better than a naive one, and that of the likeliest model alone is not.

    The model was compared with the naive forecast ``name`` in the samples by which models are chosen.
    """
    return (
        f"The forecast of all {count} models together can be relied on, {together:.3g} off one step ahead (rms; the "
        f"{naive} {least:.3g}); not so {model}, the most likely of them, alone: it was {own:.3g} off where models are "
        f"compared, the {name} {error:.3g}."
    )


def no_forecast_words(output: str, name: str, error: float, model: str, own: float) -> str:
    """Return that the naive forecast is better than that of ``model``, or of all together where none is named."""
    who = f"{model} alone is" if model else "all models together are"
    return (
        f"No forecast of {output} can be relied on: one step ahead {who} {own:.3g} off (rms), the {name} {error:.3g}."
    )


def alone_words(name: str, error: float, together: float, model: str, own: float) -> str:
    """Return that the forecast of all models is worse than a naive one, and that the model's own is told."""
    return (
        f"All models together forecast worse than the {name}, {together:.3g} off against {error:.3g} (rms); "
        f"{model} alone is {own:.3g} off and is what is told here."
    )


def step_words(name: str, time: str, interval: str) -> str:
    """Return when the answer to a step of an input is 63 % done."""
    return f"63 % of the answer to a step of {name} is done after {time} (95 % interval {interval})."


def at_once_words(name: str, step: str) -> str:
    """Return that the answer to a step of an input is 63 % done before the next sample, ``step`` later if known."""
    within = f"the sampling time of {step}" if step else "one sample"
    return f"63 % of the answer to a step of {name} is done within {within}."


def time_constant_words(tau: float, interval, table, is_pair: bool = False) -> str:
    """Return a time constant with where it lies; ``interval`` None where that is not known."""
    said = f"Time constant {table.lasting(tau)}{' (a pair of poles)' * is_pair}"
    if interval is None:
        return f"{said}."
    low, high = interval
    end = f"{table.lasting(low)} to {table.lasting(high)}" if math.isfinite(high) else f"at least {table.lasting(low)}"
    return f"{said}, 95 % interval {end}."


def swing_words(period: str, between: str, time: str) -> str:
    """Return how an answer swings, and how long; ``time`` is empty where it hardly dies out."""
    end = f"dies out with time constant {time}" if time else "hardly dies out"
    return f"Oscillation of period {period} (95 % interval {between}) that {end}."


def gain_sentence(gain: float, std: float, interval, name: str, bend=None, is_open=False, about=None) -> str:
    """Return the steady-state gain from an input; where it bends, that it does and by how much.

    ``about``: the output at which it is that, where it grows in proportion to the output.

    >>> gain_sentence(-320.0, 20.0, (-359.0, -281.0), "price", about=1640.0)
    'Gain -320 ± 20 from price where the output is about 1.64e+03, and in proportion elsewhere.'
    """
    low, high = interval
    said = f"{gain:.3g} ± {std:.2g}" if math.isfinite(std) else f"{low:.3g} to {high:.3g} (95 %)"
    of = name if about is None else f"{name} where the output is about {about:.3g}, and in proportion elsewhere"
    if bend is None:
        return f"Gain {said} from {of}{'; whether it is nonlinear cannot be told' * is_open}."
    least, most = sorted(bend, key=abs)
    return f"Gain {said} from {of} on average: it is nonlinear, {least:.3g} to {most:.3g} over what {name} did."


def no_gain_words(names: list[str], is_endless: bool = False) -> str:
    """Return the inputs whose steady effect is hardly known; ``is_endless``: because their answers may never end."""
    why = ": the end of an answer was not seen, the plant may integrate" * is_endless
    return f"How much {listed(names)} {'moves' if len(names) == 1 else 'move'} it in the long run is not known{why}."


def no_change_words(level: float, gains: dict[str, float], noise: float) -> str:
    """Return that no jump was found, and how large one would have been."""
    found = [f"of the level by {level:.2g}"]
    found += [f"of the gain from {name} by {percent(share)}" for name, share in gains.items()]
    found += [f"of the noise by a factor of {noise:.2g}"] if math.isfinite(noise) else []
    return f"No jump was found; one {listed(found).replace(' and ', ' or ')}, outside of its edges, would have been."


def season_sentence(seasons: str, share: float) -> str:
    """Return how much smaller errors are with a season.

    >>> season_sentence("A season of 12 samples (a year)", 0.813)
    'A season of 12 samples (a year) takes 81 % off the error variance of the best model without one.'
    """
    verb, without = ("takes", "one") if seasons.startswith("A ") else ("take", "any")
    return f"{seasons} {verb} {100 * share:.0f} % off the error variance of the best model without {without}."


def growth_words(power: float, share: float) -> str:
    """Return that the noise grows with the level.

    >>> growth_words(1.0, 0.093)
    'The noise grows with the level: it is about 9.3 % of it.'
    """
    how = "it is about" if power == 1.0 else "as the root of it, and is on average"
    return f"The noise grows with the level: {how} {percent(share)} of it."


def more_changes_words(count: int) -> str:
    """Return that more changes were noticed than are told.

    >>> more_changes_words(1), more_changes_words(3)
    ('There is 1 more change.', 'There are 3 more changes.')
    """
    return f"There {'is' if count == 1 else 'are'} {count_of(count, 'more change')}."


def fit_sentence(fit: float, rmse: float, spread: float) -> str:
    """Return how much of the movement is predicted one step ahead."""
    if fit > 0:
        return f"One step ahead, {fit:.1f} % of the movement is predicted."
    mean = f" ({rmse:.3g} off against {spread:.3g}, rms, but nobody knew that mean before)" if spread else ""
    return f"One step ahead it is predicted no better than by the mean of the record{mean}."


def band_sentence(coverage: float) -> str:
    """Return how often the bands hold."""
    return f"{100 * coverage:.0f} % of the samples lie in their 95 % band."


def choice_words(why: str, count: int, chosen: str, best: str) -> str:
    """Return which model is shown, and why."""
    if why == "most likely":
        return f"Of {count} models, {chosen} is the most likely."
    if why == "as likely":
        return f"Of {count} models, {chosen} is the simplest of those about as likely as the best, {best}."
    return (
        f"Of {count} models, {chosen} is the best that can follow a change, and regressions predict better where they "
        f"forget; {best} is the most likely, with constant parameters."
    )
