"""Altitude and vertical rate of a track, where its plots have altitudes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..estimators.track.estimator import TrackEstimator
from ..estimators.track.trace import TrackTrace

STEEP = 0.1  # of what is fast for the class: fast upwards
LEAST = 2  # altitudes without which there is nothing to say


def vertical(track: Any) -> TrackTrace | None:
    """Return the trace of the altitudes of a `Track`, a row for each plot; None where they are unknown.

    Altitudes come in steps (25 or 100 feet of a transponder): a rounded number errs by step / sqrt(12).
    """
    altitude = track.altitude
    known = altitude[np.isfinite(altitude)]
    if len(known) < LEAST:
        return None
    steps = np.abs(np.diff(known))
    step = float(steps[steps > 1e-6].min()) if (steps > 1e-6).any() else 1.0
    estimator = TrackEstimator(STEEP * track.estimator.speed, coordinates=1)
    follow = estimator.smooth if track.is_smoothed else estimator.scan
    return follow(track.plots.time, altitude[:, None], np.array([[step**2 / 12]]))
