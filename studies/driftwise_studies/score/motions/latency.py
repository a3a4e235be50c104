"""How old positions are when they are stamped: what receivers, networks and stations between them do.

An aircraft's position comes by a transponder that repeats its last fix, from ground stations with latencies of their
own, or is solved from several stations' messages some time after. Who stamps it on arrival sees it behind by its speed
times that age. Each way is a function (rng, times (T,), whether the object slows down (T,)) -> ages (T,), s.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .drawing import between

LATENCY = 0.3, 1.3  # s
APART = 10.0, 100.0  # s between two positions that come late, in the mean, of a scene ..
FEWEST = 10.0  # .. and plots, at least
CAUGHT_UP = 0.5, 3.0  # s until a position that was late is of now again
LASTING = 5.0, 60.0  # s that a run of late ones lasts
WANDERING = 0.1  # s, what a latency changes by in a second
DWELLING = 1.0, 30.0  # plots from one station in a row, in the mean
SLOWING = 0.1, 0.3  # share of the late ones in a descent: of what slows down, and is near the ground
ROUNDED = 0.1, 1.0  # s, of the clock that stamps


def begins(rng, time) -> np.ndarray:
    """Return at which plots something begins, that does so once in a while."""
    scan = float(np.median(np.diff(time)))
    return 3 + np.flatnonzero(rng.random(len(time) - 3) < 1.0 / max(between(rng, APART) / scan, FEWEST))


def single(rng, time, slows) -> np.ndarray:
    """One plot now and then comes late."""
    old, late = np.zeros(len(time)), begins(rng, time)
    old[late] = rng.uniform(*LATENCY, len(late))
    return old


def fading(rng, time, slows) -> np.ndarray:
    """A queue is worked off: one comes late, the next less so."""
    old = np.zeros(len(time))
    for k in begins(rng, time):
        age = rng.uniform(*LATENCY) * (1.0 - (time - time[k]) / rng.uniform(*CAUGHT_UP))
        old = np.maximum(old, np.where(time >= time[k], age, 0.0))
    return old


def drifting(rng, time, slows) -> np.ndarray:
    """For some time all come late, by a latency that changes slowly."""
    old = np.zeros(len(time))
    steps = WANDERING * np.sqrt(np.diff(time, prepend=time[0])) * rng.standard_normal(len(time))
    for k in begins(rng, time):
        run = (time >= time[k]) & (time < time[k] + between(rng, LASTING)) & (old == 0.0)
        old[run] = np.clip(rng.uniform(*LATENCY) + np.cumsum(steps[run]), *LATENCY)
    return old


def stations(rng, time, slows) -> np.ndarray:
    """Two ground stations in turn, each with a latency of its own."""
    fresh = rng.uniform(0.0, LATENCY[0])
    latencies = np.array([fresh, fresh + rng.uniform(*LATENCY) - 0.5 * LATENCY[0]])
    changes = rng.random(len(time)) < 1.0 / between(rng, DWELLING)
    return latencies[(np.cumsum(changes) + int(rng.integers(2))) % 2]


def descent(rng, time, slows) -> np.ndarray:
    """Single ones come late, most of them where the object slows down."""
    late = rng.random(len(time)) < between(rng, SLOWING) * slows
    return np.where(late, rng.uniform(*LATENCY, len(time)), single(rng, time, slows))


def rounded(rng, time, slows) -> np.ndarray:
    """Stamps are those of a coarse clock."""
    return rng.uniform(0.0, between(rng, ROUNDED), len(time))


WAYS: dict[str, Callable] = {
    "single": single, "fading": fading, "drifting": drifting, "stations": stations, "descent": descent,
    "rounded": rounded,
}  # fmt: skip
