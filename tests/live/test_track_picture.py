"""What a map is told of a tracker: that of its tracks, bounded, and JSON whatever came."""

import json

import numpy as np
import pytest

import driftwise as dw
from driftwise.live import track_picture
from driftwise.live.track_picture import encoded, picture
from driftwise.tracking.plots import plots


def flights(names, steps=100, speed=(150.0, 80.0), **options):
    """Return a tracker that was fed with parallel flights, a plot of each every 4 s."""
    n, time = len(names), np.repeat(4.0 * np.arange(steps), len(names))
    place = np.stack([speed[0] * time, speed[1] * time + 5000 * np.tile(np.arange(n), steps)], axis=1)
    noise = np.random.default_rng(1).normal(0, 20, place.shape)
    tracker = dw.tracking.Tracker(**options)
    tracker.feed(plots(time, place + noise, key=[f"K{k}" for k in range(n)] * steps, name=list(names) * steps))
    return tracker


def told(tracker):
    return json.loads(encoded(picture(tracker)), parse_constant=pytest.fail)


def test_it_is_what_the_tracks_say():
    tracker = flights(["A", "<b>&", ""])
    seen, tracks = told(tracker), tracker.tracks
    assert [one["name"] for one in seen["tracks"]] == ["A", "<b>&", "K2"]
    assert (seen["plots"], seen["total"], seen["time"], seen["ahead"]) == (300, 3, 396.0, 60)
    for one, track in zip(seen["tracks"], tracks):
        trace = track.trace
        for name in ("position", "velocity", "speed", "speed_sd", "course", "course_sd"):
            np.testing.assert_allclose(one[name], getattr(trace, name)[-1], rtol=1e-12)
        np.testing.assert_allclose(one["trail"][::-1], trace.position[::-3], atol=0.051)  # 100 plots, every third
        (a, b, course), C = one["ellipse"], trace.spread[-1][::3, ::3]
        u = np.array([np.sin(np.radians(course)), np.cos(np.radians(course))])
        turned = np.stack([u, [u[1], -u[0]]])
        np.testing.assert_allclose(turned.T @ np.diag([a * a, b * b]) @ turned, -2 * np.log(0.05) * C, rtol=1e-9)


def test_it_is_bounded(monkeypatch):
    monkeypatch.setattr(track_picture, "MOST", 5)
    monkeypatch.setattr(track_picture, "POINTS", 7)
    tracker = flights(["x" * 1000] * 8, steps=300)
    seen = told(tracker)
    assert (len(seen["tracks"]), seen["total"]) == (5, 8)
    assert all(len(one["trail"]) <= 7 and len(one["name"]) <= 40 for one in seen["tracks"])
    one, track = seen["tracks"][0], tracker.tracks[seen["tracks"][0]["id"] - 1]
    np.testing.assert_allclose(one["trail"][-1], track.trace.position[-1], atol=0.051)
    oldest = np.abs(track.trace.position - one["trail"][0]).sum(axis=1).argmin()
    assert 0 <= track.plots.time[oldest] - (track.plots.time[-1] - 600) < 4 * 22, "the trail goes ten minutes back"


def test_what_is_shown_last_is_what_was_seen_last(monkeypatch):
    monkeypatch.setattr(track_picture, "MOST", 1)
    tracker = flights(["A", "B"])
    tracker.feed(plots([400.0], [[400 * 150.0, 400 * 80.0 + 5000]], key=["K1"], name=["B"]))
    assert [one["name"] for one in told(tracker)["tracks"]] == ["B"]


def test_nothing_and_the_unknown_are_json():
    assert told(dw.tracking.Tracker()) == {"time": None, "plots": 0, "total": 0, "ahead": 60.0, "tracks": []}
    assert told(flights(["A"], steps=2))["total"] == 0, "a tentative track is not shown"
    assert told(flights(["A"], estimator="boat", speed=(5.0, 2.0)))["ahead"] == 360
    seen = picture(flights(["A", "B"]))
    seen.rows[0, 1:] = np.nan
    seen.trails[0][0] = np.inf
    one, other = json.loads(encoded(seen), parse_constant=pytest.fail)["tracks"]
    assert one["speed"] is None and one["ellipse"] == [None] * 3 and one["trail"][0] == [None, None]
    assert other["speed"] == pytest.approx(170, abs=5)


def test_later_plots_do_not_change_a_picture():
    tracker = flights(["A"])
    seen = picture(tracker)
    before = encoded(seen)
    tracker.feed(plots([400.0], [[400 * 150.0, 400 * 80.0]], key=["K0"], name=["A"]))
    assert encoded(seen) == before != encoded(picture(tracker))
