"""The manoeuvre filter in positions against the filter of second differences, Singer's, and draws."""

import numpy as np
import pytest
from oracle import golden

import driftwise as dw

KNOWN = dw.models.InverseGamma(1e15, 1e15)  # a noise that is known, by the code that learns it


def track(samples=200, sigma=170.0, offset=2e5, seed=3):
    """A target that turns now and then, far away, one plot every 12 s."""
    rng = np.random.default_rng(seed)
    a = np.repeat(rng.normal(0, 1.5, samples // 20 + 1), 20)[:samples] * 12.0**2
    return offset + np.cumsum(2000 + np.cumsum(a)) + sigma * rng.standard_normal(samples)


def differences(y, rho, R, walk, limit=0.98, spread=25.0, cap=0.45**2):
    """Return predictions and variances of y by (1 - phi q) w = (1 - rho q)^2 v, w = y - 2 y' + y'', written plainly."""
    c = np.array([0.0, rho**2, -2 * rho])  # on xi_1, xi_2, xi_3
    z, P = np.zeros(4), np.diag([spread * R] * 3 + [cap])
    H, G = np.array([0.0, 0, 1, 0]), np.append(c, 0.0)
    found = []
    for t in range(2, len(y)):
        w, base = y[t] - 2 * y[t - 1] + y[t - 2], 2 * y[t - 1] - y[t - 2]
        F = np.zeros((4, 4))
        F[1, 0] = F[2, 1] = F[3, 3] = 1.0
        F[2, 3] = w
        S = H @ P @ H + R
        M = F @ P @ H + G * R
        found.append((base + z[2], S))
        z = F @ z + M / S * (w - z[2])
        P = F @ P @ F.T + np.outer(G, G) * R - np.outer(M, M) / S
        P[3, 3] += min(walk, max(cap - P[3, 3], 0.0))
        z[3] = np.clip(z[3], -limit, limit)
    return np.array(found).T


@pytest.mark.parametrize("walk, limit", [(0.0, 0.98), (1e-3, 0.98), (1e-3, 0.3)])
def test_positions_and_second_differences_are_one_filter(walk, limit):
    """Two poles held, x moved along j with every step of phi that no plot made: the two forms agree to 1e-8."""
    y, R = track(), 128.0**2
    trace = dw.tracking.Manoeuvre(0.5, 2, scale=KNOWN, walk=walk, limit=limit, y_scale=128.0, dt=12.0).scan(y)
    prediction, variance = differences(y, 0.5, R, walk, limit)
    assert np.any(trace.status & dw.Status.PROJECTED) or limit > 0.3
    golden.assert_close(trace.prediction[2:] - y[1:-1], prediction - y[1:-1], 1e-8)
    golden.assert_close(trace.variance[2:], variance, 1e-8)


def test_where_the_track_lies_does_not_matter():
    y = track(offset=0.0)
    est = dw.tracking.Manoeuvre(y_scale=128.0)
    near, far = est.scan(y), est.scan(y + 1e6)
    golden.assert_close(near.innovation[2:], far.innovation[2:], 1e-8)


def test_with_its_pole_known_it_is_singers_filter():
    """phi = exp(-alpha T), C the spectral factor: the predictions of the steady Kalman filter of Singer's model."""
    y, alpha, q, r = track(samples=300), 0.02, 1.5, 170.0**2
    model = dw.models.Singer(alpha, q, 12.0)
    form = model.canonical(r)
    est = dw.tracking.Manoeuvre(
        d=form.d, scale=KNOWN, pole=np.exp(-alpha * 12), pole_std=0.0, walk=0.0, y_scale=form.variance**0.5, dt=12.0
    )
    trace = est.scan(y)
    x, P = np.array([y[0], 0, 0]), np.diag([r, 1e6, 10.0])
    expected = np.zeros((2, len(y)))
    for t in range(1, len(y)):
        x, P = model.Phi @ x, model.Phi @ P @ model.Phi.T + model.Q
        expected[:, t] = x[0], P[0, 0] + r
        K = P[:, 0] / (P[0, 0] + r)
        x, P = x + K * (y[t] - x[0]), P - np.outer(K, P[0])
    late = slice(150, None)
    golden.assert_close((trace.prediction - y)[late], (expected[0] - y)[late], 1e-6)
    golden.assert_close(trace.variance[late], expected[1][late], 1e-6)
    seconds = est.time_constant(trace.state)
    assert seconds == pytest.approx((50.0, 50.0, 50.0))


def test_a_missed_scan_has_the_moments_of_draws():
    """From a state with an uncertain phi, the plot is not seen: mean and covariance of the next state by a million."""
    est = dw.tracking.Manoeuvre(scale=KNOWN, walk=0.0, y_scale=128.0, dt=12.0)
    state = est.scan(track(samples=12, offset=0.0)).state
    after, step = est.update(state, np.nan)
    rng = np.random.default_rng(0)
    s = rng.multivariate_normal(est.mean(state), est.covariance(state), 1_000_000, method="svd")
    v = 128.0 * rng.standard_normal(len(s))
    y = s[:, 2] + v
    x = np.column_stack([0 * y, s[:, 0], s[:, 1]]) - s[:, 3:] * y[:, None] + np.outer(v, [0.0, 0.25, -1.0])
    nxt = np.column_stack([x, s[:, 3:]])
    P = est.covariance(after)
    sd = np.sqrt(np.diag(P))
    assert np.all(np.abs(nxt.mean(0) - est.mean(after)) < 5 * sd / 1000)
    np.testing.assert_allclose(np.cov(nxt.T) / np.outer(sd, sd), P / np.outer(sd, sd), atol=0.02)
    assert step.variance == pytest.approx(np.var(y), rel=0.01)


def test_velocity_is_the_slope_of_the_forecast():
    y = track()
    est = dw.tracking.Manoeuvre(y_scale=128.0, dt=12.0)
    state = est.scan(y).state
    ahead = est.scan(np.full(2, np.nan), state=state)
    mean, std = est.velocity(state)
    assert mean == pytest.approx(np.diff(ahead.prediction)[0] / 12, rel=1e-9)
    assert 0 < std < 100
    assert np.isnan(est.velocity(est.start())[0])


def test_two_poles_stay_at_one_whatever_the_plots_say():
    est = dw.tracking.Manoeuvre()
    trace = est.scan(np.cumsum(np.cumsum(np.random.default_rng(2).standard_normal(80))))
    expected = np.array([-2, 1, 0]) + np.outer(est.pole(trace)[0], [-1, 2, -1])
    np.testing.assert_allclose(trace.parameters, expected, rtol=1e-14, atol=1e-14)
    low, value, high = est.time_constant(trace)
    assert np.all((0 <= low) & (low <= value) & (value <= high))


def test_bad_numbers_are_refused():
    for options, words in [
        (dict(rho=1.0), "below 1"),
        (dict(m=4), "2 or 3"),
        (dict(limit=1.0), "limit must be below 1"),
        (dict(pole=0.99), "within -limit"),
        (dict(walk=-1e-3), "not be negative"),
        (dict(variance=0.0), "positive"),
    ]:
        with pytest.raises(dw.InputError, match=words):
            dw.tracking.Manoeuvre(**options)
