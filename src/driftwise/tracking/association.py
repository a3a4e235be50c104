"""Whose plots without keys are: those of one instant are shared out among the tracks at once, by likelihood ratios.

    gain of a pair      log P_D r p(z) / (beta(z) (1 - P_D r))      r: that the track is an object, still there

The pairs with the largest sum of gains are taken, none that is negative: a plot left over begins a track. p is the
forecast's density, tails included, and with a small probability anything that a manoeuvre leads to.
(Blackman and Popoli 1999, section 6.4.)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..estimators.track import bank
from .live import Live, Plot

AT = bank.TRACK_SAMPLE.slices(2)
BASE, SHARES, SPREADING, RARE, WIDER = (
    AT[name].start for name in ("base", "shares", "spreading", "unforeseen", "wider")
)
MANOEUVRES = 0.05, 0.5  # probability, and how far one leads away by the next plot, of what is fast for the class


class Pair(NamedTuple):
    """A plot that may be of a track."""

    gain: float
    plot: int
    track: Live
    odds: float  # of the track before the plot
    missed: float  # scans
    score: float  # log P_D p / beta


class Forecast:
    """Density of the next plot of a track."""

    def __init__(self, estimator, track: Live, time: float):
        nothing = np.full((1, 2), np.nan)
        out = estimator.run(track.state.copy(), np.array((time,)), nothing, nothing)[0]
        self.east, self.north = out[:2].tolist()
        base, shares = out[BASE : BASE + 2].tolist(), out[SHARES : SHARES + bank.TAILS].tolist()
        rare, wider = out.item(RARE), out[WIDER : WIDER + 2].tolist()
        self.says = all(0 < s < math.inf for s in base)  # something of the next plot
        if not self.says:
            return
        learnt = 1 - rare
        self.variances = [learnt * s * out.item(SPREADING) + rare * (s + more) for s, more in zip(base, wider)]
        turns, far = MANOEUVRES[0], (MANOEUVRES[1] * estimator.speed * (time - track.last.time)) ** 2
        self.mixtures = [
            [_normal(learnt * share, v * s) for share, v in zip(shares, bank.SCALES)] + [_normal(rare, s + more)]
            for s, more in zip(base, wider)
        ]
        a, b = base[0] + far, base[1] + far
        self.turned = turns / (2 * math.pi * math.sqrt(a * b)), -0.5 / a, -0.5 / b
        self.steady = 1 - turns

    def deviations(self, plot: Plot) -> float:
        """Return how many standard deviations a plot is off."""
        if not self.says:
            return math.inf
        a, b = self.variances
        return math.sqrt((plot.east - self.east) ** 2 / a + (plot.north - self.north) ** 2 / b)

    def log_density(self, plot: Plot) -> float:
        """Return the log density of a plot, per m^2."""
        if not self.says:
            return -math.inf
        e, n = (plot.east - self.east) ** 2, (plot.north - self.north) ** 2
        share, a, b = self.turned
        total = share * math.exp(max(a * e + b * n, -700.0))
        total += self.steady * _mixed(self.mixtures[0], e) * _mixed(self.mixtures[1], n)
        return math.log(total) if total > 0.0 else -math.inf


def _normal(share: float, variance: float) -> tuple[float, float]:
    return share / math.sqrt(2 * math.pi * variance), -0.5 / variance


def _mixed(mixture: list[tuple[float, float]], square: float) -> float:
    total = 0.0
    for height, rate in mixture:
        if rate * square > -40.0:
            total += height * math.exp(rate * square)
    return total


def best_pairs(pairs: list[Pair], plots: int) -> list[Pair | None]:
    """Return for each plot the pair that it is in where the sum of all gains is largest."""
    made: list[Pair | None] = [None] * plots
    by_plot: list[list[Pair]] = [[] for _ in range(plots)]
    by_track: dict[int, list[Pair]] = {}
    for pair in pairs:
        by_plot[pair.plot].append(pair)
        by_track.setdefault(pair.track.id, []).append(pair)
    done: set[int] = set()
    for first in range(plots):
        if first in done or not by_plot[first]:
            continue
        rows, columns, waiting = [], [], [first]
        done.add(first)
        while waiting:  # all that hangs together
            row = waiting.pop()
            rows.append(row)
            for pair in by_plot[row]:
                if pair.track.id not in columns:
                    columns.append(pair.track.id)
                    for other in by_track[pair.track.id]:
                        if other.plot not in done:
                            done.add(other.plot)
                            waiting.append(other.plot)
        if len(rows) == 1:
            made[first] = max(by_plot[first], key=lambda p: p.gain)
            continue
        rows.sort()
        gains, at = np.zeros((len(rows), len(columns))), {}
        for i, row in enumerate(rows):
            for pair in by_plot[row]:
                j = columns.index(pair.track.id)
                gains[i, j], at[i, j] = pair.gain, pair
        for i, j in zip(*linear_sum_assignment(gains, maximize=True)):
            made[rows[i]] = at.get((i, j))
    return made
