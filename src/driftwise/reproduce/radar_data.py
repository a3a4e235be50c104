"""The 12 s long-range radar, C-130: one track of an air-surveillance radar, put on a grid of scans in metres.

The recording is not part of the package; ``DRIFTWISE_DATA`` names the folder where it lies (default ../shared/data).
"""

from __future__ import annotations

import datetime
import json
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..tracking.frames import east_north

FOLDER = Path("tracking") / "longrange_radar"


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
    # src/driftwise/reproduce -> the project's folder; its neighbour holds the recordings of a developer
    default = Path(__file__).resolve().parents[4] / "shared" / "data"
    folder = Path(os.environ.get("DRIFTWISE_DATA", default)) / FOLDER
    return next(iter(sorted(folder.glob("*.json"))), folder / "track.json")


def read() -> Track:
    """Return the track: the anchor that is no radar plot dropped, times rounded to scans, missed scans NaN."""
    plots = [plot for plot in json.loads(path().read_text())["waypoints"] if plot["site"] != "anchor"]
    time = np.array([datetime.datetime.fromisoformat(plot["utc"].replace("Z", "+00:00")).timestamp() for plot in plots])
    position = east_north(np.array([p["lat"] for p in plots]), np.array([p["lon"] for p in plots]))
    step = np.diff(time)
    scans = np.concatenate([[0], np.cumsum(np.maximum(np.rint(step / np.median(step)), 1))]).astype(int)
    y = np.full((scans[-1] + 1, 2), np.nan)
    y[scans] = position
    return Track(y, (time[-1] - time[0]) / scans[-1], int(len(y) - len(plots)), len(plots))
