"""Smoothing against oracles of another kind: exact rationals, the stacked joint Gaussian, Monte Carlo."""

import numpy as np
import pytest
from oracle import dense, golden
from test_golden import joint as golden_joint
from test_joint_vs_dense import covariance, noise_of

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.engine import compile, loops
from driftwise.estimators.joint import smoother


def test_exact_rationals():
    given, expected, tolerance = golden.case("G11")
    est = golden_joint(given)
    smoothed = est.smooth(given["y"], given["u"], keep="covariance")
    order = est.model.salut
    golden.assert_close(smoothed.table[:, : est.model.N][:, order], expected["s"], tolerance)
    golden.assert_close(smoothed.covariance[:, order][:, :, order], expected["P"], tolerance)


def stacked(st, noise, s, P, y, u):
    """Smoothed moments by conditioning one Gaussian of all states on all outputs: no recursion backwards.

    Given the data before it, s(t+1) = A s(t) + g + noise of covariance W, with the filter's own moments.
    """
    T, N = len(y), st.size
    Q, S, R = noise
    mean, path, block = np.zeros(N * T), np.zeros((N * T, N * T)), P
    H = [dense.row(st, u[t]) for t in range(T)]
    maps, at = [], [slice(t * N, t * N + N) for t in range(T)]
    prior = s
    for t in range(T):
        mean[at[t]], path[at[t], at[t]] = prior, block
        if y[t] == y[t]:
            kappa = S / R
            A, W, g = dense.transition(st, y[t], u[t]) - np.outer(kappa, H[t]), Q - np.outer(kappa, S), kappa * y[t]
            s, P = dense.step(st, noise, s, P, y[t], u[t])[:2]
        else:
            A = dense.transition(st, H[t] @ s, u[t])
            A -= np.outer(np.concatenate([s[st.n : 2 * st.n], np.zeros(N - st.n)]), H[t])
            s_next, P_next = dense.missing_step(st, noise, s, P, u[t])
            W, g = P_next - A @ P @ A.T, s_next - A @ s
            s, P = s_next, P_next
        maps.append(A)
        prior, block = A @ prior + g, A @ block @ A.T + W
    for t in range(T):
        cross = path[at[t], at[t]]
        for later in range(t + 1, T):
            cross = maps[later - 1] @ cross
            path[at[later], at[t]], path[at[t], at[later]] = cross, cross.T
    C = np.zeros((T, N * T))
    for t in range(T):
        C[t, at[t]] = H[t]
    seen = np.isfinite(y)
    C = C[seen]
    gain = np.linalg.solve(C @ path @ C.T + R * np.eye(len(C)), C @ path).T
    full = path - gain @ C @ path
    return (mean + gain @ (y[seen] - C @ mean)).reshape(T, N), np.array([full[at[t], at[t]] for t in range(T)])


@pytest.mark.parametrize("kind", ["equation error", "polynomial", "state covariances", "full covariances"])
@pytest.mark.parametrize("missing", [0.0, 0.25])
def test_moments_are_those_of_the_stacked_gaussian(kind, missing):
    """Means and covariances, gaps included (there both are the best linear ones given the filter's moments)."""
    rng = np.random.default_rng(5)
    st = dense.Structure(2, 2, True)
    noise, matrices = noise_of(kind, st, rng)
    s0, P0 = rng.standard_normal(st.size) * 0.3, covariance(rng, st.size)
    y, u = rng.standard_normal(14), rng.standard_normal((14, 2))
    y[rng.random(14) < missing] = np.nan
    est = dw.Joint(2, 2, True, noise=noise, s0=s0, P0=P0)
    means, covariances = stacked(st, matrices, s0, P0, y, u)
    order = est.model.salut
    smoothed = est.smooth(y, u, keep="covariance")
    golden.assert_close(smoothed.table[:, : st.size][:, order], means, 1e-9)
    golden.assert_close(smoothed.covariance[:, order][:, :, order], covariances, 1e-9)


def backwards(est, y, u):
    """Smoothed means by Rauch, Tung and Striebel with a pseudo-inverse, from the filter's own trace."""
    trace = est.scan(y, u, keep="covariance")
    N, n = est.model.N, est.model.n
    filtered, P = trace.table[:, 4 : 4 + N], trace.covariance
    state, before = est.start(), []
    for t in range(len(y)):
        before.append((np.concatenate([state["x"], state["theta"]]), est.covariance(state)))
        state, _ = est.update(state, y[t], u[t])
    back = est.model.salut
    means = [filtered[-1]]
    for t in range(len(y) - 2, -1, -1):
        s, P_next = before[t + 1][0], before[t + 1][1][np.ix_(back, back)]
        F = np.eye(N)
        F[:n, :n] = np.eye(n, k=1)
        F[:n, n : 2 * n] = -y[t] * np.eye(n)
        F[:n, 2 * n : 3 * n] = u[t] * np.eye(n)
        J = P[t] @ F.T @ np.linalg.pinv(P_next, rcond=1e-13, hermitian=True)
        means.append(filtered[t] + J @ (means[-1] - s))
    return np.array(means[::-1])


def test_means_agree_with_rauch_tung_striebel():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=60, noise_std=0.5, seed=3)
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.25), memory=dw.RandomWalk(1e-3), P0=10.0)
    smoothed = est.smooth(y, u, keep="means")
    golden.assert_close(smoothed.table, backwards(est, y, u), 1e-7)


def options():
    return [
        dict(order=2, inputs=1),
        dict(order=2, inputs=1, direct=True, noise=dw.models.OutputError(), memory=dw.RandomWalk(1e-5)),
        dict(order=3, noise=dw.models.NoisePolynomial((0.1, 0.2, -0.3))),
        dict(order=1, inputs=2, noise=dw.models.UnknownPolynomial(), gate=dw.InnovationGate()),
        dict(order=2, inputs=1, memory=dw.RestartOnChange(), scale=dw.models.InverseGamma(2.0, 1.0)),
    ]


def record(est, T=90, seed=0):
    from driftwise.analysis.laws import example

    return example(est, T, seed)


@pytest.mark.parametrize("given", options(), ids=str)
class TestLaws:
    def test_the_last_sample_and_lag_zero_are_the_filter(self, given):
        est = dw.Joint(**given)
        y, u = record(est)
        N, trace = est.model.N, est.scan(y, u)
        assert np.allclose(est.smooth(y, u).table[-1], trace.table[-1, 4:], rtol=1e-7, atol=1e-9)
        still = est.smooth(y, u, lag=0).table
        assert np.allclose(still[:, :N], trace.table[:, 4 : 4 + N], rtol=1e-7, atol=1e-9)
        free = np.ones(N, bool) if not est.model.coloured else ~np.isin(np.arange(N), [4])  # c is held at first
        assert np.allclose(still[:, N:][:, free], trace.table[:, 4 + N :][:, free], rtol=1e-6, atol=1e-9)

    def test_a_long_lag_is_the_interval_and_a_short_one_sees_no_further(self, given):
        est = dw.Joint(**given)
        y, u = record(est)
        assert np.allclose(est.smooth(y, u, lag=len(y)).table, est.smooth(y, u).table, rtol=1e-12, atol=1e-12)
        cut = 60
        part = est.smooth(y[:cut], None if u is None else u[:cut], lag=5).table
        assert same(part[: cut - 5], est.smooth(y, u, lag=5).table[: cut - 5])

    def test_blocks_and_halves_change_no_bit(self, given, monkeypatch):
        est = dw.Joint(**given)
        y, u = record(est)
        whole, lagged = est.smooth(y, u), est.smooth(y, u, lag=3)
        monkeypatch.setattr(smoother, "BLOCK", 7)
        assert same(whole.table, est.smooth(y, u).table)
        assert same(lagged.table, est.smooth(y, u, lag=3).table)
        assert same(whole.state, est.scan(y, u).state)
        first = est.scan(y[:40], None if u is None else u[:40])
        rest = est.smooth(y[40:], None if u is None else u[40:], state=first.state)
        assert same(rest.table, whole.table[40:])

    def test_compiled_equals_plain(self, given, monkeypatch):
        est = dw.Joint(**given)
        y, u = record(est, 40)
        fast = est.smooth(y, u)
        monkeypatch.setattr(compile, "recorder", lambda *kinds: loops.make_recorder(kinds, 0))
        monkeypatch.setattr(compile, "smoother", lambda form: loops.make_smoother(form, 0))
        assert np.allclose(fast.table, est.smooth(y, u).table, rtol=1e-6, atol=1e-9)

    def test_spreads_shrink_and_stay_real(self, given):
        est = dw.Joint(**given)
        y, u = record(est)
        smoothed, trace = est.smooth(y, u), est.scan(y, u)
        assert np.isfinite(smoothed.table).all()
        s2 = est.sigma2(smoothed.state)
        filtered = trace.table[:, 4 + est.model.N :]
        if not isinstance(est.scale, dw.models.InverseGamma):
            assert np.all(smoothed.table[:, est.model.N :] <= filtered * (1 + 1e-6) + 1e-6)
        assert s2 > 0


def test_a_hopelessly_wide_prior_makes_no_bar_too_short():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.3, seed=6)
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.09), P0=1e12)
    smoothed = est.smooth(y, u)
    assert np.all(smoothed.parameters_std >= 0.95 * smoothed.parameters_std[-1])
    assert np.allclose(smoothed.parameters_std[20:], smoothed.parameters_std[-1], rtol=1e-6)


@pytest.mark.parametrize("P0", [None, 1e4])
def test_a_wide_prior_costs_few_digits(P0):
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.3, seed=6)
    for noise in (dw.models.EquationError(0.09), dw.models.NoisePolynomial((0.5, -1.2), 0.09)):
        est = dw.Joint(2, 1, noise=noise, P0=P0).scaled_to(y, u)
        smoothed = est.smooth(y, u)
        assert np.allclose(smoothed.parameters, smoothed.parameters[-1], rtol=1e-6, atol=1e-6)
        assert np.allclose(smoothed.parameters_std, smoothed.parameters_std[-1], rtol=1e-4)


def test_constant_parameters_have_one_value():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.3, seed=6)
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.09), P0=10.0)
    smoothed = est.smooth(y, u)
    assert np.allclose(smoothed.parameters, est.scan(y, u).parameters[-1], rtol=1e-9, atol=1e-10)
    assert np.allclose(smoothed.parameters_std, smoothed.parameters_std[-1], rtol=1e-6)


def drifting(rng, T, walk, R, n=1):
    """Truth drawn from the prior: a starts at N(-.5, .01), b at N(1, .01), both walk."""
    a = -0.5 + 0.1 * rng.standard_normal() + np.concatenate([[0], np.cumsum(walk * rng.standard_normal(T - 1))])
    b = 1.0 + 0.1 * rng.standard_normal() + np.concatenate([[0], np.cumsum(walk * rng.standard_normal(T - 1))])
    u = rng.standard_normal(T)
    x, y, xs = rng.standard_normal(), np.empty(T), np.empty(T)
    for t in range(T):
        xs[t] = x
        y[t] = x + np.sqrt(R) * rng.standard_normal()
        x = -a[t] * y[t] + b[t] * u[t]
    return y, u, np.stack([xs, a, b], axis=1)


def test_error_bars_of_drifting_parameters():
    """200 records, truth from the prior: NEES per dimension within [.9, 1.1], and smoothing beats filtering."""
    rng, T, walk, R = np.random.default_rng(7), 120, 0.01, 0.04
    est = dw.Joint(
        1, 1, noise=dw.models.EquationError(R), memory=dw.RandomWalk(walk**2), s0=[0, -0.5, 1.0], P0=[1, 0.01, 0.01]
    )
    uncapped = est.policies[2]._replace(cap=np.full(2, 1e9))
    est.policies = (*est.policies[:2], uncapped, *est.policies[3:])
    est.spec = est.spec_of(est.policies)
    nees, error, filtered = [], [], []
    for _ in range(200):
        y, u, truth = drifting(rng, T, walk, R)
        smoothed, trace = est.smooth(y, u, keep="covariance"), est.scan(y, u)
        e = smoothed.table[:, :3] - truth
        nees.append([e[t, 1:] @ np.linalg.solve(smoothed.covariance[t, 1:, 1:], e[t, 1:]) / 2 for t in (5, 60, 100)])
        error.append(e[60, 1:])
        filtered.append(trace.parameters[60] - truth[60, 1:])
    assert 0.9 <= np.mean(nees) <= 1.1
    assert np.all(np.std(error, axis=0) < 0.9 * np.std(filtered, axis=0))


def test_bad_input():
    est = dw.Joint(1)
    with pytest.raises(dw.InputError, match="lag"):
        est.smooth([1.0, 2.0], lag=-1)
    with pytest.raises(dw.InputError, match="keep"):
        est.smooth([1.0, 2.0], keep="innovations")
    with pytest.raises(dw.InputError, match="empty"):
        est.smooth([])
    with pytest.raises(dw.InputError, match="covariance"):
        _ = est.smooth([1.0, 2.0]).covariance


@pytest.mark.parametrize("method", ["ekf", "rml", "els"])
def test_constant_parameters_have_one_value_under_unknown_noise_too(method):
    y, u = dw.simulate([-1.2, 0.5], [1.0, 0.5], d=[0.2, -0.5], samples=150, noise_std=0.3, seed=6)
    y[40:43] = np.nan
    noise = dw.models.UnknownPolynomial(d=(-0.5, 0.2), method=method, variance=0.09, radius=0.9999)
    est = dw.Joint(2, 1, True, noise=noise, P0=[0.5] * 6 + [1e-3, 1e-3, 0.5])  # C is never shrunk
    smoothed, trace = est.smooth(y, u), est.scan(y, u)
    assert np.allclose(smoothed.parameters, trace.parameters[-1], rtol=1e-7, atol=1e-9)
    assert np.allclose(smoothed.parameters_std, trace.parameters_std[-1], rtol=1e-6)


def test_nothing_is_learnt_about_x_across_a_restart():
    """Where a gap lost the state, x before it is what it was without all that followed (parameters known)."""
    y, u = dw.simulate([-1.3], [1.0], samples=30, noise_std=0.1, seed=1)
    later, v = dw.simulate([-1.3], [1.0], samples=20, noise_std=0.1, seed=2)
    gap = np.full(200, np.nan)
    y, u = np.concatenate([y, gap, later]), np.concatenate([u, np.ones(200), v])
    est = dw.Joint(1, 1, noise=dw.models.OutputError(0.01), s0=[0.0, -1.3, 1.0], P0=[1.0, 0.0, 0.0])
    lost = np.flatnonzero(est.scan(y, u).status & int(dw.Status.LOST))
    assert len(lost)
    whole, part = est.smooth(y, u), est.smooth(y[:40], u[:40])
    assert np.allclose(whole.table[:40], part.table, rtol=1e-9, atol=1e-12)
    assert not np.allclose(whole.x[lost[-1] + 1 :], est.scan(y, u).x[lost[-1] + 1 :])  # after it, the future tells
