"""The state row of the algebraic observer: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, open_scratch
from ...engine.layout import Field, Layout
from ..common.columns import OBSERVER_SAMPLE
from ..window_observer.row import HEAD

COLUMNS = OBSERVER_SAMPLE.size(1)


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


ALGEBRAIC = Layout(
    *HEAD,
    Field("clock", ("1",), "samples since the integrals began"),
    Field("chi", ("N",), "state of the filter; errors are those that the noise leaves, of chi and of the newest y"),
    Field("last", ("3",), "y(k), its error's variance, the prediction of y(k+1) without the part of u"),
    Field("link", ("N",), "covariance of the errors of chi and y(k)"),
    Field("h", ("N",), "y(k+1) = h chi + .."),
    Field("P", ("N", "N"), "covariance of the error of chi"),
    Field("held", ("inputs",), "input: last known value"),
    Field("estimates", ("E",), "what is asked for", trace="their names"),
    Field("std", ("E",), "standard deviations, relative to sigma"),
    E="len(form.tolerance)",
)
ALGEBRAIC.on(Algebraic)


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


def scratch_size(form) -> int:
    """Return how many numbers `Work` takes."""
    N = int(form.N)
    return 8 * (N + 1) + 3 * N * N


@open_scratch.on(Algebraic)
def open_scratch_algebraic(form, scratch):
    N = int(form.N)
    v = scratch[: 8 * (N + 1)].reshape(8, N + 1)
    M = scratch[8 * (N + 1) : 8 * (N + 1) + 3 * N * N].reshape(3, N, N)
    return Work(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], M[0], M[1], M[2])
