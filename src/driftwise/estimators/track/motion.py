"""Speed and course of a mean and covariance of [E, vE, aE, N, vN, aN], by the delta method."""

from __future__ import annotations

from functools import cache

import numpy as np

from . import bank


def unpacked(outs, C):
    """Return mean (.., 3C) and covariance (.., 3C, 3C) of the state in rows of a trace."""
    n, at = 3 * C, bank.sample_at(C).state
    return outs[..., at : at + n], outs[..., _square(C)]


@cache
def _square(C):
    """Return where the entries of the covariance stand among the columns."""
    n = 3 * C
    i, j = np.triu_indices(n)
    square = np.empty((n, n), int)
    square[i, j] = square[j, i] = bank.sample_at(C).covariance + np.arange(len(i))
    return square


def _along(gradient, V):
    """Return the standard deviation of a function with this gradient."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.maximum(np.einsum("...i,...ij,...j->...", gradient, V, gradient), 0.0))


def moving(x, V):
    """Return speed and course (rad clockwise from North) with their standard deviations: (s, sd, course, sd)."""
    vE, vN = x[..., 1], x[..., 4]
    speed = np.hypot(vE, vN)
    zero, rest = np.zeros_like(speed), speed == 0.0  # at rest: the larger deviation, and any course
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.stack([zero, vE / speed, zero, zero, vN / speed, zero], axis=-1)
        across = np.stack([zero, vN, zero, zero, -vE, zero], axis=-1) / (speed * speed)[..., None]
        most = np.sqrt(np.maximum(V[..., 1, 1], V[..., 4, 4]))
        speed_sd, course_sd = np.where(rest, most, _along(along, V)), np.where(rest, np.inf, _along(across, V))
        return speed, speed_sd, np.arctan2(vE, vN), course_sd
