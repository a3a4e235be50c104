"""How the past fades in a filter with the user's matrices: that of its state, and of the scale of its noise."""

from __future__ import annotations

import math

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.exponential_forgetting import ExponentialForgetting
from ...memory.likelihood_drift import LikelihoodDrift
from ...memory.settings import more_than_one
from ..common.refusals import OF_PARAMETERS


def scale_fading(samples, scale) -> float:
    """Return what is left, after a sample, of the weight of what sigma^2 was learnt from."""
    if isinstance(samples, float | int) and samples == math.inf:
        return 1.0
    if scale is None:
        raise InputError("scale_samples says how long sigma^2 is remembered, and none is learnt: give scale, its prior")
    return 1.0 - 1.0 / more_than_one("scale_samples", samples)


def effective(each, observed: float, fade: float) -> np.ndarray:
    """Return how many outputs count at each sample, of those before it; ``observed`` of them before the first."""
    if fade == 1.0:
        return observed + np.cumsum(each) - each
    found, now = np.empty(len(each)), observed
    for t, count in enumerate(each.tolist()):
        found[t] = fade * now
        now = found[t] + count
    return found


def fading(memory) -> float:
    """Return what is left of the past's weight after a sample."""
    if isinstance(memory, ExponentialForgetting):
        return validation.share("lam", memory.lam, "a weight per sample")
    if not isinstance(memory, Constant | LikelihoodDrift):
        raise InputError(f"{OF_PARAMETERS}; got {memory!r}")
    return 1.0
