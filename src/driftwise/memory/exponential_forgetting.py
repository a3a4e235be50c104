"""Exponential forgetting: the past counts less and less, at a given rate."""

from typing import NamedTuple

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter
from ..engine.errors import InputError
from .constant import on_alarm_constant
from .questions import on_alarm, resolve, time_update
from .registry import register
from .wind_up import MEMORIES, precisions, shrink


@register("exponential:LAM", about="a sample fades to LAM of its weight with each new one", lam=0.95)
class ExponentialForgetting(NamedTuple):
    """A sample of age k counts ``lam`` to the power k: exponential forgetting, gain (1 - lam)/(1 - lam^n).

    The memory is 1/(1 - lam) samples. Without excitation no variance exceeds that of one typical sample (status
    CAPPED). P is what the weighted sum allows, as if old samples had louder noise. Where the parameters are in fact
    constant the variance of their estimate is P/(1 + lam): bars are sqrt(1 + lam), about 1.4, too wide, and leave room
    for drift. Source: Perriot-Mathonna (1981), eqs. 7-9 (his p). Bad at: directions that stay unexcited, which are
    forgotten meanwhile.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.ExponentialForgetting(0.97)).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.01, 0.02])
    """

    lam: float


class ExponentialForgettingKernel(NamedTuple):
    """What the kernel sees of it, and of `GainFloor`: lambda = min(lam, (samples - 1)/weight)."""

    lam: float
    samples: float
    horizon: float
    precision: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: those of `wind_up.shrink`."""
        return 1 + parameters


def weight_and_horizon(lam) -> tuple[float, float]:
    """Return a weight per sample, and over how many samples `shrink` calls something typical."""
    if np.ndim(lam) > 0:
        raise InputError(
            f"lam is one weight for all parameters, got {lam!r}: a single sum over the past fades. Where each is to "
            "have a pace of its own say how fast it drifts, RandomWalk([q, ..]), or let AutoMemory() find out"
        )
    lam = validation.share("lam", lam, "a weight per sample")
    return lam, MEMORIES / (1 - lam) if lam < 1 else np.inf


@resolve.on(ExponentialForgetting)
def resolve_exponential_forgetting(memory, setting):
    lam, horizon = weight_and_horizon(memory.lam)
    return ExponentialForgettingKernel(lam, np.inf, horizon, precisions(setting.cap))


@time_update.on(ExponentialForgettingKernel)
def time_update_exponential_forgetting(memory, state, elapsed, view):
    lam = memory.lam
    if view.weight > 0.0:
        lam = min(lam, (memory.samples - 1.0) / view.weight)
    if not (view.surprise >= 0.0 and lam < 1.0):
        return 1.0, 0
    return lam, shrink(lam, memory.horizon, memory.precision, state, view)


on_alarm.on(ExponentialForgettingKernel)(on_alarm_constant)
