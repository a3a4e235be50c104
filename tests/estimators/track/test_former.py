"""States, traces and late plots as they were saved before one of the members went by legs: what was learnt goes on."""

from pathlib import Path

import numpy as np
import pytest

import driftwise as dw
from driftwise.estimators.track import bank, former
from driftwise.estimators.track.late import LatePlots

SAVED = Path(__file__).parents[2] / "saved"


def record():
    """Return times and plots of a jet: straight, a turn, straight; the first forty were seen before it was saved."""
    t = 4.0 * np.arange(60)
    course = np.radians(3) * np.clip(t - 120, 0, 60)
    path = np.cumsum(800 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0)
    return t, path + 40 * np.random.default_rng(5).standard_normal(path.shape)


@pytest.mark.parametrize("C", [1, 2])
def test_a_saved_track_goes_on_as_if_it_had_always_been_one_of_today(C):
    t, y = record()
    est, state = dw.load_state(SAVED / f"track-{C}-former.json")
    assert est.coordinates == C and state["seen"] == 40 and state["weights"].max() == 0.0
    ahead, whole = est.scan(t[40:], y[40:, :C], state=state), est.scan(t, y[:, :C])
    off = np.abs(ahead.prediction - whole.prediction[40:]) / np.sqrt(whole.variance[40:])
    assert off.max() < 1.0 and off.mean() < 0.15
    assert abs(np.log(ahead.variance / whole.variance[40:])).mean() < 0.3  # the tails are known by a hundred plots
    np.testing.assert_allclose(ahead.weights[-1], whole.weights[-1], atol=0.1)


def test_the_legs_of_a_saved_track_begin_where_the_member_that_turns_is():
    _, state = dw.load_state(SAVED / "track-2-former.json")
    row = np.atleast_1d(state).view(float)
    legs = row[bank.at_legs(2) :][: bank.LEG * bank.LEGS].reshape(bank.LEG, bank.LEGS)
    turn = row[bank.at_circle(2, 0) :][: bank.CIRCULAR]
    np.testing.assert_array_equal(legs[0], bank.LEG_SHARES)
    np.testing.assert_array_equal(legs[1:5], np.broadcast_to(turn[:4, None], (4, bank.LEGS)))
    assert (legs[5] * legs[8] > legs[6] ** 2 + legs[7] ** 2).all()


def test_a_saved_trace_tells_what_it_told():
    t, y = record()
    trace = dw.Trace.load(SAVED / "trace-track-former.npz")
    assert trace.weights.shape == (12, len(trace.estimator.names)) and trace.weights[5:, -4].max() == 0.0
    np.testing.assert_allclose(trace.weights[1:].sum(axis=1), 1.0)
    np.testing.assert_allclose(trace.innovation[1:], y[1:12] - trace.prediction[1:], rtol=1e-12)
    ahead = trace.estimator.scan(t[12:], y[12:], state=trace.state)
    assert np.median(ahead.nis) < 2.0


def test_late_plots_that_were_saved_are_put_in_their_place():
    t, y = record()
    late, state = dw.load_state(SAVED / "late-former.json")
    assert isinstance(late, LatePlots)
    state, shown = late.update(state, t[40], y[40])
    again, between = late.update(state, t[40] - 2.0, 0.5 * (y[39] + y[40]))
    assert shown.nis < 9.0 and between is not None and again["late"] == 1.0


def test_rows_of_any_other_size_are_left_alone():
    for found in (np.zeros(former.size(2) + 1), np.zeros((3, bank.row_size(2))), np.zeros(())):
        assert former.rows(2, found) is found
    fresh = former.rows(2, np.zeros((3, former.size(2))))
    np.testing.assert_array_equal(fresh, np.zeros((3, bank.row_size(2))))


@pytest.mark.parametrize("C", [1, 2])
def test_noise_of_rows_that_did_not_count_its_plots_is_known_by_all(C):
    t, y = record()
    state = dw.TrackEstimator("aircraft", coordinates=C).scan(t, y[:, :C]).state
    row = np.atleast_1d(state).view(float)
    at = bank.row_at(C).known
    again = former.rows(C, row[None, :at])
    np.testing.assert_array_equal(again[0, :at], row[:at])
    assert at == len(row) - 1 and again[0, at] == row[bank.SEEN] == 60.0 >= row[at]
