"""Tracks: the whole bank against one filter of filterpy; 1000 aircraft at once; what a state weighs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import driftwise as dw

from .clock import cpu, ratio
from .verdicts import Verdict, at_most, for_information

SOURCE = "bench/tracks.py"
SCAN, TRACKS, SCANS = 4.0, 1000, 12  # s; aircraft; turns of the antenna


def verdicts(plots: int = 2000) -> Iterator[Verdict]:
    """Yield the cost of a plot in a record, streamed and through the tracker, and the size of a state."""
    draw = np.random.default_rng(1)
    time = SCAN * np.arange(plots)
    path = np.stack([200.0 * time, 50.0 * time], axis=1) + 50.0 * draw.standard_normal((plots, 2))
    est, few = dw.TrackEstimator("aircraft"), plots // 10
    _, mine, other = ratio(lambda: est.scan(time, path), lambda: _constant_velocity(time[:few], path[:few]), rounds=7)
    mine, other = mine / plots / 2 * 1e6, other / few / 2 * 1e6
    note = f"{len(est.names)} members; one constant-velocity filter of filterpy: {other:.0f} us"
    yield at_most("tracks, a plot and coordinate, whole bank", mine, 25.0, "us", SOURCE, note)
    yield for_information("tracks, whole bank over one filter of filterpy", mine / other, "x", SOURCE).beside(
        "filterpy", mine / other
    )
    yield at_most("tracks, state of a track", est.dtype.itemsize, 4096, "bytes", SOURCE)

    def stream():
        state = est.start()
        for k in range(few):
            state, _ = est.update(state, time[k], path[k])

    yield for_information("tracks, est.update", np.median([cpu(stream) for _ in range(5)]) / few * 1e6, "us", SOURCE)
    seconds = _airspace(draw)
    share = 100 * seconds / (SCANS * SCAN)
    note = f"{seconds / SCANS / TRACKS * 1e6:.0f} us a plot through Tracker"
    yield at_most("tracks, 1000 aircraft at a 4 s scan", share, 5.0, "% of a core", SOURCE, note)


def _airspace(draw) -> float:
    """Return the CPU seconds of SCANS turns of an antenna that sees TRACKS aircraft."""
    from driftwise.tracking.plots import plots

    start, velocity = 2e5 * draw.standard_normal((TRACKS, 2)), 150.0 * draw.standard_normal((TRACKS, 2))
    keys = np.array([f"{k:06X}" for k in range(TRACKS)], object)
    tracker, seconds = dw.tracking.Tracker("aircraft"), 0.0
    for scan in range(SCANS + 3):
        at = SCAN * (scan + np.arange(TRACKS) / TRACKS)
        seen = plots(at, start + velocity * at[:, None] + 50.0 * draw.standard_normal((TRACKS, 2)), key=keys)
        taken = cpu(partial(tracker.feed, seen))
        seconds += taken if scan >= 3 else 0.0  # the first turns make the tracks
    return seconds


def _constant_velocity(time, path) -> None:
    from filterpy.kalman import KalmanFilter

    kf = KalmanFilter(dim_x=4, dim_z=2)
    kf.H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]])
    kf.R, kf.P = 2500.0 * np.eye(2), np.diag([2500.0, 250.0**2, 2500.0, 250.0**2])
    kf.x = np.array([path[0, 0], 0, path[0, 1], 0])
    for d, y in zip(np.diff(time), path[1:]):
        block, Q = np.array([[1, d], [0, 1]]), 0.1 * np.array([[d**3 / 3, d * d / 2], [d * d / 2, d]])
        kf.F, kf.Q = np.kron(np.eye(2), block), np.kron(np.eye(2), Q)
        kf.predict()
        kf.update(y)
