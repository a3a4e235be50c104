"""The state row of the algebraic observer: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, open_row, open_scratch
from ..window_observer.row import HEAD

COLUMNS = 5  # prediction, innovation, variance, status, statistic (0: nothing watches)


class Algebraic(NamedTuple):
    """The filter in units of samples (`filter.Filter`), and what is read out of it."""

    N: float
    inputs: float
    dt: float
    least: float  # samples until y and its derivatives are determined
    wait: float  # and until they are ready: epsilon
    R: float  # noise variance, relative to sigma^2 where that is learnt
    Phi: Vector
    Y0: Vector
    Y1: Vector
    U0: Vector  # empty without an input
    U1: Vector
    powers: Vector
    alpha: Vector
    reach: Vector  # (N,): y one sample on, from z = (y, y', ..) in units of samples
    ahead: Vector  # (2,): and from u(k), u(k+1)
    rows: Vector  # (E, d): estimates from the first d of z
    feeds: Vector  # (E,): and from u
    slopes: Vector  # (E,): and from the slope of u, per second
    tolerance: Vector  # (E,) largest deviations that are ready


class Row(NamedTuple):
    """Views of one state row. Errors are those the noise leaves: of chi, and of the newest y."""

    head: np.ndarray
    clock: np.ndarray  # samples since the integrals began
    chi: np.ndarray
    last: np.ndarray  # y(k), its error's variance, the prediction of y(k+1) without the part of u
    link: np.ndarray  # covariance of the errors of chi and y(k)
    h: np.ndarray  # y(k+1) = h chi + ..
    P: np.ndarray  # covariance of the error of chi
    held: np.ndarray  # input: last known value
    estimates: np.ndarray
    std: np.ndarray  # relative to sigma


class Work(NamedTuple):
    """Scratch."""

    p: np.ndarray  # r^e q^(N-e)
    w0: np.ndarray
    w1: np.ndarray
    f: np.ndarray
    g: np.ndarray
    chi: np.ndarray
    z: np.ndarray
    now: np.ndarray  # (1,): input of this sample
    M: np.ndarray
    T: np.ndarray  # z = T chi
    C: np.ndarray


def fields(form) -> list[tuple]:
    """Return the fields of a row as NumPy's dtype wants them; the order is that of `Row`."""
    N, E = int(form.N), len(form.tolerance)
    return [
        *((name, "f8") for name in HEAD), ("clock", "f8", (1,)), ("chi", "f8", (N,)), ("last", "f8", (3,)),
        ("link", "f8", (N,)), ("h", "f8", (N,)), ("P", "f8", (N, N)), ("held", "f8", (int(form.inputs),)),
        ("estimates", "f8", (E,)), ("std", "f8", (E,)),
    ]  # fmt: skip


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    N = int(form.N)
    return 8 * (N + 1) + 3 * N * N


@open_row.on(Algebraic)
def open_row_algebraic(form, row):
    N, E, clock = int(form.N), form.tolerance.size, len(HEAD)
    chi = clock + 1
    last = chi + N
    link = last + 3
    h = link + N
    P = h + N
    held = P + N * N
    estimates = held + int(form.inputs)
    std = estimates + E
    return Row(
        row[:clock], row[clock:chi], row[chi:last], row[last:link], row[link:h], row[h:P], row[P:held].reshape(N, N),
        row[held:estimates], row[estimates:std], row[std:],
    )  # fmt: skip


@open_scratch.on(Algebraic)
def open_scratch_algebraic(form, scratch):
    N = int(form.N)
    v = scratch[: 8 * (N + 1)].reshape(8, N + 1)
    M = scratch[8 * (N + 1) : 8 * (N + 1) + 3 * N * N].reshape(3, N, N)
    return Work(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], M[0], M[1], M[2])
