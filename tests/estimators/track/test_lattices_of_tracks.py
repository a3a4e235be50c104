"""Plots on a lattice or on a publisher's lines say little of errors."""

import numpy as np
import pytest

import driftwise as dw


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_errors_do_not_vanish_on_a_lattice(speed):
    """At rest, or with steps of the lattice, plots repeat themselves for long; then one is the next place."""
    t = 10.0 * np.arange(200)
    path = np.stack([speed * t, 0.03 * t], axis=1)
    y = 20.0 * np.round((path + 3 * np.random.default_rng(6).standard_normal(path.shape)) / 20.0)
    trace = dw.TrackEstimator("boat").scan(t, y)
    assert np.all(trace.variance[80:] > 20.0**2 / 12) and np.max(trace.nis[80:]) < 30 and np.mean(trace.nis[3:]) < 3


def test_a_lattice_of_degrees_is_one_though_a_plane_bends_it():
    """A ship at anchor, positions in thousandths of a degree: East moves by centimetres where North moves by a step."""
    from driftwise.tracking.frames import east_north

    rng = np.random.default_rng(8)
    steps = rng.integers(0, 2, (300, 2)) * (rng.random((300, 1)) < 0.1)
    y = east_north(50.77 + 1e-4 * steps[:, 0], -1.09 + 1e-4 * steps[:, 1], (50.7, -1.3))
    trace = dw.TrackEstimator("boat").scan(10.0 * np.arange(300), y)
    assert np.mean(trace.nis[40:]) < 3 and np.all(trace.variance[150:] > 1.0)


@pytest.mark.parametrize("is_bent", [False, True])
def test_plots_that_a_publisher_drew_on_lines_say_nothing_of_errors(is_bent):
    """A flight seen every 20 s with errors of 50 m, resampled to 5 s in the plane or in degrees, one pause bridged."""
    from driftwise.tracking.frames import east_north, geographic

    rng, t = np.random.default_rng(4), 5.0 * np.arange(401)
    seen = np.delete(np.arange(0, 401, 4), slice(50, 58))
    course = np.radians(1.0) * np.cumsum(np.clip(np.sin(t / 60), 0, 1))
    path = np.cumsum(1000 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0)
    y = path[seen] + 50 * rng.standard_normal((len(seen), 2))
    if is_bent:
        angles = (np.interp(t, t[seen], angle) for angle in geographic(y, (48.0, 11.0)).T)
        y = east_north(*angles, (48.0, 11.0))
    else:
        y = np.stack([np.interp(t, t[seen], one) for one in y.T], axis=1)
    trace = dw.TrackEstimator("aircraft").scan(t, y)
    assert np.mean(trace.nis[3:]) < 3 and np.max(trace.nis[3:]) < 100


@pytest.mark.parametrize("cell, bars", [(16.0, 3), (110.0, 8)])
def test_a_place_that_only_repeats_may_be_anywhere_in_a_cell_of_unknown_size(cell, bars):
    t = 0.6 * np.arange(16)
    path = np.stack([0.6 * t - 0.1 * cell, 1.0 * t - 0.4 * cell], axis=1)  # m: a walker, on a lattice
    trace = dw.TrackEstimator(2.0).scan(t, cell * np.round(path / cell))
    assert np.all(np.abs(trace.position - path)[3:] < bars * trace.position_sd[3:])


def test_who_leaves_a_cell_of_unknown_size_is_not_wild():
    """A boat at rest in one cell of 80 m, once in the next one: how far that is says nothing, nor does the rest."""
    t = 1.5 * np.arange(80)
    y = np.zeros((80, 2))
    y[60, 0] = 80.0
    trace = dw.TrackEstimator("boat").scan(t, y)
    assert not (trace.status & int(dw.Status.OUTLIER)).any()
    assert np.array_equal(trace.tails()[61], trace.tails()[3]) and np.all(trace.variance[61:, 0] > 80.0**2 / 12)


def test_noise_that_is_a_thousand_times_larger_from_now_on_is_no_wandering():
    rng = np.random.default_rng(3)
    t = 1.5 * np.arange(60)
    path = np.stack([12.0 * t, 5.0 * t], axis=1)
    trace = dw.TrackEstimator("helicopter").scan(
        t, path + np.where(t < 20, 0.02, 20.0)[:, None] * rng.standard_normal((60, 2))
    )
    assert np.all(np.abs(trace.position - path)[3:] < 8 * trace.position_sd[3:])


@pytest.mark.parametrize("cells", [1.0, 2.0])
def test_a_step_that_repeats_may_be_that_of_one_cell(cells):
    """It goes as many cells in each scan, and is off by up to half of one all the while; across it errs as plots do."""
    t, cell = np.arange(40.0), 5.0
    off = np.random.default_rng(8).standard_normal(40)
    plots = np.stack([cells * cell * t, 3.0 * t + off], axis=1)
    trace = dw.TrackEstimator(2.0).scan(t, plots)
    assert (trace.position_sd[5:, 0] > 0.5 * cells * cell / 9).all()
    assert (trace.position_sd[20:, 1] < 1.0).all()
