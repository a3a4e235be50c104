"""How an innovation becomes a correction of the parameters."""

import math
from typing import NamedTuple

from ...engine.dispatch import choice, kernel
from ...memory.questions import View, adapt
from .row import WEIGHT


class LeastSquares(NamedTuple):
    """Gain P psi / T with P from the memory: least squares, prediction error, Kalman; ``R`` is the noise's."""

    R: float


@kernel
def view_of(state, scratch, s2, surprise):
    """Return what the memory sees of a state."""
    return view_of_output(state, scratch, s2, surprise, math.nan)


@kernel
def view_of_output(state, scratch, s2, surprise, y):
    """Return what it sees while an output is taken in."""
    nothing = scratch.c[:0]
    return View(
        0, state.theta, state.U, state.D, scratch.psi, scratch.f, scratch.b, scratch.c,
        s2, state.head[WEIGHT], surprise, 0.0, nothing, scratch.row, y, nothing, 0.0,
    )  # fmt: skip


@choice
def correct_by(method, memory, state, e, R, s2, y, scratch):
    """Take the innovation e of an output y and the row ``scratch.psi`` into the state; return its expected variance T.

    Minus T says that the sample could not be used.
    """


@correct_by.on(LeastSquares)
def correct_by_least_squares(method, memory, state, e, R, s2, y, scratch):
    return adapt(memory, state.memory_state, e, R, view_of_output(state, scratch, s2, math.nan, y))
