"""`ContinuousJoint` on plants: recovery, order of convergence, jitter, noise, error bars; why (9) is no filter."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from oracle import continuous as oracle

import driftwise as dw
from driftwise.models.canonical import Canonical

C = 1.3


# --- plants ------------------------------------------------------------------------------------------------


def test_exact_recovery_where_straight_lines_are_true():
    """y that obeys the filtered equation without noise gives its parameters back, whatever the instants."""
    rng = np.random.default_rng(8)
    time = np.cumsum(rng.exponential(0.3, 200))
    u = rng.standard_normal((200, 1))
    a, b, x0 = np.array([1.1, 2.0, 0.7]), [np.array([0.5, -1.0, 2.0])], [1.0, 0.5, -2.0]
    y = oracle.own_law(C, a, b, x0, time, u, np.zeros(200))
    est = dw.ContinuousJoint(3, 1, observer=C, noise=dw.models.EquationError(0.0), P0=1e4)
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
        y, u = dw.models.simulate_continuous([0.6, 1.0], [0.0, 1.0], time=time, u=u)
        est = dw.ContinuousJoint(2, 1, observer=0.8, dt=gap, noise=dw.models.EquationError(1e-6), P0=1e6)
        errors.append(np.abs(est.scan(y, u, time=time).state["theta"] - [0.6, 1.0, 0.0, 1.0]).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(abs(orders[1:] - 2) < 0.25), (errors, orders)


@pytest.fixture(scope="module")
def script():
    """scripts/continuous_time.py, which prints the numbers of docs/continuous.md."""
    path = Path(__file__).parents[3] / "scripts" / "continuous_time.py"
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
            y, u = dw.models.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, noise_std=noise, seed=seed)
            est = dw.ContinuousJoint(2, 1, dt=0.1, observer=6.0).scaled_to(y, u)
            clean = dw.models.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, seed=seed)[0]
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
        2, 1, observer=c, noise=dw.models.EquationError(noise**2), s0=s0[back], P0=P0[np.ix_(back, back)], floor=0.0
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
            dw.models.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, noise_std=s, seed=seed)
            for s in (0.05, 0.0)
        )
        state, ideal = (est.scan(r, u, keep="innovations").state for r in (y, clean))
        bias.append((state["theta"] - ideal["theta"])[0])
        w = 1 - (lam - state["theta"][:n]) @ own
        shift.append((est.model_of(state).covariance[:n, :n] @ own / w * len(y))[0])
    bias, shift = np.mean(bias), np.mean(shift)
    assert bias < -0.01 and bias + shift > 2 * abs(bias)
