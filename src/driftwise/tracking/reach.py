"""How far an object can have come from one plot to the next, and how far plots may err."""

from __future__ import annotations

import math

import numpy as np

from ..estimators.track.bank import GRAIN, LOG, of_coordinate
from .live import Live, Plot

LOGS, GRAINS = ([of_coordinate(2, what, c) for c in range(2)] for what in (LOG, GRAIN))  # in a state
ACROSS = 1e-4  # of a step in a row or column of a lattice: what leads out of it is no more
LONGEST = 20.0  # s of what is fast: such a step is no longer


def reaches(a: Plot, b: Plot, fastest: float, allowance: float) -> bool:
    """Say whether one object can give both plots: within its speed, or by a step of the lattice that both lie on."""
    far, within = math.hypot(b.east - a.east, b.north - a.north), fastest * (b.time - a.time)
    return far <= within + allowance or far <= within + step(a, b, fastest)


def step(a: Plot, b: Plot, fastest: float) -> float:
    """Return the step between two plots in one row or column of a lattice, m; 0 where they share none."""
    east, north = abs(b.east - a.east), abs(b.north - a.north)
    along = max(east, north)
    return along if min(east, north) <= ACROSS * along and along <= LONGEST * fastest else 0.0


def error(track: Live) -> float:
    """Return how far a plot of a track may be off, m: its standard deviation, or the step of its lattice."""
    of = track.state.item
    return max(float(np.exp(0.5 * max(of(LOGS[0]), of(LOGS[1])))), of(GRAINS[0]), of(GRAINS[1]))


def miss(track: Live, plot: Plot) -> float:
    """Return how far a plot lies from where a track would be by now, m."""
    past, last = plot.time - track.sure.time, track.sure
    return math.hypot(plot.east - last.east - past * track.motion[0], plot.north - last.north - past * track.motion[1])
