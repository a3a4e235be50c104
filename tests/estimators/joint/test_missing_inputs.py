"""Lost inputs cost information, not honesty: squared error over covariance, per parameter, over 200 records."""

import numpy as np
import pytest
from draws import slow

import driftwise as dw

RECORDS, SAMPLES = 200, 300


def nees(b0, lost_u, lost_y):
    total = 0.0
    truth = np.array([-1.2, 0.5, 1.0, 0.5, b0])
    for seed in range(RECORDS):
        rng = np.random.default_rng(10**6 + seed)
        u = rng.standard_normal(SAMPLES)
        y, _ = dw.simulate(truth[:2], truth[2:4], direct=b0, samples=SAMPLES, noise_std=0.3, u=u, seed=seed)
        u[rng.random(SAMPLES) < lost_u] = np.nan
        y[rng.random(SAMPLES) < lost_y] = np.nan
        model = dw.Joint(2, inputs=1, direct=True, noise=dw.models.EquationError(0.09), P0=100.0).scan(y, u).model()
        error = model.values - truth
        total += error @ np.linalg.solve(model.covariance, error) / len(truth)
    return total / RECORDS


@pytest.mark.parametrize(
    "b0, lost_u, lost_y, bound",
    [
        (1.5, 0.0, 0.0, 1.15),
        slow(0.0, 0.2, 0.0, 1.3),
        (0.0, 0.2, 0.2, 1.3),
        slow(1.5, 0.2, 0.0, 2.2),
        (1.5, 0.2, 0.2, 2.2),
    ],
)
def test_lost_inputs_leave_nearly_honest_error_bars(b0, lost_u, lost_y, bound):
    """The mean of 200 has a standard error of about 0.045; with a direct term the step is inexact: bounded so."""
    value = nees(b0, lost_u, lost_y)
    print(f"b0 {b0}, inputs lost {lost_u:.0%}, outputs lost {lost_y:.0%}: {value:.2f}")
    assert 0.8 < value < bound


def test_a_held_direct_term_widens_the_product_with_a():
    """Output error, x = 0 known, y lost: x+ = -a b0 u with a and u independent, so its variance is written down."""
    a, Pa, b0, mean, spread = -0.6, 0.09, 1.5, 0.4, 0.25
    est = dw.Joint(1, 1, True, noise=dw.models.OutputError(0.01), s0=[0.0, a, 0.0, b0], P0=[0.0, Pa, 0.0, 0.0])
    state = est.start()
    state["known"], state["sums"], state["squares"] = 2, 2 * mean, 2 * (mean**2 + spread)
    state["steps"] = 1e9  # a white input: its mean is put in its place
    state, _ = est.update(state, np.nan, np.nan)
    assert np.isclose(state["input_variance"][0], spread) and np.isclose(state["held"][0], mean)
    variance = (a**2 + Pa) * b0**2 * spread + Pa * (b0 * mean) ** 2
    assert np.isclose(est.covariance(state)[0, 0], variance, rtol=1e-12)


def test_a_held_direct_term_widens_the_prediction():
    """y = x + b0 u + w, x = 0 known: with u lost, y has the variance of a product of two independent numbers, and w."""
    R, b0, Pb, mean, spread = 0.04, 1.5, 0.3, 0.4, 0.25
    est = dw.Joint(1, 1, True, noise=dw.models.EquationError(R), s0=[0.0, -0.6, 0.0, b0], P0=[0.0, 0.0, 0.0, Pb])
    state = est.start()
    state["known"], state["sums"], state["squares"] = 2, 2 * mean, 2 * (mean**2 + spread)
    state["steps"] = 1e9  # a white input: its mean is put in its place
    _, step = est.update(state, 0.0, np.nan)
    assert step.prediction == pytest.approx(b0 * mean, rel=1e-12)
    assert step.variance == pytest.approx(R + (b0**2 + Pb) * (mean**2 + spread) - (b0 * mean) ** 2, rel=1e-12)


def test_an_input_that_stays_lost_is_the_forecast_of_its_own_process():
    """Five in a row: mean and variance of an AR(1) process k steps ahead, of the moments seen, in closed form."""
    mean, spread, last, rho = 0.4, 0.25, 1.3, 0.8
    est = dw.Joint(1, 1, True, noise=dw.models.EquationError(0.04), P0=1.0)
    state, known = est.start(), 11
    state["known"], state["sums"], state["squares"] = known, known * mean, known * (mean**2 + spread)
    state["steps"] = (known - 1) * 2 * spread * (1 - rho)  # the mean squared step of such a process
    state["held"] = last
    for k in range(1, 6):
        state, _ = est.update(state, 0.0, np.nan)
        assert state["held"][0] == pytest.approx(mean + rho**k * (last - mean), rel=1e-12)
        assert state["input_variance"][0] == pytest.approx((1 - rho ** (2 * k)) * spread, rel=1e-12)
