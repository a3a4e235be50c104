"""Values of a column that cannot be believed: codes for "missing", and drop-outs of a sample or three.

A drop-out goes, for at most `LONGEST` samples, far outside both of its neighbours and returns to where it was, by
a distance that the rest of the record never moves in one sample. That last condition is what spares true steps,
pulses, rain and floods: there the other samples move as far.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .stuck_sensor import SILENT, repeats

LONGEST = 3  # samples that a drop-out lasts at most
REACH = 16  # rows over which its neighbours are looked for
SHARE = 0.03  # of the samples that may be drop-outs
APART = 8.0  # times farther than everything else
RAIL = 3.0  # the same where all of them read the same value: the end of a scale, a lost wire
EVENTS = 1e3  # the same for a signal that rests and fires: rain, pulses, alarms
UNSEEN = 20.0  # times farther than all that was seen, for a drop-out that comes later
CODES = (
    -99.0, -99.9, -99.99, -200.0, -999.0, -999.9, -999.99, -9999.0, -9999.9, -99999.0, 999.0, 9999.0, 99999.0,
    -6999.0, 6999.0, -7999.0, 7999.0, -7777.0, -8888.0, -32768.0, 32767.0, 65535.0, 1e20, -1e20,
)  # fmt: skip


class Belief(NamedTuple):
    """What is believed of a column.

    low, high : range of the believed values of the first rows
    drop : a departure this large, that returns, is a drop-out
    seen : whether one was in the first rows; if not, it must leave [low, high] too
    rail : the value that drop-outs read, NaN if they differ
    codes : values that stand for "missing"
    still : so many equal readings in a row are those of a stuck sensor; 0 where the column may rest
    """

    low: float
    high: float
    drop: float = np.inf
    seen: bool = False
    rail: float = np.nan
    codes: tuple[float, ...] = ()
    still: int = 0


def believe(values) -> Belief:
    """Judge a column by its first rows.

    Bad at: drop-outs that last longer, or as frequent as every thirtieth sample, and signals whose only moves
    are lone pulses.

    Examples
    --------
    >>> import numpy as np
    >>> y = 80 + np.sin(np.arange(200) / 5)
    >>> y[[50, 120, 121]] = [0, -3, 2]
    >>> belief = believe(y)
    >>> belief.seen, np.flatnonzero(doubtful(y, belief)).tolist()
    (True, [50, 120, 121])
    """
    values = np.asarray(values, float)
    codes = codes_in(values)
    rows = np.flatnonzero(np.isfinite(values) & ~np.isin(values, codes))
    y = values[rows]
    if y.size < 2 * LONGEST + 2:
        return Belief(float(y.min()), float(y.max()), codes=codes) if y.size else Belief(np.nan, np.nan, codes=codes)
    rail = _rail(y, rows)
    believed = ~_short(y == rail)
    y, rows = y[believed], rows[believed]
    sizes = _largest(y, rows)
    drop, unseen = _threshold(y, rows, sizes)
    kept = y[sizes < drop]
    seen = bool(np.isfinite(drop))
    return Belief(float(kept.min()), float(kept.max()), drop if seen else unseen, seen, rail, codes)


def doubtful(values, belief: Belief):
    """Return where the values of a column (T,) cannot be believed, as a mask."""
    values = np.asarray(values, float)
    doubt = np.isin(values, belief.codes)
    for one in repeats(np.where(doubt, np.nan, values), belief.still) if belief.still else ():
        doubt[one.start : one.stop] = np.isfinite(values[one.start : one.stop])
    rows = np.flatnonzero(np.isfinite(values) & ~doubt)
    short = _short(values[rows] == belief.rail)
    doubt[rows[short]] = True
    rows = rows[~short]
    y = values[rows]
    if y.size > 2 and np.isfinite(belief.drop) and np.abs(np.diff(y)).max() >= belief.drop:
        found = np.flatnonzero(_sizes(y, rows) >= belief.drop)
        if not belief.seen:
            found = found[(y[found] < belief.low) | (y[found] > belief.high)]
        doubt[rows[found[_is_far(y, rows, found)]]] = True
    return doubt


def judged(columns) -> dict[str, tuple[Belief, np.ndarray]]:
    """Return what is believed of each column of a table, and where its values cannot be."""
    beliefs = {name: believe(values) for name, values in columns.items()}
    return {name: (beliefs[name], doubtful(values, beliefs[name])) for name, values in columns.items()}


class Cleaner:
    """Makes what cannot be believed missing, chunk by chunk; what comes out does not depend on the chunks.

    The last rows are held back until their neighbours are known; `flush` hands them over.
    """

    def __init__(self, beliefs):
        self.beliefs = tuple(beliefs)
        self.cleaned = np.zeros(len(self.beliefs), int)
        self._known: np.ndarray | None = None  # rows around those held back; None before the first
        self._before = 0  # of them, already handed over
        self._near = max(REACH, *(belief.still * SILENT for belief in self.beliefs))  # rows that say what is believed

    def push(self, values):
        """Take the next rows (T, k); return the rows that are ready, cleaned."""
        return self._out(np.asarray(values, float), self._near)

    def flush(self):
        """Return the rows that were held back."""
        return self._out(np.empty((0, len(self.beliefs))), 0)

    def _out(self, fresh, held):
        joined = fresh if self._known is None else np.concatenate((self._known, fresh))
        ready = max(len(joined) - held, self._before)
        clean = joined[self._before : ready].copy()
        for j, belief in enumerate(self.beliefs):
            doubt = doubtful(joined[:, j], belief)[self._before : ready]
            clean[doubt, j] = np.nan
            self.cleaned[j] += int(doubt.sum())
        keep = max(ready - max(2 * REACH, self._near), 0)
        self._known, self._before = joined[keep:].copy(), ready - keep
        return clean


def codes_in(values) -> tuple[float, ...]:
    """Return the values far outside the range of all others that loggers write for "missing"."""
    found = [code for code in CODES if np.any(values == code)]
    rest = values[np.isfinite(values) & ~np.isin(values, found)]
    if not found or not rest.size:
        return ()
    low, high = rest.min(), rest.max()
    return tuple(code for code in found if high > low and max(low - code, code - high) > 0.5 * (high - low))


def _sizes(y, rows):
    """Return, per finite sample, how far it departs and returns with its run of at most three; 0 if it does not."""
    sizes = np.zeros(y.size)
    for length in range(1, LONGEST + 1):
        count = y.size - length - 1
        if count < 1:
            break
        before, after = y[:count], y[length + 1 :]
        inside = [y[1 + i : 1 + i + count] for i in range(length)]
        low, high = np.minimum.reduce(inside), np.maximum.reduce(inside)
        size = np.maximum(low - np.maximum(before, after), np.minimum(before, after) - high)
        returns = (np.abs(after - before) <= 0.25 * size) & (rows[length + 1 :] - rows[:count] <= REACH)
        size = np.where(returns, size, 0.0)
        for i in range(length):
            np.maximum(sizes[1 + i : 1 + i + count], size, out=sizes[1 + i : 1 + i + count])
    return sizes


def _is_far(y, rows, at):
    """Whether samples are farther from the middle of their surroundings than half of their way to a neighbour.

    Between two drop-outs a good sample looks like one; the surroundings tell which is which.
    """
    near = at[:, None] + np.arange(-REACH // 2, REACH // 2 + 1)
    inside = (near >= 0) & (near < y.size)
    near = np.clip(near, 0, y.size - 1)
    inside &= np.abs(rows[near] - rows[at][:, None]) <= REACH
    middle = np.nanmedian(np.where(inside, y[near], np.nan), axis=1)
    step = np.maximum(np.abs(y[at] - y[np.maximum(at - 1, 0)]), np.abs(y[at] - y[np.minimum(at + 1, y.size - 1)]))
    return np.abs(y[at] - middle) > 0.5 * step


def _largest(y, rows):
    """Return `_sizes`, of which the largest were checked against their surroundings."""
    sizes = _sizes(y, rows)
    at = np.argsort(-sizes, kind="stable")[: max(2 * LONGEST, int(2 * SHARE * y.size))]
    at = at[sizes[at] > 0]
    if at.size:
        sizes[at[~_is_far(y, rows, at)]] = 0.0
    return sizes


def _short(mask):
    """Return the part of a mask that is in runs of at most `LONGEST`."""
    if not mask.any():
        return mask
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False]))))
    starts, stops = edges[::2], edges[1::2]
    keep = stops - starts <= LONGEST
    short = np.zeros(mask.size + 1, int)
    np.add.at(short, starts[keep], 1)
    np.add.at(short, stops[keep], -1)
    return np.cumsum(short)[:-1] > 0


def _rail(y, rows) -> float:
    """Return the end of the range that short drop-outs read, NaN if there is none."""
    sizes = _largest(y, rows)
    for end in (float(y.min()), float(y.max())):
        at = y == end
        if not 3 <= at.sum() <= SHARE * y.size:
            continue
        moves = _moves(y, rows)[~(at[1:] | at[:-1])]
        rest = max(float(moves.max(initial=0.0)), float(sizes[~at].max(initial=0.0)))
        far = np.median(sizes[at]) >= RAIL * rest and np.mean(sizes[at] > rest) >= 0.8
        if rest > 0 and far and not _fires(y[~at]):
            return end
    return np.nan


def _moves(y, rows):
    """Return how far each sample is from the one before, 0 behind a hole."""
    apart = np.diff(rows)
    return np.where(apart <= 2 * np.median(apart), np.abs(np.diff(y)), 0.0)


def _threshold(y, rows, sizes):
    """Return (the smallest drop-out or infinity, what a drop-out yet unseen must exceed)."""
    moves = _moves(y, rows)
    beside = np.maximum(sizes[1:], sizes[:-1])  # the departure that a move belongs to
    order = np.argsort(beside, kind="stable")
    beside, largest = beside[order], np.maximum.accumulate(moves[order])
    levels = np.unique(np.concatenate(([0.0], sizes)))
    drops, smaller = levels[1:], levels[:-1]
    before = np.searchsorted(beside, drops)
    rest = np.maximum(smaller, np.where(before > 0, largest[before - 1], 0.0))  # what stays, with each as the smallest
    rare = np.searchsorted(np.sort(sizes), drops) >= y.size - max(1, int(SHARE * y.size))
    fires = _fires(y[sizes < drops[rare][0]]) if rare.any() else _fires(y)
    alone = 1e6 * max(abs(float(np.median(y))), 1.0)  # where nothing else moves
    found = drops[rare & (drops >= (EVENTS if fires else APART) * rest) & ((rest > 0) | (drops >= alone))]
    usual = max(float(moves.max()), float(sizes.max()))
    unseen = (EVENTS if fires else UNSEEN) * usual if usual > 0 else np.inf
    return float(found[0]) if found.size else np.inf, unseen


def _fires(y) -> bool:
    """Whether a signal rests at one end of its range: rain, pulses, alarms, a valve that is mostly shut."""
    if not y.size:
        return True
    found, counts = np.unique(y, return_counts=True)
    j = int(np.argmax(counts))
    return bool(counts[j] >= 0.3 * y.size and j in (0, found.size - 1))
