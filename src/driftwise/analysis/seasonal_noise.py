"""Noise that comes and goes with a season: what the sun drives is loud by day, and at rest by night."""

from __future__ import annotations

import math

import numpy as np

from .noise_jumps import cut
from .response import Response

NEAR = 24  # part of a season over which its noise is smoothed
REST = 1e-3  # of the loudest hour, below which a plant is at rest


def of_season(now: Response, season: int) -> np.ndarray:
    """Return the deviation of what is left at each row as the other seasons have it at that hour; 0 where they rest.

    What a sample did itself takes no part in what is expected of it.
    """
    n = -(-len(now.used) // season)
    squares, counts = np.zeros((2, n * season))
    squares[now.rows], counts[now.rows] = cut(now.unscaled, now.record.floor) ** 2, 1.0
    near = np.ones(2 * (season // NEAR) + 1)
    total, many = (np.convolve(x, near, "same").reshape(n, season) for x in (squares, counts))
    total, many = total.sum(axis=0) - total, many.sum(axis=0) - many
    found = np.sqrt(total / np.maximum(many, 1.0)).ravel()[now.rows]
    return np.where(found > REST * float(found.max()), found, 0.0)


def in_season(r: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Return what is left in units of a shape, NaN where nothing was expected and nothing came."""
    least = REST * max(float(shape.max()), 1e-300)
    is_at_rest = (shape == 0) & (abs(r) <= least)
    return np.where(is_at_rest, math.nan, r / np.maximum(shape, least))
