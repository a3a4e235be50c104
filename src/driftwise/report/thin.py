"""Fewer points for the same picture."""

from __future__ import annotations


def extremes(group, *columns):
    """Return sorted indices: of every run of equal ``group``, the first lowest and the first highest of each column.

    NaN is never an extreme, but a group of nothing but NaN keeps its first one. Thinning what was thinned, with groups
    that contain the old ones, gives the same as thinning at once.
    """
    import numpy as np

    start = np.flatnonzero(np.concatenate(([True], group[1:] != group[:-1])))
    size = np.diff(np.concatenate((start, [len(group)])))
    chosen = []
    for values in columns:
        for sign in (1, -1):
            y = np.where(np.isnan(values), np.inf, sign * values)
            best = np.flatnonzero(y == np.repeat(np.minimum.reduceat(y, start), size))
            chosen.append(best[np.unique(group[best], return_index=True)[1]])
    return np.unique(np.concatenate(chosen))


def envelope(y, points: int):
    """Return sorted indices of at most `points` samples that keep every bucket's lowest and highest value.

    A spike of one sample stays visible; the first and the last sample are always kept. NaN is never an
    extreme, but a hole as wide as a bucket keeps one of them, so that a hole in a line stays a hole.
    """
    import numpy as np

    y = np.asarray(y, float)
    size = len(y)
    if size <= points:
        return np.arange(size)
    holes = _holes(np.isnan(y))
    buckets = max((points - 2) // (3 if len(holes) else 2), 1)  # at most one wide hole for each
    width = -(-size // buckets)
    wide = holes[holes[:, 1] - holes[:, 0] >= width, 0]
    return np.unique(np.concatenate(([0], extremes(np.arange(size) // width, y), wide, [size - 1])))


def _holes(missing):
    """Return first sample and end of every run of missing ones, (holes, 2)."""
    import numpy as np

    edges = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False]))))
    return edges.reshape(-1, 2)


def together(points: int, *lines):
    """Return indices for several lines drawn over each other, at most `points` in all."""
    import numpy as np

    if len(lines[0]) <= points:
        return np.arange(len(lines[0]))
    return np.unique(np.concatenate([envelope(line, points // len(lines)) for line in lines]))


def alone(y):
    """Return which samples are there while both their neighbours are missing: a line would not show them."""
    import numpy as np

    seen = np.concatenate(([False], np.isfinite(np.asarray(y, float)), [False]))
    return seen[1:-1] & ~seen[:-2] & ~seen[2:]
