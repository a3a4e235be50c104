"""How an innovation becomes a correction of the parameters."""

from typing import NamedTuple

from ...engine.dispatch import choice
from ...memory.adapt import adapt


class LeastSquares(NamedTuple):
    """Gain P psi / T with P from the memory: least squares, prediction error, Kalman; ``R`` is the noise's."""

    R: float


@choice
def correct_by(method, memory, state, e, R, s2, scratch):
    """Take the innovation e of the row ``scratch.psi`` into the state; return the variance T it was expected to have.

    Minus T says that the sample could not be used.
    """


@correct_by.on(LeastSquares)
def correct_by_least_squares(method, memory, state, e, R, s2, scratch):
    return adapt(memory, state.memory_state, e, R, s2, state.theta, state.U, state.D, scratch)
