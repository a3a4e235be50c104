"""Forgetting: the past counts less and less, at a rate that is given, or that the surprises choose."""

from typing import NamedTuple

from ..engine.dispatch import Vector
from .adapt import plain, time_update
from .hold import shrink


class GainFloor(NamedTuple):
    """The gain falls like 1/n and stops at 1/``samples``: then the past fades with that many samples of memory.

    Without excitation no variance exceeds that of one typical sample (status CAPPED). Where the parameters are in fact
    constant, their bars are 1.4 times too wide, as those of `ExponentialForgetting`.
    Source: Perriot-Mathonna (1981), eq. 6. Bad at: both ends, as every constant gain is (slow after a jump, restless
    without one).
    """

    samples: float


class ExponentialForgetting(NamedTuple):
    """A sample of age k counts ``lam`` to the power k: exponential forgetting, gain (1 - lam)/(1 - lam^n).

    The memory is 1/(1 - lam) samples. Without excitation no variance exceeds that of one typical sample (status
    CAPPED). P is what the weighted sum allows, as if old samples had louder noise. Where the parameters are in fact
    constant the variance of their estimate is P/(1 + lam): bars are sqrt(1 + lam), about 1.4, too wide, and leave room
    for drift. Source: Perriot-Mathonna (1981), eqs. 7-9 (his p). Bad at: directions that stay unexcited, which are
    forgotten meanwhile.
    """

    lam: float


class VariableForgetting(NamedTuple):
    """Forget as much as the last error surprises: lambda = 1 - e^2/(sigma^2 T ``samples``), at least ``least``.

    While the model fits, the memory is ``samples`` long; an error of k standard deviations forgets as much as k^2
    usual ones. Where the noise variance is learnt, the memory keeps two samples per parameter. Where the parameters are
    in fact constant, their bars are about 1.4 times too wide, as those of `ExponentialForgetting`.
    Source: Fortescue, Kershenbaum and Ydstie (1981): constant information. Bad at: outliers and noise
    that grows, both of which it takes for a change (put a `InnovationGate` before it).
    """

    samples: float = 100.0
    least: float = 0.9


class Fade(NamedTuple):
    """What the kernel sees of `GainFloor` and `ExponentialForgetting`: lambda = min(lam, (samples - 1)/weight)."""

    lam: float
    samples: float
    horizon: float
    cap: Vector


class Alert(NamedTuple):
    """What the kernel sees of `VariableForgetting`; below ``settle`` effective samples nothing is forgotten."""

    samples: float
    least: float
    settle: float
    horizon: float
    cap: Vector


plain(Fade, Alert)


@time_update.on(Fade)
def time_update_fade(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    lam = memory.lam
    if weight > 0.0:
        lam = min(lam, (memory.samples - 1.0) / weight)
    if not (surprise >= 0.0 and lam < 1.0):
        return 1.0, 0
    return lam, shrink(U, D, lam, weight, memory.horizon, memory.cap, memory_state, scratch)


@time_update.on(Alert)
def time_update_alert(memory, memory_state, weight, surprise, share, s2, theta, U, D, scratch):
    lam = max(1.0 - surprise / memory.samples, memory.least)
    if not (surprise >= 0.0 and lam < 1.0 and weight > memory.settle):
        return 1.0, 0
    return lam, shrink(U, D, lam, weight, memory.horizon, memory.cap, memory_state, scratch)
