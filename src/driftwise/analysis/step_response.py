"""How a model answers a step of an input: when 63 % of it is done, whether it overshoots, how far that is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..models.filtering import linear_filter

DRAWS = 200  # of the parameters, from their posterior
LONGEST = 4000  # samples until which a response is followed
SETTLED = 8.0  # time constants of the slowest mode after which it is over
DONE = 1 - math.exp(-1)  # share of the way that a plant of first order has gone after its time constant
OVERSHOOT = 0.05  # of the way, beyond which a response swings


class StepResponse(NamedTuple):
    """In samples, with 95 % intervals; the overshoot as a share of the way, its low end."""

    time: float
    interval: tuple[float, float]
    overshoot: float


def step_responses(model) -> list[StepResponse | None]:
    """Return the answer to a step of each input; None where it has no end that is known.

    Poles that a model needs for its noise, and pairs of poles and zeros that cancel, hardly matter here: what is read
    off is the response itself. Bad at: plants that first go the wrong way, of which the first crossing is told.
    """
    whole = getattr(model, "common", model)
    return answers([whole.form.polynomials(theta) for theta in (whole.values, *whole.samples[:DRAWS])])


def answers(drawn) -> list[StepResponse | None]:
    """Return the same of polynomials (A, B of each input), the likeliest first, then draws of them."""
    a, b = drawn[0]
    slowest = max((float(abs(p)) for p in np.roots(a)), default=0.0)
    if not slowest < 1:
        return [None] * len(b)
    length = int(min(10 + SETTLED / -math.log(max(slowest, 1e-3)) + max(map(len, [a, *b])), LONGEST))
    found = np.array([_answers(one, length) for one in drawn])  # (1 + draws, k, 2)
    return [_summary(found[:, i]) for i in range(len(b))]


def _answers(polynomials, length: int) -> np.ndarray:
    """Return time and overshoot of the response to each input, NaN where it does not settle."""
    a, b = polynomials
    found = np.full((len(b), 2), np.nan)
    if np.any(abs(np.roots(a)) >= 1):
        return found
    for i, row in enumerate(b):
        gain = row.sum() / a.sum()
        y = linear_filter(row, a, np.ones(length)) / gain if gain else np.zeros(length)
        at = int(np.argmax(y >= DONE))
        if y[at] >= DONE:
            before = y[at - 1] if at else 0.0
            found[i] = max(at - 1 + (DONE - before) / (y[at] - before), 0.0), y.max() - 1
    return found


def _summary(found) -> StepResponse | None:
    (time, _), known = found[0], found[np.isfinite(found[:, 0])]
    if not np.isfinite(time) or len(known) < 0.95 * len(found):
        return None
    (low, high), overshoot = np.quantile(known[:, 0], [0.025, 0.975]), np.quantile(known[:, 1], 0.025)
    return StepResponse(float(time), (float(min(low, time)), float(max(high, time))), float(overshoot))
