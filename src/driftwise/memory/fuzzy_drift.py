"""Drift by a fuzzy rule: is the innovation large, does the parameter move?"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter, kernel
from ..engine.elementary import exp, log
from ..engine.errors import InputError
from ..engine.layout import Layout, each, numbers
from .questions import resolve
from .registry import register
from .unknown_drift import common, drift_state_size, learns_drift, revise


@register("fuzzy", about="the ratio is learnt by a fuzzy rule")
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


class FuzzyDriftKernel(NamedTuple):
    """What the kernel sees of a `FuzzyDrift`."""

    R: float
    phi: PerParameter
    cap: PerParameter
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

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps."""
        return drift_state_size(parameters, DELAYED.size(parameters) if self.delayed > 0.0 else 0)


DELAYED = Layout(
    *numbers("head", begun="whether there was a sample before", error="its |e|/sqrt(S)"),
    *each("N", steps="its steps", before="theta predicted for it"),
    given=("N",),
)
open_delayed = kernel(DELAYED.open)
BEGUN, ERROR = range(2)  # of the head


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
        logs = none * log(policy.small) + one * log(policy.medium) + both * log(policy.large)
        return exp(logs)
    return none * policy.small + one * policy.medium + both * policy.large


learns_drift(FuzzyDriftKernel)


@resolve.on(FuzzyDrift)
def resolve_fuzzy_drift(memory, setting):
    levels = _rising("levels", memory.levels, 3, "noise variance ratios, small, medium and large")
    error = _rising("error", memory.error, 2, "where |e|/sqrt(S) begins to be large, and where it wholly is")
    geometric = validation.yes("geometric", memory.geometric)
    delayed = validation.yes("as_published", memory.as_published)
    small, medium, large = np.maximum(levels, 1e-12) if geometric else levels  # a logarithm
    return FuzzyDriftKernel(
        **common(setting, memory.phi), small=small, medium=medium, large=large, usual=error[0], alarming=error[1],
        increment=validation.positive("increment", memory.increment),
        geometric=float(geometric), delayed=float(delayed),
    )  # fmt: skip


def _rising(name, value, size, meaning) -> np.ndarray:
    levels = validation.floats(name, value)
    if levels.shape != (size,) or not np.isfinite(levels).all() or levels[0] < 0 or np.any(np.diff(levels) <= 0):
        raise InputError(f"{name} must be {size} numbers that rise, none negative: {meaning}; got {value!r}")
    return levels


@revise.on(FuzzyDriftKernel)
def revise_fuzzy_drift(policy, own, sample, theta, U, D, q):
    e, N = sample.e / math.sqrt(sample.s2), q.size
    error = abs(e) / math.sqrt(sample.T)
    if policy.delayed == 0.0:
        for i in range(N):
            unit = sample.unit[i]
            q[i] = table(policy, error, sample.b[i] / sample.T * e / math.sqrt(unit)) * unit if unit > 0.0 else 0.0
        return
    last = open_delayed(own, N)
    used = last.head[ERROR] if last.head[BEGUN] > 0.0 else error
    for i in range(N):
        unit, predicted = sample.unit[i], theta[i] - sample.b[i] / sample.T * sample.e
        step = (predicted - last.before[i]) / math.sqrt(sample.s2 * unit) if unit > 0.0 else 0.0
        q[i] = table(policy, used, last.steps[i] if last.head[BEGUN] > 0.0 else step) * unit
        last.steps[i], last.before[i] = step, predicted
    last.head[BEGUN], last.head[ERROR] = 1.0, error
