"""What the bank promises on flights drawn like the recorded one: a seeded Monte Carlo, its claims at 99 %.

One record says little: medians of ten stretches of nine plots differ by .1 from flight to flight, and the bank's
forecasts are not white. So promises are made of drawn flights, and of the recording is asked whether it may be one of
them, by the rank of its number among theirs (Barnard 1963).
"""

from __future__ import annotations

from functools import cache
from itertools import count
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest, norm

from ..score.motions.drawing import draw
from ..score.motions.jets import alone
from ..score.motions.scene import Sensor
from ..score.motions.simulation import simulate
from .flight import CV, LENGTH, SHIPPED, Flight, tuned
from .recordings import LONG_RANGE, Series

FLIGHTS = 199  # so that one in a hundred is a whole number of ranks
DOUBT = 0.01  # of each claim: how often chance alone denies it
SEED = 40917
SENSOR = Sensor("A", 11.9, 160.0)  # s, m: of the recorded radar, as constant velocity tuned to it has them
PLOTS = 284
EARLY, LATER = slice(6, 15), slice(15, LENGTH)


class Drawn(NamedTuple):
    """A number or two of each drawn flight."""

    bank: np.ndarray  # (FLIGHTS,), the larger Ljung-Box(5) of both coordinates
    fixed: np.ndarray  # (FLIGHTS,), the same of constant velocity tuned in hindsight
    ratios: np.ndarray  # (FLIGHTS, 2), median error over constant velocity's in plots 6-14 and 15-49 of records of 50

    @property
    def is_whiter(self) -> bool:
        """Whether the bank is nearer to white than constant velocity on more flights than not."""
        less = int(np.sum(self.bank < self.fixed))
        return bool(binomtest(less, len(self.bank), 0.5, "greater").pvalue < DOUBT)

    @property
    def mean(self) -> np.ndarray:
        """The geometric mean of the ratios, (2,)."""
        return np.exp(np.mean(np.log(self.ratios), axis=0))

    @property
    def most(self) -> np.ndarray:
        """What the geometric mean of all such flights does not exceed, (2,): its upper bound at 99 %."""
        logs = np.log(self.ratios)
        return self.mean * np.exp(norm.isf(DOUBT) * logs.std(axis=0, ddof=1) / np.sqrt(len(logs)))


def rank(value: float, drawn: np.ndarray) -> float:
    """Return the share of flights, the recorded one with them, whose number is at least this."""
    return (1 + int(np.sum(drawn >= value))) / (1 + len(drawn))


@cache
def drawn(seed: int = SEED, flights: int = FLIGHTS) -> Drawn:
    """Return what the bank does on drawn flights without troubles, seen as the recorded one is."""
    numbers = (k for k in count() if draw(seed, k).name == "flight")
    found = [one(seed, next(numbers)) for _ in range(flights)]
    return Drawn(*(np.array(part) for part in zip(*found)))


def one(seed: int, number: int) -> tuple[float, float, np.ndarray]:
    """Return the numbers of one flight."""
    seen = simulate(alone(draw(seed, number))._replace(plots=PLOTS, sensors=(SENSOR,))).plots
    y = seen.position - seen.position[0]
    logs = tuned((CV,), [Series("", seen.time, y[:, i]) for i in range(2)], LONG_RANGE)
    flight = Flight(seen.time, y, LONG_RANGE, logs)
    bank, fixed = (flight.calibration(name)[3].max() for name in (SHIPPED, CV))
    return bank, fixed, np.median(learning(flight), axis=(0, 2))


def learning(flight: Flight) -> np.ndarray:
    """Return the bank's errors over those of constant velocity in records of 50: (records, windows, coordinates)."""
    return np.array([[piece.ratios(SHIPPED, CV, part) for part in (EARLY, LATER)] for piece in flight.cut()])
