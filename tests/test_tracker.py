"""Plots to tracks: initiation, coasting, splitting, association; streams and records give the same tracks."""

import numpy as np
from plain_filter import PlainFilter

from driftwise.tracking.plots import plots
from driftwise.tracking.tracker import Tracker


def flight(T=20, scan=4.0, start=(0.0, 0.0), velocity=(200.0, 50.0), begin=0.0, **named):
    """Plots of a straight flight, 30 m of error on each coordinate."""
    time = begin + scan * np.arange(T)
    noise = 30 * np.random.default_rng(3).standard_normal((T, 2))
    return plots(time, np.array(start) + (time - begin)[:, None] * velocity + noise, **named)


def together(*parts, **named):
    columns = {c: np.concatenate([getattr(p, c) for p in parts]) for c in ("position", "altitude", "key", "sensor")}
    return plots(np.concatenate([p.time for p in parts]), **columns, **named)


def kinds(tracker):
    return [(e.track, e.kind) for e in tracker.events]


def run(data, **options):
    tracker = Tracker(PlainFilter(), **options)
    tracker.feed(data)
    tracker.finish()
    return tracker


def test_a_track_is_confirmed_coasts_and_ends():
    data = flight(20, key="4BAA5F")
    tracker = run(data)
    assert kinds(tracker) == [(1, "initiated"), (1, "confirmed")]
    assert tracker.events[1].time == data.time[2]
    last = data.time[-1]
    assert [e.kind for e in tracker.advance(last + 4 * 3.6)] == ["coasting"]
    assert tracker.tracks[0].status == "coasting"
    mean, _ = tracker.tracks[0].predict(last + 16)
    assert np.hypot(*(mean - data.position[-1] - [3200, 800])) < 100
    assert [e.kind for e in tracker.feed(flight(1, begin=last + 16, start=mean, key="4BAA5F"))] == ["resumed"]
    assert [e.kind for e in tracker.advance(last + 100)] == ["coasting", "ended"]
    assert len(tracker.tracks[0]) == 21 and tracker.tracks[0].missed == 3
