"""A detector on its own: a signal in, alarms out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..engine import compile
from ..engine.dispatch import flatten
from ..engine.errors import InputError
from .brownian import positive
from .watch import OWN


@dataclass(frozen=True)
class Alarms:
    """When a detector alarmed, and since when, by its own estimate, things were different.

    Attributes
    ----------
    samples : (A,) the samples that alarmed
    changes : (A,) the first sample after each change; negative where it lies before the record
    directions : (A,) +1 or -1
    which : (A,) the parameter or probe that changed, -1 where the detector cannot say
    statistic : (T,) relative to the threshold, 1 and more alarms; NaN where the sample was missing
    state : where a scan of the samples that follow goes on

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> z = np.r_[np.zeros(10), np.full(10, 3.0)]
    >>> found = dw.PageHinkley(jump=2.0).scan(z)
    >>> found.samples.tolist(), found.changes.tolist(), found.directions.tolist()
    ([12, 15, 18], [10, 13, 16], [1, 1, 1])
    """

    samples: np.ndarray
    changes: np.ndarray
    directions: np.ndarray
    which: np.ndarray
    statistic: np.ndarray
    state: np.ndarray

    def __len__(self):
        return len(self.samples)

    def __repr__(self):
        told = [
            f"{f'#{which} ' if which >= 0 else ''}{'up' if direction > 0 else 'down'} at {sample} since {change}"
            for sample, change, direction, which in zip(self.samples, self.changes, self.directions, self.which)
        ]
        more = f", and {len(told) - 5} more" if len(told) > 5 else ""
        what = f": {', '.join(told[:5])}{more}" if told else ""
        return f"{len(told)} alarm{'s' * (len(told) != 1)} in {len(self.statistic)} samples{what}"


def scan(detector: Any, signal, mean=0.0, std=1.0, state=None, slopes=None) -> Alarms:
    """Return the alarms of a kernel's detector in (signal - mean)/std; ``slopes`` (T, m) where it wants them."""
    std = positive("std", std)
    try:
        z = (np.asarray(signal, float) - float(mean)) / std
        slopes = np.zeros((len(z), 0)) if slopes is None else np.asarray(slopes, float)
    except (TypeError, ValueError):
        raise InputError(f"signal must be a sequence of numbers, and mean one number, got mean = {mean!r}") from None
    if z.ndim != 1 or slopes.ndim != 2 or len(slopes) != len(z):
        raise InputError(f"signal must be (T,), and what goes with it (T, m), got {z.shape} and {slopes.shape}")
    if np.isinf(z).any() or np.isinf(slopes).any():
        raise InputError("signal is infinite somewhere; mark missing samples by NaN. Was something divided by zero?")
    there = np.flatnonzero(np.isfinite(z) & np.isfinite(slopes).all(axis=1))
    detector_state = (
        np.zeros((1, detector.state_size(slopes.shape[1]))) if state is None else _marks(detector, slopes, state)
    )
    outs = np.empty((1, len(there), 1 + OWN))
    numbers = flatten((detector,))
    look: Any = compile.watcher(_kind(detector))
    look(detector_state, z[None, there], np.ascontiguousarray(slopes[None, there]), outs, numbers)
    alarm, level, since, which = outs[0].T
    statistic = np.full(len(z), np.nan)
    statistic[there] = level
    at = np.flatnonzero(alarm)
    first = at - since[at].astype(int) + 1
    changes = np.where(first >= 0, there[np.maximum(first, 0)] if len(there) else 0, first)
    return Alarms(there[at], changes, alarm[at].astype(int), which[at].astype(int), statistic, detector_state[0])


def _kind(detector) -> Any:
    return type(detector)


def _marks(detector, slopes, state) -> np.ndarray:
    size = detector.state_size(slopes.shape[1])
    if np.shape(state) != (size,):
        raise InputError(
            f"state must be the {size} numbers of alarms.state, got {np.shape(state)}: another detector's?"
        )
    return np.array(state, float)[None]


def simulated_delay(
    detector: Any, jump: float, runs: int = 2000, before: int = 500, seed: int = 0
) -> tuple[float, float]:
    """Return mean delay and its standard error when the mean of N(0, 1) moves by ``jump``.

    Runs that alarm in the ``before`` samples start afresh, as they would in use. For detectors without a formula.
    """
    rng, spec = np.random.default_rng(seed), flatten((detector,))
    look: Any = compile.watcher(_kind(detector))
    detector_state, delay, first = np.zeros((runs, detector.state_size(0))), np.zeros(runs), 0
    block = before
    look(
        detector_state,
        rng.standard_normal((runs, before)),
        np.zeros((runs, before, 0)),
        np.empty((runs, before, 1)),
        spec,
    )
    while not delay.all():
        left = np.flatnonzero(delay == 0)
        kept, outs = detector_state[left], np.empty((len(left), block, 1))
        look(kept, jump + rng.standard_normal((len(left), block)), np.zeros((len(left), block, 0)), outs, spec)
        detector_state[left] = kept
        found = outs[:, :, 0] * np.sign(jump) > 0
        delay[left] = np.where(found.any(axis=1), first + found.argmax(axis=1) + 1, 0)
        first += block
    return float(delay.mean()), float(delay.std() / np.sqrt(runs))
