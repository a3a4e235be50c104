"""Signals that are others, later: what a filter makes of all of them follows from what it makes of those."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.copies import copies
from driftwise.analysis.response_record import delayed
from driftwise.models.regression import filtered_rows

X = np.random.default_rng(5).standard_normal((2, 60))
B, A = [1.0, 0.4], np.array([1.0, -1.2, 0.5])


def at(found, rows, a=np.ones(1)):
    """Return signals through 1/a at some samples, (P, rows)."""
    return filtered_rows(a, found.signals, found.table, np.zeros((0, 60)), rows, np.ones(len(rows))).T


@pytest.mark.parametrize("rows", [np.arange(60), np.arange(7, 40), np.array([0, 3, 4, 30, 59]), np.arange(0)])
def test_each_is_the_filter_of_its_own_signal(rows):
    found = copies([(X[0], range(1, 4)), (X[1], (0, 9))]).filtered(B, np.ones(1))
    wanted = [lfilter(B, A, delayed(X[k], late)) for k, late in ((0, 1), (0, 2), (0, 3), (1, 0), (1, 9))]
    np.testing.assert_allclose(at(found, rows, A), np.array(wanted)[:, rows], atol=1e-12)


def test_some_of_them_keep_the_signals_they_need():
    every = copies([(X[0], range(2)), (X[1], (5,))])
    some = every.only(every.places[2:])
    assert some.signals.shape == (1, 60)
    np.testing.assert_array_equal(at(some, np.arange(60)), [delayed(X[1], 5)])
