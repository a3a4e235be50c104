"""A detector on its own, fed sample by sample."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..engine import compile
from ..engine.dispatch import flatten
from ..engine.errors import InputError, refuse_class
from ..engine.portable import Portable
from .brownian import positive
from .watch import OWN, watch


class Sign(NamedTuple):
    """What one sample said: alarm (0, or +1, -1: the direction) and statistic over threshold.

    At an alarm ``since`` is the number of samples since the change, this one included, and ``which`` the parameter (-1:
    cannot say).
    """

    alarm: int
    statistic: float
    since: int
    which: int


class Monitor(Portable):
    """Watches a signal sample by sample: state in, state out, like every estimator's `update`.

    Parameters
    ----------
    detector : PageHinkley, VarianceCUSUM, GLR or ScoreCUSUM
    mean, std : float, what the signal is like in control, in its units
    parameters : how many slopes come with each sample (`ScoreCUSUM`)

    Examples
    --------
    >>> import driftwise as dw
    >>> monitor = dw.detect.Monitor(dw.PageHinkley("1 per 10_000", jump=2.0))
    >>> state = monitor.start()
    >>> for t, z in enumerate([0.1, -0.4, 0.3, 2.2, 1.9, 2.4, 2.6, 1.7, 2.1, 2.3]):
    ...     state, sign = monitor.update(state, z)
    ...     if sign.alarm:
    ...         print(f"sample {t}: {'up' if sign.alarm > 0 else 'down'}, since {sign.since} samples")
    sample 6: up, since 4 samples
    """

    def __init__(self, detector: Any, *, mean: float = 0.0, std: float = 1.0, parameters: int = 0):
        refuse_class("detector", detector)
        resolve = getattr(detector, "resolve", None)
        found = resolve(parameters) if resolve else detector
        kind: Any = type(found)
        if kind not in watch.table:
            raise InputError(
                f"detector must be PageHinkley(), VarianceCUSUM(), GLR() or ScoreCUSUM(), got {detector!r}"
            )
        self.mean, self.std = float(mean), positive("std", std)
        self._size, self._parameters = found.state_size(parameters), parameters
        self._spec = flatten((found,))
        self._kind = kind
        self._look  # noqa: B018  (compiles)

    @cached_property
    def _look(self) -> Any:
        return compile.watcher(self._kind)

    def start(self) -> np.ndarray:
        """Return a fresh state: a few plain numbers."""
        return np.zeros(self._size)

    def update(self, state, value: float, slopes=()) -> tuple[np.ndarray, Sign]:
        """Return the next state and what this sample said; a sample with NaN, or with a slope that is, is skipped."""
        detector_state = np.array(state, float).reshape(1, -1)
        if detector_state.size != self._size:
            raise InputError(f"state must be {self._size} numbers, got {detector_state.size}: another detector's?")
        z, m = (value - self.mean) / self.std, np.empty((1, 1, self._parameters))
        if math.isinf(z):
            raise InputError(f"value must be finite, or NaN where missing, got {value!r}")
        if self._parameters:
            if np.shape(slopes) != (self._parameters,):
                raise InputError(
                    f"slopes must be {self._parameters} numbers, how the mean of value moves per unit of each "
                    f"parameter (the regressors), got shape {np.shape(slopes)}; were they left out?"
                )
            m[0, 0] = np.divide(slopes, self.std)
            if np.isinf(m).any():
                raise InputError(f"slopes must be finite, or NaN where missing, got {slopes!r}")
        if z != z or np.isnan(m).any():
            return detector_state[0], Sign(0, math.nan, 0, -1)
        outs = np.empty((1, 1, 1 + OWN))
        self._look(detector_state, np.array([[z]]), m, outs, self._spec)
        alarm, statistic, since, which = outs[0, 0].tolist()
        return detector_state[0], Sign(int(alarm), statistic, int(since) if alarm else 0, int(which) if alarm else -1)
