"""`ContinuousJoint`: closed-form filters, the posterior, predictions, clocks, and what it does on true plants."""

import importlib.util
from pathlib import Path

import mpmath
import numpy as np
import pytest
from oracle import continuous as oracle

import driftwise as dw
from driftwise.estimators.continuous_chain import decay, respond
from driftwise.models.canonical import Canonical
from driftwise.models.continuous import ContinuousModel, observer
from driftwise.workflow.laws import LAWS, example, same

C = 1.3


def problem(seed, n=2, k=1, samples=60, gaps=True, late=True):
    """Irregular instants, random y and u, gaps in both, y missing at the start."""
    rng = np.random.default_rng(seed)
    time = 5.0 + np.cumsum(rng.exponential(0.3, samples))
    y, u = rng.standard_normal(samples).cumsum() / 3, rng.standard_normal((samples, k))
    if gaps:
        y[rng.random(samples) < 0.25] = np.nan
        y[20:30] = np.nan
        u[rng.random((samples, k)) < 0.1] = np.nan
    if late:
        y[:4] = np.nan
    return time, y, u


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
    est = dw.ContinuousJoint(n, k, observer=C, noise=dw.EquationError(0.3), floor=0.0, **given)
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
        2, 1, observer=C, noise=dw.EquationError(1.0), scale=dw.UnknownScale(2.0, 0.5), floor=0.0, **given
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
    est = dw.ContinuousJoint(n, k, observer=C, noise=dw.EquationError(0.3), floor=0.0, **given)
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
    est = dw.ContinuousJoint(n, k, observer=C, noise=dw.EquationError(0.3), floor=0.0, **given)
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
    est = dw.ContinuousJoint(1, observer=1.0, noise=dw.EquationError(0.01), s0=[0.0, -5.0], P0=0.01)
    state, _ = est.update(est.start(), 2.0, time=0.0)
    state, step = est.update(state, np.nan, time=4.0)
    assert step.prediction == 2.0 and step.variance > 1e3


# --- plants ------------------------------------------------------------------------------------------------


def test_exact_recovery_where_straight_lines_are_true():
    """y that obeys the filtered equation without noise gives its parameters back, whatever the instants."""
    rng = np.random.default_rng(8)
    time = np.cumsum(rng.exponential(0.3, 200))
    u = rng.standard_normal((200, 1))
    a, b, x0 = np.array([1.1, 2.0, 0.7]), [np.array([0.5, -1.0, 2.0])], [1.0, 0.5, -2.0]
    y = oracle.own_law(C, a, b, x0, time, u, np.zeros(200))
    est = dw.ContinuousJoint(3, 1, observer=C, noise=dw.EquationError(0.0), P0=1e4)
    theta = est.scan(y, u, time=time).state["theta"]
    np.testing.assert_allclose(theta, [*a, *b[0]], rtol=1e-9)


def test_error_of_the_straight_lines_is_of_second_order():
    """A true plant without noise: half the interval, a quarter of the error."""
    errors = []
    for halving in range(4):
        gap = 0.4 / 2**halving
        rng = np.random.default_rng(9)
        steps = np.repeat(0.4 * (1 + 0.5 * rng.uniform(-1, 1, 100)), 2**halving) / 2**halving
        time = np.cumsum(steps)
        u = np.repeat(rng.standard_normal(100), 2**halving)
        y, u = dw.simulate_continuous([0.6, 1.0], [0.0, 1.0], time=time, u=u)
        est = dw.ContinuousJoint(2, 1, observer=0.8, dt=gap, noise=dw.EquationError(1e-6), P0=1e6)
        errors.append(np.abs(est.scan(y, u, time=time).state["theta"] - [0.6, 1.0, 0.0, 1.0]).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(abs(orders[1:] - 2) < 0.25), (errors, orders)


@pytest.fixture(scope="module")
def script():
    """scripts/continuous_time.py, which prints the numbers of docs/continuous.md."""
    path = Path(__file__).parent.parent / "scripts" / "continuous_time.py"
    spec = importlib.util.spec_from_file_location("continuous_time", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_jitter(script):
    """a = (.3, 1), noise .005, 400 steps jittered by 0, 50 and 90 percent, 20 seeds.

    Jitter costs little here; the discrete form, which takes every step for the same, loses the plant.
    """
    found = script.jitter(rates=(0.2,))
    assert all(ours < 0.011 for ours, _ in found.values()), found
    assert found[0.9][0] < 2 * found[0.0][0]
    assert found[0.0][1] < 0.04 and found[0.5][1] > 0.2 and found[0.9][1] > 0.6, found


def test_the_printed_equation_is_not_a_filter(script):
    """Theorem 3 converges, the Ito form to it; equation (9) as printed goes to something that is no covariance."""
    found = script.compare()
    steps = sorted(found)
    limit = found[steps[-1]]["theorem 3, exact"]

    def away(form, k):
        s, P = found[steps[k]][form]
        return max(np.abs(s - limit[0]).max(), np.abs(P - limit[1]).max())

    assert away("Ito form", 2) < 0.005 < 0.02 < away("Ito form", 0)
    assert away("theorem 3, exact", 1) < 0.02 < away("theorem 3, exact", 0)
    for k in range(3):
        s, P = found[steps[k]]["(9) as printed"]
        assert np.linalg.eigvalsh(P)[0] < -0.03
        assert s[0] * limit[0][0] < 0
        assert away("(9) as printed", k) > 0.2


def test_measurement_noise_biases_a():
    """The known weakness, by its law: noise on y enters the regressors, and the bias grows with its variance."""
    time = 0.1 * np.arange(2000)
    bias = []
    for noise in (0.02, 0.04):
        found = []
        for seed in range(30):
            y, u = dw.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, noise_std=noise, seed=seed)
            est = dw.ContinuousJoint(2, 1, dt=0.1, observer=6.0).scaled_to(y, u)
            clean = dw.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, seed=seed)[0]
            state, ideal = (est.scan(r, u, keep="innovations").state["theta"][:2] for r in (y, clean))
            found.append(state - ideal)
        bias.append(np.linalg.norm(np.mean(found, axis=0)))
    assert bias[0] > 0.005 and 2.5 < bias[1] / bias[0] < 5.5, bias


def nees(noise, seeds, samples=150, c=1.0, draws=0):
    """NEES per dimension of theta at the end, truth drawn from the prior, data from exactly the filtered equation.

    With ``draws``, of the posterior weighted by the slopes 1 - g_k(a) of the residuals, which a regression leaves out.
    """
    s0 = np.array([0.0, 0.0, 0.8, 1.0, 0.0, 1.0])
    P0 = np.diag([1.0, 1.0, 0.04, 0.04, 0.25, 0.25])
    back = Canonical(2, 1).salut
    est = dw.ContinuousJoint(
        2, 1, observer=c, noise=dw.EquationError(noise**2), s0=s0[back], P0=P0[np.ix_(back, back)], floor=0.0
    )
    total = 0.0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        s = s0 + np.sqrt(np.diag(P0)) * rng.standard_normal(6)
        time = np.cumsum(rng.uniform(0.05, 0.35, samples))
        u = rng.standard_normal((samples, 1))
        y = oracle.own_law(c, s[2:4], [s[4:]], s[:2], time, u, noise * rng.standard_normal(samples))
        state = est.scan(y, u, time=time, keep="innovations").state
        mean, P = est.mean(state)[back][2:], est.covariance(state)[np.ix_(back, back)][2:, 2:]
        if draws:
            theta = rng.multivariate_normal(mean, P, draws)
            own = oracle.regression(c, 2, time, y, u)[2]
            log = np.log(np.abs(1 - (np.array([2 * c, c * c]) - theta[:, :2]) @ own.T)).sum(axis=1)
            weight = np.exp(log - log.max())
            mean, P = np.average(theta, axis=0, weights=weight), np.cov(theta.T, aweights=weight)
        away = mean - s[2:]
        total += away @ np.linalg.solve(P, away) / 4
    return total / seeds


@pytest.mark.slow
def test_error_bars_under_the_models_own_law():
    """200 seeds, 4 dimensions: the standard deviation of the mean is sqrt(2 / 800) = .05, so .1 is two of them."""
    assert 0.9 < nees(0.01, 200) < 1.1


@pytest.mark.slow
def test_error_bars_in_strong_noise_lack_one_factor():
    """Too narrow by what y_k on both sides costs: with the slopes of the residuals as weights they are right again."""
    assert nees(0.2, 200) > 1.3
    assert 0.85 < nees(0.2, 200, draws=4000) < 1.15


def test_on_sensor_noise_the_slopes_would_overshoot():
    """Why the factor prod w_k(a) is left out: to first order it moves a by P sum grad log w_k, past the truth."""
    gap, n, c, bias, shift = 0.1, 2, 5.0, [], []
    time, lam = gap * np.arange(1000), np.poly(np.full(2, -5.0))[1:]
    own = oracle.interval(oracle.companion(lam), np.eye(n, 1), gap).rise[:, 0]
    est = dw.ContinuousJoint(n, 1, observer=c, dt=gap)
    for seed in range(10):
        (y, u), (clean, _) = (
            dw.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, noise_std=s, seed=seed) for s in (0.05, 0.0)
        )
        state, ideal = (est.scan(r, u, keep="innovations").state for r in (y, clean))
        bias.append((state["theta"] - ideal["theta"])[0])
        w = 1 - (lam - state["theta"][:n]) @ own
        shift.append((est.model_of(state).covariance[:n, :n] @ own / w * len(y))[0])
    bias, shift = np.mean(bias), np.mean(shift)
    assert bias < -0.01 and bias + shift > 2 * abs(bias)


def test_words_of_a_run():
    time = np.cumsum(np.random.default_rng(0).uniform(0.05, 0.15, 600))
    y, u = dw.simulate_continuous([2.0], [4.0], time=time, noise_std=0.002, seed=3)
    words = dw.ContinuousJoint(1, 1).scaled_to(y, u, time=time).scan(y, u, time=time).summary().words
    assert "time constant 0.5" in words or "time constant 0.49" in words
    assert "Steady-state gain 2" in words or "Steady-state gain 1.99" in words


# --- clocks, doors, laws -----------------------------------------------------------------------------------

ESTIMATORS = {
    "default": dw.ContinuousJoint(2, 1),
    "no input": dw.ContinuousJoint(3, observer=2.0),
    "two inputs, walk, gate": dw.ContinuousJoint(
        1, 2, dt=0.1, noise=dw.EquationError(0.01), memory=dw.Walk(1e-4), gate=dw.Gate(), P0=100.0
    ),
    "exact": dw.ContinuousJoint(2, 1, noise=dw.EquationError(0.0), P0=100.0),
}


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", ESTIMATORS)
def test_law(name, law):
    law(ESTIMATORS[name], *example(ESTIMATORS[name]))


def test_time_stamps_one_by_one_in_halves_and_as_a_fleet():
    time, y, u = problem(11)
    est = dw.ContinuousJoint(2, 1, observer=C, memory=dw.Walk(1e-3), gate=dw.Gate())
    whole = est.scan(y, u, time=time)
    state = est.start()
    for t in range(len(y)):
        state, _ = est.update(state, y[t], u[t], time=time[t])
    assert same(state, whole.state)
    first = est.scan(y[:33], u[:33], time=time[:33])
    second = est.scan(y[33:], u[33:], time=time[33:], state=first.state)
    assert same(second.state, whole.state) and same(np.r_[first.outs, second.outs], whole.outs)
    states, _ = est.tick(est.start(2), np.stack([y, y]), np.stack([u, u]), time=np.stack([time, time + 7.0]))
    assert same(states[0], whole.state)
    np.testing.assert_allclose(states[1]["theta"], whole.state["theta"], rtol=1e-8)
    assert same(whole.time, time)


def test_dt_is_the_clock_without_stamps():
    y, u = example(ESTIMATORS["default"])
    est = dw.ContinuousJoint(2, 1, dt=0.25)
    plain, stamped = est.scan(y, u), est.scan(y, u, time=0.25 * np.arange(len(y)))
    np.testing.assert_array_equal(plain.time, stamped.time)
    assert same(plain.outs, stamped.outs)


def test_a_walk_goes_by_the_second():
    """Ten empty samples within a second widen as much as one second does, and never beyond the prior."""
    est = dw.ContinuousJoint(1, 1, observer=1.0, noise=dw.EquationError(0.01), memory=dw.Walk(1e-3), P0=2.0)
    y, u = dw.simulate_continuous([1.0], [1.0], time=np.arange(50) * 0.3)
    state = est.scan(y, u, time=np.arange(50) * 0.3).state
    one, _ = est.update(state, np.nan, 0.0, time=15.7)
    many = state
    for t in np.linspace(14.8, 15.7, 10):
        many, _ = est.update(many, np.nan, 0.0, time=t)
    np.testing.assert_allclose(est.covariance(one), est.covariance(many), rtol=1e-12, atol=1e-15)
    seconds = 15.7 - 49 * 0.3
    widened = np.diag(est.covariance(one) - est.covariance(state))[1:]
    np.testing.assert_allclose(widened, 1e-3 * seconds, rtol=1e-9)
    late, step = est.update(state, np.nan, 0.0, time=1e6)
    assert step.status & dw.Status.CAPPED
    np.testing.assert_allclose(np.diag(est.covariance(late))[1:], 2.0, rtol=1e-9)


def test_an_outlier_is_passed_by():
    time, y, u = problem(12, gaps=False, late=False)
    y = oracle.own_law(C, [1.0, 2.0], [[0.0, 1.0]], [0, 0], time, u, np.zeros(60))
    est = dw.ContinuousJoint(2, 1, observer=C, noise=dw.EquationError(1e-4), gate=dw.Gate(6.0, settle=20))
    spoiled, gap = y.copy(), y.copy()
    spoiled[40], gap[40] = 1e3, np.nan
    a, b = est.scan(spoiled, u, time=time), est.scan(gap, u, time=time)
    assert a.status[40] & dw.Status.REJECTED
    assert same(a.parameters, b.parameters)


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda t: np.r_[t[:5], t[3], t[6:]], r"time\[5\].*unsorted"),
        (lambda t: np.r_[t[:5], t[4], t[6:]], r"time\[5\] = .* repeats .*clock too coarse"),
        (lambda t: np.r_[t[:5], np.nan, t[6:]], r"time\[5\] is nan"),
        (lambda t: t[:-1], "one instant per sample"),
        (lambda t: ["noon"] * len(t), "turn dates into seconds"),
    ],
)
def test_bad_time_stamps_are_named(change, words):
    time, y, u = problem(13)
    with pytest.raises(dw.InputError, match=words):
        dw.ContinuousJoint(2, 1).scan(y, u, time=change(time))


def test_a_stream_does_not_go_back():
    est = dw.ContinuousJoint(1)
    state, _ = est.update(est.start(), 1.0, time=10.0)
    for time in (10.0, 9.0):
        with pytest.raises(dw.InputError, match="not after the state's last sample at 10 s"):
            est.update(state, 1.0, time=time)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(observer=0.0), "observer must be a positive"),
        (dict(noise=dw.OutputError()), "noise must be EquationError"),
        (dict(memory=0.98), "memory must be Never"),
        (dict(order=13), "order must be at most 12"),
        (dict(dt=-1.0), "dt must be a positive"),
    ],
)
def test_bad_options_are_named(options, words):
    with pytest.raises(dw.InputError, match=words):
        dw.ContinuousJoint(**{"order": 2, **options})


def test_save_and_load(tmp_path):
    time, y, u = problem(14)
    est = dw.ContinuousJoint(2, 1, observer=C, memory=dw.Walk(1e-3))
    trace = est.scan(y, u, time=time)
    trace.save(tmp_path / "run.npz")
    back = dw.Trace.load(tmp_path / "run.npz")
    assert type(back.estimator) is type(est) and same(back.estimator.spec, est.spec)
    assert same(back.outs, trace.outs) and same(back.time, time)
    dw.save_state(est, trace.state, tmp_path / "s.json")
    other, state = dw.load_state(tmp_path / "s.json")
    a, b = (e.update(s, 1.0, 0.5, time=time[-1] + 1) for e, s in ((est, trace.state), (other, state)))
    assert same(a[0], b[0])


# --- the model ---------------------------------------------------------------------------------------------


def test_model():
    from scipy import signal

    model = ContinuousModel(Canonical(2, 1), np.array([0.3, 1.0, 0.5, 2.0]), np.diag([1e-6, 4e-6, 1e-6, 1e-6]))
    A, B, Cm, D = model.to_scipy()
    assert isinstance(signal.lti(A, B, Cm, D), signal.StateSpace)
    np.testing.assert_allclose(
        sorted(model.poles, key=lambda p: p.imag), sorted(np.roots([1, 0.3, 1.0]), key=lambda p: p.imag)
    )
    assert model.is_stable and model.dc_gain == pytest.approx([2.0])
    for w in (0.3, 1.7):
        p = 1j * w
        expected = (0.5 * p + 2) / (p * p + 0.3 * p + 1)
        assert model.frequency_response(w)[0][0, 0] == pytest.approx(expected, rel=1e-12)
        assert (Cm @ np.linalg.solve(p * np.eye(2) - A, B) + D)[0, 0] == pytest.approx(expected, rel=1e-12)
    rng = np.random.default_rng(0)
    draws = model.values + rng.standard_normal((4000, 4)) * np.sqrt(np.diag(model.covariance))
    poles = np.array([ContinuousModel(model.form, d, model.covariance).poles[0] for d in draws])
    spread = np.cov(np.stack([poles.real, poles.imag]))
    np.testing.assert_allclose(np.diag(model.poles_covariance[0]), np.diag(spread), rtol=0.08)
    assert np.std(draws[:, 3] / draws[:, 1]) == pytest.approx(model.dc_gain_std[0], rel=0.05)


def test_model_to_control():
    control = pytest.importorskip("control")
    model = ContinuousModel(Canonical(1, 1), np.array([2.0, 3.0]), np.eye(2))
    system = model.to_control()
    assert system.isctime() and control.dcgain(system) == pytest.approx(1.5)
    with pytest.raises(dw.InputError, match="no input"):
        ContinuousModel(Canonical(1), np.array([2.0]), np.eye(1)).to_control()


def test_trace_gives_continuous_models():
    time, y, u = problem(15)
    est = dw.ContinuousJoint(2, 1, observer=C)
    trace = est.scan(y, u, time=time)
    assert isinstance(trace.model(), ContinuousModel) and isinstance(trace.model(30), ContinuousModel)
    np.testing.assert_array_equal(trace.model(30).values, trace.parameters[30])


def test_simulation_is_the_exact_plant():
    """Held inputs, any instants: against scipy's lsim on a grid that contains them."""
    from scipy import signal

    grid = np.arange(0, 200) * 0.05
    at = np.array([0, 3, 4, 20, 33, 80, 81, 150, 199])
    u = np.random.default_rng(1).standard_normal(len(at))
    fine = np.repeat(u, np.diff(np.append(at, 200)))
    A, B, Cm, D = ContinuousModel(Canonical(2, 1), np.array([0.3, 1.0, 0.5, 2.0]), np.eye(4)).to_scipy()
    Ad, Bd, *_ = signal.cont2discrete((A, B, Cm, D), 0.05)
    x, expected = np.array([1.0, -1.0]), []
    for value in fine:
        expected.append(x[0])
        x = Ad @ x + Bd[:, 0] * value
    y, _ = dw.simulate_continuous([0.3, 1.0], [0.5, 2.0], time=grid[at], u=u, x0=[1.0, -1.0])
    np.testing.assert_allclose(y, np.array(expected)[at], rtol=1e-9, atol=1e-12)
    with pytest.raises(dw.InputError, match="increasing"):
        dw.simulate_continuous([1.0], time=[0.0, 0.0])
