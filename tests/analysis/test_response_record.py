"""Normal equations and autoregressions of records: by Cholesky where all is told, by eigenvectors elsewhere."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.response_record import ahead, autoregression, least_squares

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
