"""What a recursive estimator knows of outputs that were not measured, and what the next measured one tells of them."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.status import Status
from driftwise.estimators.arx.gaps import pass_gap

A, B = [-1.7, 1.1, -0.3], [1.0, 0.5]  # oversampled: the squares of A alone sum to 4


def simulated(T, seed, a=A, noise=0.1):
    """Input and output of 1 + a1 q^-1 + .., B = q^-1 + .5 q^-2, at rest before."""
    rng = np.random.default_rng(seed)
    u, e, y = rng.standard_normal(T), noise * rng.standard_normal(T), np.zeros(T)
    for t in range(T):
        y[t] = e[t] + sum(-c * y[t - i - 1] for i, c in enumerate(a) if t > i)
        y[t] += sum(c * u[t - i - 1] for i, c in enumerate(B) if t > i)
    return u, y


def conditional(a, mean, y, noise):
    """Mean and variance of each y given the measured ones before: the joint Gaussian, in full (no recursion)."""
    T = len(y)
    L = np.linalg.inv(np.eye(T) + sum(c * np.eye(T, k=-i - 1) for i, c in enumerate(a)))
    V = noise**2 * L @ L.T
    found = np.empty((T, 2))
    for t in range(T):
        seen = np.flatnonzero(np.isfinite(y[:t]))
        gain = np.linalg.solve(V[np.ix_(seen, seen)], V[seen, t]) if len(seen) else np.zeros(0)
        found[t] = mean[t] + gain @ (y - mean)[seen], V[t, t] - gain @ V[seen, t]
    return found.T


@pytest.mark.parametrize("method", ["ls", "iv"])
def test_known_parameters_give_the_conditional_gaussian(method):
    T, noise = 150, 0.1
    u, y = simulated(T, 1, noise=noise)
    _, mean = simulated(T, 1, noise=0.0)
    y[1:][np.random.default_rng(2).random(T - 1) < 0.3] = np.nan
    y[60:90] = np.nan
    options = dict(theta0=[*A, *B], P0=np.full(5, 1e-18), variance=noise**2, at_rest=True, method=method)
    trace = dw.ARX(3, 2, **options).scan(y, u)
    prediction, variance = conditional(A, mean, y, noise)
    np.testing.assert_allclose(trace.prediction, prediction, atol=1e-9)
    np.testing.assert_allclose(trace.variance, variance, rtol=1e-9)


def test_several_outputs_give_the_conditional_gaussian():
    """Two outputs, the first of which needs two lags of both, each missing on its own and both at once."""
    T, noise, rng = 120, np.array([0.1, 0.3]), np.random.default_rng(4)
    lags = [np.array([[-1.5, 0.2], [0.1, -0.8]]), np.array([[0.7, -0.1], [0.0, 0.0]])]
    L = np.linalg.inv(sum((np.kron(np.eye(T, k=-i - 1), a) for i, a in enumerate(lags)), np.eye(2 * T)))
    e = noise * rng.standard_normal((T, 2))
    y, V = (L @ e.ravel()).reshape(T, 2), L @ np.diag(np.tile(noise**2, T)) @ L.T
    y[1:][rng.random((T - 1, 2)) < 0.25] = np.nan
    y[40:60, 0] = y[50:70, 1] = np.nan
    theta = {"a1.11": -1.5, "a2.11": 0.7, "a1.12": 0.2, "a2.12": -0.1, "a1.21": 0.1, "a1.22": -0.8}
    known = dict(theta0=theta, P0=1e-18, variance=noise**2, at_rest=True)
    trace, flat = dw.ARXMIMO(2, 0, na=[[2, 2], [1, 1]], nb=0, **known).scan(y), y.ravel()
    for t in range(T):
        seen = np.flatnonzero(np.isfinite(flat[: 2 * t]))
        here = [2 * t, 2 * t + 1]
        gain = np.linalg.solve(V[np.ix_(seen, seen)], V[np.ix_(seen, here)]) if len(seen) else np.zeros((0, 2))
        np.testing.assert_allclose(trace.prediction[t], flat[seen] @ gain, atol=1e-9)
        variance = np.diag(V[np.ix_(here, here)] - V[np.ix_(here, seen)] @ gain)
        np.testing.assert_allclose(trace.variance[t], variance, rtol=1e-9)


def test_a_forecast_from_within_a_gap_knows_what_is_unknown():
    T, noise = 80, 0.1
    u, y = simulated(T, 3, noise=noise)
    _, mean = simulated(T, 3, noise=0.0)
    y[50:] = np.nan
    est = dw.ARX(3, 2, theta0=[*A, *B], P0=np.full(5, 1e-18), variance=noise**2, at_rest=True)
    std = est.predict(est.scan(y[:57], u[:57]).state, u[57:])[1]
    np.testing.assert_allclose(std**2, conditional(A, mean, y, noise)[1][57:], rtol=1e-6)


@pytest.mark.parametrize("memory", [dw.Constant(), dw.AutoMemory()])
def test_bands_hold_within_a_gap_and_after_it(memory):
    """300 records; 40 samples without an output after 300 with one. Bands of 95 % are taken at 1.96 deviations."""
    runs, gap, T = 300, slice(300, 340), 360
    est, held, lost, z = dw.ARX(3, 2, memory=memory), np.zeros((runs, 60)), 0, np.zeros((runs, 60))
    for seed in range(runs):
        u, y = simulated(T, seed)
        seen = y.copy()
        seen[gap] = np.nan
        trace = est.scan(seen, u)
        z[seed] = ((y - trace.prediction) / np.sqrt(trace.variance))[300:]
        lost += np.count_nonzero(trace.status & Status.LOST)
    held = np.abs(z) < 1.96
    assert lost == 0
    # 300 runs, of which each counts for itself: deviation of the mean of held over a gap is at most .0126
    assert 0.95 - 3 * 0.0126 < held[:, :40].mean() < 0.95 + 2 * 0.0126
    assert 0.95 - 3 * 0.0126 < held[:, 40:].mean() < 0.95 + 2 * 0.0126
    assert 0.7 < np.mean(z[:, 10:40] ** 2) < 1.35


@pytest.mark.parametrize("doubt", [0.0, 0.5])
def test_an_output_in_doubt_corrects_the_past_by_what_it_is_worth(doubt):
    """Errors d of three past outputs, e = -a' d + w + glitch, all Gaussian: mean and covariance of d given e."""
    rng, theta, y_variance, w = np.random.default_rng(8), np.array([-1.2, 0.5, 0.1]), doubt, 0.09
    root = rng.standard_normal((3, 3))
    S, ys, e = root @ root.T, rng.standard_normal(3), 0.8
    T = theta @ S @ theta + w
    gain = -S @ theta / (T + doubt)
    mean, covariance = ys + gain * e, S - np.outer(gain, gain) * (T + doubt)
    flat, past = S.ravel().copy(), ys.copy()
    pass_gap(flat, past, theta, np.zeros(3), 0.3, y_variance, e, T)
    np.testing.assert_allclose(past, mean, rtol=1e-12)
    after = flat.reshape(3, 3)
    np.testing.assert_allclose(after[1:, 1:], covariance[:2, :2], rtol=1e-12)  # the oldest has left
    assert after[0, 0] == -doubt and not after[0, 1:].any() and not after[1:, 0].any()
