"""How dense plots of nobody are around a place: anywhere in the field at first, locally where plots say so.

    disc of area A, seen in S scans, n plots in it      beta = (a + n) / (a / beta' + S A),   beta': the larger disc's

beta is Poisson's rate per scan and m^2 with a gamma prior of shape a whose mean is that of the larger disc: where few
plots are it is what it is around, where many were it is theirs. A plot counts as much as it is likely that its track
is no object. (Clutter maps: Musicki, Suvorova, Morelande and Moran 2005; the chain of priors: Gelman and others 2013,
chapter 5.)
"""

from __future__ import annotations

import math

import numpy as np

from .live import Live, Plot

REMEMBERED = 100, 1024  # scans, and plots, of nobody
SHAPE = 4.0  # plots that a disc about counts for
SHRINK, DISCS = 0.5, 24  # of the radius from one disc to the next, and how many there are at most
DENSEST = 100.0  # times as dense as in all the field: objects not yet known lie among plots of nobody, too
EVEN = 0.5  # plots in all the field that are assumed


class Clutter:
    """The last plots that were of no known object.

    Time, East, North, the track that each began or went to, and the probability that this is no object.
    """

    def __init__(self):
        self.table = np.empty((0, 5))

    def append(self, plot: Plot, track: Live) -> None:
        """Keep a plot of a track that may be none."""
        row = (plot.time, plot.east, plot.north, float(track.id), 1.0 - chance(track.odds))
        self.table = np.concatenate([self.table[-REMEMBERED[1] + 1 :], [row]])

    def weigh(self, track: Live) -> None:
        """Let the plots of a track count as its odds say by now."""
        self.table[self.table[:, 3] == track.id, 4] = 1.0 - chance(track.odds)

    def remove(self, track: Live) -> None:
        """Drop the plots of a track that is an object after all."""
        self.table = self.table[self.table[:, 3] != track.id]

    def since(self, begun: float, time: float, scan: float) -> tuple[np.ndarray, float]:
        """Return the plots that are not too old at a time, and how many scans they are of."""
        scans = min(REMEMBERED[0], (time - begun) / scan)
        self.table = self.table[self.table[:, 0] >= time - REMEMBERED[0] * scan]
        if len(self.table) == REMEMBERED[1]:
            scans = min(scans, (time - float(self.table[0, 0])) / scan)
        return self.table, max(scans, 1.0)


class Density:
    """Density of plots of nobody, per scan and m^2."""

    def __init__(self, nobody: np.ndarray, scans: float, field: float):
        self.place, self.who, self.weight = nobody[:, 1:3], nobody[:, 3], nobody[:, 4]
        self.owners = set(self.who.tolist())
        self.scans, self.field = scans, field
        radius = math.sqrt(field / math.pi) * SHRINK ** np.arange(1.0, DISCS)
        self.squares = radius**2
        self.seen = (math.pi * scans * self.squares).tolist()

    def at(self, plot: Plot) -> Around:
        """Return the density around a plot."""
        off = self.place - (plot.east, plot.north)
        return Around(self, off[:, 0] ** 2 + off[:, 1] ** 2)


class Around:
    """Density of plots of nobody around one place."""

    def __init__(self, whole: Density, square: np.ndarray):
        self.whole, self.square = whole, square
        self.all = self._log(square, whole.weight)

    def beside(self, track: Live) -> float:
        """Return the log density but for the plots of a track itself."""
        if track.id not in self.whole.owners:
            return self.all
        others = self.whole.who != track.id
        return self._log(self.square[others], self.whole.weight[others])

    def _log(self, square: np.ndarray, weight: np.ndarray) -> float:
        whole, order = self.whole, np.argsort(square)
        upto = np.concatenate([[0.0], np.cumsum(weight[order])])
        even = beta = (upto[-1] + EVEN) / (whole.field * whole.scans)
        inside = upto[np.searchsorted(square[order], whole.squares)]
        for n, seen in zip(inside.tolist(), whole.seen):
            if n == 0.0 and seen * beta < 1e-3:
                break
            beta = (SHAPE + n) / (SHAPE / beta + seen)
        return math.log(min(beta, DENSEST * even))


def chance(odds: float) -> float:
    """Return the probability that log odds say."""
    return 1.0 / (1.0 + math.exp(-odds)) if odds > -700.0 else 0.0
