"""The estimator: what runs a model and a memory over samples, and what every one of them can be asked."""

from __future__ import annotations

import inspect
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..engine import compile, objects, recovery, validation
from ..engine.dispatch import flatten
from ..engine.errors import InputError
from ..engine.layout import Layout
from ..engine.portable import Portable
from ..models.canonical import power_of_two
from ..results import verbs
from ..results.parameter_trace import ParameterTrace
from ..results.snapshot import register
from ..results.trace import width
from .answers import Answers
from .common.columns import SAMPLE
from .common.times import instants

NUMBERS = np.dtype(np.float64)
ARRAY, NEW = np.ndarray, tuple.__new__  # what a stream makes at every sample


class Step(NamedTuple):
    """What one sample showed: its prediction, the error, its variance, what happened (arrays for a fleet).

    Attributes
    ----------
    prediction : y given the samples before it, in its units
    innovation : y less that; NaN where y is missing
    variance : of the innovation, as it was expected
    status : `Status` bits

    Examples
    --------
    >>> import driftwise as dw
    >>> est = dw.AR(1)
    >>> state, step = est.update(est.start(), 1.0)
    >>> state, step = est.update(state, 0.9)
    >>> float(step.prediction), float(step.innovation)
    (0.0, 0.9)
    """

    prediction: Any
    innovation: Any
    variance: Any
    status: Any


class Estimator(Answers, Portable):
    """States as rows of numbers, and the compiled loop over them: for one sample, a record, a fleet.

    A kind of estimator sets what is annotated here, and says how its states are read. Inside, samples are (T, p). An
    estimator of one output shows (T,), and a number for a sample; one of several (T, p) and (p,), also where p is 1.
    """

    model: Any
    policies: Any = ()
    dtype: np.dtype
    scratch_size: int
    options: dict[str, Any]
    dt: float
    u_scale: np.ndarray
    takes_instants = False  # whether the step goes by ``time=``; if not, a trace only shows it
    starting: Any = None  # what makes its start from its first samples, if anything
    trace_kind: Any = ParameterTrace  # what a run over a record returns
    unknown_parts: tuple[str, ...] = ("first_y", "first_u")  # of a state, where NaN says what is not known
    sample_layout: Layout = SAMPLE  # what the loop writes of each sample, before estimates and their spread
    _s0: np.ndarray
    _D0: np.ndarray
    _U0: np.ndarray
    _x = "x"  # the state's field in a row

    def __init_subclass__(cls, **options):
        super().__init_subclass__(**options)
        register(cls)

    def __repr__(self):
        first = next(iter(self.options))
        defaults: dict[str, Any] = {}
        for kind in reversed(type(self).__mro__):
            defaults |= inspect.signature(kind).parameters if kind is not object else {}
        changed = {k: v for k, v in self.options.items() if k == first or repr(v) != repr(defaults[k].default)}
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in changed.items())})"

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = np.zeros(() if series is None else validation.count("series", series), self.dtype)
        n = self.model.n
        state[self._x], state["theta"] = self._s0[:n], self._s0[n:]
        state["D"], state["U"] = self._D0, self._U0
        return state

    def scaled_to(self, y, u=None):
        """Return the same estimator with its default prior in units of the data (powers of two).

        Scaling an output or input by a power of two then scales every result exactly.
        """
        return self.replace(**self.scales(y, u))

    def scales(self, y, u=None) -> dict[str, Any]:
        """Return the typical sizes of the data, powers of two, as the options that they are: y_scale and u_scale."""
        y, u = validation.record(y, u, self.model.inputs, self.outputs)
        y_scale = power_of_two(y) if self.outputs is None else [power_of_two(c) for c in y.T]
        found = dict(y_scale=y_scale, u_scale=[power_of_two(c) for c in u.T] or 1.0)
        return {name: scale for name, scale in found.items() if name in self.options}

    def replace(self, **options) -> Any:
        """Return the same estimator with some options replaced."""
        return type(self)(**self.options | options)

    def _set_units(self, dt, y_scale, u_scale=1.0) -> None:
        """Check and set the seconds between samples, and the typical size of each output and input."""
        self.dt, p = validation.size("dt", dt), self.outputs
        self.y_scale = validation.size("y_scale", y_scale) if p is None else validation.sizes("y_scale", y_scale, p)
        self.u_scale = validation.sizes("u_scale", u_scale, self.model.inputs)

    # --- columns -------------------------------------------------------------------------------------------

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Where in ``trace.table`` the columns of each name lie, as many as there are outputs; estimates follow."""
        return self.sample_layout.slices(*self._sample_sizes())

    @cached_property
    def width(self) -> int:
        """How many numbers a state has."""
        return self.dtype.itemsize // 8

    @cached_property
    def n_columns(self) -> int:
        """How many columns of ``trace.table`` come before those of the estimates."""
        return self.sample_layout.size(*self._sample_sizes())

    @cached_property
    def step_columns(self) -> int:
        """How many of these a sample on its own is shown."""
        return self.columns["status"].stop

    @cached_property
    def _stream(self):
        """The loop for one sample of plain numbers, ``(rows, y, u, spec)``; it answers () where they are not."""
        sizes = self.model.inputs, self.step_columns, self.scratch_size
        return (objects.step(self.drive, *sizes) if self.outputs is None else None) or _leave

    @cached_property
    def _row_shape(self) -> tuple[int, int]:
        """The shape of the numbers of one state."""
        return 1, self.width

    def _sample_sizes(self) -> tuple[int, ...]:
        """Return the sizes that ``sample_layout`` is given."""
        return (self.outputs or 1,)

    @cached_property
    def spec(self) -> np.ndarray:
        """The numbers that the compiled loop is given."""
        return self.spec_of(self.policies)

    def spec_of(self, policies) -> np.ndarray:
        """Return these policies as numbers, and behind them the fresh state that follows one that is poisoned."""
        return np.append(flatten(policies), recovery.tail(self.start(), self.unknown_parts))

    # --- running -------------------------------------------------------------------------------------------

    def update(self, state, y, u=None, *, time: float | None = None) -> tuple[np.ndarray, Step]:
        """Return the next state and what this sample showed; NaN means missing.

        Parameters
        ----------
        state : from `start`, `update`, or a trace
        y : the output; with several (p,)
        u : the input, or a sequence of k inputs
        time : instant in seconds, of an estimator that goes by it; dt after the sample before if omitted
        """
        rows = self._rows(state)
        shown = self._stream(rows, y, u, self.spec) if time is None else ()
        if shown:
            return ARRAY((), self.dtype, rows), NEW(Step, shown)
        return self._update(rows, y, u, time, state)

    def _update(self, rows, y, u, time, state, **given) -> tuple[np.ndarray, Step]:
        """Return the same, the general way: of any number of outputs, and with what else a sample brings."""
        p = self.outputs
        ys, us = validation.sample(y, u, self.model.inputs, p)
        us = self._driving(us[0], None if time is None else [time], state, **given)[None]
        outs = np.empty((1, 1, self.step_columns))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        if p is None:
            prediction, innovation, variance, status = outs[0, 0, :4].tolist()
            return ARRAY((), self.dtype, rows), Step(prediction, innovation, variance, int(status))
        of_each = outs[0, 0, : 4 * p].reshape(4, p)
        return ARRAY((), self.dtype, rows), Step(of_each[0], of_each[1], of_each[2], of_each[3].astype(int))

    def scan(self, y, u=None, *, state=None, keep: str = "std", time=None):
        """Run over a record and return its trace; ``trace.state`` continues where it ended.

        Parameters
        ----------
        y : (T,) outputs, with several (T, p); NaN where missing
        u : (T,) or (T, k) inputs; NaN where missing (the last one is held on)
        state : state to start from; a fresh one if omitted
        keep : "innovations", "means", "std" or "covariance": how much of each sample the trace holds
        time : (T,) increasing instants in seconds; steps of dt if omitted
        """
        return self._scan(y, u, state, keep, time)

    def _scan(self, y, u, state, keep, time, **given):
        """Return the same, with what else each sample brings."""
        index = y.index if hasattr(y, "iloc") else None  # of pandas
        y, u = validation.record(y, u, self.model.inputs, self.outputs)
        start = self.start() if state is None else state
        rows, is_stamped = self._rows(start), self.takes_instants and time is not None
        us = self._driving(u, time if is_stamped else None, start, **given)
        time = us[:, self.model.inputs].copy() if is_stamped else time
        outs = np.empty((1, len(y), self.table_width(keep)))
        self.drive(rows, y.reshape(1, len(y), self.outputs or 1), us[None], outs, self.spec, self.scratch())
        end = rows.view(self.dtype).reshape(())
        clock = self._clock(np.asarray(start), end, len(y)) if time is None else time
        trace = self._trace(y, u, outs[0], keep, np.array(start), end, clock)
        trace.is_stamped, trace.index = is_stamped, index
        return trace

    def update_batch(self, states, y, u=None, *, time=None):
        """Advance a fleet: one state, and one sample or a stretch of samples, per series.

        Parameters
        ----------
        states : (S,) states
        y : (S,) or (S, T) outputs; with several (S, p) or (S, T, p)
        u : (S,), (S, k) or (S, T, k) inputs
        time : (S,) or (S, T) instants in seconds, of an estimator that goes by them; steps of dt if omitted

        Returns
        -------
        states : (S,) new states
        steps : Step of arrays shaped like y
        """
        rows, p = self._rows(states, is_one=False), self.outputs or 1
        ys, us, shape = validation.fleet(y, u, len(rows), self.model.inputs, self.outputs)
        S, T = ys.shape[:2]
        if time is not None:
            expected = shape if self.outputs is None else shape[:-1]
            if np.shape(time) != expected:
                raise InputError(f"time must be {expected}, one instant per sample, got {np.shape(time)}")
            series = np.asarray(time, float).reshape(S, T)
            stamps = np.array([self._instants(t, T, s) for t, s in zip(series, np.ravel(states))]).reshape(S, T, 1)
            us = np.concatenate([us, stamps], axis=2)
        outs = np.empty((S, T, self.step_columns))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        columns = np.moveaxis(outs[..., : 4 * p].reshape(S, T, 4, p), 2, 0).reshape(4, *shape)
        step = Step(columns[0], columns[1], columns[2], columns[3].astype(int))
        return rows.view(self.dtype).reshape(np.shape(states)), step

    def table_width(self, keep) -> int:
        """Return the number of columns of a trace."""
        return width(keep, self.model.N, self.n_columns)

    def _trace(self, y, u, outs, keep, start, end, time):
        trace = self.trace_kind(self, y, u, outs, keep, end, start["observed"], time)
        trace.begun = start
        return trace

    def _driving(self, u, time, state) -> np.ndarray:
        """Return what the loop is given of each sample besides y, (T, ..): inputs, and behind them its instant if any.

        A model that takes more of a sample, as keyword arguments of `update` and `scan`, adds that behind the instant.
        """
        return u if time is None else np.concatenate([u, self._instants(time, len(u), state)[:, None]], axis=1)

    def _instants(self, time, samples, state) -> np.ndarray:
        """Return the instants of so many samples that follow a state, checked."""
        if not self.takes_instants:
            raise InputError(
                f"{type(self).__name__} counts samples, dt apart, and goes by no instants: leave time out, and mark "
                "samples that are missing by NaN (ContinuousJoint and WindowObserver take irregular ones)"
            )
        return instants(time, (samples,), state)

    def _clock(self, start, end, samples) -> Any:
        """Return the instants of a record that came without; None: the trace counts multiples of dt."""
        return None

    def smooth(self, *args, **options):
        """Refuse (InputError): smoothing needs regressors that are data, or a joint posterior with the state."""
        raise InputError(
            f"{type(self).__name__} has no smoother: use ARX, AR or Regression, or Joint(order, inputs).smooth(y, u)"
        )

    def tune(self, *args, **options):
        """Refuse (InputError): the regressors of this model are not data."""
        raise InputError(
            f"{type(self).__name__} has no tune: drift is learnt from a record by ARX, AR and Regression, "
            "whose regressors are data"
        )

    def predict(self, *args, **options):
        """Refuse (InputError): missing samples at the end of a record are the prediction here."""
        raise InputError(
            f"{type(self).__name__} has no predict: scan the inputs to come with y missing, "
            "ahead = est.scan(np.full(h, np.nan), u, state=state), and read ahead.prediction and ahead.variance "
            "(several outputs: np.full((h, p), np.nan))"
        )

    def export(
        self,
        folder,
        state=None,
        *,
        language: str = "c",
        name: str = "driftwise",
        precision: str = "double",
        keep: str = "std",
    ) -> list[Path]:
        """Write the estimator as C for a controller, with a test and a README; return where the files are.

        Parameters
        ----------
        folder : where to put NAME.c, NAME.h, test_NAME.c and README.md; made if it is not there
        state : state to begin with, as a run left it; a fresh one if omitted
        language : "c" (C99, which is C++ too); "st": Structured Text of IEC 61131-3 (NAME.st), for ARX, AR, Regression
            and Joint with `Constant`, `ExponentialForgetting`, `RandomWalk` or `RestartOnChange`
        name : what files, functions and types begin with
        precision : "double", the same bits as here; or "single", refused where it was not shown to be sound
        keep : "means" or "std": whether each update works out standard deviations of the estimates too

        Examples
        --------
        >>> import driftwise as dw
        >>> y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
        >>> est = dw.ARX(1, 1, memory=dw.ExponentialForgetting(0.99))
        >>> files = est.export("pump", est.scan(y, u).state, name="pump")  # doctest: +SKIP
        """
        options: dict[str, Any] = dict(language=language, name=name, precision=precision, keep=keep)
        return verbs.call("export", self, folder, state, **options)

    @property
    def is_single_step(self) -> bool:
        """Whether a sample is one compiled step from row to row, and nothing besides: what can be exported."""
        return type(self).drive is Estimator.drive and type(self).update is Estimator.update

    @cached_property
    def drive(self):
        """The compiled loop, ``drive(rows, ys, us, outs, est.spec, est.scratch())``: the fastest way in, no checks."""
        return self._started(compile.driver(*map(type, self.policies)))

    def _started(self, drive):
        """Return a loop with the estimator's start in it, if it has one."""
        return drive if self.starting is None else self.starting.wrap(drive)

    def scratch(self) -> np.ndarray:
        """Return memory for one run of `drive`; its contents do not matter, but no two threads may share it."""
        return np.empty(self.scratch_size)

    def _rows(self, state, is_one=True):
        """Return a copy of the states as rows of numbers."""
        if is_one and type(state) is ARRAY and state.dtype is self.dtype and not state.ndim:
            base = state.base  # of a state that `update` returned: numbers already, and a copy of a view takes longer
            if type(base) is ARRAY and base.shape == self._row_shape and base.dtype is NUMBERS:
                return base.copy()
        state = np.asarray(state)
        if state.dtype != self.dtype:
            raise InputError("the state belongs to another estimator: start one with est.start()")
        if is_one and state.shape != ():
            raise InputError(f"one state is expected, got {state.shape}: advance a fleet with update_batch")
        if not state.flags.c_contiguous:
            state = np.ascontiguousarray(state)
        return np.ndarray((state.size, self.width), np.float64, state).copy()  # faster than field by field


def _leave(*sample) -> tuple[()]:
    """Take no sample: it goes by the general way."""
    return ()


def is_estimator(value: Any) -> bool:
    """Say whether what a user hands over is an estimator at all."""
    return isinstance(value, Estimator)
