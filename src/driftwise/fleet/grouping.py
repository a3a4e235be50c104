"""Which samples belong to which row, in one pass over them and without moving any: a counting sort."""

from __future__ import annotations

import numpy as np

from ..engine import compile

FEW = 8  # rows for each sample from which it is cheaper to sort the samples than to count those of every row


def group_samples(at, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Return members, starts, order, and whether the order is still to be filled in by `place`.

    Sample i belongs to row ``at[i]``, below ``count``. The samples of ``members[j]`` are
    ``order[starts[j]:starts[j + 1]]``, as they stand; an empty order is 0, 1, .. n - 1.
    """
    room = min(len(at), count)
    members, starts = np.empty(room, np.int64), np.empty(room + 1, np.int64)
    order, is_open = np.empty(0, np.int64), False
    found = _compiled(runs, 3)(at, members, starts)
    if found < 0 and len(at) * FEW < count:
        order = np.argsort(at, kind="stable")
        found = _compiled(runs, 3)(at[order], members, starts)
    elif found < 0:
        order, is_open = np.empty(len(at), np.int64), True
        found = _compiled(totals, 4)(at, np.zeros(count, np.int64), members, starts)
    return members[:found], starts[: found + 1], order, is_open


def place(at, members, starts, order) -> None:
    """Fill in the order of the samples of these members, which are a stretch of all of them."""
    _compiled(spread, 5)(at, members, starts, np.empty(members[-1] - members[0] + 1, np.int64), order)


def stable_order(at, count: int) -> np.ndarray:
    """Return the order that sorts row numbers below ``count`` and keeps samples of one row as they stand."""
    at = np.ascontiguousarray(at, np.int64)
    members, starts, order, is_open = group_samples(at, count)
    if is_open:
        place(at, members, starts, order)
    return order if order.size else np.arange(len(at))


def runs(at, members, starts):
    """Fill members and starts of samples sorted by row; return the number of members, or -1 where they are not."""
    found, last, i = 0, -1, 0
    while i < at.size:
        row = at[i]
        if row < last:
            return -1
        if row > last:
            members[found], starts[found] = row, i
            found, last = found + 1, row
        i += 1
        while i + 4 <= at.size and (at[i] ^ row) | (at[i + 1] ^ row) | (at[i + 2] ^ row) | (at[i + 3] ^ row) == 0:
            i += 4
    starts[found] = at.size
    return found


def totals(at, counts, members, starts):
    """Fill members and starts of samples in any order; return the number of members."""
    for i in range(at.size):
        counts[at[i]] += 1
    found, total = 0, 0
    for row in range(counts.size):
        if counts[row] > 0:
            members[found], starts[found] = row, total
            found, total = found + 1, total + counts[row]
    starts[found] = total
    return found


def spread(at, members, starts, spots, order):
    """Write the number of each sample of these members to where it belongs; ``spots`` has room for each row."""
    first = members[0]
    for j in range(members.size):
        spots[members[j] - first] = starts[j]
    for i in range(at.size):
        row = at[i] - first
        if 0 <= row < spots.size:
            order[spots[row]] = i
            spots[row] += 1
    return order.size


def _compiled(loop, count: int):
    """Return one of the loops above, compiled: all it takes are so many rows of indices."""
    return compile.function(loop, *["index"] * count)
