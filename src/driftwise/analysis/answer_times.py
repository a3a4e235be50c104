"""How long a plant takes to answer before and after it became faster or slower, and how far that is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..models.quantities import NORMAL_95
from .effects import deviations, is_known, polynomials
from .response import Response
from .response_covariance import covariance, without_end
from .speeds import pieces
from .step_response import DRAWS, answers


class Span(NamedTuple):
    """Samples after which 63 % of the answer to a step is done, and the 95 % interval."""

    time: float
    low: float
    high: float


class Slowed(NamedTuple):
    """Of which input the answer is told, how long it takes before and after, and how much longer it became.

    ``input`` is -1 where of none both are known: then only the factor of all time constants, with its interval, is; or
    of the slowest alone.
    """

    input: int
    before: Span | None
    after: Span | None
    factor: float
    interval: tuple[float, float]
    is_alone: bool


def slowed_by(now: Response, j: int) -> Slowed:
    """Return what the j-th change of its speed does to the answers of a response: of the input known best."""
    n, own, at = len(now.a), len(now.a) + now.b.size, now.placed()["speeds"]
    speeds = np.arange(own + at.start, own + at.stop)
    every, P = np.concatenate([np.arange(own), speeds]), covariance(now)
    v = float(now.theta[speeds[j]])
    if not np.isfinite(P).all():
        return Slowed(-1, None, None, math.exp(-v), (0.0, math.inf), now.is_alone)
    std = math.sqrt(P[speeds[j], speeds[j]])
    between = math.exp(-v - NORMAL_95 * std), math.exp(-v + NORMAL_95 * std)
    factor = Slowed(-1, None, None, math.exp(-v), between, now.is_alone)
    drawn = now.theta[every] + np.vstack([np.zeros(len(every)), deviations(P[np.ix_(every, every)], DRAWS)])
    a, b = polynomials(now, drawn[:, :own])
    k = [piece.first for piece in now.stretches].index(now.speeds[j])
    stretches = [pieces(one, now.speeds, values, now.is_alone) for one, values in zip(a, drawn[:, own:])]
    before, after = (answers(np.array([each[m].a for each in stretches]), b) for m in (k - 1, k))
    endless, best, least = without_end(now, P), factor, math.inf
    for i, pair in enumerate(zip(before, after)):
        if n and not endless[i] and all(step and step.time > 0 and is_known(step.interval) for step in pair):
            spans = [Span(step.time, *step.interval) for step in pair if step]
            width = max((one.high - one.low) / one.time for one in spans)
            if width < least:
                best, least = factor._replace(input=i, before=spans[0], after=spans[1]), width
    return best
