"""What lags leave, against least squares of each delay."""

import numpy as np
import pytest

from driftwise.models.lags import shares_left


@pytest.mark.parametrize("many, delay", [(1, 0), (2, 5), (3, 8)])
def test_shares_are_those_of_least_squares(many, delay):
    rng, T, most = np.random.default_rng(delay), 200, 8
    x = np.cumsum(rng.standard_normal(T)) * 0.2
    y = np.append(np.zeros(delay), x[: T - delay]) + 0.3 * rng.standard_normal(T) + 1.0
    rows = np.arange(most + many - 1, T)
    about = y[rows] - y[rows].mean()
    expected = []
    for d in range(most + 1):
        X = np.column_stack([*(x[rows - d - j] for j in range(many)), np.ones(len(rows))])
        expected.append(np.sum((y[rows] - X @ np.linalg.lstsq(X, y[rows])[0]) ** 2) / (about @ about))
    found = shares_left(y, x, many, most, 1e-10)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert np.argmin(found) == np.argmin(expected)
