"""Plots to tracks: initiation, coasting, splitting, association; streams and records give the same tracks."""

import numpy as np
import pytest

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
    tracker = Tracker(**options)
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


def traffic():
    """Two with addresses, one that turns up twice, one without, one wild plot, one far away with an address in use."""
    leap = flight(12, key="AAAAAA", start=(90e3, 90e3), begin=83.0)
    wild = flight(1, key="4BAA5F", start=(60e3, -60e3), begin=41.0)
    twin = flight(15, key="ABCDEF", start=(-80e3, 0), begin=21.5)
    return together(
        flight(40, key="4BAA5F"), wild, flight(20, key="AAAAAA", start=(0, 9e3), begin=1.0), leap,
        flight(30, key="ABCDEF", begin=2.0, start=(9e3, 9e3)), twin, flight(25, start=(-30e3, 5e3), begin=0.7),
        flight(25, start=(-30e3, -5e3), velocity=(-90.0, 120.0), begin=2.3),
    )  # fmt: skip


def same(a, b):
    assert a.events == b.events and a.counts == b.counts and len(a.tracks) == len(b.tracks)
    for s, t in zip(a.tracks, b.tracks):
        assert (s.id, s.key, s.status, s.follows, s.events) == (t.id, t.key, t.status, t.follows, t.events)
        for name in ("time", "position", "key", "sensor"):
            np.testing.assert_array_equal(getattr(s.plots, name), getattr(t.plots, name))
        np.testing.assert_array_equal(s.outs, t.outs)
        assert s.state.tobytes() == t.state.tobytes()


@pytest.mark.parametrize("size", [1, 7])
@pytest.mark.parametrize("delay", [0.0, 9.0])
def test_a_stream_gives_the_tracks_of_the_record(size, delay, tmp_path):
    data = traffic()
    record = run(data, delay=delay)
    stream = Tracker(delay=delay)
    for first in range(0, len(data), size):
        stream.feed(data[first : first + size])
        if first == 70:  # a follower is stopped, and started again on another machine
            stream.save(tmp_path / "tracker.npz")
            stream = Tracker.load(tmp_path / "tracker.npz")
    stream.finish()
    same(record, stream)


def test_traffic_is_told_apart():
    tracker = run(traffic())
    tracks = tracker.tracks
    told = {kind: [e for e in tracker.events if e.kind == kind] for _, kind in kinds(tracker)}
    assert [t.key for t in tracks].count("4BAA5F") == 1 and [t.key for t in tracks].count("ABCDEF") == 2
    first, then = tracks.of("AAAAAA")
    assert then.follows == first.id and first.status == "ended" and len(first) == 20 and len(then) == 12
    assert [e.time for e in told["split"]] == [83.0] and len(told["duplicate"]) == 1
    assert tracker.counts["outliers"] == 1
    assert sorted(len(t) for t in tracks.of("")) == [25, 25]
    assert sum(map(len, tracks)) + tracker.counts["outliers"] == len(traffic())
