"""A level or a gain that walks: what that explains, to be weighed against a change that comes at once."""

from __future__ import annotations

import math

import numpy as np

from .change_effects import GAIN, LEVEL, NUMBERS, SPEED
from .change_places import lacking
from .response import Response
from .speeds import passed

FASTER = -1  # the place of how fast a plant answers, among its inputs
WAVES, WALKS = 30, (-12.0, 6.0, 40)  # of a walk; the logarithms of its variances that are weighed


def walked(now: Response, part: str, j: int, calm: float) -> float:
    """Return the log odds, to those of `Place.whole`, that what changed walked: a random walk of its level or gain.

    A gain is weighed as the change was, beside all else as it is there: fitted anew without it, poles and the other
    numbers take a part of what wanders from the walk, and none from the change.
    """
    if part == "gains":
        return walk(lacking(now, part, j), now.gains[j][0], calm)
    if part == "speeds":
        return walk(now.without(part, j).refined(), FASTER, calm)
    return walk(now.without(part, j).refined(), None, calm)


def walk(other: Response, i: int | None, calm: float) -> float:
    """Return the log odds that the gain of input i walked beside a response; its level (None), or speed (`FASTER`).

    The cosines of a walk over the record, of deviations that fall as 1/k, are weighed by the variance under which they
    are likeliest (a marginal likelihood); by Schwarz's criterion it costs what the numbers of a jump cost.
    """
    U, spread = walks(other, i)
    gained = best_walk(U.T @ (other.left * other.weight), spread, calm)
    return gained - NUMBERS[LEVEL if i is None else SPEED if i == FASTER else GAIN] * 0.5 * math.log(len(other.rows))


def walks(other: Response, i: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Return what walks do to the rows beside all else: directions (rows, K), and the deviation of each, (K,)."""
    T, k = len(other.used), np.arange(1, WAVES + 1)[:, None]
    waves = np.cos(np.pi * k * (np.arange(T) + 0.5) / T) / k
    if i == FASTER:
        waves = passed(other.stretches, other.faster(other.is_alone) * waves, is_held=False)
    elif i is not None:
        waves = other.answered(other.driven(i, other.moved(i)) * waves)
    D = (other.whitened(waves) * other.weight).T
    return np.linalg.svd(D - other.basis @ (other.basis.T @ D), full_matrices=False)[:2]


def best_walk(z, spread, calm: float) -> float:
    """Return the log likelihood ratio of z (K,), along the directions of walks, under the likeliest variance of one."""
    power = np.exp(np.linspace(*WALKS))[:, None] * spread**2
    return float(np.max(np.sum(power * z**2 / (1 + power) - np.log1p(power), axis=1))) / 2 / calm
