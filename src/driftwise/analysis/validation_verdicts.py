"""The tests of a validation as verdicts: each says what is wrong with the model, and the remedy."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..results.sentences import (
    colour_words,
    computed_words,
    delay_words,
    echo_words,
    feedback_words,
    loop_words,
    missing_lag_words,
    squares_words,
)  # fmt: skip
from ..results.verdicts import Verdict
from .delays import SURE, DelayScan, longest_delay
from .forecast_verdicts import LEVEL, whiteness_verdict
from .residual_tests import LAGS, Correlated, echoed, feedback, is_computed, missing_lags, squares

GAIN = 0.005  # of the squared residuals: what another delay takes off at least


class Residuals(NamedTuple):
    """What the tests look at: scaled innovations of the settled filter, the record, the equation, its noise filter."""

    z: np.ndarray  # (T,); NaN where there is none, or the filter had not settled
    y: np.ndarray
    u: np.ndarray  # (T, k)
    prediction: np.ndarray
    orders: tuple[int, tuple[int, ...], tuple[int, ...]]  # na, nb, nk of A y = B u + e after the filter
    filtered: tuple[np.ndarray, np.ndarray]  # y and u after it
    names: tuple[str, ...]  # of the inputs
    for_colour: str  # what to try where they are not white


class Tested(NamedTuple):
    """Verdicts, and the correlations behind them by the name of a verdict."""

    verdicts: list[Verdict]
    correlated: dict[str, Correlated]


def judge_residuals(r: Residuals, level: float = LEVEL) -> Tested:
    """Return the verdicts on residuals: autocorrelation, delay, missing lags, feedback, squares."""
    from ..results.whiteness import Correlations

    white = Correlations().add(r.z)
    found = [whiteness_verdict(white.whiteness, white.count)._replace(name="autocorrelation")]
    correlated: dict[str, Correlated] = {}
    answers = feedback(r.y, r.u, level, [delay > 0 for delay in r.orders[2]])
    backward = [(_feedback(r, i, back), back) for i, back in enumerate(answers)]
    in_loop = tuple(not verdict.is_fine for verdict, _ in backward)
    delays = _delays(r, in_loop) if r.names else []
    for i, name in enumerate(r.names):
        lags = max(LAGS, longest_delay(r.y))
        left = missing_lags(r.z, r.u[:, i], lags, level)
        of = f" of {name}" if len(r.names) > 1 else ""
        correlated |= {f"missing lag{of}": left, f"feedback{of}": backward[i][1]}
        some = delays[i], _missing(left, r, i, not delays[i].is_fine, in_loop[i]), backward[i][0]
        found += [verdict._replace(name=verdict.name + of) for verdict in some]
    found.append(_squares(r, level))
    if not found[0].is_fine:
        others = [v.name for v in found[1:] if not v.is_fine]
        found[0] = found[0]._replace(advice=colour_words(white.whiteness.p_value, others, r.for_colour))
    return Tested(found, correlated)


def _delays(r: Residuals, in_loop: tuple[bool, ...]) -> list[Verdict]:
    """Return a verdict on the delay of each input; that both go together at once in a loop is no delay."""
    (na, nb, nk), most = r.orders, longest_delay(r.y)
    limits, found = (-math.inf, SURE + math.log(max(most, 1))), []
    scan = DelayScan(*r.filtered, na, nb, max(most, *nk)) if most > 1 else None
    if scan is None or not scan.is_enough:
        return [Verdict("delay", math.nan, limits, True, "too few samples to tell the delay") for _ in r.names]
    best = scan.best(nk, tuple(int(fed and said > 0) for fed, said in zip(in_loop, nk)))
    for i, name in enumerate(r.names):
        said = (*best[:i], nk[i], *best[i + 1 :])  # the others as they are best
        odds, gain = scan.odds(said, best), 1 - scan.left(best) / scan.left(said)
        is_fine = odds <= limits[1] or gain < GAIN
        found.append(Verdict("delay", odds, limits, is_fine, delay_words(name, nk[i], best[i], odds, is_fine)))
    return found


def _missing(left: Correlated, r: Residuals, i: int, is_late: bool, in_loop: bool) -> Verdict:
    limits, name = (0.0, left.limit), r.names[i]
    if not left.is_known:
        return Verdict("missing lag", math.nan, limits, True, f"{name} moves too seldom to tell")
    _, nb, nk = r.orders
    is_fine = left.largest <= left.limit
    if not is_fine and in_loop and left.without(0) <= left.limit:
        return Verdict("missing lag", left.without(0), limits, True, loop_words(name))
    words = missing_lag_words(name, left.at, is_fine, nk[i], nb[i], is_late)
    return Verdict("missing lag", left.largest, limits, is_fine, words)


def _feedback(r: Residuals, i: int, back: Correlated) -> Verdict:
    name, limits, is_fine = r.names[i], (0.0, back.limit), back.largest <= back.limit
    if is_computed(r.y, r.u[:, i]):
        return Verdict("feedback", math.inf, limits, False, computed_words(name))
    if not back.is_known:
        return Verdict("feedback", math.nan, limits, True, f"{name} moves too seldom to tell")
    if is_fine and len(r.names) == 1 and (odds := echoed(r.y, r.u[:, i])) > SURE:
        return Verdict("feedback", odds, (-math.inf, SURE), False, echo_words(name))
    words = feedback_words(name, back.at, back.without(0) > back.limit, is_fine)
    return Verdict("feedback", back.largest, limits, is_fine, words)


def _squares(r: Residuals, level: float) -> Verdict:
    lags = max(r.orders[1], default=0)
    statistic, limit, degrees = squares(r.z, r.y, r.u, r.prediction, r.orders[2], max(lags, 2), level)
    if not degrees:
        advice = "the inputs have two values only, or too little was measured: a square law would not show"
        return Verdict("nonlinearity", math.nan, (0.0, limit), True, advice)
    is_fine = statistic <= limit
    share = statistic / max(int(np.isfinite(r.z).sum()), 1)
    return Verdict("nonlinearity", statistic, (0.0, limit), is_fine, squares_words(is_fine, share))
