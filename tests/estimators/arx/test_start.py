"""A record that begins in the middle of things: what was before it is unknown, not zero."""

import numpy as np
import pytest

import driftwise as dw

ESTIMATORS = {
    "ARX": dw.ARX(2, 2),
    "instruments": dw.ARX(2, 2, method="iv"),
    "ARMAX": dw.ARMAX(2, 2, 1),
    "observer": dw.estimators.AdaptiveObserver(2, 0.1),
}
SKIPPED = int(dw.Status.SKIPPED)


def records(missing):
    for seed in range(20):
        y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1000, noise_std=0.1, seed=seed)
        y, u = y[400:], u[400:]
        y[np.random.default_rng(seed).random(600) < missing] = np.nan
        yield y, u


@pytest.mark.parametrize("missing", [0.0, 0.2])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_the_noise_is_the_noise_wherever_the_record_begins(name, missing):
    """NIS and the noise's standard deviation, mean of 20 records of 600 samples; from zeros NIS is below .2."""
    found = []
    for y, u in records(missing):
        summary = ESTIMATORS[name].scaled_to(y, u).scan(y, u, keep="innovations").summary()
        found.append((summary.nis, summary.noise_std / 0.1))
    nis, std = np.mean(found, axis=0)
    assert 0.85 < nis < 1.1 and 0.95 < std < (1.1 if name != "observer" else 1.3), (nis, std)


def test_zeros_before_the_record_are_an_assumption_one_can_make():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    unknown, rest = dw.ARX(2, 2, P0=1e6).scan(y, u), dw.ARX(2, 2, P0=1e6, at_rest=True).scan(y, u)
    assert (unknown.status & SKIPPED).nonzero()[0].tolist() == [0, 1] and not np.any(rest.status & SKIPPED)
    assert np.max(abs(unknown.parameters[-1] - rest.parameters[-1]) / rest.parameters_std[-1]) < 1
    assert dw.ARX(2, 2, at_rest=True).scan(y[100:], u[100:]).summary().nis < 0.2


@pytest.mark.parametrize("delay", [1, 4])
def test_learning_begins_when_the_lags_are_full(delay):
    """Counted from the first measured output; equals the estimator that was handed the same samples at rest."""
    y, u = dw.simulate([-0.8], [1.0], samples=60, noise_std=0.1, seed=1)
    y[:7] = np.nan
    trace = dw.ARX(1, 2, delay).scan(y, u)
    first = 7 + max(1, 2 + delay - 1)
    assert np.flatnonzero(trace.weight > 0)[0] == first
    phi = [[-y[t - 1], u[t - delay], u[t - delay - 1]] for t in range(first, 60)]
    expected = dw.Regression(3).scan(y[first:], np.array(phi))
    np.testing.assert_allclose(trace.parameters[first:], expected.parameters, rtol=1e-9, atol=1e-12)
