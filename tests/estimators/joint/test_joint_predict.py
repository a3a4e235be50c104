"""`Joint.predict` against the forecast of the same regression, and against what comes."""

import numpy as np
import pytest

import driftwise as dw

FUTURE = np.sin(np.arange(25) / 3)


def test_it_is_that_of_the_same_regression():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1000, noise_std=0.1, noise="equation", seed=2)
    joint, arx = dw.Joint(2, 1, offset=True), dw.ARX(2, 2, offset=True)
    for one, other in zip(
        joint.predict(joint.scan(y, u).state, FUTURE), arx.predict(arx.scan(y, u).state, FUTURE), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=5e-3, atol=1e-3)


def test_it_covers_what_comes():
    """Coloured noise, an offset and an input: 95 % of what comes 1 to 20 samples later lies in two deviations."""
    est, inside = dw.Joint(2, 1, offset=True, noise=dw.models.UnknownPolynomial()), []
    for seed in range(40):
        y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=820, noise_std=0.5, seed=seed)
        mean, std = est.predict(est.scan(y[:800] + 9.0, u[:800]).state, u[800:])
        inside.append(abs(y[800:] + 9.0 - mean) < 1.96 * std)
    assert 0.91 < np.mean(inside) < 0.98


def test_what_is_missing_is_said():
    est = dw.Joint(1, 1)
    with pytest.raises(dw.InputError, match="how far"):
        est.predict(est.start())
    with pytest.raises(dw.InputError, match="must be known"):
        est.predict(est.start(), [1.0, np.nan])
