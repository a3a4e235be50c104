"""The scikit-learn face: all of scikit-learn's checks, and the same numbers as the estimator behind it."""

import importlib
import sys

import numpy as np
import pytest

import driftwise as dw

pytest.importorskip("sklearn")
from sklearn.model_selection import TimeSeriesSplit, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from driftwise.adapters.sklearn import DriftRegressor


@parametrize_with_checks([DriftRegressor()])  # none is expected to fail: order matters to fit, not to predict
def test_scikit_learn_checks(estimator, check):
    check(estimator)


@pytest.fixture
def data():
    rng = np.random.default_rng(1)
    X = rng.standard_normal((300, 2))
    slope = np.where(np.arange(300) < 200, 1.0, 3.0)
    y = slope * X[:, 0] - X[:, 1] + 5 + 0.1 * rng.standard_normal(300)
    X[::13, 0], y[::17] = np.nan, np.nan
    return X, y


def test_pieces_are_the_scan_bit_for_bit(data):
    X, y = data
    whole = DriftRegressor().fit(X, y)
    trace = whole.estimator_.scan(y, X)
    pieces = DriftRegressor().fit(X[:100], y[:100])
    assert pieces.estimator_.options == whole.estimator_.options  # the same sizes, hence the same prior
    pieces.partial_fit(X[100:101], y[100:101]).partial_fit(X[101:], y[101:])
    assert whole.state_.tobytes() == pieces.state_.tobytes() == trace.state.tobytes()
    assert np.array_equal(whole.coef_, trace.state["theta"][:2]) and whole.intercept_ == trace.state["theta"][2]


def test_predictions_are_those_of_the_next_sample(data):
    X, y = data
    model = DriftRegressor().fit(X, y)
    rows = np.array([[0.5, -1.0], [np.nan, 2.0], [0.0, 0.0]])
    mean, std = model.predict(rows, return_std=True)
    for row, m, s in zip(rows, mean, std):
        _, step = model.estimator_.update(model.state_, np.nan, row)
        assert np.allclose([m, s], [step.prediction, np.sqrt(step.variance)], rtol=1e-12)
    assert std[1] > 5 * std[0]  # a missing regressor is doubt
    assert np.allclose(model.predict(rows[[0, 2]]), rows[[0, 2]] @ model.coef_ + model.intercept_)
    assert np.abs(model.coef_ - [3, -1]).max() < 4 * model.coef_std_.max() < 0.1  # followed the jump


def test_it_goes_with_pipelines_and_splits_in_time(data):
    X, y = np.nan_to_num(data[0]), np.nan_to_num(data[1], nan=5.0)
    pipeline = make_pipeline(StandardScaler(), DriftRegressor(dw.ExponentialForgetting(0.95)))
    assert cross_val_score(pipeline, X, y, cv=TimeSeriesSplit(3)).shape == (3,)


@pytest.mark.parametrize(
    "X, y, words",
    [
        (np.ones((3, 2)), np.full(3, np.nan), "no measured value"),
        (np.ones((3, 2)), np.array([1.0, np.inf, 2.0]), "y is infinite"),
        (np.ones((3, 2)), None, "y to be passed"),
        (np.array([[np.inf]]), np.ones(1), "infinity"),
    ],
)
def test_refusals(X, y, words):
    with pytest.raises(ValueError, match=words):
        DriftRegressor().fit(X, y)


@pytest.mark.parametrize("name, absent", [("sklearn", "sklearn.base"), ("river", "river"), ("control", "control")])
def test_each_adapter_names_its_extra(name, absent, monkeypatch):
    monkeypatch.setitem(sys.modules, absent, None)
    monkeypatch.delitem(sys.modules, f"driftwise.adapters.{name}", raising=False)
    with pytest.raises(ImportError, match=rf"pip install driftwise\[{name}\]"):
        importlib.import_module(f"driftwise.adapters.{name}")
