"""Stochastic gradient: theta <- theta + step psi e/(psi' psi). The cheap end: O(N) per sample, and no covariance."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, open_scratch
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.exponential_forgetting import ExponentialForgetting
from ...memory.gain_floor import GainFloor
from .methods import correct_by
from .row import LAGS, Lags, Work, regress
from .step import fill_lags, steps_like_lags

LEAST = 1e-3  # added to psi' psi, in units of y squared


@steps_like_lags
class LagsAlone(Lags):
    """`Lags` without a covariance."""

    __slots__ = ()


class Gradient(NamedTuple):
    """Gain step M psi/(c + psi' M psi), M the squared units of theta (one where the data have none)."""

    R: float
    step: float
    plain: float  # 1: the gain is step M psi/y_scale^2, not normalised, but never beyond M psi/(psi' M psi)
    unit: float  # y_scale^2
    units: Vector


LAGS.replace(M="0").on(LagsAlone)


@open_scratch.on(LagsAlone)
def open_scratch_lags_alone(form, buffer):
    N, nothing = int(form.N), buffer[:0]  # the row of a covariance that is not there
    return Work(nothing, nothing, buffer[N : 2 * N], nothing, nothing, nothing, buffer[:N])


@regress.on(LagsAlone)
def regress_lags_alone(form, state, scratch, s2):
    return fill_lags(form, state, scratch.own, s2)


@correct_by.on(Gradient)
def correct_by_gradient(method, memory, state, e, R, s2, y, scratch):
    theta, psi, units = state.theta, scratch.own, method.units
    size = 0.0
    for i in range(theta.size):
        size += units[i] * psi[i] * psi[i]
    if method.plain != 0.0:
        gain = min(method.step / method.unit, 1.0 / size) if size > 0.0 else 0.0
    else:
        gain = method.step / (LEAST * method.unit + size)
    for i in range(theta.size):
        theta[i] += gain * units[i] * psi[i] * e
    return R


def gradient(kind, step, memory, units, y_scale, R) -> Gradient:
    """Return the method "nlms" or "lms"."""
    if not (isinstance(step, int | float | np.number) and 0 < step < 2):
        raise InputError(f"step must lie between 0 and 2, where the recursion is stable, got {step!r}")
    if type(memory) not in (Constant, GainFloor, ExponentialForgetting):
        raise InputError(
            f"with method={kind!r} a constant step forgets by itself; memory says how the variance does: "
            f"Constant(), GainFloor(N) or ExponentialForgetting(lam), got {memory!r}"
        )
    return Gradient(R, float(step), float(kind == "lms"), y_scale**2, units)
