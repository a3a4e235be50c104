"""The state row of recursive equations side by side: what they share, and the part of each.

Every equation has head, theta, D, U, cells and marks of its own, as a recursive estimator of one output has. The lags
of outputs and inputs are kept once.
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, kernel, open_row, open_scratch
from ..arx.row import HEAD, INPUT, Lags

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
    told: float
    past: Vector  # (p,) lags of each output
    nb: Vector
    nk: Vector


class Row(NamedTuple):
    """Views of one state row."""

    samples: np.ndarray
    heads: np.ndarray  # (HEAD, p)
    theta: np.ndarray
    D: np.ndarray
    U: np.ndarray
    ys: np.ndarray  # past outputs (p, past), newest first
    ydoubt: np.ndarray  # covariance (M M,) of their errors, M = p past, where some were predicted
    held: np.ndarray
    unsure: np.ndarray
    known: np.ndarray
    sums: np.ndarray
    squares: np.ndarray
    steps: np.ndarray
    us: np.ndarray
    udoubt: np.ndarray
    products: np.ndarray  # (p, p) of the innovations, e_i e_j weighed by their variances, and the sum of the weights
    weights: np.ndarray
    memory_state: np.ndarray
    detector_state: np.ndarray


class ChannelRow(NamedTuple):
    """What the step of one equation sees: its own numbers, everybody's lags; what belongs to inputs is empty."""

    head: np.ndarray
    theta: np.ndarray
    D: np.ndarray
    U: np.ndarray
    ys: np.ndarray  # its own output's
    all_ys: np.ndarray
    all_doubt: np.ndarray
    held: np.ndarray
    unsure: np.ndarray
    known: np.ndarray
    sums: np.ndarray
    squares: np.ndarray
    steps: np.ndarray
    us: np.ndarray
    udoubt: np.ndarray
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


def fields(form) -> list[tuple]:
    """Return the fields of a row as NumPy's dtype wants them; the order is that of `Row`."""
    p, k, past, deep = (int(v) for v in form[:4])
    N, U, memory_size, detector_size = (int(table[-1]) for table in form[5:9])
    return [
        ("samples", "f8"), ("clock", "f8", (p,)), *((name, "f8", (p,)) for name in HEAD[1:]),
        ("x", "f8", (0,)), ("theta", "f8", (N,)), ("D", "f8", (N,)), ("U", "f8", (U,)),
        ("ys", "f8", (p, past)), ("ydoubt", "f8", ((p * past) ** 2,)),
        *((name, "f8", (k,)) for name in INPUT),
        ("us", "f8", (k, deep)), ("udoubt", "f8", (k, deep)),
        ("products", "f8", (p, p)), ("weights", "f8", (p, p)), ("memory_state", "f8", (memory_size,)),
        ("detector_state", "f8", (detector_size,)),
    ]  # fmt: skip


@open_row.on(Several)
def open_row_several(form, row):
    p, k, past, deep = int(form.outputs), int(form.inputs), int(form.past), int(form.deep)
    N, memory_size = int(form.theta_at[p]), int(form.memory_at[p])
    s = 1 + len(HEAD) * p
    D = s + N
    U = D + N
    y = U + int(form.U_at[p])
    S = y + p * past
    h = S + (p * past) ** 2
    u = h + 6 * k
    z = u + 2 * k * deep
    c = z + 2 * p * p
    inputs, lags = row[h:u].reshape(6, k), row[u:z].reshape(2, k, deep)
    pairs = row[z:c].reshape(2, p, p)
    return Row(
        row[:1], row[1:s].reshape(len(HEAD), p), row[s:D], row[D:U], row[U:y], row[y:S].reshape(p, past), row[S:h],
        inputs[0], inputs[1], inputs[2], inputs[3], inputs[4], inputs[5], lags[0], lags[1], pairs[0], pairs[1],
        row[c : c + memory_size], row[c + memory_size :],
    )  # fmt: skip


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


open_scratch.on(Channel)(open_scratch.table[Lags])


@kernel
def open_channel(form, state, scratch, i):
    """Return the views of equation i."""
    theta0, theta1 = int(form.theta_at[i]), int(form.theta_at[i + 1])
    nothing = state.theta[:0]
    return ChannelRow(
        state.heads[:, i], state.theta[theta0:theta1], state.D[theta0:theta1],
        state.U[int(form.U_at[i]) : int(form.U_at[i + 1])], state.ys[i], state.ys, state.ydoubt,
        nothing, nothing, nothing, nothing, nothing, nothing, state.us, state.udoubt, scratch.fresh[i],
        state.memory_state[int(form.memory_at[i]) : int(form.memory_at[i + 1])],
        state.detector_state[int(form.detector_at[i]) : int(form.detector_at[i + 1])],
    )  # fmt: skip
