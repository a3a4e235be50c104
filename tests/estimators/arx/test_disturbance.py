"""A disturbance beside drifting parameters: the exact Kalman filter, its forecast, and what is refused."""

import numpy as np
import pytest

import driftwise as dw

POLE, NVR, RATIO, VARIANCE = 0.8, 0.002, 30.0, 0.09
COLOUR = dw.models.Disturbance(POLE, RATIO)


def estimator(**options):
    return dw.Regression(
        ["a", "b"], offset=True, disturbance=COLOUR, memory=dw.memory.Drift(q=NVR), variance=VARIANCE, **options
    )


@pytest.fixture(scope="module")
def record():
    """300 samples of which every other ten have a reference; (y, phi, d)."""
    rng = np.random.default_rng(3)
    phi, d = rng.standard_normal((300, 2)), np.zeros(300)
    for t in range(1, 300):
        d[t] = POLE * d[t - 1] + np.sqrt(COLOUR.nvr * VARIANCE) * rng.standard_normal()
    y = phi @ [2.0, -1.0] + 0.5 + d + np.sqrt(VARIANCE) * rng.standard_normal(300)
    return np.where(np.arange(300) // 10 % 2 == 0, y, np.nan), phi, d


def dense(y, phi, q):
    """The same filter in plain matrices: (predictions, their variances)."""
    F, Q, P = np.diag([1.0, 1, 1, POLE]), np.diag([q, q, q, COLOUR.nvr * VARIANCE]), None
    P, x, found = estimator().prior_covariance.copy(), np.zeros(4), []
    for z, row in zip(y, phi):
        h = np.array([*row, 1.0, 1.0])
        S = h @ P @ h + VARIANCE
        found.append((h @ x, S))
        if np.isfinite(z):
            x, P = x + P @ h / S * (z - h @ x), P - np.outer(P @ h, P @ h) / S
        x, P = F @ x, F @ P @ F.T + Q
    return np.array(found).T


def test_it_is_the_kalman_filter_of_parameters_and_disturbance(record):
    y, phi, _ = record
    trace = estimator().scan(y, phi)
    mean, variance = dense(y, phi, NVR)
    np.testing.assert_allclose(trace.prediction, mean, atol=1e-9)
    np.testing.assert_allclose(trace.variance, variance, rtol=1e-9)
    assert trace.names == ["a", "b", "offset", "disturbance"]


def test_a_forecast_is_what_the_filter_says_of_samples_without_a_reference(record):
    y, phi, _ = record
    est = dw.Regression(["a", "b"], offset=True, disturbance=COLOUR, memory=dw.memory.Drift(q=0.0), variance=VARIANCE)
    state = est.scan(y[:250], phi[:250]).state
    mean, std = est.predict(state, phi[250:256])
    blind = est.scan(np.full(6, np.nan), phi[250:256], state=state)
    np.testing.assert_allclose(mean, blind.prediction, atol=1e-9)
    np.testing.assert_allclose(std**2, blind.variance, rtol=1e-9)


def test_learnt_speeds_leave_the_colour_to_the_disturbance(record):
    _, phi, d = record
    y = phi @ [2.0, -1.0] + d  # of white noise there is next to none
    plain = dw.Regression(["a", "b"], offset=True, memory=dw.AutoMemory("outliers"))
    beside = dw.Regression(["a", "b"], offset=True, disturbance=COLOUR, memory=dw.AutoMemory("outliers"))
    slopes = [np.std(est.scan(y, phi).parameters[100:, :2] - [2.0, -1.0]) for est in (plain, beside)]
    assert slopes[1] < slopes[0]


def test_settings_survive_being_written_down(record, tmp_path):
    y, phi, _ = record
    est = estimator()
    dw.save_state(est, est.scan(y, phi).state, tmp_path / "state.json")
    again, state = dw.load_state(tmp_path / "state.json")
    assert again.disturbance == COLOUR
    assert again.update(state, 1.0, phi[0])[1].prediction == est.update(state, 1.0, phi[0])[1].prediction


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"memory": dw.ExponentialForgetting(0.99)}, "fades by itself"),
        ({"disturbance": 0.8}, "Disturbance"),
        ({"disturbance": dw.models.Disturbance(1.0)}, "pole"),
        ({"disturbance": dw.models.Disturbance(0.5, 0.0)}, "ratio"),
        ({"memory": dw.memory.Drift(nvr=(1e-3,) * 3)}, "nvr"),
        ({"method": "nlms"}, "least squares"),
        ({"start": "algebraic"}, "algebraic"),
    ],
)
def test_what_does_not_fit_is_refused(options, words):
    with pytest.raises(dw.InputError, match=words):
        dw.Regression(1, offset=True, **{"disturbance": COLOUR, "memory": dw.memory.Drift(nvr=1e-4), **options})


def test_hindsight_is_refused(record):
    with pytest.raises(dw.InputError, match="disturbance"):
        estimator().smooth(*record[:2])
    with pytest.raises(dw.InputError, match="disturbance"):
        estimator().tune(*record[:2])


def test_a_calibration_follows_the_sensor_and_not_the_weather(record):
    """An offset that drifts, references one day in five: better than carrying the last day's disturbance on."""
    rng = np.random.default_rng(1)
    T, d = 3000, np.zeros(3000)
    for t in range(1, T):
        d[t] = 0.85 * d[t - 1] + 0.5 * rng.standard_normal()
    sensor = rng.standard_normal(T)
    truth = 2.0 * sensor + 0.002 * np.arange(T) + d
    y = np.where(np.arange(T) // 24 % 5 == 0, truth, np.nan)
    hidden = np.isnan(y) & (np.arange(T) > 1000)
    trace = dw.estimators.sensor_calibration(["sensor"]).scan(y, sensor)
    plain = dw.Regression(["sensor"], offset=True, memory=dw.AutoMemory("outliers")).scan(y, sensor)
    error, other = ((one.prediction - truth)[hidden] for one in (trace, plain))
    assert np.std(error) < 1.12 * d.std()  # what nobody can know is there
    assert np.mean(error**2) < 0.9 * np.mean(other**2)
    assert 0.7 < np.mean(error**2 / trace.variance[hidden]) < 1.4
