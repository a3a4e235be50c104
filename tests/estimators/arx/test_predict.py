"""Several samples ahead: exact for known parameters, honest for estimated ones."""

import sys
import time

import numpy as np
import pytest
from oracle.polynomial import System
from test_polynomials import SYSTEMS, estimator, inputs

import driftwise as dw
from driftwise.estimators.arx import forecast

HORIZON = 12


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_known_parameters_known_prediction(name, lost):
    """Mean and std are those of a Kalman filter run on without measurements."""
    s = SYSTEMS[name]
    (y,), (u,) = s.records(1, 80 + HORIZON, 0.5, seed=9)
    y[:80][np.random.default_rng(1).random(80) < lost] = np.nan
    y[78 if lost else 80 :] = np.nan
    est = estimator(name, theta0=s.theta, P0=0.0, variance=0.25)
    trace = est.scan(y[:80], inputs(s, u[:80]))
    mean, std = est.predict(trace.state, *([u[80:]] if s.b else [None, HORIZON]))
    expected, variance, *_ = s.filtered(y, u, 0.5)
    np.testing.assert_allclose(mean, expected[80:], atol=5e-4 if lost else 1e-9)
    np.testing.assert_allclose(std, np.sqrt(variance[80:]), rtol=1e-5)
    again = trace.predict(*([u[80:]] if s.b else [None, HORIZON]))
    np.testing.assert_array_equal(again, (mean, std))


@pytest.mark.parametrize(("name", "std"), [("ARX", 0.5), ("ARMA", 1.0), ("ARMAX", 1.0), ("OE", 1.0), ("BJ", 0.5)])
@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_coverage(name, std, lost):
    """Records of 300 samples, so that the parameters' part of the std counts; errors are correlated within one."""
    s = SYSTEMS["ARMAX"].at([-1.5, 0.7, 1.0, 0.5, 0.0, 0.0]) if name == "ARX" else SYSTEMS[name]
    y, u = s.records(150, 300 + HORIZON, std, seed=11)
    seen = y[:, :300].copy()
    seen[np.random.default_rng(5).random(seen.shape) < lost] = np.nan
    est = dw.ARX(2, 2) if name == "ARX" else estimator(name)
    est = est.scaled_to(seen[0], inputs(s, u[0, :300]))
    states, _ = est.update_batch(est.start(150), seen, inputs(s, u[:, :300]))
    z = []
    for i in range(150):
        mean, spread = est.predict(states[i], *([u[i, 300:]] if s.b else [None, HORIZON]))
        z.append((y[i, 300:] - mean) / spread)
    z = np.array(z)
    error = (np.abs(z) < 1.96).mean(axis=1).std() / np.sqrt(150)
    assert abs(np.mean(np.abs(z) < 1.96) - 0.95) < 3 * error + 0.01
    assert 0.75 < np.mean(z[:, 0] ** 2) < 1.3  # one sample ahead: 150 independent ones, 3 standard errors are .35


@pytest.mark.parametrize("name", SYSTEMS)
def test_parameters_part_is_first_order(name):
    """Its variance is that of the predictions of records run with other parameters: the registers move too."""
    s = SYSTEMS[name]
    (y,), (u,) = s.records(1, 60 + HORIZON, 0.5, seed=9)
    future = [u[60:]] if s.b else [None, HORIZON]

    def ahead(theta, d=0.0):
        est = estimator(name, theta0=theta, P0=0.0, variance=0.25)
        state = est.scan(y[:60], inputs(s, u[:60])).state
        state["D"] = d
        return est.predict(state, *future)

    d = np.linspace(1e-4, 3e-4, len(s.theta))
    steps = 1e-5 * np.eye(len(d))
    J = np.array([(ahead(s.theta + h)[0] - ahead(s.theta - h)[0]) / 2e-5 for h in steps])
    added = ahead(s.theta, d)[1] ** 2 - ahead(s.theta)[1] ** 2
    np.testing.assert_allclose(added, (J**2).T @ d, rtol=1e-6)


def test_parameters_count():
    """Without the parameters' part a short record's prediction is too sure of itself."""
    s = System(a=[-0.9], b=[[1.0]], nk=[1], f=[[]])
    (y,), (u,) = s.records(1, 15, 1.0, seed=2)
    est = dw.ARX(1, 1)
    state = est.scan(y, u).state
    _, std = est.predict(state, np.ones((30, 1)))
    P, certain = state["D"].copy(), state.copy()
    certain["D"] = 0 * P
    assert std[-1] > 1.2 * est.predict(certain, np.ones((30, 1)))[1][-1]


def test_an_input_in_doubt_counts():
    """A missing input that has not acted yet (delay 3) makes the samples it will act on less sure, no others."""
    s = System(b=[[1.0]], nk=[3], f=[[-0.5]])
    (y,), (u,) = s.records(1, 200, 0.1, seed=3, hold=1)
    u[-1] = np.nan
    est = dw.OE(1, 1, 3, theta0=s.theta, P0=0.0, variance=0.01)
    _, std = est.predict(est.scan(y, u).state, np.zeros((6, 1)))
    spread = np.nanvar(u[:-1])
    expected = 0.01 + spread * np.array([0, 0, 1, 0.5, 0.25, 0.125]) ** 2
    np.testing.assert_allclose(std**2, expected, rtol=0.05)


def test_what_is_refused():
    est = dw.OE(1, 1)
    y, u = SYSTEMS["OE"].records(1, 50, 0.1)
    state = est.scan(y[0], u[0]).state
    with pytest.raises(dw.InputError, match="say how far"):
        est.predict(state)
    with pytest.raises(dw.InputError, match="must be known"):
        est.predict(state, [1.0, np.nan])
    with pytest.raises(dw.InputError, match="simultaneous"):
        est.predict(state, [1.0, 2.0], 3)
    with pytest.raises(dw.InputError, match="has no predict"):
        dw.AdaptiveGain().scan(y[0]).predict(horizon=1)


def test_regressions_and_models_without_inputs():
    phi = np.random.default_rng(0).standard_normal((100, 2))
    est = dw.Regression(2, offset=True)
    mean, std = est.predict(est.scan(phi @ [2.0, -1.0] + 0.5, phi).state, [[1.0, 1.0]])
    assert abs(mean[0] - 1.5) < 1e-3 and std[0] < 0.01
    y, _ = SYSTEMS["ARMA"].records(1, 500, 1.0)
    mean, std = dw.AR(3).scan(y[0]).predict(horizon=200)
    assert abs(mean[-1]) < 0.05 * std[-1] and abs(std[-1] / y.std() - 1) < 0.3


def test_a_forecast_costs_some_updates_not_hundreds():
    """Twenty-four samples ahead: 80 us beside an update of 8 when this was written, both without a neighbour."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.1, seed=1)
    est = dw.ARX(2, 2)
    state, ahead = est.scan(y, u).state, u[:24].copy()

    calls = [lambda: est.predict(state, ahead), lambda: est.update(state, 1.0, 1.0)]
    best = [np.inf, np.inf]
    for _ in range(400):  # in turns: what else the machine does slows both
        for k, call in enumerate(calls):
            begun = time.perf_counter()
            call()
            best[k] = min(best[k], time.perf_counter() - begun)
    assert best[0] < 60 * best[1]


def test_a_forecast_is_one_call_of_compiled_code_however_far_ahead(monkeypatch):
    """Mean and deviation come of the same loop; no work is done in Python for a sample."""
    real, ran = forecast.compile.function, []

    def counted(function, *types):
        go = real(function, *types)
        return lambda *arguments: (ran.append(function), go(*arguments))

    monkeypatch.setattr(forecast.compile, "function", counted)
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    est = dw.ARX(2, 2)
    state, steps = est.scan(y, u).state, []
    for horizon in (24, 24, 960):  # the first compiles
        ran.clear()
        steps.append(0)

        def count(frame, event, argument):
            steps[-1] += event in ("call", "c_call")

        sys.setprofile(count)
        try:
            est.predict(state, np.ones(horizon))
        finally:
            sys.setprofile(None)
        assert ran == [forecast.run_on]
    assert steps[1] == steps[2]
