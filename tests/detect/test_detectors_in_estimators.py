"""Detectors inside an estimator: laws, saving, changes found and named."""

from typing import NamedTuple

import numpy as np
import pytest

import driftwise as dw
from driftwise.detect.watch import OWN, STATISTIC, watch


@pytest.mark.parametrize(
    "detector",
    [
        dw.PageHinkley(threshold=2.0),
        dw.detect.VarianceCUSUM(threshold=2.0, sides="both"),
        dw.detect.GLR(threshold=2.0, window=5),
    ],
    ids=["hinkley", "variance", "GLR"],
)
def test_every_detector_of_innovations_obeys_the_laws_in_an_estimator(detector):
    dw.check_policy(detector)


class Loud(NamedTuple):
    """A user's own: alarms at every innovation beyond a bound."""

    bound: float

    def state_size(self, parameters):
        return OWN


@watch.on(Loud)
def _(detector, marks, z, slope):
    marks[STATISTIC] = abs(z) / detector.bound
    return 1.0 if z >= detector.bound else -1.0 if -z >= detector.bound else 0.0


def test_a_detector_of_ones_own():
    dw.check_policy(Loud(2.0))
    y, u = dw.simulate([-0.5], [1.0], samples=300, noise_std=0.1, seed=1)
    trace = dw.Joint(
        1,
        1,
        noise=dw.models.EquationError(0.01),
        memory=dw.RestartOnChange(Loud(2.5), dw.memory.CovarianceInflation(0.01), 9),
    ).scan(y, u)
    z = trace.innovation / np.sqrt(trace.variance)
    expected = (abs(z) >= 2.5) & (np.arange(300) >= 9)
    assert expected.any()
    assert np.array_equal((trace.status & int(dw.Status.JUMP)) > 0, expected)


def test_an_estimator_watches_as_the_detector_alone_would():
    """Until the first alarm the marks in the state are those of a scan of the whitened innovations."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    detector = dw.PageHinkley(jump=0.4, threshold=1e3)
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.01), memory=dw.RestartOnChange(detector, settle=50))
    trace = est.scan(y, u)
    z = trace.innovation[50:] / np.sqrt(trace.variance[50:])
    np.testing.assert_allclose(trace.state["detector_state"], detector.scan(z).state, rtol=1e-9, atol=1e-9)
    assert trace.state["detector_state"][STATISTIC] > 0


def test_a_bias_that_widens_nothing_is_found_by_the_mean():
    """An offset of 1 sd on the equation: the mean moves, the variance hardly."""
    rng, T = np.random.default_rng(0), 1500
    e = 0.1 * (rng.standard_normal((20, T)) + (np.arange(T) >= 1000))
    alarms = {}
    for detector in (dw.PageHinkley("1 per 100_000"), dw.detect.VarianceCUSUM(false_alarms="1 per 100_000")):
        est = dw.Joint(
            1,
            noise=dw.models.EquationError(0.01),
            memory=dw.RestartOnChange(detector, dw.memory.CovarianceInflation(0.01)),
        )
        found = np.zeros((20, T), bool)
        for i in range(20):
            y = np.zeros(T)
            for t in range(1, T):
                y[t] = 0.5 * y[t - 1] + e[i, t]
            found[i] = (est.scan(y).status & int(dw.Status.JUMP)) > 0
        assert found[:, :1000].sum() <= 1
        alarms[type(detector).__name__] = found[:, 1000:1050].any(axis=1).sum()
    assert alarms["PageHinkley"] >= 19
    assert alarms["VarianceCUSUM"] <= 15


def test_each_output_has_its_detector():
    y, u = dw.simulate(np.where(np.arange(1200)[:, None] < 600, [-1.5, 0.72], [-1.2, 0.5]), [1.0, 0.5],
                       samples=1200, noise_std=0.1, seed=3)  # fmt: skip
    est = dw.JointMIMO(
        (2, 2), 1, noise=dw.models.EquationError(0.01), memory=dw.RestartOnChange(dw.detect.VarianceCUSUM())
    )
    still, _ = dw.simulate([-1.5, 0.72], [1.0, 0.5], u=u, samples=1200, noise_std=0.1, seed=4)
    status = est.scan(np.column_stack([y, still]), u).status & int(dw.Status.JUMP)
    assert 600 <= np.flatnonzero(status[:, 0])[0] < 620
    assert not status[:, 1].any()


def test_continuous_time_until_a_jump():
    rng, T, dt = np.random.default_rng(0), 2000, 0.1
    u, y = np.repeat(rng.standard_normal(T // 10), 10), np.zeros(T)
    for t in range(1, T):
        a = 1.0 if t < 1000 else 3.0
        y[t] = np.exp(-a * dt) * y[t - 1] + (1 - np.exp(-a * dt)) / a * u[t - 1]
    y += 0.02 * rng.standard_normal(T)
    est = dw.ContinuousJoint(1, 1, noise=dw.models.EquationError(0.0004), dt=dt, memory=dw.RestartOnChange())
    trace = est.scan(y, u)
    alarms = np.flatnonzero(trace.status & int(dw.Status.JUMP))
    assert 1000 <= alarms[0] < 1050
    stubborn = dw.ContinuousJoint(1, 1, noise=dw.models.EquationError(0.0004), dt=dt).scan(y, u)
    assert abs(trace.parameters[-1, 0] - 3.0) < 0.2 < abs(stubborn.parameters[-1, 0] - 3.0)
    dw.check_estimator(dw.ContinuousJoint(1, 1, memory=dw.RestartOnChange(dw.PageHinkley(threshold=2.0), settle=10)))


def test_a_detector_is_saved_with_its_estimator(tmp_path):
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=200, noise_std=0.1, seed=1)
    for detector in (
        dw.PageHinkley(jump=(1.0, 0.5)),
        dw.detect.GLR(window=20),
        dw.detect.VarianceCUSUM(false_alarms=1e5),
    ):
        est = dw.Joint(2, 1, memory=dw.RestartOnChange(detector, settle=20))
        state = est.scan(y[:100], u[:100]).state
        dw.save_state(est, state, tmp_path / "state.json")
        other, back = dw.load_state(tmp_path / "state.json")
        assert np.array_equal(
            est.scan(y[100:], u[100:], state=state).table, other.scan(y[100:], u[100:], state=back).table
        )


@pytest.mark.parametrize(
    "detector",
    [dw.PageHinkley("1/200"), dw.detect.VarianceCUSUM(false_alarms="1/200"), dw.detect.GLR("1/200", window=20)],
    ids=repr,
)
def test_sample_by_sample_is_the_record(detector):
    z = np.random.default_rng(5).standard_normal(600)
    z[300:] += 1.0
    z[::17] = np.nan
    whole = detector.scan(2 * z + 3, mean=3.0, std=2.0)
    monitor = dw.detect.Monitor(detector, mean=3.0, std=2.0)
    state, alarms = monitor.start(), []
    for t, value in enumerate(2 * z + 3):
        before = state.copy()
        state, sign = monitor.update(state, value)
        assert np.isnan(z[t]) == np.isnan(sign.statistic)
        assert not np.isnan(z[t]) or np.array_equal(state, before)
        alarms += [(t, sign.alarm)] if sign.alarm else []
    assert alarms == list(zip(whole.samples, whole.directions))
    assert len(alarms) > 2
    assert np.array_equal(state, whole.state)


def test_a_monitor_takes_slopes_and_refuses_nonsense():
    rng = np.random.default_rng(6)
    slopes, z = rng.standard_normal((400, 2)), rng.standard_normal(400)
    z[200:] += 1.5 * slopes[200:, 1]
    found = dw.detect.ScoreCUSUM(jump=1.5).scan(z, slopes)
    monitor = dw.detect.Monitor(dw.detect.ScoreCUSUM(jump=1.5), parameters=2)
    state, alarms = monitor.start(), []
    for t in range(400):
        state, sign = monitor.update(state, z[t], slopes[t])
        alarms += [(t, sign.which)] if sign.alarm else []
    assert alarms == list(zip(found.samples, found.which))
    assert alarms[0][1] == 1
    with pytest.raises(dw.InputError, match="another detector's"):
        monitor.update(np.zeros(3), 0.0, [1.0, 1.0])
    with pytest.raises(dw.InputError, match="must be finite"):
        monitor.update(state, np.inf, [1.0, 1.0])
    with pytest.raises(dw.InputError, match="detector must be"):
        dw.detect.Monitor(12.0)


def test_what_changed_names_the_parameter():
    """ARX(2, 2), one parameter jumps by a little: at least 90 % of 80 runs name it and its direction (97 % do)."""
    right = 0
    for i, size in enumerate((0.03, -0.03, 0.05, -0.05)):
        theta = np.tile([-1.5, 0.7, 1.0, 0.5], (700, 1))
        theta[400:, i] += size
        for seed in range(20):
            y, u = dw.simulate(theta[:, :2], theta[:, 2:], samples=700, noise_std=0.1, seed=seed)
            told = dw.ARX(2, 2).scaled_to(y, u).scan(y, u).what_changed(400)
            right += told.which == i and told.direction == np.sign(size)
    assert right >= 72


def test_what_changed_needs_a_regression():
    y, u = dw.simulate([-0.8], [1.0], samples=50, seed=1)
    with pytest.raises(dw.InputError, match="ARX"):
        dw.Joint(1, 1).scan(y, u).what_changed(10)
    with pytest.raises(dw.InputError, match="ARX"):
        dw.ARX(1, 1, method="nlms").scan(y, u).what_changed(10)
