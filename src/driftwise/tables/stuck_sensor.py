"""Segments of a record in which a sensor is stuck: it repeats one reading while what it measures must have moved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LEAST = 12  # equal readings in a row
SILENT = 10  # rows from one of them to the next, at most: what is missing in between says nothing else
MOVES = 0.3  # share of the rows, elsewhere, in which the sensor reads something new
LONGER = 4  # times as long as any other run of equal readings: a sensor that is written in steps has some
TURNS, NOISY = 0.05, 0.3  # share of them in which it turns round: a ramp does not, noise does; white noise 2/3
CHANCE = 0.05  # of so long a run anywhere in the column, if it moved as seldom as in the rows beside it
FINE = 3.0  # resolutions that it moves by, usually, below which noise that becomes quiet may not be seen at all
LEAST_STEP = 0.01  # quantile of the moves that counts as the least: fractions make smaller ones
REST = 0.3  # share of the readings that must be elsewhere
WITNESS = 0.2  # of the range of another column, which it must cross meanwhile


class Segment(NamedTuple):
    """Rows ``start`` to before ``stop`` read ``value``."""

    start: int
    stop: int
    value: float


def repeats(values, least: int = LEAST) -> list[Segment]:
    """Return the segments in which a column (T,) reads the same at least so many times in a row.

    >>> repeats([1, 2, 2, np.nan, 2, 3, np.nan, np.nan, np.nan], 3)
    [Segment(start=1, stop=5, value=2.0)]
    """
    edges, rows, read = _runs(values)
    at = np.flatnonzero(np.diff(edges) >= least)
    return [Segment(int(rows[edges[k]]), int(rows[edges[k + 1] - 1]) + 1, float(read[edges[k]])) for k in at]


def _runs(values):
    """Return where runs of equal readings begin among the readings of a column, and where the last ends; their rows."""
    values = np.asarray(values, float)
    rows = np.flatnonzero(np.isfinite(values))
    read = values[rows]
    is_new = (read[1:] != read[:-1]) | (np.diff(rows) > SILENT)
    return np.flatnonzero(np.concatenate(([True], is_new, [True]))), rows, read


def stuck(values, others) -> list[Segment]:
    """Return the segments in which a column (T,) is stuck, judged beside the other columns of the table.

    It must read something new in many other rows, as a noisy sensor does and a switch or a set point does not, or end
    by a step larger than any other, and nowhere else repeat itself for nearly as long. All that it repeats must lie
    between its other values, each once, as a plant at rest at the end of its range does not; and another column must
    move meanwhile.

    Bad at: sensors that move seldom, segments in which nothing else is known to move, and coarse noise that is followed
    by one reading to the end: the sensor may be stuck, or the noise below its resolution, and it is not said to be.
    """
    found, steps = _alike(values)
    is_noisy = _turns(steps[steps != 0]) >= TURNS  # of its moves: a sensor that is written in steps rests between them
    is_sensor = found and (is_noisy or _end_by_leaps(values, found, steps))
    return found if is_sensor and any(_moved(other, one) for one in found for other in others) else []


def still(values) -> list[Segment]:
    """Return the segments in which a column (T,) says nothing of what it measures, judged by itself.

    It repeats itself there as a stuck sensor does, while elsewhere noise turns it round at every third row, or leaves
    by a step larger than any other: a plant at rest does not.
    """
    found, steps = _alike(values)
    return found if found and (_turns(steps) >= NOISY or _end_by_leaps(values, found, steps)) else []


def _end_by_leaps(values, found: list[Segment], steps) -> bool:
    """Say whether a column leaves each segment by a step larger than any other."""
    edges, rows, read = _runs(values)
    at = np.searchsorted(rows[edges[1:] - 1], [one.stop - 1 for one in found]) + 1
    if at[-1] > len(edges) - 2:
        return False
    leaps = abs(read[edges[at]] - [one.value for one in found])
    return bool(leaps.min() > abs(steps).max())


def _alike(values) -> tuple[list[Segment], np.ndarray]:
    """Return the segments in which a column (T,) repeats one reading as nowhere else, and its steps from row to row."""
    values = np.asarray(values, float)
    found, rest = [one for one in repeats(values, _least(values)) if not _is_quiet(values, one)], np.isfinite(values)
    readings = np.count_nonzero(rest)
    for one in found:
        rest[one.start : one.stop] = False
    if not found or np.count_nonzero(rest) < max(REST * readings, 2 * LEAST):
        return [], np.zeros(0)
    rows = np.flatnonzero(rest)
    beside = np.diff(np.searchsorted([one.start for one in found], rows)) == 0  # what a sensor leaps by is no step
    steps, levels = np.diff(values[rows])[beside], {one.value for one in found}
    is_rest = len(levels) < len(found) or min(levels) <= values[rest].min() or max(levels) >= values[rest].max()
    return ([], steps) if is_rest or np.mean(steps != 0) < MOVES else (found, steps)


def _is_quiet(values, segment: Segment) -> bool:
    """Whether a column may repeat itself so long because it moves seldom there: noise below its resolution does.

    How seldom is what as many rows on either side say, on the side where it moves less. Where a record begins or ends
    with the run nobody knows one side: the noise may be as quiet as it likes there, unless more than noise moves the
    column, or it is read finely.
    """
    length = segment.stop - segment.start
    before, after = values[max(segment.start - length, 0) : segment.start], values[segment.stop : segment.stop + length]
    sides = [_leaves(side) for side in (before, after) if np.count_nonzero(np.isfinite(side)) >= LEAST]
    if len(sides) < 2 and not _is_fine(values):
        return True
    share = min(sides, default=1.0)
    return len(values) * share * (1 - share) ** length > CHANCE


def _leaves(values) -> float:
    """Return the share of rows at which a column leaves its reading: as a rule it comes back, by a second move.

    The row that ends the run counts as one more.
    """
    read = values[np.isfinite(values)]
    return (1 + np.count_nonzero(np.diff(read)) / 2) / (1 + len(read))


def _is_fine(values) -> bool:
    """Whether more than noise moves a column, or it moves by many times the least that it moves by."""
    steps = np.diff(values[np.isfinite(values)])
    steps = steps[steps != 0]
    if _turns(steps) < NOISY:
        return True
    return float(np.median(abs(steps))) > FINE * float(np.quantile(abs(steps), LEAST_STEP))


def _turns(steps) -> float:
    """Return the share of steps that turn round."""
    return float(np.mean(steps[1:] * steps[:-1] < 0)) if len(steps) > 1 else 0.0


def _least(values) -> int:
    """Return how many equal readings in a row stand out of all others of a column."""
    edges, rows, _ = _runs(values)
    lengths = np.sort(np.diff(edges))[::-1] if rows.size else np.zeros(1, int)
    clear = np.flatnonzero((lengths >= LEAST) & (lengths >= LONGER * np.append(lengths[1:], 1)))
    return int(lengths[clear[-1]]) if clear.size else rows.size + 1


def _moved(other, segment: Segment) -> bool:
    """Whether a column crosses a good part of its range during a segment."""
    inside, known = other[segment.start : segment.stop], other[np.isfinite(other)]
    inside = inside[np.isfinite(inside)]
    return inside.size > 1 and np.ptp(inside) > WITNESS * np.ptp(known) > 0
