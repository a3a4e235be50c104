"""The state row of the adaptive gain: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, open_row, open_scratch
from ..arx.row import HEAD

COLUMNS = 8  # prediction, innovation, variance, status, weight, statistic, since, which
INNOVATION, PULL, PROBES = range(3)  # what the detector listens to


class GainForm(NamedTuple):
    """The plant, how its gain is learnt and kept stable, and what happens at an alarm."""

    n: float
    inputs: float
    score: float  # 1: full gradient of the prediction (rpem), 0: the last innovation only (plr)
    absolute: float  # 1: P is the covariance of K; 0: relative to the innovation variance
    start: float  # measured samples that set x by dead-beat (0: x was given)
    wait: float  # samples that make an innovation variance before K learns
    samples: float  # memory of that variance
    unit: float  # the variance before there is one
    settle: float  # measured samples before the detector counts
    signal: float
    low: float  # limits of H K, scalar state
    high: float
    radius: float  # poles of the filter stay inside; 0: not watched
    memory_size: float
    detector_size: float
    Phi: Vector
    H: Vector
    B: Vector
    dead_beat: Vector
    cap: Vector  # prior variances
    poles: Vector  # characteristic polynomial of the filter: poles + moves K
    moves: Vector
    reopen: Vector  # (up, down) answer to an alarm
    probes: Vector


class Row(NamedTuple):
    """Views of one state row."""

    head: np.ndarray
    x: np.ndarray  # predicted state x(t+1 | t)
    theta: np.ndarray  # K
    D: np.ndarray
    U: np.ndarray
    W: np.ndarray  # dx/dK
    held: np.ndarray  # inputs: last known value
    doubt: np.ndarray  # 1: an input was missing since the last measured output
    probes: np.ndarray  # predicted state of each probe
    memory_state: np.ndarray
    detector_state: np.ndarray


class Work(NamedTuple):
    """Scratch: psi is the gradient of the prediction, f = U' psi; G = W U."""

    psi: np.ndarray
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    slope: np.ndarray
    old: np.ndarray
    p: np.ndarray
    q: np.ndarray
    polynomial: np.ndarray
    G: np.ndarray
    ratios: np.ndarray


def fields(form) -> list[tuple]:
    """Return the fields of a row as NumPy's dtype wants them; the order is that of `Row`."""
    n = int(form.n)
    return [
        *((name, "f8") for name in HEAD),
        ("x", "f8", (n,)), ("theta", "f8", (n,)), ("D", "f8", (n,)), ("U", "f8", (n * (n - 1) // 2,)),
        ("W", "f8", (n, n)), ("held", "f8", (int(form.inputs),)), ("doubt", "f8", (1,)),
        ("probes", "f8", (len(form.probes) // n, n)), ("memory_state", "f8", (int(form.memory_size),)),
        ("detector_state", "f8", (int(form.detector_size),)),
    ]  # fmt: skip


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    n = int(form.n)
    return 9 * n + n * n + len(form.probes) // n


@open_row.on(GainForm)
def open_row_gain_form(form, row):
    n, M = int(form.n), form.probes.size
    s = len(HEAD)
    theta = s + n
    D = theta + n
    U = D + n
    W = U + n * (n - 1) // 2
    h = W + n * n
    d = h + int(form.inputs)
    p = d + 1
    c = p + M
    m = c + int(form.memory_size)
    return Row(
        row[:s], row[s:theta], row[theta:D], row[D:U], row[U:W], row[W:h].reshape(n, n), row[h:d], row[d:p],
        row[p:c].reshape(M // n, n), row[c:m], row[m:],
    )  # fmt: skip


@open_scratch.on(GainForm)
def open_scratch_gain_form(form, scratch):
    n = int(form.n)
    v, end = scratch[: 9 * n].reshape(9, n), 9 * n + n * n
    return Work(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], scratch[9 * n : end].reshape(n, n), scratch[end:])
