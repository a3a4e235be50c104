"""The 12 s long-range radar, C-130: one track of an air-surveillance radar, put on a grid of scans in metres.

The recording is not part of the package; ``DRIFTWISE_DATA`` names the folder where it lies (default ../shared/data).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from . import recordings


class Track(NamedTuple):
    """Positions on the antenna's grid; NaN where a scan was missed."""

    y: np.ndarray  # (T, 2) East, North of the first plot, m
    period: float  # s
    missed: int
    plots: int

    @property
    def time(self):
        """Seconds since the first plot."""
        return self.period * np.arange(len(self.y))


def path() -> Path:
    """Return where the recording is, or should be (one JSON file in its folder)."""
    folder = recordings.folder() / "longrange_radar"
    return next(iter(sorted(folder.glob("*.json"))), folder / "track.json")


def read() -> Track:
    """Return the track on its grid."""
    ((_, time, position),) = recordings.long_range(recordings.folder())
    y, period = on_grid(time, position)
    return Track(y, period, len(y) - len(time), len(time))


def on_grid(time, position):
    """Return plots (T, m) on the grid of scans, NaN where one was missed, and the period: times rounded to scans."""
    step = np.diff(time)
    scans = np.concatenate([[0], np.cumsum(np.maximum(np.rint(step / np.median(step)), 1))]).astype(int)
    y = np.full((scans[-1] + 1, *position.shape[1:]), np.nan)
    y[scans] = position
    return y, (time[-1] - time[0]) / scans[-1]
