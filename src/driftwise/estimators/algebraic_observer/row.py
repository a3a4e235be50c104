"""The state row of the algebraic observer: what is kept between samples, where, and the scratch of a run."""

from typing import NamedTuple

from ...engine.dispatch import Vector, open_scratch
from ...engine.layout import Field, Layout, each
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


SCRATCH = Layout(
    *each(
        "N + 1",
        p="r^e q^(N-e)",
        w0="vector",
        w1="vector",
        f="vector",
        g="vector",
        chi="vector",
        z="y and its derivatives",
        now="input of this sample",
    ),
    *each("N", "N", M="matrix", T="z = T chi", C="matrix"),
)
open_scratch.on(Algebraic)(SCRATCH.open)
