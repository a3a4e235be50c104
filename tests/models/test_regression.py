"""Rows of filtered signals against NumPy's, and fits against singular values."""

import numpy as np
import pytest

from driftwise.models.filtering import linear_filter
from driftwise.models.regression import filtered_rows, fitted, robustly_fitted

A = np.array([1.0, -1.5, 0.7])
PLACES = [(0, 0), (0, 1), (1, 3), (1, 40)]


def drawn(T=300, seed=1):
    rng = np.random.default_rng(seed)
    return rng, rng.standard_normal((2, T)), rng.standard_normal((3, T))


def expected(signals, beside):
    """Return all rows as they are defined, (T, P + m)."""
    passed = linear_filter([1.0], A, signals.T).T
    late = [np.append(np.zeros(lag), passed[k])[: signals.shape[1]] for k, lag in PLACES]
    return np.column_stack([*late, *beside])


def test_rows_are_filtered_delayed_and_divided():
    rng, signals, beside = drawn()
    rows, deviations = np.sort(rng.permutation(300)[:120]), rng.uniform(0.5, 2.0, 120)
    X = filtered_rows(A, signals, np.ravel(PLACES), beside, rows, deviations, more=1)
    assert X.shape == (120, 8)
    np.testing.assert_allclose(X[:, :-1], expected(signals, beside)[rows] / deviations[:, None], rtol=1e-12, atol=1e-12)


def test_rows_after_gaps_are_sums_of_those_before():
    rng, signals, beside = drawn()
    rows, after, weights = np.arange(1, 300), np.array([0, 17, 298]), rng.standard_normal((3, 5))
    X = filtered_rows(A, signals, np.ravel(PLACES), beside, rows, np.ones(299), (after, weights))
    whole = np.vstack([np.zeros((4, 7)), expected(signals, beside)])
    for k, weight in zip(after, weights):
        np.testing.assert_allclose(X[k], weight @ whole[rows[k] + 4 :: -1][:5], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("rows", [7, 8, 9, 301])
def test_a_fit_is_that_of_least_squares(rows):
    rng = np.random.default_rng(2)
    X, weight = rng.standard_normal((rows, 5)) * [1.0, 1e3, 1e-3, 1.0, 1.0], rng.uniform(0.1, 1.0, rows)
    values, left = fitted(X, weight)
    np.testing.assert_allclose(values, np.linalg.lstsq(X[:, :-1] * weight[:, None], X[:, -1] * weight)[0], rtol=1e-9)
    np.testing.assert_allclose(left, X[:, -1] - X[:, :-1] @ values, atol=1e-12)


def test_what_is_not_told_apart_is_shared():
    rng = np.random.default_rng(3)
    x = rng.standard_normal(50)
    values, left = fitted(np.column_stack([x, x, np.zeros(50), 3 * x]), np.ones(50))
    np.testing.assert_allclose(values, [1.5, 1.5, 0.0], atol=1e-9)
    np.testing.assert_allclose(left, 0.0, atol=1e-9)


@pytest.mark.parametrize("rows", [200, 201])
def test_what_is_far_off_counts_less(rows):
    rng = np.random.default_rng(4)
    X = rng.standard_normal((rows, 3))
    X[:, 2] += X[:, :2] @ [1.0, -2.0]
    X[::20, 2] += 30.0
    first = np.linalg.lstsq(X[:, :2], X[:, 2])[0]
    r = abs(X[:, 2] - X[:, :2] @ first)
    w = np.sqrt(np.minimum(1.0, 2.5 * 1.4826 * np.median(r) / r))
    values, left = robustly_fitted(X, 2.5)
    np.testing.assert_allclose(values, np.linalg.lstsq(X[:, :2] * w[:, None], X[:, 2] * w)[0], rtol=1e-10)
    np.testing.assert_allclose(left, X[:, 2] - X[:, :2] @ values, atol=1e-12)
