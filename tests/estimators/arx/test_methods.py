"""Other ways from innovation to parameters: instrumental variables, stochastic gradient, adaptive observer."""

import numpy as np
import pytest
import scipy.signal

import driftwise as dw
from driftwise.analysis.laws import example

TRUTH = np.array([-1.5, 0.7, 1.0, 0.5])


def lagged(x, lag):
    return np.concatenate([np.zeros(lag), x])[: len(x)]


def plant(samples, seed, equation=(1.0,), measurement=0.0, std=0.3):
    """A(q) y = B(q) u + C(q) e, plus white noise on the measurement."""
    rng = np.random.default_rng(seed)
    u, e = rng.choice([-1.0, 1.0], samples), std * rng.standard_normal(samples)
    a = [1.0, *TRUTH[:2]]
    y = scipy.signal.lfilter([0.0, *TRUTH[2:]], a, u) + scipy.signal.lfilter(equation, a, e)
    return y + measurement * rng.standard_normal(samples), u


# --- instrumental variables --------------------------------------------------------------------------------


@pytest.mark.parametrize("p", [1.0, 0.98])
def test_equals_batch_instrumental_variables(p):
    """Fixed instruments: theta = (sum zeta phi')^-1 sum zeta y with the prior, C = M (sum zeta zeta') M'."""
    T, N = 1500, 6
    rng = np.random.default_rng(4)
    u = rng.standard_normal((T, 2))
    y = scipy.signal.lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u[:, 0]) + rng.standard_normal(T)
    memory = dw.Constant() if p == 1 else dw.ExponentialForgetting(p)
    est = dw.ARX(
        2, (2, 1), (1, 0), offset=True, method="iv", instruments="delayed", memory=memory, P0=1e3, at_rest=True
    )
    trace = est.scan(y, u)
    state = trace.state
    assert not np.any(trace.status[100:] & dw.Status.CAPPED)  # a variance held there would be another one in the end
    rest = [lagged(u[:, 0], 1), lagged(u[:, 0], 2), u[:, 1], np.ones(T)]
    phi = np.column_stack([-lagged(y, 1), -lagged(y, 2), *rest])
    zeta = np.column_stack([lagged(u[:, 0], 3), lagged(u[:, 0], 4), *rest])
    zeta[: 2 * N] = phi[: 2 * N]  # least squares first
    w = p ** np.arange(T - 1, -1, -1.0)
    M = np.linalg.inv(p**T * np.eye(N) / 1e3 + (zeta.T * w) @ phi)
    np.testing.assert_allclose(state["theta"], M @ (zeta.T @ (w * y)), rtol=0, atol=1e-10)
    C = M @ (p**T * np.eye(N) / 1e3 + (zeta.T * w) @ zeta) @ M.T / p  # the state is that of the next sample
    np.testing.assert_allclose(est.covariance(state), C, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(
    "noise", [dict(measurement=0.7, std=0.0), dict(equation=(1.0, 0.9))], ids=["on the measurement", "coloured"]
)
def test_consistent_where_least_squares_is_not(noise):
    """Mean error over 100 records of 2000 samples in units of its standard error; how often 95 % bars hold."""
    found = {"ls": [], "model": [], "delayed": []}
    for seed in range(100):
        y, u = plant(2000, seed, **noise)
        for name, rows in found.items():
            kind = dict(method="ls") if name == "ls" else dict(method="iv", instruments=name)
            trace = dw.ARX(2, 2, **kind).scaled_to(y, u).scan(y, u)
            rows.append((trace.parameters[-1] - TRUTH, trace.parameters_std[-1]))
    for name, rows in found.items():
        error, std = np.array(rows).swapaxes(0, 1)
        bias = error.mean(axis=0)
        t, inside = bias / error.std(axis=0) * 10, np.mean(abs(error) < 1.96 * std, axis=0)
        print(
            f"{name}: bias {bias.round(4)}, t {t.round(1)}, rms {np.sqrt(np.mean(error**2, 0)).round(3)}, in {inside}"
        )
        if name == "ls":
            assert np.max(abs(t)) > 20
            wrong = abs(bias[0])
        elif name == "model":  # what the start has left falls like 1/n
            assert np.max(abs(bias)) < 0.05 * max(wrong, 0.1)
        else:  # (a ratio of random sums: its mean has a tail)
            assert np.max(abs(np.median(error, axis=0))) < 0.15 * wrong


def test_bars_of_instruments_hold_under_white_noise():
    """Squared error over covariance per parameter, 200 records: 1 with standard error .05."""
    found = []
    for seed in range(200):
        y, u = plant(600, seed)
        m = dw.ARX(2, 2, method="iv").scaled_to(y, u).scan(y, u, keep="innovations").model()
        error = m.values - TRUTH
        found.append(error @ np.linalg.solve(m.covariance, error) / 4)
    print(f"per parameter {np.mean(found):.3f}")
    assert 0.85 < np.mean(found) < 1.15


def test_a_sample_without_instruments_is_skipped():
    """An input that does nothing: 1 + phi' P zeta comes near zero now and then; all stays finite."""
    rng = np.random.default_rng(0)
    y, u = scipy.signal.lfilter([1], [1, -0.9], rng.standard_normal((2, 20_000)))[0], rng.standard_normal(20_000)
    trace = dw.ARX(1, 1, method="iv", instruments="delayed", memory=dw.ExponentialForgetting(0.9), at_rest=True).scan(
        y, u
    )
    skipped = (trace.status & int(dw.Status.SKIPPED)) != 0
    assert 0 < skipped.sum() < 2000
    at = np.flatnonzero(skipped)
    assert np.array_equal(trace.parameters[at], trace.parameters[at - 1])
    assert np.isfinite(trace.table).all() and np.all(trace.parameters_std >= 0)


def test_tracks_with_a_memory():
    y, u = plant(3000, 1, measurement=0.3, std=0.0)
    more, v = plant(3000, 2, measurement=0.3, std=0.0)
    est = dw.ARX(2, 2, method="iv", memory=dw.ExponentialForgetting(0.99)).scaled_to(y, u)
    end = est.scan(np.append(y, -2 * more), np.append(u, v)).parameters[-1]  # the gain changes its sign and doubles
    np.testing.assert_allclose(end, TRUTH * [1, 1, -2, -2], atol=0.3)


def test_a_reset_of_the_gain_frees_the_instruments_too():
    """After the alarm both matrices have grown: the new plant is found soon."""
    y, u = plant(1500, 1, measurement=0.1, std=0.0)
    more, v = plant(300, 2, measurement=0.1, std=0.0)
    memory = dw.RestartOnChange(dw.PageHinkley(threshold=12.0), dw.memory.GainReset(8))
    est = dw.ARX(2, 2, method="iv", memory=memory).scaled_to(y, u)
    trace = est.scan(np.append(y, -2 * more), np.append(u, v))
    assert np.any(trace.status[1500:1520] & dw.Status.JUMP)
    np.testing.assert_allclose(trace.parameters[-1], TRUTH * [1, 1, -2, -2], atol=0.15)


# --- stochastic gradient -----------------------------------------------------------------------------------


@pytest.mark.parametrize("method, step", [("nlms", 0.5), ("nlms", 1.9), ("lms", 0.02)])
def test_equals_the_textbook(method, step):
    """w <- w + mu/(eps + x'x) e x, as every book has it, sample by sample."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal((300, 3))
    y = x @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(300)
    trace = dw.Regression(3, method=method, step=step).scan(y, x)
    w = np.zeros(3)
    for t in range(300):
        e = y[t] - w @ x[t]
        w = w + (step / (1e-3 + x[t] @ x[t]) if method == "nlms" else step) * e * x[t]
        np.testing.assert_allclose(trace.parameters[t], w, rtol=0, atol=1e-13)
        assert trace.innovation[t] == pytest.approx(e, abs=1e-13)
    assert trace.estimator.sigma2(trace.state) == pytest.approx(np.mean(trace.innovation**2), rel=0.05)


def test_a_normalised_gradient_knows_no_units():
    rng = np.random.default_rng(4)
    x, e = rng.standard_normal((300, 3)), rng.standard_normal(300)
    y = x @ [1.0, -2.0, 0.5] + 0.1 * e
    one = dw.Regression(3, method="nlms", step=0.5).scan(y, x)
    two = dw.Regression(3, method="nlms", step=0.5, y_scale=1e3, u_scale=1e3).scan(1e3 * y, 1e3 * x)
    np.testing.assert_allclose(two.parameters, one.parameters, rtol=0, atol=1e-12)


def test_a_gradient_never_runs_away():
    rng = np.random.default_rng(2)
    x = 100 * rng.standard_normal((20_000, 4))
    y = x @ np.ones(4) + rng.standard_normal(20_000)
    for kind in (dict(method="nlms", step=1.99), dict(method="lms", step=1.99)):
        trace = dw.Regression(4, **kind).scan(y, x)
        assert abs(trace.parameters - 1).max() < 2


def test_a_gradient_claims_no_accuracy(tmp_path):
    """Deviations are infinite wherever they are asked for, and nothing falls over that."""
    import matplotlib

    matplotlib.use("Agg")
    y, u = example(dw.ARX(2, 2), samples=600)
    trace = dw.ARX(2, 2, method="nlms", memory=dw.ExponentialForgetting(0.99)).scaled_to(y, u).scan(y, u)
    assert np.all(np.isinf(trace.parameters_std)) and trace.state["U"].size == 0
    summary = trace.summary()
    assert all(np.isinf(std) for *_, std in summary.parameters) and summary.unlearned == []
    assert 0.7 < summary.nis < 1.4
    assert "A second-order model" in summary.words and summary.as_dict()["parameters"][0]["std"] is None
    trace.plot()
    full = trace.estimator.scan(y, u, keep="covariance")
    assert np.all(np.isinf(full.parameters_std)) and np.isfinite(full.model().poles).all()
    trace.report(tmp_path / "page.html")


def test_a_long_filter_costs_what_it_has():
    """A thousand taps: no covariance of a million numbers."""
    rng = np.random.default_rng(3)
    u, taps = rng.standard_normal(20_000), rng.standard_normal(1000) / 30
    y = scipy.signal.lfilter(np.append(0.0, taps), [1.0], u)
    est = dw.ARX(0, 1000, method="nlms", step=1.0)
    assert est.dtype.itemsize < 8 * 3200
    trace = est.scan(y, u, keep="innovations")
    assert np.linalg.norm(trace.state["theta"] - taps) < 0.01 * np.linalg.norm(taps)


# --- adaptive observer -------------------------------------------------------------------------------------


def filtered(v, lam):
    """v(t-k)/Lambda, k = 1..n, as columns."""
    w = scipy.signal.lfilter([1.0], lam, v)
    return [lagged(w, k) for k in range(1, len(lam))]


@pytest.mark.parametrize("poles", [0.3, [0.5 + 0.3j, 0.5 - 0.3j], 0.0], ids=str)
def test_equals_the_regression_on_filtered_data(poles):
    y, u = plant(400, 1)
    est = dw.estimators.AdaptiveObserver(2, poles, 1, offset=True, P0=100.0, at_rest=True)
    state = est.scan(y, u).state
    lam = np.poly(np.broadcast_to(poles, 2)).real
    Y, U = np.column_stack(filtered(y, lam)), np.column_stack(filtered(u, lam))
    psi = np.column_stack([-Y, U, np.ones(400)])
    P = np.linalg.inv(np.eye(5) / 100 + psi.T @ psi)
    np.testing.assert_allclose(state["theta"], P @ psi.T @ (y - Y @ lam[1:]), rtol=0, atol=1e-11)
    np.testing.assert_allclose(est.covariance(state), P, rtol=1e-9, atol=1e-14)


def test_poles_at_zero_are_arx():
    est = dw.ARX(2, 2)
    y, u = example(est, samples=300)
    y[np.isnan(y)] = 0.0
    one, two = est.scan(y, u), dw.estimators.AdaptiveObserver(2, 0.0, 1).scan(y, u)
    np.testing.assert_allclose(two.prediction, one.prediction, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(two.variance, one.variance, rtol=1e-5)
    assert two.names == one.names


def test_is_the_joint_filter_with_that_noise_polynomial():
    """Asymptotically: estimates agree within a fraction of their deviation, and so do the deviations and the state."""
    lam = np.poly([0.5 + 0.3j, 0.5 - 0.3j]).real
    y, u = plant(4000, 3, equation=lam)
    est = dw.estimators.AdaptiveObserver(2, [0.5 + 0.3j, 0.5 - 0.3j], 1, at_rest=True)
    one, two = est.scan(y, u), dw.Joint(2, 1, noise=dw.models.NoisePolynomial(lam[:0:-1])).scan(y, u)
    assert np.max(abs(one.parameters[-1] - two.parameters[-1]) / two.parameters_std[-1]) < 0.05
    np.testing.assert_allclose(one.parameters_std[-1], two.parameters_std[-1], rtol=0.01)
    assert np.max(abs(one.parameters[-1] - TRUTH) / one.parameters_std[-1]) < 3
    np.testing.assert_allclose(est.state_of(one.state)[0], two.state["x"], rtol=0.01)
    biased = dw.ARX(2, 2).scan(y, u)  # (least squares takes the noise for white)
    assert np.max(abs(biased.parameters[-1] - TRUTH) / biased.parameters_std[-1]) > 8


def test_state_is_the_observers():
    """x+ = shift_up(x) - a y + b u + lambda (y - x_1) from zero, with the final parameters."""
    y, u = plant(200, 4)
    v = np.column_stack([u, np.roll(u, 3)])
    est = dw.estimators.AdaptiveObserver(3, [0.2, 0.5, -0.4], 2)
    state = est.scan(y, v).state
    a, b1, b2 = est.mean(state).reshape(3, 3)
    lam, x = np.poly([0.2, 0.5, -0.4])[1:], np.zeros(3)
    for t in range(200):
        x = np.append(x[1:], 0) - a * y[t] + b1 * v[t, 0] + b2 * v[t, 1] + lam * (y[t] - x[0])
    mean, P = est.state_of(state)
    np.testing.assert_allclose(mean, x, rtol=1e-10)
    step = 1e-6  # the covariance is that of a map linear in the parameters
    J = []
    for i in range(9):
        moved = state.copy()
        moved["theta"][i] += step
        J.append((est.state_of(moved)[0] - mean) / step)
    np.testing.assert_allclose(P, est.sigma2(state) * np.array(J).T @ est.covariance(state) @ np.array(J), rtol=1e-5)


@pytest.mark.parametrize("missing, low, high", [(0.0, 0.97, 1.03), (0.3, 0.9, 1.1)])
def test_bands_of_an_observer_hold_through_gaps(missing, low, high):
    """NIS after 300 samples, 30 records of 1500: its standard error is about .01."""
    found = []
    for seed in range(30):
        y, u = plant(1500, seed, equation=np.poly([0.5, 0.4]))
        y[np.random.default_rng(10**4 + seed).random(1500) < missing] = np.nan
        trace = dw.estimators.AdaptiveObserver(2, [0.5, 0.4], 1).scaled_to(y, u).scan(y, u, keep="innovations")
        found.append(np.nanmean(trace.innovation[300:] ** 2 / trace.variance[300:]))
    print(f"lost {missing:.0%}: NIS {np.mean(found):.3f}")
    assert low < np.mean(found) < high


def test_what_a_gap_leaves_in_the_filter():
    """The error of one predicted y runs through the filter as its impulse response does, and so does its covariance."""
    y, u = plant(104, 6)
    y[100] = np.nan
    est = dw.estimators.AdaptiveObserver(2, [0.5, -0.3], 1, at_rest=True)
    trace = est.scan(y, u)
    h = scipy.signal.lfilter([1.0], np.poly([0.5, -0.3]), [1.0, 0, 0, 0])
    left = trace.variance[100] * np.outer(h[:1:-1], h[:1:-1])
    np.testing.assert_allclose(trace.state["registers"][4:8].reshape(2, 2), left, rtol=1e-9)


def test_learning_resumes_after_a_gap():
    """With missing="skip": once what a gap left in the filter has died away."""
    y, u = plant(600, 5)
    y[300] = np.nan
    trace = dw.estimators.AdaptiveObserver(2, 0.5, 1, missing="skip", at_rest=True).scaled_to(y, u).scan(y, u)
    skipped = np.flatnonzero(trace.status & int(dw.Status.SKIPPED))
    assert skipped[0] == 301 and 303 < skipped[-1] < 340


# --- doors -------------------------------------------------------------------------------------------------

BAD = {
    "method must be one of ls, iv": lambda: dw.ARX(2, 2, method="rls"),
    'instruments must be "model" or "delayed"': lambda: dw.ARX(2, 2, method="iv", instruments="u"),
    "instruments are made of inputs": lambda: dw.AR(2, method="iv"),
    "na = 0 has none": lambda: dw.Regression(2, method="iv"),
    "with method='iv' memory must be": lambda: dw.ARX(2, 2, method="iv", memory=dw.RandomWalk(1e-4)),
    "step must lie between 0 and 2": lambda: dw.ARX(2, 2, method="nlms", step=2.0),
    "has no covariance, so P0": lambda: dw.ARX(2, 2, method="nlms", P0=1.0),
    "memory says how the variance does": lambda: dw.ARX(2, 2, method="lms", memory=dw.RandomWalk(1e-4)),
    "inside the unit circle": lambda: dw.estimators.AdaptiveObserver(2, 1.0),
    "conjugates": lambda: dw.estimators.AdaptiveObserver(2, [0.5j, 0.5]),
    "poles must be a finite number, or 2": lambda: dw.estimators.AdaptiveObserver(2, [0.5]),
}


@pytest.mark.parametrize("words", BAD)
def test_what_does_not_fit_is_said(words):
    with pytest.raises(dw.InputError, match=words):
        BAD[words]()
