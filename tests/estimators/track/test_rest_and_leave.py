"""A forecast of what rests has the chance that it leaves, and a departure that came teaches no tails."""

import numpy as np
from driftwise_studies.score.motions import ships

import driftwise as dw
from driftwise.estimators.track import bank, departure

LEAVES = 30  # the first plot under way


def ferry(seed: int):
    """Return times and plots of a boat that is seen every three minutes at rest, every half minute under way."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(np.concatenate([np.full(LEAVES, 180.0), np.full(30, 30.0)]))
    way = np.maximum(t - t[LEAVES - 1] + 20.0, 0.0)[:, None]
    return t, 4.0 * way * [0.6, 0.8] + 1.0 * rng.standard_normal((len(t), 2))


def test_the_plot_that_leaves_is_in_the_variance():
    """Without its share it is 40 deviations off: a mean NIS of 30 to 60."""
    for seed in range(6):
        t, y = ferry(seed)
        trace = dw.TrackEstimator("boat").scan(t, y)
        assert np.nanmean(trace.nis[3:]) < 3.0
        assert trace.log_score[LEAVES - 1].sum() > -20.0


def test_the_share_is_told_where_it_rests_and_plots_are_ten_seconds_apart_or_more():
    t, y = ferry(1)
    est = dw.TrackEstimator("boat")
    rare = est.scan(t, y).table[:, est.columns["unforeseen"]].ravel()
    assert np.all(rare[5 : LEAVES - 1] > departure.OFTEN) and np.all(rare[LEAVES + 1 :] < 0.02)
    often = est.scan(0.04 * t, y).table[:, est.columns["unforeseen"]].ravel()
    assert np.all(often[5:] < 0.02)


def test_a_departure_that_came_teaches_no_tails():
    for seed in range(6):
        t, y = ferry(seed)
        est = dw.TrackEstimator("boat")
        shares = est.scan(t, y).table[:, est.columns["shares"]]
        wide = shares[:, np.array(bank.SCALES) > 10.0].sum(axis=1)
        assert wide[LEAVES + 2] < 1.2 * wide[LEAVES - 2]


def test_drawn_ships_that_leave_their_berths():
    """Their mean NIS was 14 to 206."""
    for number in (7, 51, 76):
        ship = ships.draw(7101, number)
        trace = dw.TrackEstimator(ships.TOLD).scan(ship.time, ship.plots)
        assert 0.3 < np.nanmean(trace.nis[3:]) < 3.0
