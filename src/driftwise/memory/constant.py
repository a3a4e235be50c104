"""Constant parameters: nothing is forgotten."""

from typing import NamedTuple

from ..engine.status import JUMP
from .questions import on_alarm
from .registry import register
from .wind_up import hold_within


@register("constant", about="constant parameters")
class Constant(NamedTuple):
    """Nothing is forgotten: constant parameters, gain 1/n. Bad at plants that change.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.Constant()).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 1.3], [0.01, 0.02])
    """


@on_alarm.on(Constant)
def on_alarm_constant(memory, state, alarm, view):
    """Let the gain be 1/``view.reopen`` again, where the estimator asks for it."""
    lam = (view.reopen - 1.0) / view.weight if view.reopen > 1.0 and view.weight > 0.0 else 1.0
    if lam >= 1.0:
        return view.weight, JUMP
    for j in range(view.D.size):
        view.D[j] /= lam
    hold_within(view.U, view.D, view.cap, view.c, view.f, view.b)
    return lam * view.weight, JUMP
