"""Flights and their tracks, for tests."""

import numpy as np

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


def run(data, **options):
    tracker = Tracker(**options)
    tracker.feed(data)
    tracker.finish()
    return tracker


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
        np.testing.assert_array_equal(s.table, t.table)
        assert s.state.tobytes() == t.state.tobytes()
