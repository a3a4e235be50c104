"""Records with a season that the clock suggests, or without: what is measured, and the forecast of who is told all.

Each kind draws (y, told, seasons): y (T,), NaN where missing; the forecast of who knows profiles, levels and parameters
but not the noise; and the seasons of the clock, in samples.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

MONTHS, HOURS, DAYS, QUARTERS = (12,), (24, 168), (7,), (96, 672)
World = tuple[np.ndarray, np.ndarray, tuple[int, ...]]
WORLDS: dict[str, Callable[[np.random.Generator], World]] = {}


def world(draw):
    """Enter a kind of records under its name."""
    WORLDS[draw.__name__] = draw
    return draw


def length(rng, low, high) -> int:
    """Draw a number of samples, evenly on a logarithmic scale."""
    return int(np.exp(rng.uniform(np.log(low), np.log(high))))


def profile(rng, s) -> np.ndarray:
    """Draw a season of s samples: some harmonics, some times of their own; mean 0, deviation 1."""
    t, harmonics = np.arange(s), int(rng.integers(1, max(2, min(5, s // 2))))
    p = sum(
        rng.standard_normal() / h * np.cos(2 * np.pi * h * t / s + rng.uniform(0, 6.3)) for h in range(1, 1 + harmonics)
    )
    p = p + rng.uniform(0, 0.7) * rng.standard_normal(s) if rng.random() < 0.5 else p
    return (p - p.mean()) / p.std()


def around(known, pole, e):
    """Return y and what is told of it: AR(1) noise about what is known."""
    noise = lfilter([1.0], [1.0, -pole], e)
    return known + noise, known + noise - e


@world
def steady_months(rng):
    """A season that stays, on a level, with noise of some memory."""
    T = length(rng, 100, 500)
    size, pole = 10 ** rng.uniform(-0.5, 0.8), rng.uniform(0, 0.9)
    season = size * np.resize(profile(rng, 12), T)
    y, told = around(20 + season, pole, rng.standard_normal(T))
    return y, told, MONTHS


@world
def growing_months(rng):
    """Passengers: a level that grows and wanders, a season in proportion to it."""
    T = length(rng, 100, 400)
    level = np.cumsum(rng.uniform(0, 0.012) + 10 ** rng.uniform(-2.3, -1.5) * rng.standard_normal(T))
    season = rng.uniform(0.05, 0.3) * np.resize(profile(rng, 12), T)
    e = 10 ** rng.uniform(-2, -1.2) * rng.standard_normal(T)
    known = np.exp(level + season)
    return 100 * known * np.exp(e), 100 * known, MONTHS


@world
def moving_months(rng):
    """A structural model: level and season walk."""
    T = length(rng, 120, 500)
    p, walk, season = 3 * profile(rng, 12), 10 ** rng.uniform(-1.5, -0.3), np.zeros(T)
    for t in range(T):
        p[t % 12] += walk * rng.standard_normal() * 12**0.5
        season[t] = p[t % 12]
    level = np.cumsum(10 ** rng.uniform(-1.5, 0) * rng.standard_normal(T))
    known = level + season
    return known + rng.uniform(0.2, 1) * rng.standard_normal(T), known, MONTHS


@world
def changing_months(rng):
    """A season whose size is another from somewhere on."""
    T = length(rng, 150, 500)
    size = np.where(np.arange(T) < T * rng.uniform(0.3, 0.8), 1.0, rng.choice([0.3, 0.5, 2.0, 3.0]))
    season = 3 * size * np.resize(profile(rng, 12), T)
    y, told = around(season, rng.uniform(0, 0.9), rng.standard_normal(T))
    return y, told, MONTHS


@world
def no_months(rng):
    """Months without a season: a walk, or noise of one or two poles."""
    T = length(rng, 100, 500)
    y, told = around(np.zeros(T), rng.choice([0.0, 0.5, 0.9, 1.0]), rng.standard_normal(T))
    second = rng.uniform(-0.5, 0.5)
    e = y - told
    y = lfilter([1.0], [1.0, -second], y)
    return y, y - e, MONTHS


def load(rng, T, day, week):
    """Draw a load by day and week: days of the week of different height and shape."""
    working, resting = 3 + profile(rng, day), 3 + profile(rng, day) * rng.uniform(0.3, 1)
    height = np.ones(7) if rng.random() < 0.3 else np.r_[rng.uniform(0.9, 1.1, 5), rng.uniform(0.5, 1, 2)]
    days = [h * (working if d < 5 else resting) for d, h in enumerate(height)]
    return np.resize(np.concatenate(days), T) if week else np.resize(working, T)


@world
def hours(rng):
    """An hourly load: day and week, noise of a long memory, a slow level; some hours missing."""
    T = length(rng, 800, 4000)
    known = load(rng, T, 24, rng.random() < 0.7)
    known = known * (1 + rng.uniform(0, 0.3) * np.sin(2 * np.pi * np.arange(T) / 8766 + rng.uniform(0, 6)))
    y, told = around(known, rng.uniform(0.5, 0.98), 10 ** rng.uniform(-1.3, -0.3) * rng.standard_normal(T))
    y[rng.random(T) < rng.choice([0, 0, 0.02, 0.2])] = np.nan
    return y, told, HOURS


@world
def no_hours(rng):
    """Hours without a season."""
    T = length(rng, 800, 3000)
    y, told = around(np.zeros(T), rng.choice([0.5, 0.9, 0.99, 1.0]), rng.standard_normal(T))
    return y, told, HOURS


@world
def days(rng):
    """Visits of a page: a week, a slow level, days that stand out."""
    T = length(rng, 200, 1500)
    level = 5 + np.cumsum(10 ** rng.uniform(-2.5, -1.3) * rng.standard_normal(T))
    known = level + rng.uniform(0.1, 0.8) * np.resize(profile(rng, 7), T)
    e = rng.uniform(0.05, 0.3) * rng.standard_normal(T)
    e[rng.random(T) < rng.choice([0, 0.02])] *= 6
    y, told = around(known, rng.uniform(0, 0.8), e)
    y[rng.random(T) < rng.choice([0, 0, 0.1])] = np.nan
    return y, told, DAYS


@world
def no_days(rng):
    """Days without a week."""
    T = length(rng, 200, 1500)
    y, told = around(np.zeros(T), rng.choice([0.0, 0.5, 0.9, 1.0]), rng.standard_normal(T))
    return y, told, DAYS


@world
def quarters(rng):
    """Quarter hours of a house: a day, noise of a long memory."""
    T = length(rng, 1000, 4000)
    size = 10 ** rng.uniform(-0.7, 0.7)
    y, told = around(size * load(rng, T, 96, False), rng.uniform(0.5, 0.98), 0.3 * rng.standard_normal(T))
    return y, told, QUARTERS
