"""Constant parameters: nothing is forgotten."""

from typing import NamedTuple

from ..engine.status import JUMP
from .registry import on_alarm, register
from .wind_up import hold_within


@register("constant", about="constant parameters")
class Constant(NamedTuple):
    """Nothing is forgotten: constant parameters, gain 1/n. Bad at plants that change."""


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
