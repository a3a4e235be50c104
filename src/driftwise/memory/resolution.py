"""In which steps outputs are recorded, learnt from the outputs: what rounding leaves is a noise that none is below.

A number rounded to steps s is wrong by up to s/2 either way: a variance of s^2/12 (Sheppard 1898), whatever the plant
does. Where it stands still no error shows that, and who learns sigma^2 from errors would believe in a plant without
noise: the next step is then beyond all odds. s is the largest number of which all moves of y so far are multiples.
Numbers written finely have none, from their third on, and nothing is bounded. An output that has not moved yet tells
nothing of its noise: neither is known, and what was believed before holds.
"""

import math

from ..engine.dispatch import kernel, rare
from ..engine.layout import numbers

LAST, STEP, KEPT = range(3)  # of what is kept, and how many
RESOLUTION = numbers(
    "resolution",
    last="y at the sample before",
    step="all its moves are multiples of it; 0: none yet, below 0: perhaps by chance",
)
NONE = 1e-300  # a step, of numbers written finely
ROUNDED = 1e-3  # of a step, by which a multiple of it may be off: written in digits, stored in binary
FINEST = 1e-6  # of a move, the least step that is told from none
FARTHEST = 1e9  # steps; a wilder move says nothing


@kernel
def off(move, step):
    """Return how far a move is from a multiple of a step."""
    return abs(move - step * math.floor(move / step + 0.5))


@rare
def common_step(move, step):
    """Return the largest number of which both are multiples (Euclid), less than zero: two may be so by chance."""
    largest = larger = max(move, step)
    smaller = min(move, step)
    while smaller > ROUNDED * larger:
        rest = off(larger, smaller)
        larger, smaller = smaller, rest
    return -larger if larger > FINEST * largest else NONE


@kernel
def step_after(step, move):
    """Return the step of outputs that have just moved so far; numbers written finely do not return by chance."""
    size = abs(step)
    if move == 0.0 or size == NONE:
        return size
    if size == 0.0:
        return -move
    if move > FARTHEST * size:
        return step
    if off(move, size) > ROUNDED * size:
        return common_step(move, size)
    return size if move > 1.5 * size else step


@kernel
def follow_resolution(resolution, y, is_first):
    """Take an output in, if it is known (else NaN); say whether it stands still and has never moved."""
    if y != y:
        return False
    step = 0.0 if is_first else step_after(resolution[STEP], abs(y - resolution[LAST]))
    resolution[LAST], resolution[STEP] = y, step
    return step == 0.0 and not is_first


@kernel
def least_variance(resolution):
    """Return the variance that rounding leaves, as far as the step is known."""
    step = max(resolution[STEP], 0.0)
    return step * step / 12.0
