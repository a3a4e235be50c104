"""What `identify` claims: every sentence of its answer, with the number behind it.

To claim more: a function from an `Identification` to claims, and its name in `CLAIMS`, where it is to be said.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.special import chdtri

from ..models.quantities import NORMAL_95
from ..results.claims import Claim
from ..results.numbers import sentence
from ..results.sentences import CHANGES_UNKNOWN, pole_words
from ..results.stable import NEAR, is_integrator, runs_away, swings, turns
from ..tables.table_words import column_claims, table_claims, taken_words
from . import identification_words as say
from .change_log import surest
from .effects import is_known
from .forecast_verdicts import whiteness_verdict
from .identifier import CLOSE
from .response_record import is_scattered
from .seasons import season_words
from .table_together import together_words

FAST = 0.05  # a pole below that is over within a sample
NOTHING = 1e-3  # of processes without memory, that are told a mode
SHOWN = 3  # changes that are named, the surest
HELPS = 0.05  # of the error variance, that a season has to take away to be spoken of
TABLE = "column", "clock", "table"  # kinds of claims that are about the table


def claims(found) -> tuple[Claim, ...]:
    """Return all that an `Identification` claims, in the order it is said."""
    makers = CLAIMS if found.summary.is_enough else (reading_claims, plant_claims, table_part)
    return tuple(claim for make in makers for claim in make(found))


def reading_claims(found) -> Iterator[Claim]:
    """Claim that the columns can be read in another way, where they can."""
    if found.is_ambiguous:
        yield Claim("reading", found.table.output, taken_words(found.table))


def plant_claims(found) -> Iterator[Claim]:
    """Claim what the chosen model is: how fast it answers, its gains; or that none can be relied on."""
    s, output = found.summary, found.table.output
    if not s.is_enough:
        yield Claim("plant", output, say.too_few_words(s.observed))
    elif not found.is_judged:
        yield Claim("plant", output, f"{s.observed} {say.FIRST_GUESSES}")
    elif not found.is_useful:
        yield Claim("plant", output, _useless(found))
        if found.effects.error < min(found.judged.values()):  # fitted to all that was measured, it says more
            yield from _effects(found)
    else:
        name, error = _least(found.naive)
        together, own = found.forecast_summary.rmse, found.quoted.rmse
        if found.is_alone and together > error:
            text = say.alone_words(name, error, together, found.chosen.name, own)
            yield Claim("forecast", "all models", text, together)
        yield from _effects(found)


def _useless(found) -> str:
    output, chosen = found.table.output, found.chosen
    name, error = _least(found.judged)
    naive, least = _least(found.naive)
    if error <= chosen.rmse and found.quoted.rmse < least and not found.is_alone:
        together = found.quoted.rmse, naive, least
        return say.together_words(chosen.name, len(found.rivals), chosen.rmse, name, error, *together)
    if error <= chosen.rmse:
        return say.no_model_words(output, name, error, len(found.rivals), min(rival.rmse for rival in found.rivals))
    return say.no_forecast_words(output, naive, least, chosen.name if found.is_alone else "", found.quoted.rmse)


def _least(errors: dict[str, float]) -> tuple[str, float]:
    return min(errors.items(), key=lambda pair: pair[1])


def _effects(found) -> Iterator[Claim]:
    """Claim what the inputs do: how fast, and how much."""
    yield from _dynamics(found)
    yield from _gains(found)


def _dynamics(found) -> Iterator[Claim]:
    """Claim how the output answers; of a model without inputs, its slowest mode."""
    table, effects = found.table, found.effects
    if not table.inputs:
        angles = turns(found.summary.model, found.summary.estimator.dt)
        modes = [
            (p, std, angle) for (p, std), angle in zip(found.summary.moduli, angles) if abs(p) > FAST and p.imag >= 0
        ]
        is_of_deviations = bool(found.chosen.candidate.seasons)  # from a season that follows the output
        is_told = found.is_useful and not is_of_deviations and has_memory(found.summary.model)
        if modes and is_told and _is_seen(*modes[0][:2], found):
            yield from _mode(*modes[0], table)
        return
    for name, effect in zip(table.inputs, effects.of):
        answer = effect.step
        if effect.is_known and answer is not None and is_known(answer.interval) and answer.time > 0:
            time, low, high = (table.dt * moment for moment in (answer.time, *answer.interval))
            text = say.step_words(name, *table.lasting_between(time, low, high))
            if answer.interval[1] < 1:  # what a line from sample to sample says is no time
                text, low, high = say.at_once_words(name, table.lasting(table.dt) if table.timed else ""), 0.0, table.dt
            yield Claim("time constant", name, text, time, (low, high))
    swing = effects.swing
    is_seen = any(effect.step is not None and effect.step.swings for effect in effects.of)
    if is_seen and swing is not None and is_known(swing.interval):
        ends = tuple(table.dt * end for end in swing.interval)
        period, between = table.lasting_between(table.dt * swing.period, *ends)
        text = say.swing_words(period, between, table.lasting(table.dt * swing.time))
        yield Claim("pole", table.output, text, table.dt * swing.period, ends)


def _is_seen(p: complex, std: float, found) -> bool:
    """Say whether a mode is told from none, and, unless it hardly dies out, is that of a model that leaves nothing."""
    is_lasting = 1 - abs(p) < min(2 * std, NEAR)
    is_white = whiteness_verdict(found.summary.whiteness, found.summary.observed).is_fine
    return (is_lasting or is_white) and ((p.real > 0 and not p.imag) or not abs(p) < 2 * std)


def has_memory(model) -> bool:
    """Whether the past outputs of a model, taken together, are told from none: roots of nothing lie on a circle."""
    n = model.form.n
    a, P = model.values[:n], model.covariance[:n, :n]
    scale = np.sqrt(np.maximum(P.diagonal(), 1e-300))
    t = a / scale
    return bool(t @ np.linalg.pinv(P / scale / scale[:, None]) @ t > chdtri(n, NOTHING))


def _mode(p: complex, std: float, angle: float, table) -> Iterator[Claim]:
    """Claim a time constant, or what else a pole means in time; ``angle`` is the standard deviation of its argument.

    Of an oscillation whose period is not known nothing is claimed.
    """
    r, dt, output = abs(p), table.dt, table.output
    if swings(p) and not runs_away(r, std) and not is_integrator(p, std):
        turn = abs(cmath.phase(p))
        ends = tuple(2 * math.pi * dt / max(turn + side * NORMAL_95 * angle, 1e-12) for side in (1, -1))
        if is_known(ends):
            period = 2 * math.pi * dt / turn
            time = "" if 1 - r <= min(2 * std, NEAR) else table.lasting(-dt / math.log(r))
            said, between = table.lasting_between(period, *ends)
            yield Claim("pole", output, say.swing_words(said, between, time), period, ends)
        return
    if not 0 < r < 1 or (p.real < 0 and not p.imag) or is_integrator(p, std):
        yield Claim("pole", output, sentence(pole_words(p, std, dt)))
        return
    tau, interval = -dt / math.log(r), None
    if math.isfinite(std):
        low, high = (min(max(r + side * NORMAL_95 * std, 1e-9), 1.0) for side in (-1, 1))
        interval = -dt / math.log(low), -dt / math.log(high) if high < 1 else math.inf
    text = say.time_constant_words(tau, interval, table, bool(p.imag))
    yield Claim("time constant", output, text, tau, interval)


def _gains(found) -> Iterator[Claim]:
    """Claim the gains that are known to within half of them; of the others, that they are not."""
    open_ = []
    for name, effect in zip(found.table.inputs, found.effects.of):
        if effect.is_known:
            numbers = effect.gain, effect.std, effect.interval
            text = say.gain_sentence(*numbers, name, effect.bend, effect.is_open, found.effects.about)
            yield Claim("gain", name, text, effect.gain, effect.interval)
        else:
            open_.append(name)
    if open_:
        yield Claim("gain", ", ".join(open_), say.no_gain_words(open_, found.effects.is_endless))


def season_claims(found) -> Iterator[Claim]:
    """Claim how much a season helps where the chosen model has one: beside the best forecast of those without.

    Nothing of one whose samples seldom follow each other: what looks a season back may find the last value there, which
    what looks back by little has not.
    """
    seasons = found.chosen.candidate.seasons
    others = [rival.rmse for rival in found.rivals if not rival.candidate.seasons]
    if seasons and not is_scattered(found.forecast.y) and found.is_judged and found.is_useful:
        share = 1 - (found.chosen.rmse / min(others)) ** 2
        if share > HELPS:
            text = say.season_sentence(season_words(seasons, found.table), share)
            yield Claim("season", ", ".join(map(str, seasons)), text, share)


def change_claims(found) -> Iterator[Claim]:
    """Claim that the noise grows with the level; and what changed, and when, or that nothing did."""
    if found.growth.power:
        yield Claim("noise", found.table.output, say.growth_words(*found.growth), found.growth.share)
    if not found.changes:
        if found.is_useful and not any(found.table.output in one.names for one in found.together):
            yield _no_change(found.visible, found.table)
        return
    shown = surest(found.changes, SHOWN)
    for change in shown:
        text = sentence(found.phrase(change))
        yield Claim("change", change.moved, text, change.since, change.interval, change.odds)
    if rest := found.alarms - len(shown):
        yield Claim("change", "others", say.more_changes_words(rest), rest)


def together_claims(found) -> Iterator[Claim]:
    """Claim what several columns have in common and changed at one date."""
    for one in found.together:
        text = together_words(one, found.table, found.origin)
        yield Claim("together", ", ".join(one.names), text, one.since, one.interval, one.odds)


def _no_change(visible, table) -> Claim:
    """Claim that nothing jumped by more than what would have been seen."""
    if visible is None:
        return Claim("change", "unknown", CHANGES_UNKNOWN)
    seen = {name: share for name, share in zip(table.inputs, visible.gains) if share < 1}
    value = {"level": visible.level, "noise": visible.noise, "gain": seen}
    return Claim("change", "none", say.no_change_words(visible.level, seen, visible.noise), value)


def forecast_claims(found) -> Iterator[Claim]:
    """Claim how much is predicted one step ahead, and how far the bands hold."""
    f = found.quoted
    if f.count:
        yield Claim("forecast", "fit", say.fit_sentence(f.fit, f.rmse, f.spread), f.fit)
        yield Claim("forecast", "band", say.band_sentence(f.coverage), 100 * f.coverage)


def note_claims(found) -> Iterator[Claim]:
    """Claim what the verdicts warn of."""
    for verdict in found.diagnosis.not_fine:
        yield Claim("note", verdict.name, f"Beware: {sentence(verdict.advice)}", verdict.value)


def choice_claims(found) -> Iterator[Claim]:
    """Claim why this model is shown."""
    chosen, best = found.chosen, found.rivals[0]
    if not found.is_judged:
        return
    is_close = chosen.evidence > best.evidence - CLOSE
    why = "most likely" if chosen is best else "as likely" if is_close else "follows"
    odds = math.exp(max(chosen.evidence - best.evidence, -700.0))
    text = say.choice_words(why, len(found.rivals), chosen.name, best.name)
    yield Claim("model choice", why, text, chosen.name, odds=odds)


def table_part(found) -> Iterator[Claim]:
    """Claim what the columns are, and what is odd in them."""
    yield from column_claims(found.table)
    yield from table_claims(found.table)
    yield from (Claim("table", "", text) for text in found.losses)


CLAIMS: tuple[Any, ...] = (
    reading_claims, plant_claims, season_claims, change_claims, together_claims, forecast_claims, note_claims,
    choice_claims, table_part,
)  # fmt: skip
