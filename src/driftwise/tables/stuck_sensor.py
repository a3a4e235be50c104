"""Segments of a record in which a sensor is stuck: it repeats one reading while what it measures must have moved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LEAST = 20  # equal readings in a row
MOVES = 0.95  # share of the rows, elsewhere, in which the sensor reads something new
TURNS = 0.05  # share of them in which it turns round: a ramp does not, noise does
REST = 0.3  # share of the readings that must be elsewhere
WITNESS = 0.2  # of the range of another column, which it must cross meanwhile


class Segment(NamedTuple):
    """Rows ``start`` to before ``stop`` read ``value``."""

    start: int
    stop: int
    value: float


def repeats(values, least: int = LEAST) -> list[Segment]:
    """Return the segments in which a column (T,) reads the same at least so many times in a row.

    >>> repeats([1, 2, 2, 2, 3, np.nan, np.nan, np.nan], 3)
    [Segment(start=1, stop=4, value=2.0)]
    """
    values = np.asarray(values, float)
    edges = np.flatnonzero(np.concatenate(([True], values[1:] != values[:-1], [True])))  # NaN equals nothing
    at = np.flatnonzero(np.diff(edges) >= least)
    return [Segment(int(edges[k]), int(edges[k + 1]), float(values[edges[k]])) for k in at]


def stuck(values, others) -> list[Segment]:
    """Return the segments in which a column (T,) is stuck, judged beside the other columns of the table.

    It must read something new in nearly every other row, as a noisy sensor does and a switch, a set point or a column
    written in coarse steps does not. All that it repeats must lie between its other values, each once, as a plant at
    rest at the end of its range does not; and another column must move meanwhile.

    Bad at: sensors that move seldom, and segments in which nothing else is known to move.
    """
    values = np.asarray(values, float)
    found = repeats(values)
    rest = np.isfinite(values)
    readings = np.count_nonzero(rest)
    for one in found:
        rest[one.start : one.stop] = False
    if not found or np.count_nonzero(rest) < max(REST * readings, 2 * LEAST):
        return []
    steps = np.diff(values)[rest[1:] & rest[:-1]]
    if not steps.size or np.mean(steps != 0) < MOVES or np.mean(steps[1:] * steps[:-1] < 0) < TURNS:
        return []
    low, high = values[rest].min(), values[rest].max()
    levels = {one.value for one in found}
    is_rest = len(levels) < len(found) or min(levels) <= low or max(levels) >= high
    return [] if is_rest or not any(_moved(other, one) for one in found for other in others) else found


def _moved(other, segment: Segment) -> bool:
    """Whether a column crosses a good part of its range during a segment."""
    inside, known = other[segment.start : segment.stop], other[np.isfinite(other)]
    inside = inside[np.isfinite(inside)]
    return inside.size > 1 and np.ptp(inside) > WITNESS * np.ptp(known) > 0
