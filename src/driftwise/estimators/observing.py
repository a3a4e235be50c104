"""What the observers of a known plant have in common: what they estimate, and running them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..models.plant import Augmented
from ..results.observer_trace import ObserverTrace, width
from .base import Rows, Step
from .common.times import instants


class Observed(NamedTuple):
    """Sizes and names of what an observer estimates: plant states, then the disturbances' and the derived outputs."""

    n: int  # states of the plant
    m: int  # with what is told of the disturbances
    N: int  # with the derived outputs
    inputs: int
    outputs: int
    state_names: list[str]
    names: list[str]
    input_names: list[str]
    output_names: list[str]

    @property
    def measured_names(self) -> list[str]:
        """Names of the measured columns of a table: an output called like what is estimated is told from it."""
        told = self.state_names + self.names
        return [f"{name}_measured" if name in told else name for name in self.output_names]


def check_names(model: Observed) -> None:
    """Refuse names that a trace's table could not tell apart."""
    own = ["time", "prediction", "innovation", "variance", "status", "statistic", "ready"]
    told = model.state_names + model.names
    names = own + model.measured_names + model.input_names + told + [f"{name}_std" for name in told]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            f"{', '.join(twice)}: a name must stand for one thing, and these are also an input, another estimate, or a "
            "column that every trace has"
        )


class Observing(Rows):
    """An observer of a known plant: sample, record, fleet; regular in time, or at instants of their own."""

    model: Observed
    plant: Augmented
    dt: float
    hold: str
    irregular: bool
    noise_std: Any
    trace_kind = ObserverTrace

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        return np.zeros(() if series is None else validation.count("series", series), self.dtype)

    def update(self, state, y, u=None, *, time: float | None = None) -> tuple[np.ndarray, Step]:
        """Return the next state and what this sample showed; NaN means missing. `estimate` reads the state.

        Parameters
        ----------
        state : from `start`, `update`, or a trace
        y : the output, or a sequence of p
        u : the input, or a sequence of k
        time : instant in seconds, where irregular; dt after the sample before if omitted
        """
        rows, p = self._rows(state), self.model.outputs
        ys, us = validation.sample(y, u, self.model.inputs, p if p > 1 else None)
        if time is not None:
            stamp = self._instants([time], 1, state)
            us = np.concatenate([us, stamp[None, :, None]], axis=2)
        outs = np.empty((1, 1, self.columns))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        state = np.ndarray((), self.dtype, rows)
        if p == 1:
            prediction, innovation, variance, status, _ = outs[0, 0].tolist()
            return state, Step(prediction, innovation, variance, int(status))
        prediction, innovation, variance, status = outs[0, 0, : 4 * p].reshape(4, p)
        return state, Step(prediction, innovation, variance, status.astype(int))

    def scan(self, y, u=None, *, time=None, state=None, keep: str = "std"):
        """Run over a record and return its trace; ``trace.state`` continues where it ended.

        Parameters
        ----------
        y : (T,) or (T, p) outputs; NaN where missing
        u : (T,) or (T, k) inputs; NaN where missing (the last value is held)
        time : (T,) instants in seconds; steps of dt if omitted
        state : state to start from; a fresh one if omitted
        keep : "innovations", "means" or "std": how much of each sample the trace holds
        """
        ys, us = validation.record(y, u, self.model.inputs, self.model.outputs)
        start = self.start() if state is None else state
        rows = self._rows(start)
        outs = np.empty((1, len(ys), width(keep, self.model.N, self.columns)))
        stamped = us
        if time is not None:
            time = self._instants(time, len(ys), start)
            stamped = np.column_stack([us, time])
        self.drive(rows, ys[None], stamped[None], outs, self.spec, self.scratch())
        end, is_stamped = rows.view(self.dtype).reshape(()), time is not None
        if time is None:
            before = np.asarray(start)
            time = self.dt * np.arange(len(ys)) + (float(before["time"]) + self.dt if before["samples"] > 0 else 0.0)
        trace = ObserverTrace(self, ys, us, outs[0], keep, end, float(np.asarray(start)["observed"]), time)
        trace.begun, trace.is_stamped = np.array(start), is_stamped
        return trace

    def update_batch(self, states, y, u=None, *, time=None):
        """Advance a fleet: one state, and one sample or a stretch of samples, per series.

        Parameters
        ----------
        states : (S,) states
        y : (S,) or (S, T) outputs; with several (S, p) or (S, T, p)
        u : (S,), (S, k) or (S, T, k) inputs
        time : (S,) or (S, T) instants in seconds; steps of dt if omitted

        Returns
        -------
        states : (S,) new states
        steps : Step of arrays shaped like y
        """
        rows, p, k = self._rows(states, is_one=False), self.model.outputs, self.model.inputs
        ys, us, shape = validation.fleet(y, u, len(rows), k, p if p > 1 else None)
        if time is not None:
            expected = shape if p == 1 else shape[:-1]
            if np.shape(time) != expected:
                raise InputError(f"time must be {expected}, one instant per sample, got {np.shape(time)}")
            series = np.asarray(time, float).reshape(ys.shape[:2])
            stamps = np.stack([self._instants(t, ys.shape[1], s) for t, s in zip(series, np.ravel(states))])
            us = np.concatenate([us, stamps[:, :, None]], axis=2)
        outs = np.empty((*ys.shape[:2], self.columns))
        self.drive(rows, ys, us, outs, self.spec, self.scratch())
        columns = np.moveaxis(outs[..., : 4 * p].reshape(*ys.shape[:2], 4, p), 2, 0).reshape(4, *shape)
        step = Step(columns[0], columns[1], columns[2], columns[3].astype(int))
        return rows.view(self.dtype).reshape(np.shape(states)), step

    def _instants(self, time, samples, state) -> np.ndarray:
        """Return the instants of a record; without ``irregular`` they may only say what the clock knows."""
        found = instants(time, (samples,), state, repeats=self.irregular)
        if not self.irregular:
            before = [float(state["time"])] if float(np.asarray(state)["samples"]) > 0 else []
            steps = np.diff(np.concatenate([before, found]))
            if np.any(abs(steps - self.dt) > 0.01 * self.dt):
                k = int(np.argmax(abs(steps - self.dt)))
                raise InputError(
                    f"time must step by dt = {self.dt:g} s, but one step is {steps[k]:g} s: mark the samples that "
                    "are missing by NaN; for instants of their own take WindowObserver and say irregular=True"
                )
        return found

    def estimate(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return plant states, disturbances and what follows them, with their deviations; NaN and inf until ready."""
        is_ready = np.asarray(state["ready"] > 0)[..., None]
        std = np.sqrt(np.asarray(self.sigma2(state)))[..., None] * state["std"]
        return np.where(is_ready, self._values(state), np.nan), np.where(is_ready, std, np.inf)

    def _values(self, state) -> np.ndarray:
        return state["estimates"]

    def tune(self, *args, **options):
        """Refuse (InputError): only walks and windows are tuned."""
        raise InputError(f"{type(self).__name__} has no tune: WindowObserver finds walks, noise and windows")

    def smooth(self, *args, **options):
        """Refuse (InputError): an observer says what is now."""
        raise InputError("an observer does not look back: a window's estimate is that at its end")

    def sigma2(self, state):
        """Return the noise variance learnt so far where noise_std is None, else 1: deviations are relative to it."""
        if self.noise_std is not None:
            return np.ones(np.shape(state["chi2"]))[()]
        return state["chi2"] / np.maximum(state["observed"], 1.0)
