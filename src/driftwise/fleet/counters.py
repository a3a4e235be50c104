"""`Tally`: what a fleet's samples amount to, series by series, in memory that does not grow with their number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..engine import compile
from ..engine.status import Status
from ..models.quantities import NORMAL_95
from .columns import Columns

COUNTED = {  # status bits that are counted as they are
    "missing": Status.MISSING_OUTPUT,
    "rejected": Status.REJECTED,
    "outliers": Status.OUTLIER,
    "jumps": Status.JUMP,
    "noise": Status.NOISE,
    "lost": Status.LOST,
}
UNUSED = ("late", "duplicate", "timeless", "early")  # rows of the table that are no samples, by the reason why
SUMS = ("scored", "z2", "inside", "compared", "e2", "dy2", "y1", "y2")
LAST = ("first_time", "last_time", "last_jump", "last_y")
CLOCK = ("gaps", "step", "votes")  # they stand behind all others
COLUMNS = ("samples", "measured", "bad", "filled", "jumped", *UNUSED, *COUNTED, *SUMS, *LAST)
FEW = 30  # samples scored, or compared, that make a verdict
GAP = 1.5  # usual steps of the clock from which on one is a gap
REJECTED, SET_ASIDE, JUMP = int(Status.REJECTED), int(Status.REJECTED | Status.OUTLIER), int(Status.JUMP)
BITS = np.array([int(bit) for bit in COUNTED.values()])
FIRST_BIT = COLUMNS.index(next(iter(COUNTED)))
SAMPLES, MEASURED, BAD, FILLED = map(COLUMNS.index, ("samples", "measured", "bad", "filled"))
SCORED, Z2, INSIDE, COMPARED, E2, DY2, Y1, Y2 = map(COLUMNS.index, SUMS)
FIRST_TIME, LAST_TIME, LAST_JUMP, LAST_Y = map(COLUMNS.index, LAST)


class Tally(Columns):
    """Counts and sums of each series of a fleet, in the order of ``fleet.keys``: ``tally["late"]`` is (S,).

    | column | is |
    |---|---|
    | samples | taken, gaps that were filled included |
    | measured | of them, with an output that could be compared to its prediction |
    | missing, rejected, outliers, jumps, noise, lost | outputs whose status says so |
    | bad | samples with a cell that could not be read |
    | filled, jumped | ticks without a row taken as samples without values; ticks beyond the longest gap, left out |
    | late, duplicate | rows not used: before the last sample taken, and at its very instant |
    | timeless, early | rows not used: without a time, and before the first measured output |
    | scored, z2, inside | outputs by which error bars are judged, their sum of e^2/variance, how many within 1.96 std |
    | compared, e2, dy2 | outputs by which forecasts are judged, sum of e^2, the same were the last value the forecast |
    | y1, y2 | sum of those compared (less the level of the series), and of their squares |
    | first_time, last_time, last_jump | instants, NaN where there is none |
    | last_y | the last measured output less its level (those of further outputs: last_y2, ...) |
    | gaps | steps of the clock longer than 1.5 usual ones |
    | step | the usual step of the clock: that of most samples (Boyer and Moore's majority vote, within a half of it) |
    | votes | by how many samples it leads |

    The first ``settle`` measured samples of a series (2 N + 10 if omitted) are neither scored nor compared: there the
    prior speaks. The numbers do not depend, bit for bit, on how samples were cut into stretches.

    Bad at: the tails of a learnt scale and of mixtures, whose 95 % band is not 1.96 deviations wide; `Summary`, which
    has one series, knows better.
    """

    def __init__(self, fleet, settle: int | None = None):
        self.outputs = fleet.crew.outputs
        self.settle = 2 * fleet.estimators[0].model.N + 10 if settle is None else settle
        more = [f"last_y{j}" for j in range(2, self.outputs + 1)]
        fresh = dict.fromkeys(COLUMNS, 0.0) | dict.fromkeys([*LAST, *more], np.nan)
        super().__init__(fresh | dict(zip(CLOCK, (0.0, np.nan, 0.0))), len(fleet))

    def count(self, name: str, at, numbers=1.0) -> None:
        """Add numbers to the series they belong to, one after the other."""
        np.add.at(self[name], at, numbers)

    def add(self, taken, outs) -> None:
        """Take in what samples (a `Taken`) showed: ``outs`` (n, 4 p or more) of `Fleet.advance`."""
        if len(taken.at):
            self.grow(int(taken.at.max()) + 1)
            at, outs = np.ascontiguousarray(taken.at, np.int64), np.ascontiguousarray(outs)
            told = (taken.ys, taken.time, taken.bad, taken.filled)
            columns = [np.ascontiguousarray(column, float) for column in told]
            adding()(self._numbers, at, *columns, outs, self.settle)


def never_moved(tally, at=slice(None)) -> Any:
    """Say whose output is one and the same number after its first samples, (S,): a sensor that is stuck."""
    return (tally["compared"][at] >= FEW) & (tally["dy2"][at] == 0)


def adding() -> Any:
    """Return the loop of `add_up`, compiled."""
    return compile.function(add_up, 2, "index", 2, 1, 1, 1, 2, int)


def add_up(numbers, at, ys, time, bad, filled, outs, settle):
    """Add samples to the columns of their series, one after the other: sums do not depend on how they are cut."""
    p = ys.shape[1]
    GAPS, STEP, VOTES = LAST_Y + p, LAST_Y + p + 1, LAST_Y + p + 2
    for i in range(at.size):
        s, is_measured = at[i], False
        numbers[SAMPLES, s] += 1
        numbers[BAD, s] += bad[i]
        numbers[FILLED, s] += filled[i]
        if math.isnan(numbers[FIRST_TIME, s]):
            numbers[FIRST_TIME, s] = time[i]
        step, usual = time[i] - numbers[LAST_TIME, s], numbers[STEP, s]
        if step > 0:
            numbers[GAPS, s] += step > GAP * usual
            numbers[VOTES, s] += 1.0 if abs(step - usual) <= 0.5 * usual else -1.0
            if numbers[VOTES, s] <= 0:  # it has lost its majority
                numbers[STEP, s], numbers[VOTES, s] = step, 1.0
        numbers[LAST_TIME, s] = time[i]
        for j in range(p):
            is_measured |= math.isfinite(outs[i, p + j])
        numbers[MEASURED, s] += is_measured
        is_settled = numbers[MEASURED, s] > settle
        for j in range(p):
            y, e, variance, status = ys[i, j], outs[i, p + j], outs[i, 2 * p + j], int(outs[i, 3 * p + j])
            if status:
                for b in range(BITS.size):
                    numbers[FIRST_BIT + b, s] += (status & BITS[b]) != 0
                if status & JUMP:
                    numbers[LAST_JUMP, s] = time[i]
            change = y - numbers[LAST_Y + j, s]
            if math.isfinite(y):
                numbers[LAST_Y + j, s] = y
            if not (is_settled and math.isfinite(e)):
                continue
            if math.isfinite(change) and not status & REJECTED:
                numbers[COMPARED, s] += 1
                numbers[E2, s] += e * e
                numbers[DY2, s] += change * change
                numbers[Y1, s] += y
                numbers[Y2, s] += y * y
            if variance > 0 and not status & SET_ASIDE:
                z2 = e * e / variance
                numbers[SCORED, s] += 1
                numbers[Z2, s] += z2
                numbers[INSIDE, s] += z2 <= NORMAL_95**2
