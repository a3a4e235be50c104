"""Plots to tracks: initiation, coasting, splitting, association; streams and records give the same tracks."""

import json
import os
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from flights import flight, run, same, together, traffic

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.tracking.placed import placed
from driftwise.tracking.plots import plots
from driftwise.tracking.read import read_plots
from driftwise.tracking.scans import Scans
from driftwise.tracking.tracker import Tracker


def kinds(tracker):
    return [(e.track, e.kind) for e in tracker.events]


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
    assert [e.kind for e in tracker.advance(last + 100)] == ["coasting"]
    assert [e.kind for e in tracker.advance(last + 160)] == ["ended"]
    assert len(tracker.tracks[0]) == 21 and tracker.tracks[0].missed == 3


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


def test_tracks_are_what_a_scan_says():
    for track in run(traffic()).tracks:
        scan = dw.TrackEstimator().scan(track.plots.time, track.plots.position)
        np.testing.assert_array_equal(track.trace.table, scan.table)
        assert track.state.tobytes() == scan.state.tobytes()


def nonsense(seed):
    """Plots that no sensor would send: equal times, leaps, wild positions, clocks and covariances, in disorder."""
    rng = np.random.default_rng(seed)
    T = int(rng.integers(1, 80))
    time = np.cumsum(rng.choice([0, 0, 1e-9, 0.3, 4, 4, 4, 30, 700], T)) + rng.choice([0, 1.7e9])
    time[rng.integers(T)] += rng.choice([0, 1e5, -1e5, 1e12])
    position = rng.choice([1e2, 1e4, 1e6, 1e12]) * rng.standard_normal((T, 2)) * rng.choice([0, 1, 1], (T, 1))
    data = plots(
        time, position, covariance=rng.choice([np.nan, 100.0, 0.0, -1.0, 1e-30, 1e30], (T, 1, 1)) * np.ones((2, 2)),
        key=rng.choice(["", "A1234", "4BAA5F"], T).astype(object), sensor=rng.choice(["", "a"], T).astype(object),
        altitude=rng.choice([np.nan, 0, 9000.0], T),
    )  # fmt: skip
    options = dict(confirm=[(3, 5), (1, 1)][rng.integers(2)], single=bool(rng.integers(2)), delay=rng.choice([0, 5.0]))
    return data[rng.permutation(len(data))] if rng.random() < 0.5 else data, options


def test_no_plot_is_lost_whatever_comes(tmp_path):
    for seed in range(40):
        data, options = nonsense(seed)
        record, stream = run(data, **options), Tracker(**options)
        for k in range(len(data)):
            stream.feed(data[k : k + 1])
            if k % 17 == 5:
                stream.save(tmp_path / "tracker.npz")
                stream = Tracker.load(tmp_path / "tracker.npz")
        stream.finish()
        same(record, stream)
        counts = record.counts
        left_out = sum(counts[name] for name in ("late", "repeated", "outliers", "discarded"))
        assert sum(map(len, [*record.tracks, *record.tentative])) + left_out == counts["plots"], seed
        assert counts["plots"] + counts["clock"] + len(record.faults) == len(data), seed


def test_a_gap_makes_a_track_that_follows():
    tracker = run(together(flight(10, key="K"), flight(10, key="K", begin=36 + 140.0, start=(35e3, 9e3))))
    first, then = tracker.tracks
    assert (first.status, then.status, then.follows, len(first), len(then)) == ("ended", "confirmed", 1, 10, 10)
    assert [e.kind for e in first.events][-2:] == ["coasting", "ended"]
    assert [e.time for e in first.events[-2:]] == [36 + 3.5 * 4, 36 + 32 * 4]  # scans, whenever it was noticed


def test_fixes_hours_apart_are_one_track():
    """A collared animal: a fix in six hours is no wild clock, with a name or without one."""
    rng = np.random.default_rng(2)
    time = 1.7e9 + 21600.0 * np.arange(60)
    walk = np.cumsum(300 * rng.standard_normal((60, 2)), axis=0)
    for key, options in (("", {}), ("", dict(single=True)), ("COLLAR 7", {})):
        tracker = run(plots(time, walk, key=key), estimator=1.0, **options)
        assert len(tracker.tracks) == 1 and tracker.counts["clock"] == 0 and len(tracker.tracks[0]) >= 59
    data, late = plots(time, walk, key="COLLAR 7"), time.copy()
    late[30] += 40 * 86400.0
    tracker = run(replace(data, time=late), estimator=1.0)
    assert tracker.counts["clock"] == 1 and len(tracker.tracks) == 1


def test_two_nameless_plots_within_reach_of_a_track_that_was_not_seen_are_its():
    """After a precise start the errors are a thousand times as large: nobody else is there."""
    rng = np.random.default_rng(3)
    time = 4.0 * np.arange(60)
    error = rng.standard_normal((60, 2)) * np.where(np.arange(60) < 20, 0.02, 20.0)[:, None]
    tracker = run(plots(time, np.stack([200 * time, 50 * time], axis=1) + error))
    (track,) = tracker.tracks
    assert len(track) + tracker.counts["discarded"] == 60 and tracker.counts["discarded"] < 2  # one beyond the gate


def test_a_slow_radar_that_sees_all_more_often_goes_on_with_its_tracks():
    """Reports every 3 s, every second, every 10 s, every second: one alone seems a second plot of its scan."""
    time = np.cumsum(np.repeat([3.0, 1.0, 10.0, 1.0], 15))
    two = [plots(time, np.stack([5.0 * time + x, 0.0 * time], axis=1), sensor="radar") for x in (0.0, 4000.0)]
    tracks = run(together(*two), estimator="boat").tracks
    assert len(tracks) == 2 and min(len(t) for t in tracks) >= 59


def test_two_wild_plots_of_a_key_are_no_second_object():
    data = flight(200, key="K")
    position = data.position.copy()
    position[[80, 86, 92]] += [[0.0, 30_000.0], [0.0, 31_000.0], [0.0, 33_000.0]]
    tracker = run(replace(data, position=position))
    assert [len(t) for t in tracker.tracks] == [197]


def test_a_track_is_where_it_was_before_a_wild_plot():
    """A plot that its object can just have reached is followed by those from which it cannot have come."""
    data = flight(40, key="K")
    position = data.position.copy()
    position[20] += [0.0, 2500.0]
    tracker = run(replace(data, position=position))
    assert len(tracker.tracks) == 1 and len(tracker.tracks[0]) + tracker.counts["outliers"] == 40


def test_a_few_plots_are_no_track():
    tracker = run(together(flight(2, key="GARBLE"), flight(20, key="4BAA5F", begin=0.5)))
    assert [t.key for t in tracker.tracks] == ["4BAA5F"] and tracker.counts["discarded"] == 2
    assert [t.key for t in run(flight(2, key="GARBLE")).tentative] == ["GARBLE"]
    assert [t.key for t in run(flight(2, key="GARBLE"), confirm=(1, 1)).tracks] == ["GARBLE"]


def test_a_mode_a_code_joins_an_addressed_track_where_it_fits():
    fits = flight(20, key="A1234", begin=2.0, start=(400.0, 100.0), sensor="old", altitude=9000.0)
    own = flight(20, key="4BAA5F", sensor="new", altitude=9100.0)
    (track,) = run(together(own, fits)).tracks
    assert track.key == "4BAA5F" and len(track) > 35 and set(track.plots.key) == {"4BAA5F", "A1234"}
    low = flight(20, key="A1234", begin=2.0, start=(400.0, 100.0), sensor="old", altitude=2000.0)
    assert [(t.key, len(t)) for t in run(together(own, low)).tracks] == [("4BAA5F", 20), ("A1234", 20)]


def test_plots_in_disorder_wait_for_their_turn():
    data = flight(30, key="4BAA5F")
    order = np.argsort(data.time + np.random.default_rng(1).uniform(0, 9, 30), kind="stable")
    assert np.any(np.diff(data.time[order]) < 0)
    patient, hasty = run(data[order], delay=10.0), run(data[order])
    assert patient.counts["late"] == 0 and hasty.counts["late"] > 3
    np.testing.assert_array_equal(patient.tracks[0].table, run(data).tracks[0].table)
    again = replace(data, position=data.position + 40.0)
    first = run(together(data, again), delay=10.0).tracks[0]  # of two at one time the one that came first
    np.testing.assert_array_equal(first.plots.position, data.position)


def test_two_nameless_ones_in_formation_are_two():
    leader = flight(20, sensor="radar")
    for behind, aside in ((0.3, 100.0), (2.0, 450.0)):  # within half a scan of the leader's plot; beside its gate
        start = np.array([200.0, 50.0]) * (20 + behind) + [aside, -aside]
        wing = flight(14, begin=behind + 20, start=start, sensor="radar")
        tracks = run(together(leader, wing)).tracks
        assert [len(t) for t in tracks] == [20, 14]
        np.testing.assert_array_equal(tracks[0].plots.position, leader.position)


def test_scan_periods_are_medians_of_the_slowest_sensor():
    scans, clock = Scans(), {}
    for time in (0.0, 4.0, 8.0, 12.0, 16.0, 916.0, 920.0, 924.0):
        scans.tick(clock, "a", time, 600.0)
    assert clock["a"][1:] == [4.0] * 6 and scans.period(clock) == 4.0  # a pause is no scan
    new = {}
    for time in (0.0, 0.2):
        scans.tick(new, "a", time, 600.0)
    assert scans.period(new) == 4.0  # what others are seen with counts until there is enough of its own
    for time in (0.4, 0.6, 0.8, 1.0, 1.2):
        scans.tick(new, "a", time, 600.0)
    assert scans.period(new) == pytest.approx(0.2)
    for time in (0.0, 12.0, 24.0):
        scans.tick(new, "b", time, 600.0)
    assert scans.period(new) == 12.0 and Scans().period({}) == 0.0


def test_tracks_of_a_moment_do_not_change():
    tracker, data = Tracker(), flight(20, key="K")
    tracker.feed(data[:12])
    before = tracker.tracks[0]
    state, outs = before.state.tobytes(), before.table.copy()
    tracker.feed(data[12:])
    assert before.state.tobytes() == state and len(tracker.tracks[0]) == 20
    np.testing.assert_array_equal(before.table, outs)


def test_one_wrong_clock_ends_nothing():
    data = flight(30, key="4BAA5F")
    time = data.time.copy()
    time[12] += 86400.0
    tracker = run(replace(data, time=time))
    assert [len(t) for t in tracker.tracks] == [29] and tracker.counts["clock"] == 1
    restarted = run(together(flight(10, key="K", begin=1e5), flight(1, key="K")))
    assert len(restarted.tracks) == 1
    back = Tracker()
    back.feed(flight(10, key="K", begin=1e5))
    back.feed(flight(10, key="K"))
    assert [len(t) for t in back.tracks] == [10, 10] and "clock went back" in back.tracks[0].events[-1].words


def test_stale_and_repeated_plots_are_counted_not_used():
    data = flight(20, key="4BAA5F")
    twice = together(data, data, data[5:6])
    stale = plots(np.r_[data.time, 42.0], np.r_[data.position, data.position[10:11]], key="4BAA5F")
    for fed, repeated in ((twice, 21), (stale, 1)):
        tracker = run(fed)
        assert len(tracker.tracks[0]) == 20 and tracker.counts["repeated"] == repeated


def test_manoeuvres_and_wild_plots_of_one_nameless_object():
    data = flight(40)
    wild = plots(data.time[20:21], data.position[20:21] + [0.0, 4e3])
    (track,) = run(together(data[:20], wild, data[21:])).tracks
    assert len(track) == 39
    tracker = run(together(data[:20], plots(data.time[20:], data.position[20:] + [260.0, -260.0])))
    assert [len(t) for t in tracker.tracks] == [40]  # nobody else is there: it manoeuvred


def test_columns_as_people_have_them():
    dates = np.array(["2024-01-01T00:00:08", "2024-01-01T00:00:00", "NaT", "2024-01-01T00:00:04"], "M8[ms]")
    some = plots(dates, np.arange(8).reshape(4, 2), covariance=[4, 9], key=[7, None, "A", np.nan])
    assert some.time.tolist() == [1704067200.0, 1704067204.0, 1704067208.0] and some.key.tolist() == ["", "", "7"]
    assert some.covariance[0].tolist() == [[4, 0], [0, 9]] and some.faults[0].offset == 2
    assert len(some[0]) == 1 and [len(one) for one in some] == [1, 1, 1]
    with pytest.raises(InputError, match=r"position must have a row .* got shape \(2, 3\)"):
        plots([0, 1, 2], np.zeros((2, 3)))
    with pytest.raises(InputError, match="are they swapped"):
        plots([0], [1, 2], origin=(200, 8))
    with pytest.raises(InputError, match="is the second argument"):
        dw.track(some, speed="boat")


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(confirm=(4, 3)), "1 <= N <= M"),
        (dict(coast=9.0), "below gap"),
        (dict(delay=-1.0), "delay must be within"),
        (dict(gate=0.0), "gate must be"),
        (dict(estimator=dw.TrackEstimator(coordinates=1)), "two coordinates"),
    ],
)
def test_what_cannot_be_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        Tracker(**options)


RECORDINGS = Path(os.environ.get("DRIFTWISE_DATA", Path(__file__).parents[3] / "shared" / "data")) / "tracking"


@pytest.mark.parametrize(
    "name, options, keys, tracks",
    [
        ("modes_raw/full_flight_short.lines00001-12000.jsonl", {}, 1, 1),
        ("longrange_radar/gofer06.json", {}, 1, 1),  # no keys: association by fit
        ("longrange_radar/gofer06.json", dict(single=True), 1, 1),
        ("adsb_tracks/ambulances__rega_sg.json.gz", dict(estimator="helicopter"), 1, 1),
        ("stonesoup/OpenSky_Plane_States.csv", {}, 83, 85),  # some are heard again after a pause
    ],
)
def test_recordings(name, options, keys, tracks):
    if not (RECORDINGS / name).exists():
        pytest.skip(f"{name} is not there; set DRIFTWISE_DATA to the folder of recordings")
    found = dw.track(recorded(RECORDINGS / name), **options)
    assert (len({t.key for t in found}), len(found)) == (keys, tracks)
    assert sum(map(len, found)) >= 0.99 * found.counts["plots"]
    long = [t for t in found if len(t) > 50]
    table = {name: np.array([t.summary()[name] for t in long]) for name in ("nis", "coverage", "speed")}
    assert 0.6 < np.median(table["nis"]) < 1.6 and 0.9 < np.median(table["coverage"]) < 0.99
    assert np.all(table["speed"] < 350)
    ends = [(t.key, t.plots.time[0], t.plots.time[-1]) for t in found if t.key]
    assert all(a[0] != b[0] or a[2] < b[1] or b[2] < a[1] for i, a in enumerate(ends) for b in ends[:i])


def recorded(path):
    """Return the plots of a recording; the radar's file has one placeholder among the returns."""
    if path.name != "gofer06.json":
        return read_plots(path)
    returns = [p for p in json.loads(path.read_text())["waypoints"] if p["site"] != "anchor"]
    time = [datetime.fromisoformat(p["utc"]).timestamp() for p in returns]
    return placed(time, [p["lat"] for p in returns], [p["lon"] for p in returns])


def test_plots_are_missed_of_scans_alone():
    """Who reports when it likes, a ship by its speed, misses nothing."""
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.choice([2.0, 3.3, 6.0, 10.0, 17.0], 120) * rng.uniform(0.9, 1.1, 120))
    ship = run(plots(time, time[:, None] * [8.0, 2.0], key="244660000"), estimator="boat").tracks[0]
    assert not ship.is_scanned and ship.missed == 0
    seen = 4.0 * np.flatnonzero(rng.random(120) < 0.7) + rng.normal(0, 0.1)
    radar = run(plots(seen, seen[:, None] * [80.0, 20.0] + rng.normal(0, 30, (len(seen), 2)), key="4BAA5F")).tracks[0]
    assert radar.is_scanned and radar.missed == round((seen[-1] - seen[0]) / 4) + 1 - len(seen)
