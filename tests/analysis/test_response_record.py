"""Normal equations and autoregressions of records: by Cholesky where all is told, by eigenvectors elsewhere."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.response_record import FLOOR, ahead, autoregression, least_squares, local_size, rounding

RNG = np.random.default_rng(3)
X = RNG.standard_normal((200, 5)) * [1.0, 1e3, 1e-3, 1.0, 1.0]
Y = RNG.standard_normal(200)


@pytest.mark.parametrize("twice", [False, True])
def test_what_is_told_twice_is_halved_and_what_is_zero_stays_zero(twice):
    columns = np.column_stack([X, X[:, 0], np.zeros(200)]) if twice else X
    wanted = np.linalg.lstsq(X, Y, rcond=None)[0]
    if twice:
        wanted = np.array([wanted[0] / 2, *wanted[1:], wanted[0] / 2, 0.0])
    np.testing.assert_allclose(least_squares(columns, Y), wanted, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("is_doubtful", [False, True])
def test_the_first_unknowns_alone_are_least_squares_of_them(is_doubtful):
    columns = np.column_stack([X, X[:, 0] + 1e-5 * X[:, 3]]) if is_doubtful else X
    found = ahead(columns.T @ columns, columns.T @ Y)
    for p in range(1, 6):
        wanted = np.linalg.lstsq(columns[:, :p], Y, rcond=None)[0]
        np.testing.assert_allclose(found[p - 1], np.append(wanted, np.zeros(columns.shape[1] - p)), rtol=1e-5)


def test_a_colour_is_learnt_from_the_rows_that_are_whole():
    v = lfilter([1.0], [1.0, -1.5, 0.7], RNG.standard_normal(3000))
    v[RNG.random(3000) < 0.03] = np.nan
    np.testing.assert_allclose(autoregression(v, 2), [-1.5, 0.7], atol=0.05)
    assert not len(autoregression(RNG.standard_normal(3000), 8))


def test_rounding_is_told_of_whole_values_and_of_those_that_were_brought_to_another_clock():
    y = np.round(32 + 0.5 * np.random.default_rng(1).standard_normal(1200))
    assert rounding(y) == pytest.approx(1 / np.sqrt(12))
    later = 0.7 * y + 0.3 * np.append(y[1:], y[-1])
    later[::50] += np.random.default_rng(2).uniform(0, 0.1, 24)
    assert 0.3 / np.sqrt(12) < rounding(later) < 1.1 / np.sqrt(12)


def test_nothing_is_rounded_of_what_moves_over_values_of_its_own():
    rest = lfilter([0.3], [1.0, -0.7], np.repeat([0.0, 1.0] * 10, 60)).round(6)  # from rest to rest, without noise
    for y in (rest, RNG.standard_normal(1200), np.repeat(RNG.standard_normal(120), 10)):
        assert rounding(y) == pytest.approx(FLOOR * np.std(y), rel=1e-6)


def test_the_size_about_samples_of_which_most_are_the_same_is_that_of_rounding():
    r = (RNG.random(600) < 0.3) * 1.0
    assert local_size(r).max() < 1e-6 and local_size(r, 0.3).min() == 0.3


def test_what_has_run_away_has_no_colour():
    """The squares of a simulation that is unstable are beyond all numbers, and so are their eigenvalues."""
    assert autoregression(1e200 * np.cumsum(Y), 8).size == 0
