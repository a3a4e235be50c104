"""Fewer points for the same picture."""

from __future__ import annotations

__all__ = ["envelope", "together"]


def envelope(y, points: int):
    """Return sorted indices of at most `points` samples that keep every bucket's lowest and highest value.

    A spike of one sample stays visible; the first and the last sample are always kept. NaN is never an
    extreme, but a bucket of nothing but NaN keeps one of them, so that a hole in a line stays a hole.
    """
    import numpy as np

    y = np.asarray(y, float)
    size = len(y)
    if size <= points:
        return np.arange(size)
    buckets = max((points - 2) // 2, 1)
    width = -(-size // buckets)
    padded = np.full(width * buckets, np.nan)
    padded[:size] = y
    table = padded.reshape(buckets, width)
    low = np.argmin(np.where(np.isnan(table), np.inf, table), axis=1)
    high = np.argmax(np.where(np.isnan(table), -np.inf, table), axis=1)
    start = np.arange(buckets) * width
    chosen = np.concatenate(([0], start + low, start + high, [size - 1]))
    return np.unique(chosen[chosen < size])


def together(points: int, *lines):
    """Return indices for several lines drawn over each other, at most `points` in all."""
    import numpy as np

    if len(lines[0]) <= points:
        return np.arange(len(lines[0]))
    return np.unique(np.concatenate([envelope(line, points // len(lines)) for line in lines]))
