"""The carriage of a positioning rig, observed: its published model, a reference from hindsight, and observers of it.

Given are the published mass M, viscous friction Fv and gain g; Coulomb friction and offset are the load, which nobody
tells anyone (Janot, Gautier, Brunot, 2019).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.signal import butter, filtfilt

import driftwise as dw

from ..records import columns

FILE = "emps_train.csv"
M, FV, GAIN = 95.1089, 203.5034, 35.15065188  # kg, N s/m, N/V
DT, ENCODER = 1e-3, 2e-6  # s, m
ROUNDED = 20e-6  # m: the encoder as a cheap one would be
LEARN = 10_000  # samples of the record's first part, on which walks and windows are tuned
CARRIAGE = dw.Plant([[0, 1], [0, -FV / M]], [0, GAIN / M], states=("position", "velocity"), inputs="voltage")


class Truth(NamedTuple):
    """What zero-phase filters say afterwards: m/s, m/s^2, N."""

    velocity: np.ndarray
    acceleration: np.ndarray
    load: np.ndarray


def read(where: Path):
    """Return voltage and position of the record."""
    table = columns(where / FILE)
    return np.asarray(table["u_V"], float), np.asarray(table["position_m"], float)


def reference(u, position) -> Truth:
    """Return the reference: fourth-order Butterworth filters, forwards and backwards, and central differences."""

    def smooth(x, hertz):
        return filtfilt(*butter(4, 2 * hertz * DT), x)

    velocity = np.gradient(smooth(position, 100), DT)
    acceleration = np.gradient(velocity, DT)
    return Truth(velocity, acceleration, smooth(GAIN * u - M * acceleration - FV * velocity, 50))


def encoder(position, step):
    """Return the position as an encoder of this step would give it (0: as it was recorded), and its deviation."""
    seen = np.round(position / step) * step if step else position
    return seen, max(ENCODER, step / math.sqrt(12))


def score(found: Truth, truth: Truth, first=500):
    """Return rms errors in mm/s, m/s^2 and N from a sample on; 500 at the end are not scored either."""
    units = 1e3, 1.0, 1.0
    return [unit * np.sqrt(np.mean((a - b)[first:-500] ** 2)) for unit, a, b in zip(units, found, truth, strict=True)]


# --- the observers -----------------------------------------------------------------------------------------


def observer(noise_std, window=math.inf, walk=0.0):
    """Return the observer of the carriage under a load that nothing is known of."""
    load = dw.models.Polynomial([0, -1 / M], np.inf, walk=walk, name="load")
    acceleration = [0, -FV / M, -1 / M], [GAIN / M]
    return dw.WindowObserver(
        CARRIAGE, window, noise_std=noise_std, disturbances=load, hold="zoh", dt=DT,
        derived={"acceleration": acceleration},
    )  # fmt: skip


def chain(noise_std, degree, window):
    """Return the window that knows of no motor: the position is a polynomial of time."""
    return dw.WindowObserver(dw.Plant(np.eye(degree + 1, k=1)), window, noise_std=noise_std, dt=DT)


def read_out(trace) -> Truth:
    """Return what an observer of the carriage says."""
    return Truth(*(trace.of(name)[0] for name in ("velocity", "acceleration", "load")))


def read_chain(trace) -> Truth:
    """Return what a chain says, with the load that the motor's equation makes of it."""
    v, a = trace.x[:, 1], trace.x[:, 2]
    return Truth(v, a, GAIN * trace.u[:, 0] - M * a - FV * v if trace.u.shape[1] else np.full(len(v), np.nan))


# --- a cold start ------------------------------------------------------------------------------------------


def beginnings(truth: Truth, starts: int) -> np.ndarray:
    """Return samples after the part that tunes, at which the carriage moves: where a cold start begins."""
    moving = np.flatnonzero(np.abs(truth.velocity) > 0.05)
    moving = moving[(moving > LEARN) & (moving < len(truth.velocity) - 1000)]
    return np.random.default_rng(0).choice(moving, starts, replace=False)


def settle(error, limit=2e-3, hold=50):
    """Return after how many samples the error stays below the limit for 50 ms; infinite if it never does."""
    inside = np.abs(error) < limit
    runs = np.convolve(inside, np.ones(hold), "valid") == hold
    return float(np.argmax(runs)) if runs.any() else math.inf
