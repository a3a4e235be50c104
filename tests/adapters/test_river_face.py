"""The river face: all of river's checks, the estimator's own numbers, and features that come and go."""

import math
import pickle

import numpy as np
import pytest
from draws import slow

import driftwise as dw

pytest.importorskip("river")
pytest.importorskip("sklearn")  # river's checks import it
from river import checks

from driftwise.adapters.river import DriftRegressor

LONG = "check_bounded_memory_growth"  # of many samples, one by one


def tried(check):
    """Return one of river's checks as a parameter."""
    make = slow if check.__name__ == LONG else pytest.param
    return make(check, id=check.__name__)


@pytest.mark.parametrize("check", [*map(tried, checks.yield_checks(DriftRegressor()))])
def test_river_checks(check):
    check(DriftRegressor())


@pytest.mark.parametrize("memory", [None, dw.Constant()], ids=["AutoMemory", "Constant"])
def test_clones_start_afresh_and_copies_go_on(memory):
    model = DriftRegressor(memory)
    model.learn_one({"a": 2.0}, 3.0)
    assert model.clone().predict_one({"a": 2.0}) == 0.0 and not model._is_stochastic
    for copy in (model.clone(include_attributes=True), pickle.loads(pickle.dumps(model))):
        assert copy.predict_one({"a": 2.0}) == model.predict_one({"a": 2.0}) != 0.0
    assert model.clone({"offset": False}).offset is False


def sample(rng, t):
    """One sample: c appears at 150 (y owes it nothing before); a is missing now and then."""
    x = dict(zip("abc", (rng.standard_normal(3) + [3, 0, 0]).tolist()))
    y = 2 * x["a"] - x["b"] + 5 + (3 * x["c"] if t >= 150 else 0) + 0.1 * rng.standard_normal()
    if t < 150:
        del x["c"]
    if t % 11 == 5:
        del x["a"]
    return x, y


def test_features_known_from_the_start_give_the_estimators_numbers():
    rng, model = np.random.default_rng(0), DriftRegressor()
    record = [sample(rng, t) for t in range(100)]
    for x, y in record:
        model.learn_one(x, y)
    X = np.array([[x.get("a", np.nan), x["b"]] for x, _ in record])
    state = model._estimator.scan([y for _, y in record], X).state
    assert model._state.tobytes() == state.tobytes()
    assert model.weights == dict(zip("ab", state["theta"].tolist())) and model.intercept == state["theta"][2]


@pytest.mark.parametrize("memory", [None, dw.Constant()], ids=["AutoMemory", "Constant"])
def test_a_feature_that_joins_keeps_what_was_learnt(memory):
    rng, model = np.random.default_rng(0), DriftRegressor(memory)
    nis = []
    for t in range(400):
        x, y = sample(rng, t)
        before = model.weights
        forecast = model.predict_one(x, with_dist=True)
        if t > 20 and t != 150:
            nis.append((forecast.mu - y) ** 2 / forecast.sigma**2)
        model.learn_one(x, y)
        if t == 150:  # what c does is free, and takes the whole error
            assert [*model.weights] == ["a", "b", "c"]
            assert abs(model.weights["a"] - before["a"]) + abs(model.weights["b"] - before["b"]) < 0.01
            assert abs(model.predict_one({"b": 0.0, "c": 0.0}) - 11) < 1  # a, absent, is near its mean of 3
    assert np.allclose([*model.weights.values(), model.intercept], [2, -1, 3, 5], atol=0.05)
    assert 0.75 < np.mean(nis) < 1.3


def test_never_is_least_squares_whenever_features_join():
    """With all of the data kept, the order in which features appear does not matter: zero before is zero."""
    rng, model = np.random.default_rng(2), DriftRegressor(dw.Constant(), offset=False)
    X = rng.standard_normal((60, 3))
    X[:20, 1], X[:40, 2] = 0.0, 0.0
    y = X @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(60)
    for row, value in zip(X, y):
        model.learn_one(dict(zip("abc", row.tolist())), value)
    assert np.allclose([*model.weights.values()], np.linalg.lstsq(X, y)[0], atol=1e-4)


def test_nothing_but_zeros_is_the_mean_of_y():
    model = DriftRegressor()
    for _ in range(50):
        model.learn_one({"heater": 0.0}, 20.0)
    assert math.isclose(model.predict_one({"heater": 0.0}), 20.0, rel_tol=1e-4) and model.weights == {}


@pytest.mark.parametrize("x, y", [({"a": "on"}, 1.0), ({"a": 1.0}, math.inf), ({"a": math.inf}, 1.0)])
def test_refusals(x, y):
    with pytest.raises(dw.InputError, match="must be"):
        DriftRegressor().learn_one(x, y)
