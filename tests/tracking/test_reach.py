"""How far an object can have come, and what a lattice adds."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.tracking.live import Plot
from driftwise.tracking.plots import plots
from driftwise.tracking.reach import reaches, step


def at(time, east, north):
    return Plot(time, east, north, (np.nan,) * 4, np.nan, "", "", "")


def test_a_step_in_a_row_of_a_lattice_is_no_jump():
    first = at(0.0, 1000.0, -500.0)
    assert not reaches(first, at(1.0, 1030.0, -490.0), 6.0, 2.0)
    assert reaches(first, at(1.0, 1030.0, -500.0), 6.0, 2.0) and reaches(first, at(1.0, 1000.0, -470.0), 6.0, 2.0)
    assert step(first, at(1.0, 1030.0, -500.0001), 6.0) == pytest.approx(30.0)
    assert not reaches(first, at(1.0, 1200.0, -500.0), 6.0, 2.0)  # farther than 20 s of what is fast


@pytest.mark.parametrize("options", [{}, {"single": True}])
def test_a_walker_on_a_lattice_far_coarser_than_a_scan_of_it_is_one(options):
    t = 0.6 * np.arange(300)
    path = np.stack([1.3 * t, 0.4 * t], axis=1) + 2.0 * np.random.default_rng(3).standard_normal((300, 2))
    told = plots(t, 28.0 * np.round(path / 28.0), key=None if options else "K")
    (track,) = dw.track(told, 2.0, **options)
    assert len(track) > 290


def test_wild_plots_far_between_confirm_nobody():
    rng = np.random.default_rng(5)
    t = 4.0 * np.arange(400)
    path = np.stack([120.0 * t, 40.0 * t], axis=1) + 30.0 * rng.standard_normal((400, 2))
    wild = rng.choice(np.arange(10, 400), 25, replace=False)
    path[wild] += rng.uniform(800.0, 2000.0, 25)[:, None]
    (track,) = dw.track(plots(t, path))
    assert len(track) > 370


def test_a_manoeuvre_is_told_however_precise_the_plots_are():
    """What its scans see of straight flight is limited; how far it is behind is not."""
    t = 7.0 * np.arange(80)
    turn = np.clip(t - 280.0, 0.0, 60.0) * np.radians(1.2)
    path = np.cumsum(7.0 * 200.0 * np.stack([np.sin(turn), np.cos(turn)], axis=1), axis=0)
    trace = dw.TrackEstimator("aircraft").scan(t, path + 6.0 * np.random.default_rng(2).standard_normal(path.shape))
    assert trace.onset[41:48].any() and not trace.onset[8:40].any()


@pytest.mark.parametrize("leap, lengths", [(50.0, [60]), (2500.0, [20, 40])])
def test_a_new_track_is_an_old_one_that_is_seen_no_more_if_it_begins_near(leap, lengths):
    """An aircraft is seen no more and one begins beside it: by some errors of plots, or too far for a scan."""
    t = 4.0 * np.arange(60)
    path = np.stack([120.0 * t, 40.0 * t], axis=1) + 5.0 * np.random.default_rng(4).standard_normal((60, 2))
    path[40:] += [leap, -leap]
    assert sorted(map(len, dw.track(plots(t, path)))) == lengths
