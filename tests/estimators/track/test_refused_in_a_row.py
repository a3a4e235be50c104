"""Plots that were refused one after the other and lie on a path of their own are where the object went."""

import numpy as np
import pytest
from rows_before import without_courses

import driftwise as dw
from driftwise.estimators.track import bank, former


def shot_away(seed, speed, deviation):
    """Return times, places and plots of a drone that hovers and flies straight off from one plot to the next."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(0.2 * rng.uniform(0.8, 1.2, 50))
    step = speed * np.diff(t, prepend=t[0]) * np.where(t > t[24], 1.0, 0.1)
    path = np.cumsum(np.stack([step, np.zeros(50)], axis=1), axis=0)
    return t, path, path + deviation * rng.standard_normal((50, 2))


@pytest.mark.parametrize("seed, speed, deviation", [(5, 4.0, 0.01), (5, 8.0, 0.03), (6, 8.0, 0.03), (9, 4.0, 0.01)])
def test_an_object_that_went_elsewhere_is_followed_there(seed, speed, deviation):
    t, path, plots = shot_away(seed, speed, deviation)
    trace = dw.TrackEstimator("uav").scan(t, plots)
    refused = np.flatnonzero(trace.status & int(dw.Status.OUTLIER))
    assert len(refused) == 2 and (np.abs(trace.position - path)[refused[-1] + 1 :] < 10 * deviation).all()


@pytest.mark.parametrize("C", [1, 2])
def test_a_track_that_was_saved_before_it_kept_what_it_refuses_goes_on(C):
    t, _, plots = shot_away(5, 4.0, 0.01)
    est = dw.TrackEstimator("uav", coordinates=C)
    state = est.scan(t[:20], plots[:20, :C]).state
    row = np.atleast_1d(state).view(float)
    begin = bank.row_at(C).courses
    places = [bank.REFUSED, *(bank.of_coordinate(C, bank.ASIDE, c) for c in range(C))]
    before = without_courses(row, C)
    again = est.carried_over(np.delete(before, places)[None])
    assert former.sizes(C)[2] == len(before) - len(places) and former.sizes(C)[3] == len(before)
    np.testing.assert_array_equal(again[0, :begin], row[:begin])
