"""Whether a track's plots are of an object, or of a thing that stands still: a pier, a reef, a wake.

    log odds that it moves     sum over plots of log p(z) - log t(z)
    log odds of a plain rest   log N(x; mu, ..) - log u,     x: the log variance about the mean place

p is the track's forecast, t that of a thing at one place whose plots scatter around it, mean and variance unknown:
Student's t in two dimensions, of the plots before (Gelman and others 2013, section 3.2). An object at rest scatters as
its sensor errs, which is known from objects that move (mu); a thing that is long or wide scatters by more (u, even).
"""

from __future__ import annotations

import math

import numpy as np

from ..estimators.track.bank import LOG, TRACK_SAMPLE, of_coordinate
from .live import PLOT, TENTATIVE, Live

LAST = 32  # plots that are looked at
KNOWN = 2  # plots from which a place and a variance are known
SHARPEST = 0.01  # of the forecast's variance: plots that repeat each other say no more
SURELY, EVERY = 4.0, 5  # log odds of an object that moves, whose errors are noted, at so many plots and their multiples
KEPT = 32  # such errors of a sensor
WIDTH = 8.0  # of log variances, among which those of things are even
VARIES = 2.0, 0.5  # errors of this variance from object to object are assumed, and count for so many
AT = TRACK_SAMPLE.slices(2)
SCORE, BASE = (slice(PLOT + AT[name].start, PLOT + AT[name].stop) for name in ("log_score", "base"))
LOGS = [of_coordinate(2, LOG, c) for c in range(2)]


def moving(rows: np.ndarray) -> float:
    """Return the log odds that the plots in a track's rows are of something that moves; 0 of two plots or fewer."""
    rows = rows[-LAST:]
    n = np.arange(KNOWN, len(rows))
    if not len(n):
        return 0.0
    place = rows[:, 1:3] - rows[0, 1:3]
    sums = np.cumsum(place, axis=0)[n - 1]
    squares = np.cumsum(np.sum(place**2, axis=1))[n - 1]
    dof = 2.0 * (n - 1)
    variance = (squares - np.sum(sums**2, axis=1) / n) / dof
    spread = np.maximum(variance, SHARPEST * np.mean(rows[KNOWN:, BASE], axis=1)) * (1 + 1 / n)
    off = np.sum((place[KNOWN:] - sums / n[:, None]) ** 2, axis=1)
    still = -np.log(2 * np.pi * spread) - (0.5 * dof + 1) * np.log1p(off / (dof * spread))
    return float(np.sum(rows[KNOWN:, SCORE]) - np.sum(still))


class Errors:
    """How much plots of a sensor err: log variances of objects that move, beside those stated, where any are."""

    def __init__(self):
        self.seen: dict[str, list[float]] = {}

    def note(self, track: Live) -> None:
        """Learn of a track that has another plot."""
        if track.status == TENTATIVE or track.count % EVERY or not moving(track.rows) > SURELY:
            return
        seen = self.seen.setdefault(track.last.sensor, [])
        seen.append(sum(track.state.item(i) for i in LOGS) / 2 - stated(track.rows))
        del seen[:-KEPT]

    def object(self, track: Live) -> float:
        """Return the log odds that a track is of an object, beside a thing that stands still."""
        return float(np.logaddexp(moving(track.rows), self.resting(track)))

    def resting(self, track: Live) -> float:
        """Return the log odds that it is an object at rest; 0 where nothing is known."""
        seen, rows = np.array(self.seen.get(track.last.sensor, ())), track.rows[-LAST:]
        if not len(seen) or len(rows) < KNOWN:
            return 0.0
        plots, varies = VARIES
        variance = (np.sum((seen - np.mean(seen)) ** 2) + plots * varies) / (len(seen) + plots) + 2 / (len(rows) - 1)
        square = np.mean(np.var(rows[:, 1:3], axis=0, ddof=1))
        if not square > 0.0:
            return 0.0
        off = max(math.log(square) - stated(rows) - float(np.mean(seen)), 0.0)  # things never scatter by less
        return float(math.log(WIDTH) - 0.5 * math.log(2 * math.pi * variance) - 0.5 * off**2 / variance)


def stated(rows: np.ndarray) -> float:
    """Return the log of the variance that is stated of a track's plots, 0 where none is."""
    told = rows[:, [3, 6]]
    return math.log(np.mean(told)) if np.isfinite(told).all() and np.mean(told) > 0 else 0.0
