"""Inputs between the rows of an irregular clock."""

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.change_log import unheld
from driftwise.analysis.scattered_noise import scattered
from driftwise.analysis.unseen_inputs import expected

RNG = np.random.default_rng(5)
ROWS = np.sort(RNG.choice(np.arange(1, 599), 150, replace=False))
SLOW = lfilter([1.0], [1.0, -0.9], RNG.normal(size=600)) + 3.0


def test_it_is_the_conditional_mean_of_a_process_of_the_first_order():
    x = SLOW[ROWS] - SLOW[ROWS].mean()
    phi = scattered(x, ROWS)[0]
    whole = phi ** abs(np.subtract.outer(np.arange(600), np.arange(600)))
    wanted = whole[:, ROWS] @ np.linalg.solve(whole[np.ix_(ROWS, ROWS)], x) + SLOW[ROWS].mean()
    inside = slice(ROWS[0], ROWS[-1] + 1)
    found = expected(SLOW, ROWS)
    np.testing.assert_allclose(found[inside], wanted[inside], atol=1e-9)
    np.testing.assert_array_equal(found[: ROWS[0]], found[ROWS[0]])  # before the first it keeps its value
    assert np.mean((found - SLOW) ** 2) < 0.7 * np.mean((np.repeat(SLOW[ROWS], 4) - SLOW) ** 2)


def test_of_white_inputs_the_mean_is_expected():
    white = RNG.normal(size=600)
    found = expected(white, ROWS)
    unseen = np.setdiff1d(np.arange(ROWS[0], ROWS[-1]), ROWS)
    np.testing.assert_allclose(found[ROWS], white[ROWS])
    np.testing.assert_allclose(found[unseen], white[ROWS].mean())


def test_rows_are_where_y_was_measured_or_an_input_moved():
    y = np.array([1.0, np.nan, np.nan, 2.0, np.nan])
    u = np.array([[0.0], [0.0], [0.0], [3.0], [3.0]])
    np.testing.assert_allclose(unheld(y, u)[:, 0], [0.0, 1.0, 2.0, 3.0, 3.0])
