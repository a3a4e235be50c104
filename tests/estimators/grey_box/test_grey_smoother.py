"""Looking back: the most probable path is that of least squares over all states and parameters at once."""

import numpy as np
import pytest
import scipy.optimize
from test_grey_box import CELL, square

import driftwise as dw
from driftwise.estimators.grey_box.start import Batch

LAG = """
[states]
x = {std = 1.0, walk = 0.2}
[inputs]
u = {}
[outputs]
y = {noise = 0.2}
z = {noise = 0.5}
[parameters]
tau = {unit = "s", start = 4}
gain = {start = 1, free = true, std = 2}
[formulas]
dx = "(gain * u - x) / tau"
y = "x"
z = "x ** 2 + gain"
"""


def lag(seed=0, samples=40):
    """Return instants, inputs and outputs of LAG, with gaps, and its states."""
    rng = np.random.default_rng(seed)
    time, u, x = np.cumsum(rng.uniform(0.3, 1.5, samples)), square(seed, samples, 8), [rng.standard_normal()]
    for step, held in zip(np.diff(time), u):
        f = np.exp(-step / 3.0)
        x.append(f * x[-1] + (1 - f) * 1.5 * held + 0.2 * np.sqrt(1.5 * (1 - f**2)) * rng.standard_normal())
    x = np.array(x)
    noise = rng.standard_normal((samples, 2)) * [0.2, 0.5]
    y = np.column_stack([x, x**2 + 1.5]) + noise
    y[3], y[7, 0], y[8, 1] = np.nan, np.nan, np.nan
    return time, u, y, x


def least_squares(time, u, y):
    """Return the most probable states and parameters of LAG, and their covariance, by SciPy.

    The noise of a step is that of the parameters it is seen with, as in a filter that is linear about them.
    """
    T, q = len(y), None

    def residuals(z):
        x, tau, gain = z[:T], np.exp(z[T]), z[T + 1]
        f = np.exp(-np.diff(time) / tau)
        said = [x[0] / 1.0, (z[T] - np.log(4)) / (np.log(5) / 1.959963984540054), (gain - 1) / 2]
        moves = (x[1:] - f * x[:-1] - (1 - f) * gain * u[:-1]) / q
        seen = np.concatenate([(y[:, 0] - x) / 0.2, (y[:, 1] - x**2 - gain) / 0.5])
        return np.concatenate([said, moves, seen[np.isfinite(seen)]])

    z = np.concatenate([np.nan_to_num(y[:, 0]), [np.log(4), 1.0]])
    for _ in range(8):
        f = np.exp(-np.diff(time) / np.exp(z[T]))
        q = 0.2 * np.sqrt(np.exp(z[T]) / 2 * (1 - f**2))
        found = scipy.optimize.least_squares(residuals, z, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        z = found.x
    return z, np.linalg.inv(found.jac.T @ found.jac)


def test_the_path_is_that_of_least_squares_over_all_states_and_parameters_and_so_are_its_bars():
    time, u, y, _ = lag()
    found = dw.GreyBox(LAG, start=None).smooth(y, u, time=time, keep="covariance")
    z, P = least_squares(time, u, y)
    T = len(y)
    std = np.sqrt(np.diag(P))
    assert found.moved < 1e-3
    np.testing.assert_allclose(found.x[:, 0], z[:T], atol=2e-3 * std[:T].max())
    np.testing.assert_allclose(found.x_std[:, 0], std[:T], rtol=1e-3)
    np.testing.assert_allclose(found.parameters, np.tile([np.exp(z[T]), z[T + 1]], (T, 1)), rtol=2e-3)
    np.testing.assert_allclose(found.of("tau")[1], np.exp(z[T]) * std[T], rtol=5e-3)
    between = found.covariance[:, 0, 2]
    np.testing.assert_allclose(between, P[:T, T + 1], atol=5e-3 * std[:T].max() * std[T + 1])


def test_one_that_was_linear_far_off_looks_back_to_where_a_batch_fit_is():
    """From a prior alone the filter's first slopes are wrong; looking back takes them anew."""
    text = CELL.replace(", walk = 1e-4", "")
    u = square(5, 300)
    truth = {"R0": 0.035, "R1": 0.06, "C1": 2500.0}
    y = dw.GreyBox(text).simulate(u, truth, seed=4)
    est = dw.GreyBox(text, start=None)
    state = est.start()
    state["bend"] = 0.0
    filtered, found = est.scan(y, u, state=state).state, est.smooth(y, u, state=state)
    fit = Batch(dw.GreyBox(text), y[:, None], np.column_stack([u, np.arange(300.0)])).fits(est._s0[2:])[0]
    bars = np.sqrt(np.diag(np.linalg.inv(fit.information)))
    ours = est.transformed(dict(zip(est.names, found.parameters[-1])))
    assert np.max(abs(ours - fit.z) / bars) < 0.05 < np.max(abs(filtered["theta"] - fit.z) / bars)


def test_what_a_jump_changed_is_another_value_before_it_and_the_others_are_one():
    est, u = dw.GreyBox(CELL.replace(", walk = 1e-4", ""), jumps="fit"), square(1, 700)
    parts = [est.simulate(u, {"R0": R0, "R1": 0.015}, seed=1) for R0 in (0.02, 0.026)]
    found = est.smooth(np.where(np.arange(700) < 450, *parts), u)
    R0, std = found.of("R0")
    assert abs(R0[100] - 0.02) < 3 * std[100] < 0.001 and abs(R0[-1] - 0.026) < 3 * std[-1] < 0.002
    assert np.flatnonzero(np.diff(R0) > 0.005).tolist() == pytest.approx([449], abs=10)
    assert np.ptp(found.of("R1")[0]) < 1e-6


def test_parameters_that_walk_are_known_better_than_by_the_filter_and_bars_hold():
    u, rng = square(2, 600, 3), np.random.default_rng(0)
    text = CELL.replace(", walk = 1e-4", "")
    est = dw.GreyBox(text, start=None, memory=dw.RandomWalk([1e-3, 1e-12, 1e-12]))
    R0 = 0.01 * np.exp(np.cumsum(10**-1.5 * rng.standard_normal(600)))
    y = est.simulate(u, {"R1": 0.02, "C1": 1000.0}, noise=1e-3, seed=1) + (R0 - 0.01) * u
    (found, std), (filtered, wide) = (one.of("R0") for one in (est.smooth(y, u), est.scan(y, u)))
    at = slice(100, 500)
    assert np.mean(std[at]) < 0.8 * np.mean(wide[at])
    assert np.std((found - R0)[at]) < 0.95 * np.std((filtered - R0)[at])
    assert 0.92 < np.mean(abs(found - R0)[at] < 1.96 * std[at]) < 0.98


def test_a_record_in_two_parts_goes_on_where_the_first_ended():
    time, u, y, _ = lag(3, 60)
    est = dw.GreyBox(LAG, start=None)
    state = est.scan(y[:20], u[:20], time=time[:20]).state
    found = est.smooth(y[20:], u[20:], state=state, time=time[20:])
    trace = est.scan(y, u, time=time)
    assert np.all(abs(found.parameters[-1] - trace.parameters[-1]) < 0.3 * trace.parameters_std[-1])
    assert len(found) == 40 and found.time[0] == time[20]


def test_bars_in_hindsight_hold():
    inside = []
    for seed in range(25):
        time, u, y, x = lag(seed, 60)
        found = dw.GreyBox(LAG, start=None).smooth(y, u, time=time)
        inside.append(abs(found.x[:, 0] - x) < 1.96 * found.x_std[:, 0])
    assert 0.92 < np.mean(inside) < 0.98


def test_what_cannot_be_looked_back_at_is_a_sentence():
    _, u, y, _ = lag()
    with pytest.raises(dw.InputError, match=r"ExponentialForgetting\(.*\) forgets, and says not how parameters move"):
        dw.GreyBox(LAG, start=None, memory=dw.ExponentialForgetting(0.99)).smooth(y, u)
    with pytest.raises(dw.InputError, match="lag must be None: GreyBox looks back over whole records, got 5"):
        dw.GreyBox(LAG).smooth(y, u, lag=5)
    with pytest.raises(dw.InputError, match="y is empty"):
        dw.GreyBox(LAG).smooth(y[:0], u[:0])
    with pytest.raises(dw.InputError, match="keep must be one of"):
        dw.GreyBox(LAG).smooth(y, u, keep="all")
