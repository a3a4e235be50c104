"""What is missing keeps its last value, beside a walk through the rows."""

import numpy as np
import pytest

from driftwise.engine.holding import held


@pytest.mark.parametrize("shape", [(0,), (50,), (50, 3), (20, 2, 2)])
@pytest.mark.parametrize("before", [np.nan, 7.0])
def test_each_missing_value_is_the_last_known(shape, before):
    rng = np.random.default_rng(1)
    values = np.where(rng.random(shape) < 0.6, np.nan, rng.standard_normal(shape))
    last, expected = np.full(shape[1:], before), np.empty(shape)
    for t, row in enumerate(values):
        expected[t] = last = np.where(np.isfinite(row), row, last)
    np.testing.assert_array_equal(held(values, before), expected)


def test_infinity_is_missing_too():
    assert held(np.array([1.0, np.inf, -np.inf])).tolist() == [1.0, 1.0, 1.0]
