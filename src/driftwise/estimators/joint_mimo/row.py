"""Several outputs: what a state row and the scratch hold, and how a group of outputs is opened.

A *group* is what one filter covers: all outputs (coupled), or one (split; the others are data). Kernel order of a
group's unknowns: [x of each output, measured first; theta of each output].

A sample's disturbances are put in front of them, [z_p .. z_1 ; u_1 .. u_k ; v ; x ; theta]: a missing output's or a
held input's error is then an unknown like any other, exact in U D U' (its row of U says what it is made of, its D what
is its own), y is known without noise once v is given, and time runs by one linear map that drops the front.
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, kernel, open_scratch, rare
from ...engine.layout import Field, Layout, each, joined
from ...engine.ud import entry
from ..common.given_state import COUNTS, room_size
from ..common.inputs import each_input


class MimoForm(NamedTuple):
    """Sizes, tables and constants of a joint filter of several outputs."""

    outputs: float
    inputs: float
    groups: float
    unknowns: float
    light: float  # 1: white noise and groups of one output, so a complete sample needs nothing in front
    floor: float  # relative error carried by each y
    exact: float  # 1: some output is measured without noise
    first: Vector  # first output of each group, and one past the last
    x_at: Vector  # where the state of each output begins, and one past the last
    theta_at: Vector
    U_at: Vector  # where the factor of each group begins in the row
    work_at: Vector  # and its scratch
    block_at: Vector  # and its blocks
    blocks: Vector  # start, size, row and source of each, start and row within the group; row -(1+i): into y_i itself
    spent: Vector  # samples that the reference prior of each group's scale costs
    Px: Vector  # prior variance of each measured state
    least: Vector  # variance of each state that counts as none
    settle: float  # measured samples of an output before its detector watches
    detector_size: float  # numbers that the detector of an output keeps
    fades: float  # 1: the memory says how many samples count
    learns: float  # 1: it takes a sample in by its own rule
    forgets_state: float  # 1: what it forgets of the parameters it forgets of the state given them, too
    memory_at: Vector  # where what the memory of each group keeps begins in the row, and one past the last
    spec_at: Vector  # where the memory of each group begins in ``spec``
    spec: Vector  # the memories of all groups


JOINT_MIMO = Layout(
    Field("samples", (), "samples taken"),
    *each(
        "outputs",
        observed="each output: samples corrected by it",
        status="bits of the last one",
        in_a_row="outliers in a row, until now",
        peak="largest recent |y|",
        top="largest |y|",
    ),
    *each("groups", chi2="each group of outputs: sum of e^2/T", logdet="sum of log T"),
    *joined(
        "s",
        Field("x", ("n",), "state at the next sample, output by output, the measured one first", trace="x{i}.{output}"),
        Field("theta", ("unknowns - n",), "parameters, output by output", trace="their names"),
    ),
    Field("D", ("unknowns",), "P = U D U' of each group, relative to its sigma^2: the diagonals"),
    Field("U", ("int(form.U_at[groups])",), "and the factors above them, group by group, column by column"),
    *each_input(),
    Field("detector_state", ("outputs", "detector_size"), "what the detector of each output keeps"),
    Field("memory_state", ("int(form.memory_at[groups])",), "what the memory of each group keeps"),
    Field(
        "counts",
        (f"{COUNTS} * groups * fades",),
        "each group: samples that count, for sigma^2 and for the gain; log density of all",
    ),
    n="int(form.x_at[outputs])",
)
JOINT_MIMO.on(MimoForm)


class Work(NamedTuple):
    """Scratch."""

    z: np.ndarray  # the data of the sample, [-y ; u], a missing one as predicted
    spread: np.ndarray  # variance of each datum's error (absolute); 0: known
    q: np.ndarray  # how many unknowns stand in front, per group
    s2: np.ndarray  # scale before the sample, per group
    surprise: np.ndarray  # mean e^2/T of the outputs that taught something, per group
    alarm: np.ndarray  # what their detectors said, per group
    R: np.ndarray  # noise variance of each output with its round-off
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    g: np.ndarray
    V: np.ndarray
    Y: np.ndarray
    rest: np.ndarray  # one stretch per group: s, D, U with room in front
    room: np.ndarray  # where the memory of a group learns


class Group(NamedTuple):
    """One group's sizes and views; ``A`` has room for what stands in front, ``U`` is the factor in the row."""

    first: int
    last: int
    n: int
    N: int
    x0: int  # where its state begins in that of all
    theta0: int  # the same for theta, within [x ; theta] of all
    s: np.ndarray
    D: np.ndarray
    A: np.ndarray
    U: np.ndarray
    blocks: np.ndarray


def widths(form, noise) -> tuple[int, int, int]:
    """Return the longest vector, the number of state rows and of columns that the scratch needs room for."""
    p, k = int(form.outputs), int(form.inputs)
    long = wide = tall = 0
    for g in range(int(form.groups)):
        first, last = int(form.first[g]), int(form.first[g + 1])
        n = int(form.x_at[last] - form.x_at[first])
        N = n + int(form.theta_at[last] - form.theta_at[first])
        front = p + k + last - first
        columns = int(noise.G_at[g + 1] - noise.G_at[g]) // n
        long, tall, wide = max(long, N + front), max(tall, n), max(wide, front + 2 * n + columns)
    return long, tall, wide


def scratch_size(form, noise) -> int:
    """Return how many numbers of scratch a run needs."""
    p, k, groups = int(form.outputs), int(form.inputs), int(form.groups)
    long, tall, wide = widths(form, noise)
    fixed = 2 * (p + k) + 4 * groups + p + 3 * long + 2 * wide + tall * tall + tall * wide + int(form.work_at[groups])
    return fixed + learning_size(form)


@kernel
def learning_size(form):
    """Return how many numbers of scratch it takes where the memory learns by its own rule."""
    p, k, size = int(form.outputs), int(form.inputs), 0
    for g in range(int(form.groups)):
        first, last = int(form.first[g]), int(form.first[g + 1])
        n = int(form.x_at[last] - form.x_at[first])
        size = max(size, room_size(n + p + k + last - first, int(form.theta_at[last] - form.theta_at[first])))
    return size if form.learns > 0.0 else 0


@open_scratch.on(MimoForm)
def open_scratch_mimo_form(form, buffer):
    p, k, groups = int(form.outputs), int(form.inputs), int(form.groups)
    long = tall = 0
    for g in range(groups):
        first, last = int(form.first[g]), int(form.first[g + 1])
        n = int(form.x_at[last] - form.x_at[first])
        N = n + int(form.theta_at[last] - form.theta_at[first])
        long, tall = max(long, N + p + k + last - first), max(tall, n)
    end = buffer.size - learning_size(form)
    left = end - 2 * (p + k) - 4 * groups - p - 3 * long - tall * tall - int(form.work_at[groups])
    wide = left // (tall + 2)
    q = 2 * (p + k)
    R = q + 4 * groups
    f = R + p
    d = f + 3 * long
    V = d + 2 * wide
    Y = V + tall * tall
    rest = Y + tall * wide
    return Work(
        buffer[: p + k], buffer[p + k : q], buffer[q : q + groups], buffer[q + groups : q + 2 * groups],
        buffer[q + 2 * groups : q + 3 * groups], buffer[q + 3 * groups : R], buffer[R:f],
        buffer[f : f + long], buffer[f + long : f + 2 * long], buffer[f + 2 * long : d],
        buffer[d : d + wide], buffer[d + wide : V],
        buffer[V:Y].reshape(tall, tall), buffer[Y:rest].reshape(tall, wide), buffer[rest:end],
        buffer[end:],
    )  # fmt: skip


@kernel
def open_group(form, state, scratch, g):
    """Return the views of group g."""
    first, last = int(form.first[g]), int(form.first[g + 1])
    x0, theta0 = int(form.x_at[first]), int(form.x_at[int(form.outputs)] + form.theta_at[first])
    n = int(form.x_at[last]) - x0
    N = n + int(form.theta_at[last] - form.theta_at[first])
    long = N + int(form.outputs) + int(form.inputs) + last - first
    s = int(form.work_at[g])
    D = s + long
    A = D + long
    end = A + long * (long - 1) // 2
    return Group(
        first, last, n, N, x0, theta0, scratch.rest[s:D], scratch.rest[D:A], scratch.rest[A:end],
        state.U[int(form.U_at[g]) : int(form.U_at[g + 1])],
        form.blocks[4 * int(form.block_at[g]) : 4 * int(form.block_at[g + 1])],
    )  # fmt: skip


@kernel
def place(form, src):
    """Return where a datum stands in front: outputs last one first, since each is made of those before it."""
    p = int(form.outputs)
    return p - 1 - src if src < p else src


@kernel
def gather(state, group):
    """Copy the group's means and D out of the row."""
    for i in range(group.N):
        at = group.x0 + i if i < group.n else group.theta0 + i - group.n
        group.s[i], group.D[i] = state.s[at], state.D[at]


@kernel
def scatter(state, group):
    """Copy them back."""
    for i in range(group.N):
        at = group.x0 + i if i < group.n else group.theta0 + i - group.n
        state.s[at], state.D[at] = group.s[i], group.D[i]


@kernel
def add_row(U, size, i, weight, f):
    """f += weight times row i of U, for ``size`` columns."""
    f[i] += weight
    at = i * (i + 1) // 2 + i  # entry (i, i + 1)
    for c in range(i + 1, size):
        f[c] += weight * U[at]
        at += c


@rare
def covariance(U, D, size, i, j):
    """Return P[i, j]."""
    p = 0.0
    for c in range(max(i, j), size):
        p += entry(U, i, c) * entry(U, j, c) * D[c]
    return p


@rare
def make_room(U, A, s, D, N, more):
    """Write U into A (which may be U itself) behind ``more`` known zeros, and move s and D likewise."""
    for c in range(N - 1, -1, -1):
        at, after = c * (c - 1) // 2, (c + more) * (c + more - 1) // 2
        for i in range(c - 1, -1, -1):
            A[after + more + i] = U[at + i]
        for i in range(more):
            A[after + i] = 0.0
        s[c + more], D[c + more] = s[c], D[c]
    for i in range(more * (more - 1) // 2):
        A[i] = 0.0
    for c in range(more):
        s[c] = D[c] = 0.0
