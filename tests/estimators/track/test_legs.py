"""Legs: circles of fixed rates, and laws of mixing; the whole member stands beside matrices in test_track_oracles."""

import numpy as np
import pytest

from driftwise.estimators.track import bank, legs
from driftwise.models import manoeuvre

UNIT = np.array([100.0, 64.0])


def begun(seed=3):
    """Return a row whose legs are anywhere, with covariances."""
    rng, row = np.random.default_rng(seed), np.zeros(bank.row_size(2))
    legs.begin(row, 2, 250.0, UNIT)
    each = row[bank.at_legs(2) :][: legs.SCALE].reshape(bank.LEG, bank.LEGS)
    each[0] = rng.dirichlet(np.ones(bank.LEGS))
    each[1:5] = rng.standard_normal((4, bank.LEGS)) * np.array([300.0, 40.0, 300.0, 40.0])[:, None]
    each[5], each[8] = rng.uniform(50, 200, (2, bank.LEGS))
    each[6:8] = 0.5 * rng.uniform(-1, 1, (2, bank.LEGS)) * np.sqrt(each[5] * each[8])
    return row, each


@pytest.mark.parametrize("d", [1e-6, 0.7, 4.0, 300.0])
def test_each_leg_is_the_circle_of_its_rate(d):
    s, c = np.zeros((2, bank.LEGS))
    legs.arcs(4.0, d, s, c)
    expected = np.array([manoeuvre.arc(rate / 4.0, d)[:2] for rate in bank.LEG_RATES])
    np.testing.assert_allclose(s, expected[:, 0], rtol=1e-11, atol=1e-11 * d)
    np.testing.assert_allclose(c, expected[:, 1], rtol=1e-11, atol=1e-11 * d)


def test_legs_that_end_leave_mean_and_covariance_of_all_as_they_were():
    row, _ = begun()
    before = [np.zeros(6), np.zeros((6, 6))]
    after = [np.zeros(6), np.zeros((6, 6))]
    legs.member_state(row, 2, 4.0, UNIT, *before)
    legs.mix(row, 2, 1.7, np.zeros(bank.LEGS), np.zeros(2 * bank.LEG))
    legs.member_state(row, 2, 4.0, UNIT, *after)
    still = [0, 1, 3, 4]  # what accelerates begins anew
    np.testing.assert_allclose(after[0][still], before[0][still], rtol=1e-12)
    half = np.trace(before[1][np.ix_(still, still)])
    assert np.isclose(np.trace(after[1][np.ix_(still, still)]), half, rtol=1e-12)


def test_on_a_quiet_leg_a_manoeuvre_follows_and_it_is_as_it_was():
    row, each = begun()
    each[0], each[:, 0] = legs.FAINTEST, [1.0, *each[1:, 0]]
    before = each[:, 0].copy()
    legs.mix(row, 2, 1.0, np.zeros(bank.LEGS), np.zeros(2 * bank.LEG))
    np.testing.assert_allclose(each[:, 0], [1 - legs.CALM, *before[1:]], rtol=1e-8)
    np.testing.assert_allclose(each[0, 1:] / legs.CALM, np.array(bank.LEG_SHARES[1:]) / 0.75, rtol=1e-8)


def test_shares_sum_to_one_whatever_the_plot():
    for y in ([0.0, 0.0], [1e30, -1e30], [5e3, 1e-9]):
        row, each = begun()
        legs.predict(row, 2, 4.0, 3.0, UNIT, np.zeros(bank.LEGS + 2 * bank.LEG))
        legs.correct(row, 2, np.array(y), np.ones(2), UNIT, np.zeros(2), np.zeros(3 * bank.LEGS))
        assert np.isclose(each[0].sum(), 1.0) and (each[0] > 0.0).all() and np.isfinite(each).all()


def test_nobody_tells_a_turn_of_what_is_at_rest_or_of_unknown_speed():
    row, each = begun()
    each[1:5], each[8] = 0.0, 1.0
    each[2] = 200.0
    assert not legs.are_hidden(row, 2, 4.0, UNIT)
    each[2] = 2.0
    assert legs.are_hidden(row, 2, 4.0, UNIT)
    each[2], each[8] = 200.0, 200.0**2
    assert legs.are_hidden(row, 2, 4.0, UNIT)
