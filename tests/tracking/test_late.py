"""Plots that come late: what is told now is bit for bit what plots in order of time give."""

import numpy as np

import driftwise as dw
from driftwise.tracking.plots import plots


def two_radars(seed=3, n=40):
    """Return plots of four aircraft by two radars, one of them without keys, and in which order they come."""
    rng, parts = np.random.default_rng(seed), []
    for k in range(4):
        for sensor, scan, first in (("A", 4.0, 0.3 * k), ("B", 5.0, 1.1 + 0.2 * k)):
            t = first + scan * np.arange(n)
            path = np.stack([150 * t + 9e3 * k, 80 * t * (-1) ** k], axis=1) + 20 * rng.standard_normal((n, 2))
            parts.append((t, path, np.full(n, f"AB{k}" if sensor == "A" else ""), np.full(n, sensor)))
    time, position, key, sensor = (np.concatenate(part) for part in zip(*parts))
    seen = plots(time, position, key=key, sensor=sensor)
    come = seen.time + np.where(seen.sensor == "B", 3.0, 0.0) + rng.uniform(0, 1.5, len(seen))
    return seen, np.argsort(come, kind="stable")


def same(a, b):
    assert [repr(t) for t in a] == [repr(t) for t in b] and a.events == b.events
    for one, other in zip(a, b):
        assert one.table.tobytes() == other.table.tobytes() and one.state.tobytes() == other.state.tobytes()
        assert one.plots.time.tobytes() == other.plots.time.tobytes() and one.events == other.events


def test_what_is_told_now_is_the_ordered_result_and_changes_nothing():
    seen, come = two_radars()
    tracker = dw.tracking.Tracker(delay=6.0)
    for k, at in enumerate(come):
        tracker.feed(seen[int(at)])
        if k in (5, 60, 61, 200, 319):
            same(tracker.now(), dw.track(seen[np.sort(come[: k + 1])]))
    assert len(tracker.now()[0].plots) > len(tracker.tracks[0].plots), "some are held back"
    tracker.finish()
    same(tracker.tracks, dw.track(seen))
    same(tracker.now(), tracker.tracks)
    assert tracker.counts["late"] == 0


def test_what_comes_later_than_the_lag_is_refused_and_counted():
    seen, come = two_radars()
    tracker = dw.tracking.Tracker(delay=1.0)
    for at in come:
        tracker.feed(seen[int(at)])
    tracker.finish()
    counts = tracker.counts
    assert counts["late"] > 20 and counts["plots"] == len(seen)
