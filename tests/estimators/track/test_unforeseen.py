"""What no plot has shown yet has a share of every forecast: a precise start may end, who rests may leave."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.estimators.track import bank, former
from driftwise.tracking.plots import plots


def precise_start(seed, few=20):
    """Return times and plots of a boat: errors of a centimetre, from one plot on of three metres."""
    rng, t = np.random.default_rng(seed), 10.0 * np.arange(90)
    error = np.where(np.arange(90) < few, 0.01, 3.0)[:, None] * rng.standard_normal((90, 2))
    return t, np.stack([5.0 * t, 2.0 * t], axis=1) + error


def test_the_end_of_a_precise_start_is_in_the_variance():
    """Hundreds of deviations of what was seen; without a share for it the mean NIS is 10 to 1700."""
    for seed in range(8):
        trace = dw.TrackEstimator("boat").scan(*precise_start(seed))
        assert np.nanmean(trace.nis[3:]) < 3.0
        assert trace.log_score[20].sum() > -18.0


def test_who_rests_may_leave():
    """A ship is known to metres by plots minutes apart, and then is fifteen metres off, and is followed."""
    for seed in range(8):
        rng, t = np.random.default_rng(seed), 180.0 * np.arange(40)
        way = np.maximum(t - t[33], 0.0)
        y = np.stack([0.05 * way, 0.08 * way], axis=1) + 1.0 * rng.standard_normal((40, 2))
        assert np.nanmean(dw.TrackEstimator("boat").scan(t, y).nis[3:]) < 1.5


def test_who_leaves_a_cell_of_unknown_size_is_expected_to_be_as_far_as_it_may_be_large():
    t, y = 1.5 * np.arange(40), np.zeros((40, 2))
    y[30:, 0] = 30.0
    trace = dw.TrackEstimator("boat").scan(t, y)
    assert trace.nis[30] < 60.0 and np.all(trace.band()[25] < 4.0)  # a quantile: what is rare is beyond


def test_the_share_falls_as_plots_come_and_bands_hardly_know_of_it():
    t, y = precise_start(3, few=90)
    est = dw.TrackEstimator("boat")
    trace = est.scan(t, y)
    rare = trace.table[:, est.columns["unforeseen"]].ravel()
    assert rare[0] == 0.0 and np.all(np.diff(rare[1:]) < 0.0) and rare[-1] < 1e-3
    assert np.median(trace.band()[30:]) < 0.05 and trace.coverage(first=10) > 0.9
    _, S = est.predict(trace.state, t[-1] + 10.0)
    assert np.diag(S)[0] > rare[-1] * 0.9 * (0.1 * 8.0 * 10.0) ** 2


def test_a_table_without_it_tells_what_it_told():
    t, y = precise_start(4)
    est = dw.TrackEstimator("boat")
    table = est.scan(t, y).table
    before = table[:, : bank.sample_at(2).unforeseen]
    carried = former.table(2, before)
    assert carried.shape == table.shape and not carried[:, before.shape[1] :].any()
    trace = est.trace_of(t, y, carried, None)
    spreading = carried[1:, est.columns["spreading"]]
    np.testing.assert_array_equal(trace.variance[1:], carried[1:, est.columns["base"]] * spreading)


@pytest.mark.parametrize("deviation", [1e-4, 1e-2])
def test_what_is_stated_of_precise_plots_counts(deviation):
    """Plots of a limb that err a tenth of a millimetre, and say so."""
    rng, t = np.random.default_rng(7), 0.01 * np.arange(40)
    y = np.stack([2.0 * t, t], axis=1) + deviation * rng.standard_normal((40, 2))
    kept = [dw.track(plots(t, y, key="L", covariance=v), 5.0)[0].trace.prediction for v in (None, deviation**2)]
    assert np.nanmax(abs(kept[1] - kept[0])) > 0.1 * deviation
