"""Noise that grows with the level: of what is counted, earned or weighed, an error is a share rather than an amount."""

from __future__ import annotations

import math
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from .noise_jumps import CUT, NoiseJump, noises
from .response import Response
from .response_record import local_size, long_run

POWERS = 1.0, 0.5  # of the level: a share of it, as of prices, or the root of it, as of counts
WIDTH = 25  # samples either side, that a level is the mean of: that of the season, or that of the sample
LIKELIER = math.log(10.0)  # than all jumps: of a plant, louder noise is the commoner
RANGE = 1.5  # between the twentieth and the last but nineteenth part of the levels, at least


class Growth(NamedTuple):
    """The deviation as a share of the level on average, and as which power of it that grows; 0: it does not."""

    power: float
    share: float


STEADY = Growth(0.0, 0.0)


def growth(now: Response, middle: float) -> tuple[Growth, list[NoiseJump]]:
    """Return how the noise that is left grows with the level, and the jumps of it that remain.

    The level is what was expected of each sample; ``middle`` is what `now` counts y from. It does grow where that is
    ten times as likely as all jumps that constant noise would need. Only what stays above zero has such a level.
    """
    jumps, r = noises(now), now.left * now.sigma[now.rows]
    level = now.record.y[now.rows] - r + middle
    low, high = np.quantile(level, [0.05, 0.95]) if jumps else (0.0, 0.0)
    if not low > 0 or np.nanmin(now.record.y + middle) < 0 or high < RANGE * low:
        return STEADY, jumps
    level = np.maximum(level, low / RANGE)
    around = np.convolve(np.pad(level, WIDTH, "edge"), np.full(2 * WIDTH + 1, 1 / (2 * WIDTH + 1)), "valid")
    limit = CUT * local_size(r, now.record.floor)
    r = np.clip(r, -limit, limit)
    shapes = [(power, of**power) for power in POWERS for of in (level, around)]
    gained, power, shape = max(((_gain(r, shape), power, shape) for power, shape in shapes), key=itemgetter(0))
    if gained - math.log(len(shapes)) < sum(jump.log_odds for jump in jumps) + LIKELIER:
        return STEADY, jumps
    usual = float(np.median(shape))
    share = 1.4826 * float(np.median(abs(r) / shape)) * usual / float(np.median(level))
    return Growth(power, share), noises(now, shape / usual)


def _gain(r, shape) -> float:
    """Return the log odds of noise of this shape against constant noise."""
    square = (r / shape) ** 2
    z = square / max(float(np.mean(square)), 1e-300) - 1
    gain = 0.5 * len(r) * math.log(float(np.mean(r * r)) / float(np.mean(square))) - float(np.sum(np.log(shape)))
    return gain / max(long_run(z) / 2, 1.0)
