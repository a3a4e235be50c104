"""Noise that grows with the level: of what is counted, earned or weighed, an error is a share rather than an amount."""

from __future__ import annotations

import math
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from .noise_jumps import NoiseJump, cut, noises
from .relative import Units
from .response import Response
from .response_record import long_run
from .seasonal_noise import REST, in_season, of_season
from .seasons import held

POWERS = 1.0, 0.5  # of the level: a share of it, as of prices, or the root of it, as of counts
WIDTH = 25  # samples either side, that a level is the mean of: that of the season, or that of the sample
LIKELIER = math.log(10.0)  # than all jumps: of a plant, louder noise is the commoner
RANGE = 1.5  # between the twentieth and the last but nineteenth part of the levels, at least


class Growth(NamedTuple):
    """The deviation as a share of the level on average, and as which power of it that grows; 0: it does not."""

    power: float
    share: float


STEADY = Growth(0.0, 0.0)
NONE = -math.inf, 0.0, np.ones(1)


def growth(now: Response, units: Units, seasons: tuple[int, ...] = ()) -> tuple[Growth, list[NoiseJump]]:
    """Return how the noise that is left grows with the level, and the jumps of it that remain.

    The level is what was expected of each sample. It does grow where that is ten times as likely as all jumps that
    constant noise would need. Only what stays above zero has such a level.
    Noise may come and go with one of ``seasons`` instead, in samples: then it does not grow, and jumps beside that.
    That of a logarithm does grow, where it is ten times as likely as constant noise of y.
    """
    steady, jumps = _of_logarithms(now, units) if units.is_relative else (STEADY, noises(now))
    r = now.unscaled
    if not jumps:
        return steady, jumps
    middle = units.y_middle / units.y_scale
    near, level = cut(r, now.record.floor), now.expected + middle
    by_level = [] if units.is_relative else _of_level(now, level, middle)
    shapes = [*by_level, *((0.0, of_season(now, s)) for s in held(seasons, len(now.used)))]
    gained, power, shape = max(((_gain(near, of), power, of) for power, of in shapes), key=itemgetter(0), default=NONE)
    if gained - math.log(max(len(shapes), 1)) < sum(jump.log_odds for jump in jumps) + LIKELIER:
        return steady, jumps
    usual = float(np.median(shape[shape > 0]))
    if not power:
        return steady, noises(now, in_season(r, shape / usual))
    share = 1.4826 * float(np.median(abs(near) / shape)) * usual / float(np.median(level))
    return Growth(power, share), noises(now, r / (shape / usual))


def _of_logarithms(now: Response, units: Units) -> tuple[Growth, list[NoiseJump]]:
    """Return how noise grows beside a response of the logarithm of y, and its jumps beside that."""
    level = units.at(now.expected) / units.y_scale
    r, (low, high) = now.unscaled * level, np.quantile(level, [0.05, 0.95])
    near, jumps = cut(now.unscaled, now.record.floor) * level, noises(now, r)
    gains = [(_gain(near, level**power), power) for power in POWERS] if high > RANGE * low else []
    gained, power = max(gains, default=(-math.inf, 0.0))
    if gained < sum(jump.log_odds for jump in jumps) + LIKELIER:
        return STEADY, jumps
    share = 1.4826 * float(np.median(abs(near) / level**power)) * float(np.median(level)) ** (power - 1)
    return Growth(power, share * units.y_scale / units.y_middle), noises(now, r / level**power)


def _of_level(now: Response, level, middle: float) -> list[tuple[float, np.ndarray]]:
    """Return powers of the level, and of its mean over the samples around, beside the power."""
    low, high = np.quantile(level, [0.05, 0.95])
    if not low > 0 or np.nanmin(now.record.y + middle) < 0 or high < RANGE * low:
        return []
    level = np.maximum(level, low / RANGE)
    around = np.convolve(np.pad(level, WIDTH, "edge"), np.full(2 * WIDTH + 1, 1 / (2 * WIDTH + 1)), "valid")
    return [(power, of**power) for power in POWERS for of in (level, around)]


def _gain(r, shape) -> float:
    """Return the log odds of noise of this shape against constant noise."""
    z = in_season(r, shape)
    seen = np.isfinite(z)
    square, shape, r = z[seen] ** 2, np.maximum(shape[seen], REST * shape.max()), r[seen]
    z = square / max(float(np.mean(square)), 1e-300) - 1
    gain = 0.5 * len(r) * math.log(float(np.mean(r * r)) / float(np.mean(square))) - float(np.sum(np.log(shape)))
    return gain / max(long_run(z) / 2, 1.0)
