"""The joint filter's numbers: what a state row and the scratch hold, and H s.

Kernel order of s: the state reversed, x_n first, then theta = a_{n-1}..a_0, b_{n-1}..b_0 of each input and the
direct terms b_n: in q^-1 language a1..an, b1..bn, b0; an offset is last. In this order F is a shift up plus data times
parameter blocks that line up with the shift, and H = [1, 0, .., 0, u, 1]:

    x+ = shift_up(x) - y a + sum_l u_l b_l + w,      y = x_n + sum_l u_l b_n,l + offset + w_n

The state row carries s(t+1 | t). U, D are the factors of its covariance (relative to sigma^2).
"""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Size, kernel, open_scratch
from ...engine.layout import Field, Layout, joined, numbers, policy
from ...engine.views import matrix
from ..common.given_state import COUNTS, Room, open_room, room_size
from ..common.inputs import each_input

SAMPLES, OBSERVED, STATUS, IN_A_ROW, CHI2, LOGDET, PEAK, TOP = range(8)  # of the head of a row
MEMO = 5  # what the last step did: T (0: no correction), R, e, what multiplied a, whether kappa holds
USED_T, USED_R, USED_E, USED_Y, HAS_KAPPA = range(MEMO)
HUGE = 1e100  # beyond this a square or a product of two would overflow


class Form(NamedTuple):
    """Sizes and constants of a joint filter."""

    n: Size
    inputs: Size
    direct: Size  # number of direct terms: 0 or the number of inputs
    coloured: Size  # 1 where the noise polynomial is unknown: its innovation v is one more "input", else 0
    rows: Size  # rows that the time update re-triangularises: n (the state), or N (noise on the parameters)
    noises: Size  # columns of G
    floor: float  # relative error carried by each y: R_t = R + (floor max|y recent|)^2
    Px: float  # prior variance of the measured state
    least: float  # variance of the state, negligible beside R, that counts as none
    settle: float  # measured samples before the detector watches
    detector_size: Size  # numbers that the detector keeps
    memory_size: Size  # and the memory
    fades: Size  # 1: the memory says how many samples count
    learns: Size  # 1: it takes a sample in by its own rule
    slopes: Size  # 1: the detector wants the slopes of the innovations by the parameters
    forgets_state: float  # 1: what it forgets of the parameters it forgets of the state given them, too
    offset: Size = 0.0  # 1: the last parameter is an offset
    fresh: Size = 0.0  # 1: the memory doubts parameters, and the state has a past of its own: `common.fresh`


JOINT = Layout(
    *numbers(
        "head",
        samples="samples taken",
        observed="of them, corrected by an output",
        status="bits of the last one",
        in_a_row="outliers in a row, until now",
        chi2="sum of e^2/T",
        logdet="sum of log T",
        peak="largest recent |y|",
        top="largest |y|",
    ),
    *joined(
        "s",
        Field("x", ("n",), "state at the next sample, the measured one first", trace="x{i}"),
        Field("theta", ("N - n",), "parameters", trace="their names"),
    ),
    Field("D", ("N",), "P = U D U', relative to sigma^2: the diagonal"),
    Field("U", ("N * (N - 1) // 2",), "and the factor above it, column by column"),
    *each_input("k"),
    policy("detector_state", of="detector"),
    policy("memory_state", of="memory"),
    Field("counts", (f"{COUNTS} * fades",), "samples that count, for sigma^2 and for the gain; log density of all"),
    Field("fresh", ("(1 + n * (N - n)) * fresh",), "what parameters do to x since they are doubted; whether they are"),
    k="inputs + coloured",
    N="n * (k + 2) + direct + offset",
)
JOINT.on(Form)


class Work(NamedTuple):
    """Sizes as integers, and scratch."""

    n: int
    inputs: int
    blocks: int  # inputs, and the noise v where its polynomial is unknown: each multiplies n parameters
    direct: int
    offset: int
    rows: int
    least: float
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    kappa: np.ndarray
    Y: np.ndarray
    d: np.ndarray
    g: np.ndarray
    memo: np.ndarray  # what the last step did, for the smoother
    room: Room  # where the memory learns


@kernel
def memo_size(form):
    """Return how many numbers tell what a step did."""
    return MEMO + int(form.n * form.coloured)


def scratch_size(form) -> int:
    """Return how many numbers of scratch a run needs."""
    n, k, rows = int(form.n), int(form.inputs + form.coloured), int(form.rows)
    m = n * (k + 1) + int(form.direct) + int(form.offset)
    width = rows + int(form.noises) + (k + 1) * (m + 1) + 2
    return 4 * (n + m) + (rows + 2) * width + memo_size(form) + int(max(form.learns, form.slopes)) * room_size(n, m)


@open_scratch.on(Form)
def open_scratch_form(form, scratch):
    n, k, rows = int(form.n), int(form.inputs), int(form.rows)
    blocks = k + int(form.coloured)
    N = n * (blocks + 2) + int(form.direct) + int(form.offset)
    has_room = int(max(form.learns, form.slopes))
    last = scratch.size - has_room * room_size(n, N - n)
    at, end = 4 * N, last - memo_size(form)
    vectors = matrix(scratch[:at], 4, N)
    wide = matrix(scratch[at:end], rows + 2, (end - at) // (rows + 2))
    return Work(
        n, k, blocks, int(form.direct), int(form.offset), rows, form.least,
        vectors[0], vectors[1], vectors[2], vectors[3], wide[:rows], wide[rows], wide[rows + 1], scratch[end:last],
        open_room(scratch[last:], has_room * n, has_room * (N - n)),
    )  # fmt: skip


@kernel
def predict_output(s, u, direct, offset):
    """Return H s, H = [1, 0, .., 0, u, 1], the 1 at the end where there is an offset."""
    yhat = s[0]
    first = s.size - direct - offset
    for l in range(direct):
        yhat += u[l] * s[first + l]
    if offset > 0:
        yhat += s[s.size - 1]
    return yhat


@kernel
def project(U, N, u, direct, offset, f):
    """Fill f = U' h."""
    last = N - offset
    first = last - direct
    f[0] = 1.0
    at = 0
    for j in range(1, N):
        at += j - 1
        f[j] = U[at]
        if j >= first:
            for i in range(first, j):
                f[j] += u[i - first] * U[at + i]
            f[j] += u[j - first] if j < last else 1.0
