"""What the observers of a known plant have in common: what they estimate, and when it is ready."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...models.plant import Augmented
from ...results.observer_trace import KEEP, ObserverTrace
from ...results.trace import width
from ..base import Estimator
from .columns import OBSERVER_SAMPLE
from .times import instants


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
        estimated = self.state_names + self.names
        return [f"{name}_measured" if name in estimated else name for name in self.output_names]


def check_names(model: Observed) -> None:
    """Refuse names that a trace's table could not tell apart."""
    own = ["time", "prediction", "innovation", "variance", "status", "statistic", "ready"]
    estimated = model.state_names + model.names
    names = own + model.measured_names + model.input_names + estimated + [f"{name}_std" for name in estimated]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            f"{', '.join(twice)}: a name must stand for one thing, and these are also an input, another estimate, or a "
            "column that every trace has"
        )


class Observer(Estimator):
    """An estimator of the state of a known plant, of samples regular in time or at instants of their own."""

    takes_instants = is_observer = True
    for_instants = "take WindowObserver and say irregular=True"  # what to do where samples are irregular
    fits_fleet = False
    trace_kind = ObserverTrace
    sample_layout = OBSERVER_SAMPLE

    model: Observed
    plant: Augmented
    dt: float
    hold: str
    irregular: bool
    noise_std: Any

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        return np.zeros(() if series is None else validation.count("series", series), self.dtype)

    @property
    def step_columns(self) -> int:
        """A sample on its own is shown all of them."""
        return self.n_columns

    def _sample_sizes(self) -> tuple[int, ...]:
        return (self.model.outputs,)

    def table_width(self, keep) -> int:
        return width(keep, self.model.N, self.n_columns, KEEP)

    @property
    def state_names(self) -> list[str]:
        """Names of the plant's states."""
        return self.model.state_names

    def degrees_of_freedom(self, is_used, observed) -> np.ndarray:
        """Return those of each prediction: infinite where the noise is known, else the innovations before it."""
        if self.noise_std is not None:
            return np.full(is_used.shape, np.inf)
        used = is_used.reshape(len(is_used), -1)
        before = np.cumsum(used).reshape(used.shape) - used
        return np.maximum(observed + before, 1.0).reshape(is_used.shape)

    def _clock(self, start, end, samples) -> np.ndarray:
        first = float(start["time"]) + self.dt if start["samples"] > 0 else 0.0
        return self.dt * np.arange(samples) + first

    def _instants(self, time, samples, state) -> np.ndarray:
        """Return the instants of samples; without ``irregular`` they may only say what the clock knows."""
        found = instants(time, (samples,), state, repeats=self.irregular)
        if not self.irregular:
            before = [float(state["time"])] if float(np.asarray(state)["samples"]) > 0 else []
            steps = np.diff(np.concatenate([before, found]))
            if np.any(abs(steps - self.dt) > 0.01 * self.dt):
                k = int(np.argmax(abs(steps - self.dt)))
                raise InputError(
                    f"time must step by dt = {self.dt:g} s, but one step is {steps[k]:g} s: mark the samples that "
                    f"are missing by NaN; for instants of their own {self.for_instants}"
                )
        return found

    def summary(self) -> Any:
        """Return what is to sum up traces of it, one after the other."""
        from ...results.observer_summary import ObserverSummary

        return ObserverSummary(self)

    def estimate(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return plant states, disturbances and what follows them, with their deviations; NaN and inf until ready."""
        is_ready = np.asarray(state["ready"] > 0)[..., None]
        std = np.sqrt(np.asarray(self.sigma2(state)))[..., None] * state["std"]
        return np.where(is_ready, self._values(state), np.nan), np.where(is_ready, std, np.inf)

    def mean(self, state) -> np.ndarray:
        """Return what is estimated, given all samples so far; NaN until it is ready."""
        return self.estimate(state)[0]

    def _values(self, state) -> np.ndarray:
        return state["estimates"]

    def loglik(self, state) -> float:
        """Return the log likelihood of the outputs; NaN where there is none."""
        return math.nan

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
