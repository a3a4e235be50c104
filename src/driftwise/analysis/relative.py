"""An output in its units, or by its logarithm: of what is counted, earned or weighed, all that moves it is a share."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .lost_inputs import completed
from .response import Response
from .response_record import Record, recorded

RANGE = 1.2  # between the twentieth and the last but nineteenth part of the outputs: below that both are the same
ROUND_OFF = 1e-9  # of the deviation of the output, which is none
LIKELIER = math.log(10.0)  # than units, what logarithms have to be: most of what is measured adds


class Units(NamedTuple):
    """What one of a record's outputs is in units of y, near the middle of these, and that; the same of inputs.

    ``is_relative`` : whether the record is of the logarithm of y
    """

    y_scale: float
    y_middle: float
    u_scale: np.ndarray
    u_middle: np.ndarray
    is_relative: bool = False

    @property
    def about(self) -> float | None:
        """The output at which what moves it moves it by as much as here; None where that is everywhere."""
        return self.y_middle if self.is_relative else None

    def size(self, step: float) -> float:
        """Return what a step of the record is in units of y, at the middle of these."""
        share = self.share(step)
        return self.y_scale * step if share is None else self.y_middle * share

    def share(self, step: float) -> float | None:
        """Return what a step is as a share of y; None in units."""
        return math.expm1(self.y_scale / self.y_middle * step) if self.is_relative else None

    def at(self, level: np.ndarray) -> np.ndarray:
        """Return what one is in units of y at each of some levels of the record."""
        share = self.y_scale / self.y_middle if self.is_relative else 0.0
        return self.y_scale * np.exp(share * level)


def read(y, u, events=()) -> tuple[Record, Units]:
    """Return a record of an output in its units, y (T,) and u (T, k)."""
    record, y_scale, y_middle, u_scale, u_middle = recorded(y, completed(y, u), events)
    return record, Units(y_scale, y_middle, u_scale, u_middle)


def read_relative(record: Record, units: Units) -> tuple[Record, Units] | None:
    """Return the same of the logarithm of the output; None where that is not above zero, or moves by too little."""
    y = units.y_middle + units.y_scale * record.y
    seen = y[np.isfinite(y)]
    low, high = np.quantile(seen, [0.05, 0.95])
    if not (seen.min() > ROUND_OFF * units.y_scale and high > RANGE * low):
        return None
    logs, scale, middle, *_ = recorded(np.log(y), record.u)
    at = math.exp(middle)
    floor = max(record.floor * units.y_scale / at / scale, logs.floor)
    return replace(record, y=logs.y, floor=floor), units._replace(y_scale=scale * at, y_middle=at, is_relative=True)


def misfit(found: list[Response], units: Units) -> float:
    """Return the least criterion of some responses, in units of y."""
    if not found:
        return math.inf
    y = found[0].record.y
    y = y[np.isfinite(y)]
    unit = 2 * float(np.log(units.at(y)).sum()) + 2 * LIKELIER * units.is_relative
    return min(one.dated_criterion for one in found) + unit
