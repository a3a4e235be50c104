"""The state row of recursive equations side by side: what they share, and the part of each.

Every equation has head, theta, D, U, cells and marks of its own, as a recursive estimator of one output has. The lags
of outputs and inputs are kept once.
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, kernel, open_scratch
from ...engine.layout import Field, Layout, each, joined, policy
from ..arx.row import HEAD, LAGS, Lags
from ..common.inputs import each_input

FRESH = 5  # numbers that `renew` is given of an output, and one more


class Several(NamedTuple):
    """Sizes of the row, and the policies of every equation one after the other."""

    outputs: float
    inputs: float
    past: float  # lags kept of each output
    deep: float  # and of each input
    missing: float
    theta_at: Vector  # where the parameters of each equation begin, and one past the last: (p + 1,) each
    U_at: Vector
    memory_at: Vector
    detector_at: Vector
    spec_at: Vector
    spec: Vector


class Channel(NamedTuple):
    """One of the equations; its registers are everybody's, hence the zeros."""

    N: float
    na: float
    inputs: float
    deep: float
    registers: float
    memory_size: float
    detector_size: float
    missing: float
    settle: float
    fill: float
    offset: float
    mixture_columns: float
    past: Vector  # (p,) lags of each output
    nb: Vector
    nk: Vector


SEVERAL = Layout(
    Field("samples", (), "samples taken"),
    *joined(
        "heads",
        Field("clock", ("outputs",), "each output: the same"),
        *(field._replace(shape=("outputs",)) for field in HEAD[1:]),
        table=(f"{len(HEAD)}", "outputs"),
    ),
    *joined(
        "theta",
        Field("x", ("0",), "no state"),
        Field("theta", ("N",), "parameters of each equation", trace="their names"),
    ),
    Field("D", ("N",), "P = U D U' of each equation, relative to its sigma^2: the diagonals"),
    Field("U", ("int(form.U_at[outputs])",), "and the factors above them, column by column"),
    Field("ys", ("outputs", "past"), "past outputs, newest first"),
    Field("ys_covariance", ("(outputs * past) ** 2",), "covariance of their errors, where some were predicted"),
    *each_input(),
    *each("inputs", "deep", us="inputs, newest first", us_variance="variance of those that were predicted"),
    Field("products", ("outputs", "outputs"), "of the innovations, e_i e_j weighed by their variances"),
    Field("weights", ("outputs", "outputs"), "sums of the weights"),
    policy("memory_state", of="memory"),
    policy("detector_state", of="detector"),
    N="int(form.theta_at[outputs])",
    memory_size="int(form.memory_at[outputs])",
    detector_size="int(form.detector_at[outputs])",
)
SEVERAL.on(Several)


class ChannelRow(NamedTuple):
    """What the step of one equation sees: its own numbers, everybody's lags; what belongs to inputs is empty."""

    head: np.ndarray
    theta: np.ndarray
    D: np.ndarray
    U: np.ndarray
    ys: np.ndarray  # its own output's
    all_ys: np.ndarray
    all_covariance: np.ndarray
    held: np.ndarray
    input_variance: np.ndarray
    known: np.ndarray
    sums: np.ndarray
    squares: np.ndarray
    steps: np.ndarray
    us: np.ndarray
    us_variance: np.ndarray
    fresh: np.ndarray  # what the output of this sample was: `Work`
    memory_state: np.ndarray
    detector_state: np.ndarray


class Work(NamedTuple):
    """Scratch."""

    y: np.ndarray  # one sample of one output
    u: np.ndarray
    fresh: np.ndarray  # (p, FRESH + 2 M) each output of this sample, as `renew` got it; then c and g of `gaps`
    moved: np.ndarray  # (M,) what it corrects in the past ones
    e: np.ndarray  # innovations of this sample relative to their scale, NaN where there is none
    T: np.ndarray  # their variances
    lam: np.ndarray  # the forgetting
    line: np.ndarray  # one equation's row of the trace
    rest: np.ndarray


def scratch_size(form, longest: int) -> int:
    """Return how many numbers of scratch a run needs, of which an equation ``longest``."""
    N = int(np.diff(form.theta_at).max())
    return fixed_size(form) + line_size(N) + longest


@kernel
def fixed_size(form):
    """Return how many numbers of scratch come before the trace of an equation."""
    p, M = int(form.outputs), int(form.outputs * form.past)
    return 1 + p * (FRESH + 2 * M) + M + 3 * p


@kernel
def line_size(N):
    """Return the longest row of the trace that an equation of N parameters writes."""
    return 8 + 2 * N + N * (N + 1) // 2


@open_scratch.on(Several)
def open_scratch_several(form, buffer):
    p, M, N = int(form.outputs), int(form.outputs * form.past), 0
    for i in range(p):
        N = max(N, int(form.theta_at[i + 1] - form.theta_at[i]))
    wide, at = FRESH + 2 * M, fixed_size(form)
    m = 1 + p * wide
    e, end = m + M, at + line_size(N)
    return Work(
        buffer[:1].reshape(1, 1), buffer[:0].reshape(1, 0), buffer[1:m].reshape(p, wide), buffer[m:e],
        buffer[e : e + p], buffer[e + p : e + 2 * p], buffer[e + 2 * p : at], buffer[at:end], buffer[end:],
    )  # fmt: skip


LAGS.on(Channel)  # the settings of each equation are resolved as if it were alone
open_scratch.on(Channel)(open_scratch.table[Lags])


@kernel
def open_channel(form, state, scratch, i):
    """Return the views of equation i."""
    theta0, theta1 = int(form.theta_at[i]), int(form.theta_at[i + 1])
    nothing = state.theta[:0]
    return ChannelRow(
        state.heads[:, i], state.theta[theta0:theta1], state.D[theta0:theta1],
        state.U[int(form.U_at[i]) : int(form.U_at[i + 1])], state.ys[i], state.ys, state.ys_covariance,
        nothing, nothing, nothing, nothing, nothing, nothing, state.us, state.us_variance, scratch.fresh[i],
        state.memory_state[int(form.memory_at[i]) : int(form.memory_at[i + 1])],
        state.detector_state[int(form.detector_at[i]) : int(form.detector_at[i + 1])],
    )  # fmt: skip
