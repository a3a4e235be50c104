"""Plots that come faster than any so far: what a track has learnt of their noise is learnt anew."""

import numpy as np
import pytest
from rows_before import without_courses

import driftwise as dw
from driftwise.estimators.track import bank, former
from driftwise.estimators.track.late import COUNTS, LatePlots


def weaving(seed, before=60, after=60, every=(60.0, 4.0)):
    """Return times and plots of 2 m: a boat that weaves by 80 m, seen once in a minute, then each 4 s."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(np.repeat(every, (before, after)))
    path = np.stack([5.0 * t, 80.0 * np.sin(t / 40.0 + rng.uniform(0, 6))], axis=1)
    return t, path + 2.0 * rng.standard_normal(path.shape)


def test_who_is_seen_more_often_is_as_well_known_as_one_whose_track_begins_then():
    known, anew, nis = [], [], []
    for seed in range(8):
        t, y = weaving(seed)
        est = dw.TrackEstimator("boat")
        whole, fresh = est.scan(t, y), est.scan(t[60:], y[60:])
        known.append(np.mean(whole.log_score[75:].sum(axis=1)))
        anew.append(np.mean(fresh.log_score[15:].sum(axis=1)))
        nis.append(np.mean(whole.nis[75:]))
    assert np.mean(known) > np.mean(anew) - 0.3
    assert 0.5 < np.median(nis) < 1.5


@pytest.mark.parametrize("steps", [(1.0, 3.0, 10.0), (3.0, 1.0, 10.0)])
def test_paces_that_come_in_turn_are_learnt_once(steps):
    t = np.cumsum(np.tile(np.repeat(steps, 10), 10))
    y = np.stack([2.0 * t, -t], axis=1) + np.random.default_rng(3).standard_normal((len(t), 2))
    est, seen = dw.TrackEstimator("boat"), []
    state = est.start()
    for k in range(len(t)):
        state, _ = est.update(state, t[k], y[k])
        seen.append(float(state["seen"]))
    assert np.sum(np.diff(seen) < 0) <= 1


def test_rows_without_a_pace_take_what_is_typical_of_the_time_between_plots():
    t, y = weaving(0)
    est = dw.TrackEstimator("boat")
    row = np.atleast_1d(est.scan(t[:50], y[:50]).state).view(float)
    later = [bank.PACE, bank.REFUSED, *(bank.of_coordinate(2, bank.ASIDE, c) for c in range(2))]
    told = former.rows(2, np.delete(without_courses(row, 2), later))
    assert told.shape == row.shape and told[bank.PACE] == row[bank.PERIOD]
    begin = [bank.PACE, *range(bank.row_at(2).courses, bank.row_size(2))]
    np.testing.assert_array_equal(np.delete(told, begin), np.delete(row, begin))
    assert not told[begin[1:-1]].any() and told[bank.row_at(2).known] == row[bank.SEEN]
    late = LatePlots(est, lag=120.0, plots=3)
    state = late.start()
    for k in range(6):
        state, _ = late.update(state, t[k], y[k])
    numbers, size = np.atleast_1d(state).view(float), bank.row_size(2)
    end = len(COUNTS) + 4 * size
    kept = np.delete(without_courses(numbers[len(COUNTS) : end].reshape(4, size), 2), later, axis=1)
    without = np.concatenate([numbers[: len(COUNTS)], kept.ravel(), numbers[end:]])
    told = late.carried_over(without)
    assert told.shape == numbers.shape and late.carried_over(numbers) is numbers
    np.testing.assert_array_equal(told[end:], numbers[end:])
