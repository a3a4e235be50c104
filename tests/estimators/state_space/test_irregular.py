"""Samples at any instants: a differential equation, functions of dt, matrices of every sample; all say the same."""

from functools import lru_cache

import numpy as np
import pytest
import scipy.linalg

import driftwise as dw
from driftwise.analysis.laws import same

A, B, H, W = (
    np.array([[0.0, 1.0], [-4.0, -0.4]]),
    np.array([[0.0], [2.0]]),
    [1.0, 0.0],
    np.array([[0.1, 0.02], [0.02, 0.3]]),
)


def step_of(seconds):
    """Return F, G and Q over a step: exponentials of the input held, and the integral by Gauss-Legendre points."""
    return _step_of(round(float(seconds), 13))


@lru_cache
def _step_of(seconds):
    F = scipy.linalg.expm(A * seconds)
    points, weights = np.polynomial.legendre.leggauss(40)
    at = 0.5 * seconds * (points + 1)
    G = sum(0.5 * seconds * w * scipy.linalg.expm(A * r) @ B for r, w in zip(at, weights))
    E = [scipy.linalg.expm(A * r) for r in at]
    return F, G, sum(0.5 * seconds * w * M @ W @ M.T for M, w in zip(E, weights))


def record(seed, T=60):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice([0.1, 0.1, 0.3, 0.01, 1.7], T))
    y, u = rng.standard_normal(T), rng.standard_normal(T)
    y[rng.random(T) < 0.2] = np.nan
    return y, u, time


def continuous(**more):
    return dw.StateSpace(A, B, H, Q=W, R=0.2, P0=1.0, dt=0.1, continuous=True, **more)


def test_a_differential_equation_is_the_discrete_filter_of_each_step():
    for seed in range(20):
        y, u, time = record(seed)
        steps = [step_of(dt) for dt in np.diff(time, prepend=time[0] - 0.1)]
        F, G, Q = (np.array(M) for M in zip(*steps))
        est = continuous()
        one = est.scan(y, u, time=time)
        other = dw.StateSpace(np.eye(2), B, H, Q=1.0, R=0.2, P0=1.0).scan(y, u, F=F, G=G, Q=Q, time=time)
        np.testing.assert_allclose(one.estimates, other.estimates, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(one.std, other.std, rtol=1e-9)
        assert est.loglik(one.state) == pytest.approx(other.log_density.sum(), rel=1e-9)


def test_functions_of_dt_are_the_same_and_stream_as_they_run():
    y, u, time = record(1)
    est = dw.StateSpace(
        lambda dt: step_of(dt)[0], lambda dt: step_of(dt)[1], H, Q=lambda dt: step_of(dt)[2], R=0.2, P0=1.0, dt=0.1
    )
    trace = est.scan(y, u, time=time)
    np.testing.assert_allclose(trace.estimates, continuous().scan(y, u, time=time).estimates, rtol=1e-9, atol=1e-11)
    state = est.start()
    for t in range(len(y)):
        state, _ = est.update(state, y[t], u[t], time=time[t])
    assert same(state, trace.state)
    with pytest.raises(dw.InputError, match="a fleet goes by instants where continuous=True"):
        est.update_batch(est.start(2), y[:2], u[:2], time=time[:2])


def test_instants_of_regular_samples_change_no_bit_and_a_stream_is_a_record_is_a_fleet():
    y, u, time = record(2)
    est = continuous(memory=dw.ExponentialForgetting(0.99), detector=dw.PageHinkley())
    assert same(est.replace(dt=0.125).scan(y, u, time=np.arange(60) / 8).state, est.replace(dt=0.125).scan(y, u).state)
    trace, state = est.scan(y, u, time=time), est.start()
    for t in range(len(y)):
        state, _ = est.update(state, y[t], u[t], time=time[t])
    assert same(state, trace.state)
    states, _ = est.update_batch(est.start(2), np.array([y, y]), np.array([u, u]), time=np.array([time, time]))
    assert same(states[1], trace.state)
    half = est.scan(y[:30], u[:30], time=time[:30])
    assert same(est.scan(y[30:], u[30:], time=time[30:], state=half.state).state, trace.state)


def test_two_measurements_at_one_instant_are_one_of_both():
    est = dw.StateSpace(A, H=H, Q=W, R=0.2, P0=1.0, dt=0.1, continuous=True)
    both = dw.StateSpace(A, H=[H, H], Q=W, R=0.2, P0=1.0, dt=0.1, continuous=True)
    y = np.random.default_rng(3).standard_normal((30, 2))
    one = est.scan(y.ravel(), time=np.repeat(0.3 * np.arange(30), 2)).estimates[1::2]
    np.testing.assert_allclose(one, both.scan(y, time=0.3 * np.arange(30)).estimates, rtol=1e-9, atol=1e-12)


def test_measured_rows_of_a_sample_go_with_steps_of_any_length():
    y, u, time = record(4)
    rows = np.tile([[[1.0, 0.0]]], (60, 1, 1))
    one, other = continuous().scan(y, u, time=time), continuous().scan(y, u, time=time, H=rows)
    np.testing.assert_allclose(one.estimates, other.estimates, rtol=1e-9, atol=1e-12)


def test_a_stiff_step_is_no_overflow():
    est = dw.StateSpace([[-1e4, 0], [1, 0]], H=[0, 1], Q=[1, 0.1], R=1.0, P0=1.0, dt=1.0, continuous=True)
    trace = est.scan(np.ones(5), time=[0, 1, 3, 1000, 1000.5])
    assert np.isfinite(trace.estimates).all() and np.isfinite(trace.std).all()
    assert trace.std[-1, 0] == pytest.approx(np.sqrt(1 / 2e4), rel=1e-3)


def test_instants_that_do_not_fit_are_a_sentence():
    with pytest.raises(dw.InputError, match="time must step by dt"):
        dw.StateSpace(1.0, Q=1.0, R=1.0).scan([1.0, 2.0, 3.0], time=[0, 1, 3])
    with pytest.raises(dw.InputError, match="time must increase"):
        continuous().scan([1.0, 2.0], [0.0, 0.0], time=[1.0, 0.5])
    with pytest.raises(dw.InputError, match="which are no functions of dt"):
        dw.StateSpace(lambda dt: A, H=H, Q=W, R=0.2, continuous=True)
