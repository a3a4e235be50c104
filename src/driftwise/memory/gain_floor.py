"""A gain that falls like 1/n, and no further than a floor."""

from typing import NamedTuple

from .exponential_forgetting import ExponentialForgettingKernel
from .questions import resolve
from .registry import register
from .settings import more_than_one
from .wind_up import MEMORIES, precisions


@register("gain-floor:N", about="gain 1/n, then 1/N", samples=20)
class GainFloor(NamedTuple):
    """The gain falls like 1/n and stops at 1/``samples``: then the past fades with that many samples of memory.

    Without excitation no variance exceeds that of one typical sample (status CAPPED). Where the parameters are in fact
    constant, their bars are 1.4 times too wide, as those of `ExponentialForgetting`.
    Source: Perriot-Mathonna (1981), eq. 6. Bad at: both ends, as every constant gain is (slow after a jump, restless
    without one).

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.memory.GainFloor(50)).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.01, 0.03])
    """

    samples: float


@resolve.on(GainFloor)
def resolve_gain_floor(memory, setting):
    samples = more_than_one("samples", memory.samples)
    return ExponentialForgettingKernel(1.0, samples, MEMORIES * samples, precisions(setting.cap))
