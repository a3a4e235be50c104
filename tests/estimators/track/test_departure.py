"""A boat that was at rest and leaves: the next plots say how fast it goes, and teach neither noise nor patience."""

import numpy as np

import driftwise as dw
from driftwise.estimators.track import bank, departure

LEAVES = 24  # the first plot under way


def scanned(seed: int, far: bool = True):
    """Return plots and trace of a boat seen every three minutes that leaves, or of which one plot is wild."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(np.concatenate([np.full(LEAVES, 180.0), np.full(20, 30.0)]))
    way = np.maximum(t - t[LEAVES - 1] + 100.0, 0.0) if far else np.where(np.arange(len(t)) == LEAVES - 1, 100.0, 0.0)
    path = 4.0 * way[:, None] * [0.6, 0.8]
    return path, dw.TrackEstimator("boat").scan(t, path + 1.5 * rng.standard_normal(path.shape))


def test_forecasts_are_of_the_size_of_their_errors_soon_after_it_left():
    soon, told = slice(LEAVES + 3, None), []
    for seed in range(10):
        path, trace = scanned(seed)
        off = np.hypot(*(trace.prediction - path)[soon].T)
        told.append((np.median(off), np.median(np.sqrt(trace.variance[soon].mean(axis=1)))))
    off, sd = np.median(told, axis=0)
    assert off < 8.0 and sd < 25.0  # m; plots err 1.5 m, and it goes 120 m between two


def test_a_wild_plot_is_no_departure():
    for seed in range(10):
        path, trace = scanned(seed, far=False)
        assert np.all(np.hypot(*(trace.position - path)[LEAVES + 2 :].T) < 6.0)


def test_who_moves_or_is_seen_often_does_not_leave():
    est, C = dw.TrackEstimator("boat"), 2
    row, parts = est.start().reshape(1).view(float).copy(), np.zeros(C * bank.TAILS)
    far = np.array([300.0, 0.0])
    assert departure.likelihood(est.task, row, C, 180.0, far, parts) == departure.OFTEN / (2 * 8.0 * 180.0)
    assert departure.likelihood(est.task, row, C, 5.0, far / 60, parts) == 0.0  # often
    assert departure.likelihood(est.task, row, C, 30.0, far, parts) == 0.0  # farther than a boat goes
    row[bank.of_coordinate(C, bank.SPEED, 1)] = 1.0
    assert departure.likelihood(est.task, row, C, 180.0, far, parts) == 0.0  # it moved
