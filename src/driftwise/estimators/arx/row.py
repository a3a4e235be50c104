"""The state row of a recursive estimator: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Size, Vector, choice, kernel, open_row, open_scratch
from ...engine.views import matrix

# head of the row, one number each: COUNT and CHI2 (of sigma^2) and WEIGHT fade with the memory; PAST: samples since
# the first measured y
SAMPLES, OBSERVED, STATUS, IN_A_ROW, COUNT, CHI2, LOGDET, SCORE, WEIGHT, TOP, PAST = range(11)
HEAD = ("samples", "observed", "status", "in_a_row", "count", "chi2", "logdet", "score", "weight", "top", "past")
INPUT = ("held", "unsure", "known", "sums", "squares", "steps")  # numbers kept for each input
PREDICT, HOLD, SKIP = range(3)  # what stands for a missing number among the regressors
COLUMNS = 9  # prediction, innovation, variance, status, weight, statistic, since, which, dof; then what a mixture tells
HUGE = 1e60  # beyond this a product of four, and of a variance, would overflow


class Lags(NamedTuple):
    """Regressors are past outputs and inputs: A(q) y = B(q) u + e, theta = [a1.., b of each input.., offset]."""

    N: Size
    na: Size
    inputs: Size
    deep: Size  # lags kept of each input
    registers: Size  # more numbers that the form keeps
    memory_size: Size  # numbers that the memory keeps
    detector_size: Size  # numbers that the detector keeps
    missing: Size  # PREDICT, HOLD or SKIP
    settle: float  # measured samples before the detector counts
    fill: float  # samples until the registers hold no time before the record
    offset: float  # value of the constant regressors, the last ones; 0: none
    told: Size  # columns of the trace that the memory fills
    nb: Vector
    nk: Vector


class Row(NamedTuple):
    """Views of one state row."""

    head: np.ndarray
    theta: np.ndarray
    D: np.ndarray
    U: np.ndarray
    ys: np.ndarray  # past outputs (na,), newest first
    ydoubt: np.ndarray  # covariance (na na,) of their errors, where some were predicted
    held: np.ndarray  # each input: its value, predicted while missing
    unsure: np.ndarray
    known: np.ndarray
    sums: np.ndarray
    squares: np.ndarray
    steps: np.ndarray
    us: np.ndarray  # inputs (k, deep), newest first, and the variance of those that were predicted
    udoubt: np.ndarray
    registers: np.ndarray
    memory_state: np.ndarray
    detector_state: np.ndarray


class Work(NamedTuple):
    """Scratch: psi is the gradient of the prediction, f = U' psi, slope is psi/sqrt(T)."""

    psi: np.ndarray
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    slope: np.ndarray
    own: np.ndarray  # the form's own


def fields(form) -> list[tuple]:
    """Return the fields of a row as NumPy's dtype wants them; the order is that of `Row`."""
    N, na, k, deep = int(form.N), int(form.na), int(form.inputs), int(form.deep)
    M = 0 if getattr(form, "is_bare", False) else N  # no covariance
    return [
        *((name, "f8") for name in HEAD),
        ("x", "f8", (0,)), ("theta", "f8", (N,)), ("D", "f8", (M,)), ("U", "f8", (M * (M - 1) // 2,)),
        ("ys", "f8", (na,)), ("ydoubt", "f8", (na * na,)),
        *((name, "f8", (k,)) for name in INPUT),
        ("us", "f8", (k, deep)), ("udoubt", "f8", (k, deep)),
        ("registers", "f8", (int(form.registers),)), ("memory_state", "f8", (int(form.memory_size),)),
        ("detector_state", "f8", (int(form.detector_size),)),
    ]  # fmt: skip


@open_row.on(Lags)
def open_row_lags(form, row):
    N, na, k, deep = int(form.N), int(form.na), int(form.inputs), int(form.deep)
    s = len(HEAD)
    D = s + N
    U = D + N
    y = U + N * (N - 1) // 2
    S = y + na
    h = S + na * na
    u = h + 6 * k
    r = u + 2 * k * deep
    c = r + int(form.registers)
    m = c + int(form.memory_size)
    inputs, lags = matrix(row[h:u], 6, k), matrix(row[u:r], 2 * k, deep)
    return Row(
        row[:s], row[s:D], row[D:U], row[U:y], row[y:S], row[S:h],
        inputs[0], inputs[1], inputs[2], inputs[3], inputs[4], inputs[5],
        lags[:k], lags[k:], row[r:c], row[c:m], row[m:],
    )  # fmt: skip


OWN = 0  # scratch of the form itself


@open_scratch.on(Lags)
def open_scratch_lags(form, buffer):
    N = int(form.N)
    v = matrix(buffer[: 5 * N], 5, N)
    return Work(v[0], v[1], v[2], v[3], v[4], buffer[5 * N :])


@choice
def regress(form, state, scratch, s2):
    """Fill ``scratch.psi``; return the prediction and the variance that predicted regressors add to it."""


@choice
def renew(form, state, scratch, y, doubt, e, T):
    """Take y (of variance ``doubt``, where it was predicted) into the registers, with the new theta; return status.

    e is the innovation, NaN where y was predicted, T its variance.
    """


@kernel
def push(line, value):
    """Shift a register by one and put ``value`` first."""
    for i in range(line.size - 1, 0, -1):
        line[i] = line[i - 1]
    if line.size:
        line[0] = value
