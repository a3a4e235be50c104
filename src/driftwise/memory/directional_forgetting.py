"""Directional forgetting: only what the new sample speaks about is forgotten."""

import math
from typing import NamedTuple

from ..engine.dispatch import PerParameter
from ..engine.ud import covariances, predicted_variance, project, widen_along
from .constant import on_alarm_constant
from .exponential_forgetting import weight_and_horizon
from .questions import adapt, least_squares, on_alarm, resolve, time_update
from .registry import register
from .wind_up import precisions, shrink


@register("directional:LAM", about="exponential, but only what new samples speak about", lam=0.95)
class DirectionalForgetting(NamedTuple):
    """Forget by the factor ``lam`` what the regressors psi of the new sample speak about; all else is kept as it is.

    Before each correction P <- P + (1/lam - 1) d d', d = P psi/sqrt(psi' P psi): the prediction's variance psi' P psi
    grows by 1/lam. In terms of information R <- R - (1 - lam) psi psi'/(psi' P psi), which cannot lose positivity, and
    knows no units. One direction of N is forgotten per sample, so the memory is N/(1 - lam) samples, N times that of
    `ExponentialForgetting`, even where all are excited; directions that never are, are never forgotten.

    Source: Kulhavy (1987), Automatica 23, 589-600. Bad at: following jumps and drift (unless lam makes up for N; after
    a jump the bars are too narrow for two or three memories); a regressor hundreds of times larger than the others,
    whose direction then stays put for long; and regressors that shrink to noise, which forget as much as large ones and
    teach nothing (held as in `ExponentialForgetting`). On constant parameters bars are too wide, as there.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.memory.DirectionalForgetting(0.95)).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.0, 0.02])
    """

    lam: float


class DirectionalForgettingKernel(NamedTuple):
    """What the kernel sees of `DirectionalForgetting`."""

    lam: float
    horizon: float
    precision: PerParameter

    def state_size(self, parameters: int) -> int:
        """Return how many numbers it keeps: those of `wind_up.shrink`."""
        return 1 + parameters


@resolve.on(DirectionalForgetting)
def resolve_directional_forgetting(memory, setting):
    return DirectionalForgettingKernel(*weight_and_horizon(memory.lam), precisions(setting.cap))


@adapt.on(DirectionalForgettingKernel)
def adapt_directional_forgetting(memory, state, e, R, view):
    U, D, known = view.U, view.D, predicted_variance(view.f, view.D, 0.0)
    if memory.lam < 1.0 and known > 0.0:
        covariances(U, D, view.f, view.c)
        for i in range(D.size):
            view.c[i] /= math.sqrt(known)
        widen_along(U, D, view.c, 1.0 / memory.lam - 1.0, D.size - 1)
        project(U, view.psi, view.f)
    return least_squares(e, R, view)


@time_update.on(DirectionalForgettingKernel)
def time_update_directional_forgetting(memory, state, elapsed, view):
    if not (view.surprise >= 0.0 and memory.lam < 1.0):
        return 1.0, 0
    return memory.lam, shrink(1.0, memory.horizon, memory.precision, state, view)


on_alarm.on(DirectionalForgettingKernel)(on_alarm_constant)
