"""This package's observers as rows of the comparison: the theorem, growing least squares, windows.

What has a state is run compiled, record by record. A full window of regular samples is a fixed filter, and its gains
are applied to all records at once; that this is what the compiled window gives, a verdict says.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.signal import oaconvolve

import driftwise as dw

from .listed import GROWING4, GROWING6, SOFT, THEOREM, THEOREM4, WINDOW4, WINDOW4_SHORT, WINDOW6
from .motor import INTO, RATE, SIGMA, VOLTS, Told, constant, cosine, motor
from .opponents import PRIOR, Run

KNOWN = dict(noise_std=SIGMA, hold="foh", dt=1 / RATE)
KALMAN = "growing window with the honest prior"
STEP = dict(noise_std=SIGMA, dt=1 / RATE)


def theorem(frequencies=(50.0,), told: Told = Told(), **options: Any) -> dw.AlgebraicObserver:
    """Return the theorem for the motor: its constant disturbance and these frequencies."""
    return dw.AlgebraicObserver(motor(told).plant, into=INTO, frequencies=frequencies, **KNOWN | options)


def window(seconds: float, *disturbances, told: Told = Told(), **options: Any) -> dw.WindowObserver:
    """Return the window of the motor with these disturbances; infinite: growing."""
    return dw.WindowObserver(motor(told).plant, seconds, disturbances=disturbances, **KNOWN | options)


@dataclass(frozen=True)
class Compiled:
    """An observer's states, record by record."""

    observer: Any

    def __call__(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the states (S, T, 3), NaN until ready."""
        return np.stack([self.observer.scan(one, u, keep="means").x for one in y])


@dataclass(frozen=True)
class Sliding:
    """The full windows of all records at once, by the window's gains: NaN while the first one fills."""

    observer: dw.WindowObserver = field(repr=False)

    def __call__(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the states (S, T, 3)."""
        design = self.observer.design
        kept = np.full((*y.shape, 3), np.nan)
        for i in range(3):
            pushed = oaconvolve(u, design.input_gains[i, ::-1, 0], mode="valid")
            kept[:, design.samples - 1 :, i] = (
                oaconvolve(y, design.gains[i, None, ::-1, 0], mode="valid", axes=1) + pushed
            )
        return kept


def everybody() -> dict[str, Run]:
    """Return this package's rows of the comparison."""
    one, line = constant(), cosine()
    soft = (constant(2.0), cosine(prior_std=2.0))
    return {
        THEOREM: Compiled(theorem()),
        THEOREM4: Compiled(theorem(())),
        GROWING6: Compiled(window(np.inf, one, line)),
        GROWING4: Compiled(window(np.inf, one)),
        KALMAN: Compiled(window(np.inf, constant(PRIOR[3]), cosine(prior_std=PRIOR[4]), x_std=PRIOR[:3])),
        WINDOW6: Sliding(window(1.0, one, line)),
        WINDOW4_SHORT: Sliding(window(0.5, one)),
        WINDOW4: Sliding(window(1.0, one)),
        **{SOFT.format(T): Sliding(window(T, *soft)) for T in (0.3, 0.5, 1, 2)},
    }


@lru_cache(maxsize=8)
def under_model_errors(told: Told) -> dict[str, Run]:
    """Return this package's columns under model errors."""
    return {
        THEOREM: Compiled(theorem((told.w,), told)),
        WINDOW4_SHORT: Sliding(window(0.5, constant(), told=told)),
        WINDOW4: Sliding(window(1.0, constant(), told=told)),
    }


@lru_cache(maxsize=1)
def forced(samples: int) -> np.ndarray:
    """Return what 24 sin t does to the motor from rest, exactly, (samples, 3): a straight line is not the sine."""
    M = np.zeros((5, 5))
    M[:3, :3] = motor().plant.A
    M[:3, 3] = VOLTS * np.ravel(motor().plant.B)
    M[3, 4], M[4, 3] = 1, -1
    step, z = expm(M / RATE), np.empty((samples, 5))
    z[0] = [0, 0, 0, 0, 1]
    for k in range(samples - 1):
        z[k + 1] = step @ z[k]
    return z[:, :3]


def silent() -> dw.Plant:
    """Return the motor without its input, for samples from which `forced` was taken."""
    return motor().plant._replace(B=None, inputs=None)
