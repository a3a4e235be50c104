"""Lost inputs cost information, not honesty: squared error over covariance, per parameter, over 200 records."""

import numpy as np
import pytest

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
        model = dw.Joint(2, inputs=1, direct=True, noise=dw.EquationError(0.09), P0=100.0).scan(y, u).model()
        error = model.values - truth
        total += error @ np.linalg.solve(model.covariance, error) / len(truth)
    return total / RECORDS


@pytest.mark.parametrize(
    "b0, lost_u, lost_y, bound",
    [(1.5, 0.0, 0.0, 1.15), (0.0, 0.2, 0.0, 1.3), (0.0, 0.2, 0.2, 1.3), (1.5, 0.2, 0.0, 2.2), (1.5, 0.2, 0.2, 2.2)],
)
def test_lost_inputs_leave_nearly_honest_error_bars(b0, lost_u, lost_y, bound):
    """The mean of 200 has a standard error of about 0.045; with a direct term the step is inexact: bounded so."""
    value = nees(b0, lost_u, lost_y)
    print(f"b0 {b0}, inputs lost {lost_u:.0%}, outputs lost {lost_y:.0%}: {value:.2f}")
    assert 0.8 < value < bound
