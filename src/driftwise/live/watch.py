"""What is watched in every series besides its model: sensors that are stuck or fall silent, and their return."""

from __future__ import annotations

import math

import numpy as np

from ..engine import compile
from ..fleet.columns import Columns
from ..fleet.events import RUNS

FRESH = dict(last=np.nan, run=0.0, longest=0.0, is_stuck=0.0, missing=0.0)
STUCK, BACK = 1.0, 2.0  # what `look` tells of a sample
OFTEN = 4.0  # times the longest run of equal outputs before, from which on another is no habit of the sensor
SILENT = RUNS["SILENT"][1]


class Watch(Columns):
    """Runs of equal and of missing outputs of each series.

    ``last`` output, ``run`` of equal ones under way, the ``longest`` before it, whether the sensor ``is_stuck``, and
    ``missing`` ones in a row. A sensor is stuck where ``least`` outputs in a row are equal, four times as many as ever
    before, and it has moved before: one with coarse steps often repeats itself. Bad at: plants that come to rest.
    """

    def __init__(self, least: int = 100, size: int = 0):
        super().__init__(FRESH, size)
        self.least = least

    def take(self, at, ys) -> np.ndarray:
        """Take outputs (n,) of rows ``at`` (n,), in order of time; return `STUCK`, `BACK` or 0 of each."""
        if not len(at):
            return np.zeros(0)
        self.grow(int(at.max()) + 1)
        told = np.zeros(len(at))
        loop = compile.function(look, 2, "index", 1, 1, 1, 1)
        loop(self._numbers, np.ascontiguousarray(at, np.int64), np.ascontiguousarray(ys), told,
             np.array([self.least, OFTEN]), np.array([float(SILENT)]))  # fmt: skip
        return told


def look(numbers, at, ys, told, limits, silent):
    """Tell of each output whether the sensor is stuck from here on, or back."""
    LAST, RUN, LONGEST, IS_STUCK, MISSING = 0, 1, 2, 3, 4
    for i in range(at.size):
        s = at[i]
        if math.isnan(ys[i]):
            numbers[MISSING, s] += 1.0
            continue
        if numbers[MISSING, s] >= silent[0]:
            told[i] = 2.0
        numbers[MISSING, s] = 0.0
        if ys[i] == numbers[LAST, s]:
            numbers[RUN, s] += 1.0
            is_long = numbers[RUN, s] >= limits[0] and numbers[RUN, s] > limits[1] * numbers[LONGEST, s]
            if limits[0] > 0.0 and is_long and numbers[LONGEST, s] > 0.0 and numbers[IS_STUCK, s] == 0.0:
                numbers[IS_STUCK, s] = 1.0
                told[i] = 1.0
        else:
            if numbers[IS_STUCK, s] > 0.0:
                told[i] = 2.0
            elif not math.isnan(numbers[LAST, s]):
                numbers[LONGEST, s] = max(numbers[LONGEST, s], numbers[RUN, s])
            numbers[IS_STUCK, s] = 0.0
            numbers[LAST, s] = ys[i]
            numbers[RUN, s] = 1.0
    return 0.0


def words(least: int) -> dict[float, tuple[str, str]]:
    """Return kind and sentence of what `look` tells."""
    return {STUCK: ("stuck", f"{least} equal outputs in a row"), BACK: ("back", "it measures again")}
