"""Clutter that is dense in places and stays there: a shore, wakes and reefs, and things that stand still.

A strip, a spot or a fixed thing returns so many plots a scan, spread around it. Fixed things return at most one, as an
object does, but not from one point: a pier is as long as many deviations, and what of it is seen differs from scan to
scan. (Musicki, Suvorova, Morelande and Moran 2005, "Clutter map and target tracking".)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .drawing import between

STRIPS, SPOTS, FIXED = 2, 3, 6  # of each, at most
RATE = 0.2, 4.0  # plots a scan of a strip or spot
STRIP, SPOT, THING = (3.0, 50.0), (5.0, 80.0), (2.0, 15.0)  # deviations of plots: their spread
RETURNS = 0.05, 0.7  # probability that a fixed thing is seen in a scan


class Patch(NamedTuple):
    """A line, or a point, around which plots of nobody lie (normal, ``spread`` in a coordinate)."""

    begin: tuple[float, float]  # m
    end: tuple[float, float]  # m
    spread: float  # m
    rate: float  # plots a scan
    is_single: bool = False  # at most one


def draw(rng, side: float, deviation: float) -> tuple[Patch, ...]:
    """Return the patches of a field of so many metres a side."""
    made = []
    for _ in range(rng.integers(0, STRIPS + 1)):
        begin, end = rng.uniform(0, side, (2, 2)).tolist()
        made.append(Patch((begin[0], begin[1]), (end[0], end[1]), deviation * between(rng, STRIP), between(rng, RATE)))
    for _ in range(rng.integers(0, SPOTS + 1)):
        at = tuple(rng.uniform(0, side, 2).tolist())
        made.append(Patch(at, at, deviation * between(rng, SPOT), between(rng, RATE)))
    for _ in range(rng.integers(0 if made else 1, FIXED + 1)):
        at = tuple(rng.uniform(0, side, 2).tolist())
        made.append(Patch(at, at, deviation * between(rng, THING), between(rng, RETURNS), True))
    return tuple(made)


def returns(rng, patch: Patch, scans: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the scan (n,) and the place (n, 2) of each plot of a patch."""
    counts = rng.random(scans) < patch.rate if patch.is_single else rng.poisson(patch.rate, scans)
    which = np.repeat(np.arange(scans), counts)
    along = rng.random((len(which), 1)) * np.subtract(patch.end, patch.begin)
    return which, patch.begin + along + patch.spread * rng.standard_normal((len(which), 2))
