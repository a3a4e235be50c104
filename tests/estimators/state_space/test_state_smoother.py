"""Smoothing of a user's system against one dense Gaussian of all samples, statsmodels, and itself."""

import numpy as np
import pytest
from oracle.linear_gaussian import SYSTEMS, each, moments, of, random_system
from test_irregular import continuous, record

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.engine import compile, loops
from driftwise.estimators.state_space import smoother

TWO = dict(F=[[0.9, 0.1], [0, 0.8]], H=[[1, 0], [1, 1]], Q=0.1, R=[[1, 0.3], [0.3, 2]], P0=1.0)


def test_it_is_the_dense_joint_gaussian_with_gaps():
    for seed in SYSTEMS:
        system = random_system(seed)
        est, y, u = of(system)
        x, P, _ = moments(*each(system[:6], len(y)), *system[6:])
        found = est.smooth(y, u, keep="covariance")
        np.testing.assert_allclose(found.x, x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.covariance, P, rtol=1e-9, atol=1e-9)


def test_a_lag_and_matrices_of_every_sample_are_those_of_the_dense_joint_gaussian():
    for seed in range(60):
        *matrices, x0, P0, y, u = random_system(seed)
        rng, T, lag = np.random.default_rng(seed), len(y), 2
        own = [M * f for M, f in zip(each(matrices, T), 1 + 0.5 * rng.random((6, T, 1, 1)))]
        est, ys, us = of((*matrices, x0, P0, y, u))
        given = {name: M for name, M in zip("FGHDQR", own) if us is not None or name not in "GD"}
        found = est.smooth(ys, us, **given, lag=lag, keep="covariance")
        for t in range(T):
            seen = min(t + lag, T - 1) + 1
            x, P, _ = moments(*(M[:seen] for M in own), x0, P0, y[:seen], u[:seen])
            np.testing.assert_allclose(found.x[t], x[t], rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(found.covariance[t], P[t], rtol=1e-9, atol=1e-9)


def test_it_is_statsmodels_with_gaps():
    KalmanSmoother = pytest.importorskip("statsmodels.tsa.statespace.kalman_smoother").KalmanSmoother
    for seed in SYSTEMS[:60]:
        F, _, H, _, Q, R, x0, P0, y, _ = random_system(seed)
        n, p = len(F), len(H)
        peer = KalmanSmoother(p, n, k_posdef=n, tolerance=0)
        peer.bind(y.copy())
        peer["transition"], peer["design"], peer["state_cov"], peer["obs_cov"] = F, H, Q, R
        peer["selection"] = np.eye(n)
        peer.initialize_known(x0, P0)
        other = peer.smooth()
        found = dw.StateSpace(F, H=H, Q=Q, R=R, x0=x0, P0=P0).smooth(y[:, 0] if p == 1 else y, keep="covariance")
        np.testing.assert_allclose(found.x, other.smoothed_state.T, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.covariance, np.moveaxis(other.smoothed_state_cov, 2, 0), rtol=1e-9, atol=1e-9)


def test_irregular_time_is_that_of_the_steps():
    for seed in range(10):
        y, u, time = record(seed)
        est = continuous()
        steps = [est.given.sampled(dt) for dt in np.diff(time, prepend=time[0] - 0.1)]
        own = {name: np.array([getattr(step, name) for step in steps]) for name in "FGQ"}
        other = dw.StateSpace(np.eye(2), np.zeros((2, 1)), [1, 0], Q=1.0, R=0.2, P0=1.0)
        one, two = est.smooth(y, u, time=time), other.smooth(y, u, **own)
        np.testing.assert_allclose(one.table, two.table, rtol=1e-9, atol=1e-11)
        assert one.time.tolist() == time.tolist()


KINDS = {
    "two outputs": TWO,
    "gate and fading": TWO | dict(gate=dw.InnovationGate(3.0, settle=5), memory=dw.ExponentialForgetting(0.98)),
    "learnt scale": TWO | dict(scale=dw.models.InverseGamma(2.0, 2.0)),
    "exact": dict(F=[[1, 1], [0, 1]], H=[1, 0], Q=[0.1, 0.1], R=0.0, P0=10.0),
    "nothing moves": dict(F=[[0.0, 1.0], [-1.0, 0.0]], H=[1, 0], Q=0.0, R=1.0, P0=[1.0, 0.0]),
    "default prior": dict(F=[[1, 1], [0, 1]], H=[1, 0], Q=[0, 0.1], R=1.0),
}


def drawn(est, T=90):
    y = np.random.default_rng(4).standard_normal((T, est.model.outputs)).cumsum(axis=0)
    y[np.random.default_rng(5).random(y.shape) < 0.1] = np.nan
    return y if est.outputs else y[:, 0]


@pytest.mark.parametrize("kind", KINDS)
class TestLaws:
    def test_the_last_sample_and_lag_zero_are_the_filter(self, kind):
        est = dw.StateSpace(**KINDS[kind])
        y = drawn(est)
        trace = est.scan(y)
        np.testing.assert_allclose(est.smooth(y).table[-1], np.r_[trace.estimates[-1], trace.std[-1]], atol=1e-9)
        still = est.smooth(y, lag=0)
        np.testing.assert_allclose(still.x, trace.estimates, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(still.x_std, trace.std, rtol=1e-9, atol=1e-7)
        assert same(still.state, trace.state)

    def test_a_long_lag_is_the_interval_and_blocks_change_no_bit(self, kind, monkeypatch):
        est = dw.StateSpace(**KINDS[kind])
        y = drawn(est)
        whole, lagged = est.smooth(y), est.smooth(y, lag=3)
        np.testing.assert_allclose(est.smooth(y, lag=len(y)).x, whole.x, rtol=1e-12, atol=1e-12)
        assert same(est.smooth(y[:60], lag=3).table[:57], lagged.table[:57])
        monkeypatch.setattr(smoother, "BLOCK", 7)
        assert same(est.smooth(y).table, whole.table) and same(est.smooth(y, lag=3).table, lagged.table)

    def test_it_is_the_same_uncompiled(self, kind, monkeypatch):
        est = dw.StateSpace(**KINDS[kind])
        y = drawn(est, 30)
        whole = est.smooth(y).table
        with monkeypatch.context() as patch, np.errstate(all="ignore"):
            patch.setattr(compile, "recorder", lambda *kinds: loops.make_recorder(kinds, 0))
            patch.setattr(compile, "passage", lambda task: loops.make_passage(task, 0))
            assert same(est.smooth(y).table, whole)


def test_what_comes_before_a_lost_state_learns_nothing_from_what_follows():
    est = dw.StateSpace([[2.0]], Q=1.0, R=1.0, P0=1.0)
    y = np.r_[1.0, np.full(400, np.nan), 2.0, 3.0]
    trace, found = est.scan(y), est.smooth(y)
    assert trace.status[400] == 0 or np.isfinite(found.table).all()
    at = int(np.flatnonzero(trace.status & int(dw.Status.LOST))[0])
    assert found.x[0] == trace.estimates[0] and np.isfinite(found.table).all()
    assert found.x_std[at - 1] == pytest.approx(trace.std[at - 1])


def test_a_noisy_level_is_known_better_in_hindsight_and_bars_hold():
    rng = np.random.default_rng(7)
    level = np.cumsum(0.3 * rng.standard_normal(4000))
    est = dw.StateSpace(1.0, Q=0.09, R=1.0, P0=1.0)
    y = level + rng.standard_normal(4000)
    found, trace = est.smooth(y), est.scan(y)
    errors, before = found.x[:, 0] - level, trace.estimates[:, 0] - level
    assert np.mean(errors**2) < 0.7 * np.mean(before**2)
    assert 0.93 < np.mean(np.abs(errors) < 1.96 * found.x_std[:, 0]) < 0.97


def test_what_cannot_be_smoothed_is_a_sentence():
    with pytest.raises(dw.InputError, match="y is empty"):
        dw.StateSpace(1.0, Q=1.0, R=1.0).smooth([])
    with pytest.raises(dw.InputError, match="there is no 'speed': x1"):
        dw.StateSpace(1.0, Q=1.0, R=1.0).smooth([1.0]).of("speed")
