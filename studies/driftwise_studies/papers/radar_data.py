"""The radars' tracks: all plots of one, in metres; and the same on a grid of scans.

The recordings are not part of the package; ``DRIFTWISE_DATA`` names the folder where they lie.
"""

from __future__ import annotations

import numpy as np

from . import recordings
from .recordings import Kind


def tracks(kind: Kind):
    """Return time (T,) and position (T, 2) of each track of a radar; none where the recording is not there."""
    series = recordings.series(kind, recordings.folder())
    return [(east.time, np.column_stack([east.y, north.y])) for east, north in zip(series[::2], series[1::2])]


def on_grid(time, position):
    """Return plots (T, m) on the grid of scans, NaN where one was missed, and the period: times rounded to scans."""
    step = np.diff(time)
    scans = np.concatenate([[0], np.cumsum(np.maximum(np.rint(step / np.median(step)), 1))]).astype(int)
    y = np.full((scans[-1] + 1, *position.shape[1:]), np.nan)
    y[scans] = position
    return y, (time[-1] - time[0]) / scans[-1]
