"""A clock that is set back while rows go on: none is left out, and what follows is no change."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.tables.autoread import read


def plant(T=900, seed=5):
    """Return y (T,) and u (T, 1) of a plant of the first order whose input steps now and then."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=(T // 20, 1)), 20, axis=0)
    y = np.zeros(T)
    for k in range(1, T):
        y[k] = 0.9 * y[k - 1] + u[k - 1, 0]
    return y + 0.1 * rng.standard_normal(T), u


def rows_of(time, y, u, chunk=10_000):
    """Return the recognised table, its segments, and the outputs that came out."""
    found, segments = read({"time_s": time, "valve": u[:, 0], "level": y}, chunk_rows=chunk)
    return found, segments, np.concatenate([part[1] for part in segments])


@pytest.mark.parametrize("back", [100.0, 300.0, 550.0])  # 550 is more than half of the way so far
def test_rows_go_on_where_the_clock_is_set_back(back):
    y, u = plant()
    time = np.arange(900.0)
    time[600:] -= back
    for chunk in (10_000, 77):
        found, segments, values = rows_of(time, y, u, chunk)
        np.testing.assert_array_equal(values, y)
        assert (found.sampling.set_back, found.sampling.late, found.sampling.restarts) == (1, 0, 0)
        assert segments.clock.breaks == [(600.0, back)]
    assert any("set back 1 time while rows went on" in note for note in found.notes)
    assert not dw.identify({"time_s": time, "valve": u[:, 0], "level": y}).changes


def test_rows_that_come_twice_or_late_are_left_out():
    y, u = plant()
    twice = np.r_[0:600, 500:900]  # two files that overlap
    found, _, values = rows_of(twice.astype(float), y[twice], u[twice])
    np.testing.assert_array_equal(values, y)
    assert found.sampling.set_back == 0
    late = np.r_[0:300, 350:600, 300:350, 600:900]  # fifty rows that waited somewhere
    found, _, values = rows_of(late.astype(float), y[late], u[late])
    assert found.sampling.set_back == 0 and np.count_nonzero(np.isnan(values)) == 50


def test_another_recording_does_not_go_on():
    y, u = plant()
    other, its = plant(seed=8)
    time = np.r_[0:600, 400:700].astype(float)
    y, u = np.r_[y[:600], 30.0 + other[:300]], np.r_[u[:600], its[:300]]
    found, _, values = rows_of(time, y, u)
    assert found.sampling.set_back == 0 and len(values) == 700
