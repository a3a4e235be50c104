"""What a memory is: settings, and the answers it gives an estimator; what it does not say itself is the plain answer.

A memory is a named tuple. Kernels ask it the questions below, each by the type of the memory: ``adapt.on(Mine)`` adds
an answer, and makes ``Mine`` a memory. Who does not answer gives the plain one, the body of the function. One more,
`resolve`, is asked once, in plain Python. What a memory remembers are so many numbers of the state row, zero at first,
as its method ``state_size(parameters)`` says; without that method there are none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from ..engine import validation
from ..engine.dispatch import PerParameter, choice, kernel
from ..engine.status import JUMP
from ..engine.ud import measurement_update

MEMORIES: set[type] = set()  # every type that answers one of the questions


class View(NamedTuple):
    """What a memory sees of an estimator: mean and covariance U D U' of its unknowns, relative to s2, and a sample.

    The parameters are those from index ``first`` on; before them stands the state of a joint filter. Between two
    samples mean and covariance are those of the next sample.

    Attributes
    ----------
    first : index of the first parameter
    theta : (N,) mean
    U : (N (N - 1)/2,) packed by columns
    D : (N,)
    psi : (N,) slopes of the prediction; empty where the family does not keep them
    f : (N,) U' psi, while a sample is corrected; like b and c scratch else
    s2 : sigma^2 so far
    weight : effective number of samples taken in
    surprise : e^2/(s2 T) of the last sample; NaN where it taught nothing
    reopen : what the estimator asks of an alarm: above 1 samples, else a share of the prior's width
    cap : (N,) variances of the prior
    row : (N,) the regressors themselves
    y : the output that is being taken in; NaN where the memory sees another scale, or none
    fresh : (N + 1,) slopes where parameters act through a state with a past of its own, had they been set free when a
        doubt of them began, and behind them what the memory thinks of that doubt (`common.fresh`); empty elsewhere
    has_past : 1 where the regressors are those of a state with a past of its own, known in part alone; else 0

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> one, none = np.ones(1), np.zeros(0)
    >>> view = dw.memory.View(0, 0 * one, none, one.copy(), one, one, 0 * one, none, 1.0, 1.0, 0.0, 0.0, one, one)
    >>> view.first, view.theta.tolist(), view.D.tolist()
    (0, [0.0], [1.0])
    """

    first: int
    theta: np.ndarray
    U: np.ndarray
    D: np.ndarray
    psi: np.ndarray  # gradient of the prediction with respect to them; empty where the family does not keep it
    f: np.ndarray  # U' psi, as long as a sample is corrected; like b and c scratch else
    b: np.ndarray
    c: np.ndarray
    s2: float  # sigma^2 so far
    weight: float  # effective number of samples taken in
    surprise: float  # e^2/(s2 T) of the last sample; NaN where it taught nothing
    reopen: float  # what the estimator asks of an alarm: above 1 a number of samples, else a share of the prior's width
    cap: np.ndarray  # variances of the prior, for that
    row: np.ndarray  # the regressors themselves: psi less what filters add to it
    y: float = math.nan  # the output that is being taken in; NaN where the memory sees another scale, or none
    fresh: np.ndarray = np.zeros(0)  # slopes by parameters set free at a doubt, and whether there is one; or empty
    has_past: float = 0.0  # 1: the regressors are those of a state with a past of its own


DOUBTED, BELIEVED = 1.0, 2.0  # what a memory thinks of a jump, behind `View.fresh`: that it may be; that it was


class Alarm(NamedTuple):
    """What a detector found: direction (+1 or -1), and which parameter changed (-1: it cannot say)."""

    way: float
    which: float


def question(prototype: Callable) -> Any:
    """Turn a prototype into a function that memories answer; its body is the plain answer."""
    return choice(prototype, MEMORIES)


# --- the questions, in the order of a sample, and one more --------------------------------------------------------


@question
def begin(memory, state, view):
    """Write into ``state`` what the memory starts with, before the first sample, from the prior. Plain: zeros.

    Parameters
    ----------
    memory : the policy, with its settings as numbers
    state : (state_size,)
        What it remembers; written.
    view : View

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> state = np.zeros(1)
    >>> dw.memory.begin(dw.Constant(), state, None)  # constant parameters have nothing to begin with
    >>> state.tolist()
    [0.0]
    """


@question
def mixture(memory, state, R, view, out):
    """Write into ``out`` what a mixture's prediction is made of: weight, mean less the whole's, squared scale of each.

    The kernel's memory has ``mixture_columns``, the size of ``out``. Plain: no mixture, nothing to tell.

    Parameters
    ----------
    memory, state, view : as for `begin`
    R : float
        Variance of the noise, relative to sigma^2.
    out : (mixture_columns,), written

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> out = np.zeros(3)
    >>> dw.memory.mixture(dw.Constant(), np.zeros(0), 1.0, None, out)
    >>> out.tolist()
    [0.0, 0.0, 0.0]
    """


@question
def adapt(memory, state, e, R, view):
    """Take the innovation e into theta and P; return T = psi' P psi + R. Plain: least squares.

    Parameters
    ----------
    memory, state, view : as for `begin`
    e, R : float
        The innovation, and the variance of the noise relative to sigma^2.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> one, none = np.ones(1), np.zeros(0)
    >>> view = dw.memory.View(0, 0 * one, none, one.copy(), one, one, 0 * one, none, 1.0, 1.0, 0.0, 0.0, one, one)
    >>> dw.memory.adapt(dw.Constant(), none, 1.0, 1.0, view), view.theta.tolist()
    (np.float64(2.0), [0.5])
    """
    return least_squares(e, R, view)


@question
def count(memory, state, count, chi2, weight, gain):
    """Count the sample just taken in: return count and chi2 (of sigma^2), and the effective number of samples.

    ``gain`` is its e^2/T. Plain: one more.

    Parameters
    ----------
    memory, state : as for `begin`
    count, chi2 : samples so far, and the sum of their gains
    weight : effective number of samples

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> dw.memory.count(dw.Constant(), np.zeros(0), 10.0, 9.0, 1.0, 0.5)
    (11.0, 9.5, 2.0)
    """
    return count + 1.0, chi2 + gain, weight + 1.0


@question
def additive_share(memory, state):
    """Return how many outliers in one are wrong in what was measured alone. Plain: all.

    The next outputs go on from the others, which stand among the regressors as measured.

    Parameters
    ----------
    memory, state : as for `begin`

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> dw.memory.additive_share(dw.Constant(), np.zeros(0))
    1.0
    """
    return 1.0


@question
def doubted_output(memory, state):
    """Return the last output, as measured and as it was expected, if it is taken for an outlier. Plain: NaN, none is.

    What comes next tells of which kind it was: wrong in what was measured alone, or what the plant goes on from.

    Parameters
    ----------
    memory, state : as for `begin`

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> dw.memory.doubted_output(dw.Constant(), np.zeros(0))
    (nan, nan)
    """
    return math.nan, math.nan


@question
def found_jump(memory, state, detector_state):
    """Say whether the memory itself found, at the sample just taken in, that the parameters had jumped: 1, otherwise 0.

    ``detector_state`` are those of a detector: statistic over threshold, and at an alarm since when and which
    parameter. Plain: 0, that is for the detector to say.

    Parameters
    ----------
    memory, state : as for `begin`

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> dw.memory.found_jump(dw.Constant(), np.zeros(0), np.zeros(3))
    0.0
    """
    return 0.0


LIKELY = 0.5  # probability of an outlier from which the mean of y and its prediction stands in: what is wrong with it
# has nothing to do with it then, and biases no parameter


@question
def outlier_probability(memory, state):
    """Return the probability that the sample just taken in was an outlier, no regressor to rely on. Plain: 0.

    Parameters
    ----------
    memory, state : as for `begin`

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> dw.memory.outlier_probability(dw.Constant(), np.zeros(0))
    0.0
    """
    return 0.0


@question
def on_alarm(memory, state, alarm, view):
    """Answer an `Alarm`; return the new effective number of samples, and status bits. Plain: report it.

    Parameters
    ----------
    memory, state, view : as for `begin`
    alarm : direction (+1 or -1) ``way``, and ``which`` parameter changed (-1: unknown)

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> one, none = np.ones(1), np.zeros(0)
    >>> view = dw.memory.View(0, 0 * one, none, one.copy(), one, one, 0 * one, none, 1.0, 1.0, 0.0, 0.0, one, one)
    >>> from driftwise.memory.questions import Alarm
    >>> dw.memory.on_alarm(dw.memory.Window(10), none, Alarm(1.0, -1.0), view)
    (1.0, 32)
    """
    return view.weight, JUMP


class Change(NamedTuple):
    """What an estimator did to theta and P between two samples, on its own account."""

    moved: np.ndarray  # theta += moved: a step taken back, because it made the predictor unstable
    freed: np.ndarray  # P += diag(freed), relative to s2: parameters that were held so far
    lam: float  # then P /= lam: the first samples knew too little to count in full


@question
def take_along(memory, state, change, view):
    """Do a `Change` to every theta and P that the memory keeps of its own. Plain: it keeps none."""


@question
def time_update(memory, state, elapsed, view):
    """Forget, between two samples; return lambda, by which all sums over the past are to shrink, and status bits.

    ``elapsed`` is one sample; in continuous time it is seconds for a memory that is ``per_second``. Plain: nothing is
    forgotten.

    Parameters
    ----------
    memory, state, view : as for `begin`

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> dw.memory.time_update(dw.Constant(), np.zeros(0), 1.0, None)
    (1.0, 0)
    """
    return 1.0, 0


@question
def resolve(memory, setting):
    """Return the memory as kernels want it: checked, complete, in the units of ``setting`` (a `Setting`).

    Plain Python. It may be of another type, one that answers the questions. Plain: of each setting marked
    `PerParameter` as many numbers as there are parameters.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> setting = dw.memory.Setting(units=np.array([1.0, 4.0]), cap=np.array([1e4, 4e4]))
    >>> dw.memory.resolve(dw.RandomWalk(0.01), setting).q.tolist()
    [0.01, 0.04]
    """
    hints = get_type_hints(type(memory), include_extras=True)
    each = [name for name in memory._fields if hints[name] == PerParameter]
    return memory._replace(**{name: validation.each(name, getattr(memory, name), setting.N) for name in each})


def finds_speed(memory, resolved) -> bool:
    """Say whether a memory finds out by itself how fast, or when, parameters move; others are told.

    It has a detector, or moves theta and P in its own way by both updates (``resolved``: as kernels have it).
    """
    return hasattr(memory, "detector") or (type(resolved) in adapt.table and type(resolved) in time_update.table)


@kernel
def least_squares(e, R, view):
    """Take a sample in by Bierman's update of P, and theta by its gain; return T.

    Parameters
    ----------
    e, R : float
        The innovation, and the variance of the noise relative to sigma^2.
    view : View

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> one, none = np.ones(1), np.zeros(0)
    >>> view = dw.memory.View(0, 0 * one, none, one.copy(), one, one, 0 * one, none, 1.0, 1.0, 0.0, 0.0, one, one)
    >>> T = dw.memory.least_squares(1.0, 1.0, view)
    >>> T, view.theta.tolist(), view.D.tolist()
    (np.float64(2.0), [0.5], [0.5])
    """
    return measurement_update(view.theta, view.U, view.D, view.f, e, R, view.b)
