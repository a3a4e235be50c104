"""`ContinuousJoint`: closed-form filters, the posterior, predictions and states, against brute force."""

import mpmath
import numpy as np
import pytest
from oracle import continuous as oracle
from oracle.continuous import problem

import driftwise as dw
from driftwise.estimators.continuous.chain import decay, respond
from driftwise.models.canonical import Canonical
from driftwise.models.continuous import observer

C = 1.3


def prior(seed, n, k):
    """A correlated prior in the order x, a, b, and the same in Salut's order."""
    N = n * (k + 2)
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((N, N))
    back = Canonical(n, k).salut
    s0, P0 = rng.standard_normal(N), root @ root.T + np.eye(N)
    return s0, P0, dict(s0=s0[back], P0=P0[np.ix_(back, back)])


# --- closed forms ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("x", [1e-12, 1e-7, 1e-3, 0.2, 1.0, 2.9, 3.0, 8.99, 9.01, 30.0, 200.0, 699.0, 1e3])
@pytest.mark.parametrize("n", [1, 3, 8])
def test_chain_response_has_all_its_digits(n, x):
    e, held, line = (np.empty(n) for _ in range(3))
    respond(x, e, held, line)
    mpmath.mp.dps = 60
    for j in range(1, n + 1):
        weight = mpmath.exp(-mpmath.mpf(x)) * mpmath.mpf(x) ** (j - 1) / mpmath.factorial(j - 1)
        P = [mpmath.gammainc(i, 0, x, regularized=True) for i in (j, j + 1)]
        expected = weight, P[0], P[0] - j * P[1] / mpmath.mpf(x)
        for got, want in zip((e[j - 1], held[j - 1], line[j - 1]), expected):
            if want < 1e-290:
                assert abs(got) < 1e-280
            else:
                assert abs(mpmath.mpf(float(got)) / want - 1) < 4e-15 * (n + 2) + 2e-16 * x * (want is weight)


def test_chain_solves_its_differential_equation():
    n, c, gap = 4, 2.5, 0.7
    e, held, line, w = (np.empty(n) for _ in range(4))
    respond(c * gap, e, held, line)
    start = np.array([0.3, -1.0, 2.0, 0.5])
    decay(e, start, w)
    A, B = c * (np.eye(n, k=-1) - np.eye(n)), c * np.eye(n, 1)
    step = oracle.interval(A, B, gap)
    np.testing.assert_allclose(
        w + 1.5 * held - 2.0 * line, step.free @ start + step.held @ [1.5] + step.rise @ [-2.0], rtol=1e-13
    )


@pytest.mark.parametrize("n", [1, 2, 5, 9])
def test_observer_is_the_resolvent_in_partial_fractions(n):
    lam, V = observer(n, C)
    np.testing.assert_allclose(lam, np.poly(np.full(n, -C))[1:], rtol=1e-12)
    for p in (0.3j, 2.0 + 1.0j, -0.4 + 3.0j):
        chain = (C / (p + C)) ** np.arange(1, n + 1)
        direct = np.linalg.inv(p * np.eye(n) - oracle.observer_matrix(lam))
        np.testing.assert_allclose(V @ chain, direct, rtol=1e-9, atol=1e-11 * abs(direct).max())


# --- the posterior -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("n, k", [(1, 0), (1, 1), (2, 1), (3, 2)])
def test_posterior_is_batch_least_squares(n, k):
    """Gaps, irregular instants, a late start: mean, covariance and evidence against exponentials and one QR."""
    time, y, u = problem(n + k, n, k)
    s0, P0, given = prior(n, n, k)
    est = dw.ContinuousJoint(n, k, observer=C, noise=dw.models.EquationError(0.3), floor=0.0, **given)
    state = est.scan(y, u if k else None, time=time).state
    H, z, own, _ = oracle.regression(C, n, time, y, u)
    mean, P = oracle.posterior(H, z, s0, P0, 0.3)
    back = est.model.salut
    got, cov = est.mean(state)[back], est.covariance(state)[np.ix_(back, back)]
    size = np.sqrt(np.diag(P))
    assert np.max(abs(got - mean) / size) < 1e-9
    assert np.max(abs(cov - P) / np.outer(size, size)) < 1e-9
    # evidence of the regression; the rest of loglik is the slope d residual / d y of each sample
    S = H @ P0 @ H.T + 0.3 * np.eye(len(z))
    e = z - H @ s0
    dense = -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(2 * np.pi * S)[1])
    lam, slopes = np.poly(np.full(n, -C))[1:], 0.0
    for i in range(len(z)):
        m, _ = oracle.posterior(H[:i], z[:i], s0, P0, 0.3)
        slopes += np.log(max(1 - (lam - m[n : 2 * n]) @ own[i], 1e-3))
    assert est.loglik(state) == pytest.approx(dense + slopes, rel=1e-9)


def test_learnt_scale_is_that_of_the_regression():
    time, y, u = problem(3)
    s0, P0, given = prior(3, 2, 1)
    est = dw.ContinuousJoint(
        2, 1, observer=C, noise=dw.models.EquationError(1.0), scale=dw.models.InverseGamma(2.0, 0.5), floor=0.0, **given
    )
    state = est.scan(y, u, time=time).state
    H, z, _, _ = oracle.regression(C, 2, time, y, u)
    mean, _ = oracle.posterior(H, z, s0, P0, 1.0)
    rest, away = z - H @ mean, mean - s0
    beta = 0.5 + 0.5 * (rest @ rest + away @ np.linalg.solve(P0, away))
    assert est.scale_posterior(state) == pytest.approx((2.0 + len(z) / 2, beta), rel=1e-9)


def test_a_missing_output_is_no_sample_at_all():
    """Rows without y change nothing but the clock of u: with u as it was they can be left out."""
    time, y, u = problem(4)
    u = np.repeat(u[::6], 6, axis=0)[: len(y)]
    u = np.where(np.isnan(u), 0.4, u)
    keep = np.isfinite(y) | (np.arange(len(y)) % 6 == 0)
    assert not keep.all()
    est = dw.ContinuousJoint(2, 1, observer=C)
    a, b = est.scan(y, u, time=time), est.scan(y[keep], u[keep], time=time[keep])
    np.testing.assert_allclose(a.parameters[keep], b.parameters, rtol=1e-8, atol=1e-10)


def test_scaled_time_scales_the_answer():
    """Milliseconds for seconds: a_i and b_i by powers of a thousand."""
    time, y, u = problem(5)
    one, two = (dw.ContinuousJoint(2, 1, dt=0.3 * g).scan(y, u, time=time * g) for g in (1.0, 1e3))
    powers = 1e3 ** np.array([1, 2, 1, 2])
    np.testing.assert_allclose(two.parameters[-1] * powers, one.parameters[-1], rtol=1e-8)
    np.testing.assert_allclose(two.prediction, one.prediction, rtol=1e-7, atol=1e-9)


# --- what is predicted and shown ---------------------------------------------------------------------------


@pytest.mark.parametrize("n, k", [(1, 1), (3, 1)])
def test_prediction_is_the_output_that_teaches_nothing(n, k):
    """Fed its own prediction, the residual is zero and the mean stays; the variance is that of the solved equation."""
    time, y, u = problem(6, n, k, late=False)
    _, _, given = prior(6, n, k)
    est = dw.ContinuousJoint(n, k, observer=C, noise=dw.models.EquationError(0.3), floor=0.0, **given)
    t = 45
    state = est.scan(y[:t], u[:t], time=time[:t]).state
    predicted = est.update(state, np.nan, u[t], time=time[t])[1]
    after, step = est.update(state, predicted.prediction, u[t], time=time[t])
    assert abs(step.innovation) < 1e-12
    np.testing.assert_allclose(after["theta"], state["theta"], rtol=0, atol=1e-11)

    # brute force: y_t as a function of s, by solving the oracle's linear equation at perturbed s
    past = np.append(y[:t], 0.0), np.append(y[:t], 1.0)
    (h0, z0), (h1, z1) = (
        (H[-1], z[-1]) for H, z, _, _ in (oracle.regression(C, n, time[: t + 1], p, u[: t + 1]) for p in past)
    )

    def solve(s):
        at_zero, at_one = z0 - h0 @ s, z1 - h1 @ s
        return -at_zero / (at_one - at_zero), at_one - at_zero

    back = est.model.salut
    m, P = est.mean(state)[back], est.covariance(state)[np.ix_(back, back)]
    yhat, w = solve(m)
    J = np.array([(solve(m + d)[0] - solve(m - d)[0]) / 2e-6 for d in 1e-6 * np.eye(len(m))])
    assert predicted.prediction == pytest.approx(yhat, rel=1e-9)
    assert predicted.variance == pytest.approx(J @ P @ J + 0.3 / w**2, rel=1e-6)


def test_states_of_the_trace():
    """x(t) at measured samples, and where y is missing: mean and covariance against the oracle's own propagation."""
    n, k = 3, 1
    time, y, u = problem(7, n, k, samples=25, gaps=False, late=False)
    _, _, given = prior(7, n, k)
    est = dw.ContinuousJoint(n, k, observer=C, noise=dw.models.EquationError(0.3), floor=0.0, **given)
    y[-1] = np.nan
    trace = est.scan(y, u, time=time, keep="covariance")
    back = est.model.salut
    for t in (len(y) - 2, len(y) - 1):
        state = est.scan(y[: t + 1], u[: t + 1], time=time[: t + 1]).state
        m, P = est.mean(state)[back], est.covariance(state)[np.ix_(back, back)]

        def x(s, v=0.0, t=t):
            a, b = s[n : 2 * n], [s[2 * n :]]
            known = y[: t + 1].copy()
            if np.isnan(known[t]):  # the output that leaves the residual v
                ends = []
                for guess in (0.0, 1.0):
                    known[t] = guess
                    ends.append(known[t] - oracle.states(C, a, b, s[:n], time[: t + 1], known, u[: t + 1])[t][0])
                known[t] = (v - ends[0]) / (ends[1] - ends[0])
            return oracle.states(C, a, b, s[:n], time[: t + 1], known, u[: t + 1])[t]

        J = np.array([(x(m + d) - x(m - d)) / 2e-6 for d in 1e-6 * np.eye(len(m))]).T
        g = (x(m, 1e-3) - x(m, -1e-3)) / 2e-3
        expected = J @ P @ J.T + 0.3 * np.outer(g, g)
        size = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(trace.x[t], x(m), rtol=1e-8, atol=1e-8)
        assert np.max(abs(trace.covariance[t][:n, :n] - expected) / np.outer(size, size)) < 1e-5
        cross = J @ P[:, n:]
        assert np.max(abs(trace.covariance[t][:n, n:] - cross)) < 1e-5 * abs(cross).max()
    std = est.scan(y, u, time=time)
    np.testing.assert_allclose(std.x_std, trace.x_std, rtol=1e-9)
    np.testing.assert_allclose(std.parameters_std, trace.parameters_std, rtol=1e-9)


def test_an_output_that_cannot_be_predicted_is_held():
    """Where the solved equation divides by nothing (an unstable mean over a long gap) the last output is predicted."""
    est = dw.ContinuousJoint(1, observer=1.0, noise=dw.models.EquationError(0.01), s0=[0.0, -5.0], P0=0.01)
    state, _ = est.update(est.start(), 2.0, time=0.0)
    state, step = est.update(state, np.nan, time=4.0)
    assert step.prediction == 2.0 and step.variance > 1e3


def test_a_doubtful_output_is_what_it_may_be_on_average():
    """The straight line from sample to sample ends between what was measured and what was predicted."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=300, noise_std=0.1, seed=1)
    est = dw.ContinuousJoint(2, 1, memory=dw.memory.AutoMemory("outliers")).scaled_to(y, u)
    before = est.scan(y[:-1], u[:-1]).state
    predicted = est.scan(y[-1:], u[-1:], state=before).prediction[0]
    ends = []
    for far in (0.1, 1.5, 1.9):  # of a deviation of .5
        state = est.scan([predicted + far], u[-1:], state=before).state
        ends.append((float(state["last"]) - predicted) / far)
    assert ends[0] == pytest.approx(1.0) and 0.1 < ends[2] < ends[1] < 0.95
