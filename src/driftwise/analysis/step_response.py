"""How a model answers a step of an input: when 63 % of it is done, whether it overshoots, how far that is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..models.filtering import many_filters

DRAWS = 200  # of the parameters, from their posterior
LONGEST = 4000  # samples until which a response is followed
SETTLED = 8.0  # time constants of the slowest mode after which it is over
DONE = 1 - math.exp(-1)  # share of the way that a plant of first order has gone after its time constant
OVERSHOOT = 0.05  # of the way, beyond which a response may swing


class StepResponse(NamedTuple):
    """In samples, with its 95 % interval; as shares of the way, low ends: overshoot and what comes back behind it."""

    time: float
    interval: tuple[float, float]
    overshoot: float
    rebound: float

    @property
    def swings(self) -> bool:
        """Whether it goes over its end and comes back behind it: a direct part that dies out does the one alone.

        A pair of poles comes back by the square of what it overshot by.
        """
        return self.overshoot > OVERSHOOT and self.rebound > OVERSHOOT**2


def step_responses(model) -> list[StepResponse | None]:
    """Return the answer to a step of each input; None where it has no end that is known.

    Poles that a model needs for its noise, and pairs of poles and zeros that cancel, hardly matter here: what is read
    off is the response itself. Bad at: plants that first go the wrong way, of which the first crossing is told.
    """
    whole = getattr(model, "common", model)
    return answers(*whole.form.polynomials(np.vstack([whole.values, whole.samples[:DRAWS]])))


def answers(a, b) -> list[StepResponse | None]:
    """Return the same of polynomials A (1 + draws, n + 1) and B (1 + draws, k, lags), the likeliest first."""
    sizes = np.abs(poles(a)).max(axis=1, initial=0.0)
    if not sizes[0] < 1:
        return [None] * b.shape[1]
    length = 10 + SETTLED / -math.log(max(sizes[0], 1e-3)) + max(a.shape[1], b.shape[2])
    one, dies_out = np.ones(int(min(length, LONGEST))), sizes < 1
    found = np.full((len(a), 3), np.nan)  # time, overshoot and rebound, NaN where it does not settle
    steps = []
    for i in range(b.shape[1]):
        found[dies_out] = _answers(a[dies_out], b[dies_out, i], one)
        steps.append(_summary(found))
    return steps


def poles(a) -> np.ndarray:
    """Return the roots of polynomials (S, n + 1) that begin with one, (S, n)."""
    a = np.asarray(a, float)
    companion = np.tile(np.eye(a.shape[1] - 1, k=-1), (len(a), 1, 1))
    companion[:, :1] = -a[:, None, 1:]
    return np.linalg.eigvals(companion)


def _answers(a, b, one) -> np.ndarray:
    """Return time, overshoot and rebound of each response to a step, (S, 3), NaN where it does not get there."""
    gain = b.sum(axis=1) / a.sum(axis=1)
    y = many_filters(b, a, one) / np.where(gain, gain, np.inf)[:, None]
    draws, at = np.arange(len(y)), np.argmax(y >= DONE, axis=1)
    last, before = y[draws, at], np.where(at, y[draws, at - 1], 0.0)
    is_done = last >= DONE
    time = at - 1 + (DONE - before) / np.where(is_done, last - before, 1.0)
    is_after = np.arange(y.shape[1]) >= np.argmax(y, axis=1)[:, None]
    rebound = 1 - np.min(y, axis=1, where=is_after, initial=1.0)
    return np.where(is_done[:, None], np.column_stack([np.maximum(time, 0.0), y.max(axis=1) - 1, rebound]), np.nan)


def _summary(found) -> StepResponse | None:
    time, known = found[0, 0], found[np.isfinite(found[:, 0])]
    if not np.isfinite(time) or len(known) < 0.95 * len(found):
        return None
    low, high = np.quantile(known[:, 0], [0.025, 0.975])
    overshoot, rebound = np.quantile(known[:, 1:], 0.025, axis=0).tolist()
    return StepResponse(float(time), (float(min(low, time)), float(max(high, time))), overshoot, rebound)
