"""The state row of a recursive estimator: what is kept between samples, where, and the scratch of a run."""

from collections import namedtuple
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from ...engine.dispatch import Size, Vector, choice, kernel, open_scratch
from ...engine.layout import Field, Layout, each, joined, numbers, policy
from ...engine.views import matrix
from ..common.columns import RECURSIVE_SAMPLE
from ..common.inputs import each_input

SAMPLES, OBSERVED, STATUS, IN_A_ROW, COUNT, CHI2, LOGDET, SCORE, WEIGHT, TOP, PAST = range(11)  # of the head of a row
PREDICT, HOLD, SKIP = range(3)  # what stands for a missing number among the regressors
COLUMNS = RECURSIVE_SAMPLE.size(1, 0)
FORMS: set[type] = set()  # every type of form that regresses
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
    mixture_columns: Size  # columns of the trace that the memory fills
    nb: Vector
    nk: Vector


def with_lags(kind: Any) -> Any:
    """Return the named tuple of the same name that has the fields of `Lags`, then those of ``kind``."""
    fields = get_type_hints(Lags, include_extras=True) | get_type_hints(kind, include_extras=True)
    made = namedtuple(kind.__name__, fields, module=kind.__module__)  # type: ignore[misc]  # one of many
    made.__doc__, made.__qualname__, made.__annotations__ = kind.__doc__, kind.__qualname__, fields
    return made


def lags(model, kind: Any = Lags, **own) -> Any:
    """Return the form, of type ``kind``, of a model with such lags as `Equation` has; ``own``: what is different.

    The size of all that memory and detector keep, and what options say, `Recursive` fills in.
    """
    return kind(
        **dict.fromkeys(Lags._fields, 0.0)
        | dict(na=model.na, inputs=model.inputs, deep=model.deep, fill=model.reach, offset=float(model.constants > 0))
        | dict(nb=np.array(model.nb, float), nk=np.array(model.nk, float))
        | own
    )


HEAD = numbers(
    "head",
    samples="samples taken",
    observed="of them, corrected by an output",
    status="bits of the last one",
    in_a_row="outliers in a row, until now",
    count="samples behind sigma^2; fades with the memory",
    chi2="sum of e^2/T over them; fades likewise",
    logdet="sum of log T",
    score="sum of log p(y)",
    weight="samples behind the estimate; fades with the memory",
    top="largest |y|",
    past="samples since the first measured y",
)
LAGS = Layout(
    *HEAD,
    *joined("theta", Field("x", ("0",), "no state"), Field("theta", ("N",), "parameters", trace="their names")),
    Field("D", ("M",), "P = U D U', relative to sigma^2: the diagonal; none where no covariance is kept"),
    Field("U", ("M * (M - 1) // 2",), "and the factor above it, column by column"),
    Field("ys", ("na",), "past outputs, newest first"),
    Field("ys_covariance", ("na * na",), "covariance of their errors, where some were predicted"),
    *each_input(),
    *each("inputs", "deep", us="inputs, newest first", us_variance="variance of those that were predicted"),
    Field("registers", ("registers",), "what the form keeps besides"),
    policy("memory_state", of="memory"),
    policy("detector_state", of="detector"),
    M="N",
)
LAGS.on(Lags)


class Work(NamedTuple):
    """Scratch: psi is the gradient of the prediction, f = U' psi, slope is psi/sqrt(T)."""

    psi: np.ndarray
    f: np.ndarray
    b: np.ndarray
    c: np.ndarray
    slope: np.ndarray
    row: np.ndarray  # psi less what filters add to it
    own: np.ndarray  # the form's own


@open_scratch.on(Lags)
def open_scratch_lags(form, buffer):
    N = int(form.N)
    v = matrix(buffer[: 5 * N], 5, N)
    return Work(v[0], v[1], v[2], v[3], v[4], v[0], buffer[5 * N :])


def among_forms(prototype) -> Any:
    """Turn a prototype into a question about forms, which it answers for those that have no answer of their own."""
    return choice(prototype, FORMS)


@among_forms
def regress(form, state, scratch, s2):
    """Fill ``scratch.psi``; return the prediction and the variance that predicted regressors add to it."""


@among_forms
def tell_kind(form, method, memory, state, scratch, y, s2):
    """Let y tell of which kind an outlier among the past outputs was; say whether there was one. Plain: none."""
    return False


@choice
def renew(form, state, scratch, y, y_variance, e, T):
    """Take y (its variance where it was predicted) into the registers, with the new theta; return status.

    e is the innovation, NaN where y was predicted, T its variance.
    """


@choice
def tell(form, memory, state, scratch, view):
    """Let the memory do to every theta and P of its own what `renew` did to those of the state."""


@kernel
def push(line, value):
    """Shift a register by one and put ``value`` first."""
    for i in range(line.size - 1, 0, -1):
        line[i] = line[i - 1]
    if line.size:
        line[0] = value
