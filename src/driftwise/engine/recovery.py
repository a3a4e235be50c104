"""A series whose state is no number any more begins afresh, at the sample at which that shows.

Samples may be as large as 1e100, and what a recursion makes of some of them (squares of squares, products with a vague
prior) is beyond doubles: infinity, then NaN, which nothing that is learnt later takes away. Every family is held to the
same guard, in the loops that take its samples: where prediction or variance of a sample is not finite it looks at the
state. One that is poisoned is replaced by a fresh one, which takes that sample again; it is flagged `LOST`.

The fresh state stands at the end of the numbers that a loop is given (`tail`): NaN in it marks what may be NaN at any
time, and stays as it is. The count of samples, which every row begins with, and its clock, if it has one, go on.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from .dispatch import kernel, rare
from .status import LOST

SAMPLES = 0  # of every row
LARGEST = sys.float_info.max


def tail(fresh: np.ndarray, unknown: tuple[str, ...]) -> np.ndarray:
    """Return the numbers of a fresh state as the loops want them, NaN in the parts that may be NaN; then its clock."""
    places: Any = fresh.dtype.fields
    fresh = fresh.copy()
    for name in unknown:
        if name in places:
            fresh[name] = np.nan
    clock = places["time"][1] // 8 if "time" in places else -1
    return np.append(np.atleast_1d(fresh).view(np.float64), clock)


@kernel
def is_sound(out, outputs):
    """Say whether prediction and variance of the sample just taken are numbers."""
    seen = 0.0
    for i in range(outputs):
        seen += abs(out[i]) + abs(out[2 * outputs + i])
    return seen <= LARGEST


@rare
def settle(row, spec, out, outputs, count, clock):
    """Return the next count and clock of a loop; where the count is not negative, its last sample is to be taken again.

    It has just been taken, for the first time where the count was negative. What is told of it, ``out``, is a row:
    handed to a function that stays apart, a row is two registers, and a table has to be in memory.
    """
    if count < 0.0:
        return begin_afresh(row, spec)
    go_on(row, spec, out, outputs, count, clock)
    return -1.0, 0.0


@rare
def begin_afresh(row, spec):
    """Replace a state in which something is not finite by the fresh one; return its count and clock, or -1."""
    first, is_poisoned = spec.size - 1 - row.size, False
    count, clock, at = row[SAMPLES], 0.0, int(spec[spec.size - 1])
    if at >= 0:
        clock = row[at]
    for i in range(row.size):
        if abs(spec[first + i]) <= LARGEST and not abs(row[i]) <= LARGEST:
            is_poisoned = True
    if not is_poisoned:
        return -1.0, 0.0
    for i in range(row.size):
        if abs(spec[first + i]) <= LARGEST:
            row[i] = spec[first + i]
    return count, clock


@rare
def go_on(row, spec, out, outputs, count, clock):
    """Let count and clock go on where they were, and flag the sample that was taken again."""
    at = int(spec[spec.size - 1])
    row[SAMPLES] = count
    if at >= 0:
        row[at] = clock
    for i in range(outputs):
        status = 3 * outputs + i
        out[status] = int(out[status]) | LOST
