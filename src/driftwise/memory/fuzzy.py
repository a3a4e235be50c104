"""Drift by a fuzzy rule: is the innovation large, does the parameter move?"""

import math
from typing import Any, NamedTuple

from ..engine.dispatch import Vector, kernel
from .unknown import adaptive, revise


class FuzzyDrift(NamedTuple):
    """The speed of drift by four rules: slow where innovation and step are small, fast where both are large.

    |e|/sqrt(S) is large by degree 0 at ``error[0]``, 1 at ``error[1]``; the step K e of a parameter by its share of
    ``increment``, in units that move y as much as the noise does. ``levels`` are the noise variance ratios of "both
    small", "one of them", "both large", averaged by degree (``geometric``: their logarithms). As the averages lie
    between the first level and the last, so does P between those of filters with these. ``as_published``: inputs one
    sample old, and the step with Phi's pull in it. ``phi`` is that of `Drift`. Source: Abid and Kamoun (2008), table
    1; its memberships are lost, these are the second best of 90 over six test systems. Bad at: parameters that rest
    (the ratio stays near 1e-3, errors are twice those of least squares), parameters of unequal speed, a noise variance
    that is told wrong, and bars that are too short where the drift is fast: all it knows is two innovations.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.memory.FuzzyDrift()).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist()
    [-0.8, 1.0]
    """

    levels: tuple = (1e-4, 1e-2, 1.0)
    error: tuple = (1.0, 3.0)
    increment: float = 1.0
    geometric: bool = False
    as_published: bool = False
    phi: Any = 1.0


class Fuzzy(NamedTuple):
    """What the kernel sees of a `FuzzyDrift`."""

    R: float
    phi: Vector
    cap: Vector
    floor: float
    moving: float
    discount: float
    small: float
    medium: float
    large: float
    usual: float  # |e|/sqrt(S) that is not large at all
    alarming: float  # and the one that is wholly large
    increment: float
    geometric: float
    delayed: float


BEGUN, ERROR, STEPS = range(3)  # own cells of the delayed rule; STEPS: N steps, then theta of the sample before


def own_cells(N: int, is_delayed: bool) -> int:
    """Return how many numbers the rule keeps."""
    return STEPS + 2 * N if is_delayed else 0


@kernel
def degree(x, low, high):
    """Return 0 below low, 1 above high, linear in between."""
    return min(max((x - low) / (high - low), 0.0), 1.0)


@kernel
def table(policy, error, step):
    """Return the noise variance ratio: rules by product, averaged."""
    m, d = degree(error, policy.usual, policy.alarming), degree(abs(step), 0.0, policy.increment)
    none, one, both = (1.0 - m) * (1.0 - d), (1.0 - m) * d + m * (1.0 - d), m * d
    if policy.geometric > 0.0:
        logs = none * math.log(policy.small) + one * math.log(policy.medium) + both * math.log(policy.large)
        return math.exp(logs)
    return none * policy.small + one * policy.medium + both * policy.large


adaptive(Fuzzy)


@revise.on(Fuzzy)
def revise_fuzzy(policy, own, sample, theta, U, D, q):
    e, N = sample.e / math.sqrt(sample.s2), q.size
    error = abs(e) / math.sqrt(sample.T)
    if policy.delayed == 0.0:
        for i in range(N):
            unit = sample.unit[i]
            q[i] = table(policy, error, sample.b[i] / sample.T * e / math.sqrt(unit)) * unit if unit > 0.0 else 0.0
        return
    steps, before = own[STEPS : STEPS + N], own[STEPS + N :]
    used = own[ERROR] if own[BEGUN] > 0.0 else error
    for i in range(N):
        unit, predicted = sample.unit[i], theta[i] - sample.b[i] / sample.T * sample.e
        step = (predicted - before[i]) / math.sqrt(sample.s2 * unit) if unit > 0.0 else 0.0
        q[i] = table(policy, used, steps[i] if own[BEGUN] > 0.0 else step) * unit
        steps[i], before[i] = step, predicted
    own[BEGUN], own[ERROR] = 1.0, error
