"""The oracle of banks against 50-digit numbers, and against what theory says of its parts."""

import json
from pathlib import Path

import numpy as np
import pytest

from oracle import auto, banks

GOLDEN = Path(__file__).parents[1] / "golden" / "abid.json"


def records(series=3, samples=60, n=2, seed=4):
    rng = np.random.default_rng(seed)
    psi = rng.standard_normal((series, samples, n))
    theta = np.cumsum(0.05 * rng.standard_normal((series, samples, n)), axis=1)
    return np.sum(psi * theta, axis=-1) + 0.3 * rng.standard_normal((series, samples)), psi


def test_bank_is_the_golden_case():
    case = next(c for c in json.loads(GOLDEN.read_text())["cases"] if c["id"] == "bank2_normal_invgamma")
    y, psi = (np.array([case["input"][name]]) for name in ("y", "psi"))
    units = banks.Units(1, 2, floor=0.0, absolute=1e-8, guard=False)
    first = banks.start(1, 2, 2, 50, chi2=0.02)
    run = banks.run_bank(y, psi, np.ones(2), first, levels=(0, 1e-2), floor=0.0, units=units)
    expected = {name: np.array(value) for name, value in case["expected"].items()}
    weights, each = expected["weights_after_update"], expected["sigma2_each"]
    np.testing.assert_allclose(run.w[0], weights, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.theta[0], expected["theta_mixture"], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.s2[0], np.sum(weights * each, axis=1), rtol=1e-9, atol=1e-9)
    assert abs(run.evidence.sum() - expected["log_predictive_total"]) <= 1e-9


def test_one_mode_is_the_kalman_filter():
    """With sigma^2 known and one level, 5.10 is the filter of section 1.3."""
    y, psi = records(1)
    first = banks.start(1, 1, 2, 1000 / 0.09, chi2=0.09)
    run = banks.run_bank(y, psi, np.array([0.9, 1.0]), first, levels=(1e-2,), learnt=False)
    theta, P, ms = np.zeros(2), 1000 * np.eye(2), np.zeros(2)
    phi = np.diag([0.9, 1.0])
    for k, row in enumerate(psi[0]):
        ms += max(1 / (k + 1), 0.005) * (row**2 - ms)
        S = row @ P @ row + 0.09
        assert run.S[0, k] == pytest.approx(S, rel=1e-10)
        theta = theta + P @ row / S * (y[0, k] - row @ theta)
        P = P - np.outer(P @ row, P @ row) / S
        np.testing.assert_allclose(run.theta[0, k], theta, atol=1e-9)
        theta, P = phi @ theta, phi @ P @ phi + np.diag(1e-2 * 0.09 / ms)


def test_mixing_keeps_the_mixtures_moments():
    """Whatever the transition matrix, 5.11 preserves mean and second moment of theta; and forgets nothing at A = I."""
    y, psi = records(2)
    b = banks.start(2, 3, 2, 2.0, chi2=0.5)
    b, _ = banks.update(b, psi[:, 0], y[:, 0])
    b.theta += np.arange(3)[:, None]
    b.chi2 *= np.array([1.0, 2.0, 4.0])
    for A in (banks.staying(3, 0.9), banks.staying_with_jump(3)):
        for before, after in zip(banks.moments(b), banks.moments(banks.mix(b, A)), strict=True):
            np.testing.assert_allclose(after, before, atol=1e-12)
    np.testing.assert_allclose(banks.mix(b, np.eye(3)).P, b.P, atol=1e-13)


@pytest.mark.parametrize("y, loud", [(2.5, 12.5), (25.0, 25.0**2 / 0.5), (1.5, 9.0)])
def test_outlier_update_is_the_mixtures_moments(y, loud):
    """5.14: the corrected theta and P are mean and covariance of the good and the outlier posterior together."""
    _, psi = records(1)
    b = banks.start(1, 1, 2, 2.0, chi2=0.5)
    new, taken = banks.update(b, psi[:, 0], np.array([y]), pi=0.3, kappa=9.0)
    row, posts = psi[0, 0], []
    for share, R in ((0.7, 1.0), (0.3, loud)):
        P = b.P[0, 0]
        St = row @ P @ row + R
        K = P @ row / St
        density = np.exp(banks.log_density(y, St * 0.5, np.array(1.0), True))
        posts.append((share * density, K * y, P - np.outer(K, P @ row)))
    total = sum(p for p, *_ in posts)
    mean = sum(p * m for p, m, _ in posts) / total
    cov = sum(p * (V * 0.5 + np.outer(m - mean, m - mean)) for p, m, V in posts) / total / 0.5
    assert taken.evidence[0] == pytest.approx(np.log(total))
    np.testing.assert_allclose(new.theta[0, 0], mean)
    np.testing.assert_allclose(new.P[0, 0], cov)


def test_sensitivities_are_derivatives():
    """The learner's dtheta, dP are central differences of its mode's, with respect to the log NVRs."""
    y, psi = records(1, 12)
    phi = np.array([0.9, 1.0])

    def follow(shift):
        learner, b = auto.Learner(1, 2), banks.start(1, 1, 2, 10.0, chi2=0.09)
        learner.eta = learner.eta + shift
        for k in range(12):
            new, taken = banks.update(b, psi[:, k], y[:, k], learnt=False)
            learner.correct(b, taken, psi[:, k])
            learner.predict(phi, np.exp(learner.eta))
            b = banks.predict(new, phi, np.exp(learner.eta)[:, None])
        return b, learner

    for j, step in enumerate(1e-5 * np.eye(2)):
        (up, _), (down, _), (_, mid) = follow(step), follow(-step), follow(0)
        np.testing.assert_allclose(mid.dtheta[:, j], (up.theta - down.theta)[:, 0] / 2e-5, atol=1e-8)
        np.testing.assert_allclose(mid.dP[:, j], (up.P - down.P)[:, 0] / 2e-5, atol=1e-8)


def test_auto_tells_a_jump_from_noise_and_skips_what_is_missing():
    """A jump at odds of 100:1, another level at 1000:1, against drift, too, that takes up to sixty samples."""
    rng = np.random.default_rng(0)
    psi = rng.standard_normal((3, 300, 2))
    theta = np.tile([1.0, -1.0], (3, 300, 1))
    theta[0, 100:, 0] = 3.0
    e = 0.1 * rng.standard_normal((3, 300))
    e[1, 100:] *= 3
    y = np.sum(psi * theta, axis=-1) + e
    y[2, 60:70] = np.nan
    run = auto.run_auto(y, psi, np.ones(2))
    assert [(s, what) for s, _, what in run.events if what != "outlier"] == [(0, "jump"), (1, "noise level")]
    assert all(100 <= k < {"jump": 105, "noise level": 160}[what] for _, k, what in run.events if what != "outlier")
    assert np.isnan(run.eps[2, 60:70]).all() and np.all(np.diff(run.P[2, 59:70, 0]) > 0)
    np.testing.assert_array_equal(run.w[2, 60:69], run.w[2, 61:70])
