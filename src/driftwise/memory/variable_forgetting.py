"""Forgetting at a rate that the surprises choose."""

from typing import NamedTuple

from ..engine import validation
from ..engine.dispatch import PerParameter
from ..engine.errors import InputError
from .constant import on_alarm_constant
from .questions import on_alarm, resolve, time_update
from .registry import register
from .settings import more_than_one
from .wind_up import MEMORIES, precisions, shrink


@register("variable:N", about="forgets when surprised, else N samples", samples=20)
class VariableForgetting(NamedTuple):
    """Forget as much as the last error surprises: lambda = 1 - e^2/(sigma^2 T ``samples``), at least ``least``.

    While the model fits, the memory is ``samples`` long; an error of k standard deviations forgets as much as k^2
    usual ones. Where the noise variance is learnt, the memory keeps two samples per parameter. Where the parameters are
    in fact constant, their bars are about 1.4 times too wide, as those of `ExponentialForgetting`.
    Source: Fortescue, Kershenbaum and Ydstie (1981): constant information. Bad at: outliers and noise
    that grows, both of which it takes for a change (put a `InnovationGate` before it).

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.memory.VariableForgetting(50)).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.0, 0.02])
    """

    samples: float = 100.0
    least: float = 0.9


class VariableForgettingKernel(NamedTuple):
    """What the kernel sees of `VariableForgetting`; below ``settle`` effective samples nothing is forgotten."""

    samples: float
    least: float
    settle: float
    horizon: float
    precision: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: those of `wind_up.shrink`."""
        return 1 + parameters


@resolve.on(VariableForgetting)
def resolve_variable_forgetting(memory, setting):
    samples, least = more_than_one("samples", memory.samples), validation.positive("least", memory.least)
    if least > 1:
        raise InputError(f"least is the smallest lambda, above 0 and at most 1, got {memory.least!r}")
    return VariableForgettingKernel(samples, least, setting.settle, MEMORIES * samples, precisions(setting.cap))


@time_update.on(VariableForgettingKernel)
def time_update_variable_forgetting(memory, state, elapsed, view):
    lam = max(1.0 - view.surprise / memory.samples, memory.least)
    if not (view.surprise >= 0.0 and lam < 1.0 and view.weight > memory.settle):
        return 1.0, 0
    return lam, shrink(lam, memory.horizon, memory.precision, state, view)


on_alarm.on(VariableForgettingKernel)(on_alarm_constant)
