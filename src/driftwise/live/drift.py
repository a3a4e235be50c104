"""`Drift`: parameters that move steadily, told once with their speed and since when."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..fleet.columns import Columns
from ..results.numbers import instant, lasting
from .history import FIRST_DATE

LOOK = 100  # samples between two looks at the estimates of a series
SCALES = 1, 16  # looks that are one of the quicker and of the slower judgement
RUN = 10  # looks in a row in which a parameter that drifts went the same way
FAR = 4.0  # deviations that it went in them
EVEN = 0.35  # of the way, at most, in one look: more is a jump
BACK = 3  # looks in a row the other way, after which a drift has ended
HOUR, DAY = 3600.0, 86400.0
FRESH = dict(value=np.nan, std=0.0, time=0.0, begin=np.nan, begin_std=0.0, begin_time=0.0, run=0.0, most=0.0, told=0.0)


class Drifting(NamedTuple):
    """A parameter that drifts: where it was, where it is, and when."""

    name: str
    begin: float
    begin_time: float
    value: float
    time: float

    @property
    def text(self) -> str:
        """What is told of it."""
        span = self.time - self.begin_time
        unit, size = next(one for one in (("day", DAY), ("hour", HOUR), ("s", 1.0)) if span >= one[1] or one[1] == 1.0)
        speed = (self.value - self.begin) / span * size if span > 0 else math.nan
        is_date = self.begin_time >= FIRST_DATE
        since = instant(self.begin_time, "1970-01-01T00:00:00" if is_date else None)
        return (
            f"{self.name} drifts by {speed:+.3g} per {unit} since {since} "
            f"(from {self.begin:.4g} to {self.value:.4g} in {lasting(span)})"
        )


class Drift(Columns):
    """How the estimates of each series have gone lately, looked at every 100 samples of it.

    A parameter drifts where it went one way in 10 looks in a row, by more than 4 deviations of where it began and where
    it is, and not the most of it at once; looked at every 100 samples and every 1600. It is told once, until it turns.
    ``value`` and ``std`` are of the last look, ``begin`` is where the run of looks began, ``most`` its largest step,
    and ``told`` the way in which it was told. Bad at: drifts that take less than 1000 samples, which come as jumps;
    those of more than 16 000 that stay below the error bars; memories that forget within 100 samples.
    """

    def __init__(self, parameters: list[str], size: int = 0):
        self.parameters = list(parameters)
        names = [f"{name} {scale} {i}" for name in FRESH for scale in SCALES for i in range(len(self.parameters))]
        repeats = len(SCALES) * len(self.parameters)
        super().__init__(dict(zip(names, np.repeat(list(FRESH.values()), repeats).tolist())), size)

    def look(self, row: int, number: int, time: float, theta, std) -> list[Drifting]:
        """Take the estimates of a series at its sample ``number``, a multiple of 100; return what is told to drift."""
        self.grow(row + 1)
        found: dict[str, Drifting] = {}
        table = self._numbers[:, row].reshape(len(FRESH), len(SCALES), len(self.parameters))
        for i, scale in enumerate(SCALES):
            if (number // LOOK) % scale == 0:
                one = dict(zip(FRESH, table[:, i]))
                way = _look(one, time, theta, std)
                for j in np.flatnonzero((way != 0.0) & (table[-1] != way).all(axis=0)).tolist():
                    name, table[-1, :, j] = self.parameters[j], way[j]
                    found[name] = Drifting(name, one["begin"][j], one["begin_time"][j], theta[j], time)
        self._numbers[:, row] = table.ravel()
        return list(found.values())


def _look(one: dict[str, np.ndarray], time: float, theta, std) -> np.ndarray:
    """Go on with the runs of all parameters, in place; return the way in which each drifts, 1, -1, or 0."""
    step = theta - one["value"]
    goes_on = np.sign(step) * np.sign(one["run"]) > 0
    begins = ~goes_on
    one["begin"][begins], one["begin_std"][begins] = one["value"][begins], one["std"][begins]
    one["begin_time"][begins], one["most"][begins] = one["time"][begins], 0.0
    one["run"][:] = np.where(np.isfinite(step), np.where(goes_on, one["run"], 0.0) + np.sign(step), 0.0)
    one["most"][:] = np.fmax(one["most"], np.abs(step))
    one["value"][:], one["std"][:], one["time"][:] = theta, std, time
    one["told"][(one["told"] * one["run"] < 0) & (np.abs(one["run"]) >= BACK)] = 0.0
    way = np.abs(theta - one["begin"])
    is_far = way > FAR * np.hypot(std, one["begin_std"])
    return np.where((np.abs(one["run"]) >= RUN) & is_far & (one["most"] <= EVEN * way), np.sign(one["run"]), 0.0)
