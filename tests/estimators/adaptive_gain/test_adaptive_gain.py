"""The adaptive gain against golden cases, dense recursions in plain NumPy, and the plates of 1981."""

import json
from pathlib import Path

import numpy as np
import pytest
from gains_followed import PHI, SLOW, records, run
from scipy.linalg import solve_discrete_are
from scipy.signal import lfilter

import driftwise as dw
from driftwise.engine.status import PROJECTED
from driftwise.models import gain as gains

CASES = {c["name"]: c for c in json.loads((Path(__file__).parents[2] / "golden" / "perriot.json").read_text())["cases"]}
PRIOR = dw.models.InverseGamma(2.5, 2.5)
TRACKER = np.array([[1.0, 1.0], [0.0, 1.0]])


def k_mse(est, y, K):
    return 1000 * (run(est, y)[0] - K) ** 2


# --- exact ---------------------------------------------------------------------------------------------------


def test_golden_hampton():
    case = CASES["hampton_as_engine"]
    given, expected = case["input"], case["expected"]
    plain = dict(method="plr", memory=dw.Constant(), limits=None, x0=0.0)
    trace = dw.AdaptiveGain(given["Phi"], K0=given["K0"], P0=given["R0"], **plain).scan(given["y"])
    np.testing.assert_allclose(trace.parameters[:, 0], expected["K"], rtol=1e-10)
    np.testing.assert_allclose(trace.innovation, expected["eps"], rtol=1e-10)


def test_golden_mean_field():
    case = CASES["hampton_theory"]
    given, expected = case["input"], case["expected"]
    K = np.array(given["K"])
    Q = gains.noise_of_gain(np.array(given["K_opt"]), given["Phi"], given["R"])
    np.testing.assert_allclose(Q, expected["Q"], rtol=1e-10)
    np.testing.assert_allclose(gains.error_variance(K, given["Phi"], Q, given["R"]), expected["P"], rtol=1e-10)
    np.testing.assert_allclose(gains.mean_pull(K, given["Phi"], Q, given["R"]), expected["meanZ"], rtol=1e-10)


def directly(y, score, gain, K, R=1.0, limits=(0.0, 1.0)):
    """Hampton's recursion as printed in the corrected theory: R before K, f = Phi nu or its full gradient."""
    xp = nu = psi = 0.0
    found, weight = np.empty(len(y)), 1.0
    for t in range(len(y)):
        f, nu = psi if score else PHI * nu, y[t] - xp
        if t:
            g, weight = gain(weight)
            R += g * (f * f - R)
            K = np.clip(K + g / R * f * nu, *limits)
        found[t], psi, xp = K, PHI * (1 - K) * psi + PHI * nu, PHI * (xp + K * nu)
    return found


def decreasing(weight):
    return 1 / (weight + 1), weight + 1


def weighted(weight):
    return 1 / (0.98 * weight + 1), 0.98 * weight + 1


@pytest.mark.parametrize("method", ["plr", "rpem"])
@pytest.mark.parametrize("memory, gain", [(dw.Constant(), decreasing), (dw.ExponentialForgetting(0.98), weighted)])
def test_equals_the_direct_recursion_over_20000_samples(method, memory, gain):
    y = records(1, seed=3, segment=5000)[1][0]
    # P0 is 1/R before it has been divided by p: the first forgetting comes after the first lesson here
    est = dw.AdaptiveGain(
        PHI, method=method, memory=memory, K0=0.2, x0=0.0, P0=[1.0] if gain is decreasing else [1 / 0.98]
    )
    found = est.scan(y, keep="means").parameters[:, 0]
    np.testing.assert_allclose(found, directly(y, method == "rpem", gain, 0.2), atol=1e-12)


def test_rpem_equals_the_general_engine():
    """The general engine, written out: F, G, H, K, C of Hampton, theta before the update in state and gradient."""
    F, G, H = np.array([[PHI, 0], [-1, 0]]), np.array([PHI, -1.0]), np.array([0, PHI])
    y = records(1, levels=(0.3,), seed=5, segment=2000)[1][0]
    x, W, K, R, C = np.zeros(2), np.zeros(2), 0.3, 200.0, np.array([1.0, 0])
    expected = np.empty(len(y))
    for t in range(len(y)):
        nu = H @ x
        eps, psi = y[t] - C @ x - K * nu, (C + K * H) @ W + nu
        R, before = R + psi * psi, K
        K += psi * eps / R
        W = (F + before * np.outer(G, H)) @ W + G * nu
        x = F @ x + G * before * nu + np.array([0, 1.0]) * y[t]
        expected[t] = K
    est = dw.AdaptiveGain(PHI, memory=dw.Constant(), K0=0.3, P0=1 / 200, x0=0.0, limits=None)
    np.testing.assert_allclose(est.scan(y).parameters[:, 0], expected, atol=1e-12)


def dense(y, Phi, H, q, K, P, c, count, wait, memory=100):
    """The random-walk gain for any number of states in plain matrices: variance within the prior, poles halved in."""
    n, cap = len(H), np.diag(P).copy()
    x, W, found = np.zeros(n), np.zeros((n, n)), np.empty((len(y), n))
    for t in range(len(y)):
        if np.isnan(y[t]):
            found[t] = K
        else:
            e, psi = y[t] - H @ x, H @ W
            if count >= wait and np.any(psi):
                T = psi @ P @ psi + c
                K, old = K + P @ psi * e / T, K
                P = P - np.outer(P @ psi, P @ psi) / T
                while max(abs(np.linalg.eigvals(Phi - Phi @ np.outer(K, H)))) >= 1 - 1e-3:
                    K = (K + old) / 2
            c, count = c + max(1 / memory, 1 / (count + 1)) * (e * e - c), count + 1
            W = W - np.outer(K, H @ W) + e * np.eye(n)
            x = x + K * e
            found[t] = K
        x, W = Phi @ x, Phi @ W
        P = P + np.diag(np.minimum(q, np.maximum(cap - np.diag(P), 0)))
    return found, x, P, c


def tracked(samples, q=0.01, seed=0, runs=1):
    """States (T, 2) and output of a constant-velocity target."""
    rng = np.random.default_rng(seed)
    L = np.linalg.cholesky(q * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]]))
    x = np.zeros((samples, 2))
    for t in range(1, samples):
        x[t] = TRACKER @ x[t - 1] + L @ rng.standard_normal(2)
    return x, x[:, 0] + rng.standard_normal(samples)


@pytest.mark.parametrize("scale", [None, dw.models.InverseGamma(2.5, 5.0)])
def test_walk_equals_the_dense_recursion(scale):
    _, y = tracked(500)
    y[[100, 101, 250]] = np.nan
    P0 = np.array([[0.3, 0.05], [0.05, 0.1]])
    est = dw.AdaptiveGain(TRACKER, memory=dw.RandomWalk([1e-3, 1e-4]), K0=[0.4, 0.1], P0=P0, x0=[0.0, 0.0], scale=scale)
    expected, x, P, c = dense(
        y, TRACKER, np.array([1.0, 0]), np.array([1e-3, 1e-4]), np.array([0.4, 0.1]), P0,
        *((0.0, 0.0, 5) if scale is None else (2.0, 5.0, 0)),
    )  # fmt: skip
    trace = est.scan(y)
    assert np.any(trace.status & dw.Status.PROJECTED)  # the halving is part of what is compared
    np.testing.assert_allclose(trace.parameters, expected, atol=1e-12)
    np.testing.assert_allclose(trace.state["x"], x, atol=1e-10)
    np.testing.assert_allclose(est.covariance(trace.state)[2:, 2:], P, atol=1e-12)
    assert est.sigma2(trace.state) == pytest.approx(c, rel=1e-12)


def test_gradient_of_the_state_against_central_differences():
    _, y = tracked(60)
    fixed = dict(memory=dw.RandomWalk(0.0), P0=0.0, x0=[0.0, 0.0])
    W = dw.AdaptiveGain(TRACKER, K0=[0.4, 0.1], **fixed).scan(y).state["W"]
    h = 1e-5
    for i, step in enumerate(h * np.eye(2)):
        up, down = (dw.AdaptiveGain(TRACKER, K0=[0.4, 0.1] + s, **fixed).scan(y).state["x"] for s in (step, -step))
        np.testing.assert_allclose(W[:, i], (up - down) / (2 * h), rtol=1e-8)


# --- the plates: 200 records, K-MSE times 1000 -----------------------------------------------------------------


@pytest.mark.parametrize(
    "memory, expected",
    [(dw.Constant(), 13.35), (dw.ExponentialForgetting(0.996), 11.98), (dw.memory.GainFloor(250), 12.25)],
)
def test_plates_of_1981(memory, expected):
    _, y, K = records(200, seed=2)
    est = dw.AdaptiveGain(PHI, method="plr", memory=memory, K0=0.0, x0=0.0)
    assert k_mse(est, y, K).mean() == pytest.approx(expected, rel=0.08)


def test_matched_walk_is_better_than_all_of_them():
    _, y, K = records(200, seed=2)
    for scale, first, whole in ((None, 5.4, 6.3), (PRIOR, 4.5, 6.3)):
        error = k_mse(dw.AdaptiveGain(PHI, scale=scale, **SLOW), y, K)
        assert error[:, :500].mean() < first and error.mean() < whole
    assert k_mse(dw.AdaptiveGain(PHI), y, K).mean() < 8  # nothing told


@pytest.mark.parametrize("method, expected", [("plr", 1 / (2 * PHI**2)), ("rpem", (1 - PHI**2 * 0.49) / (2 * PHI**2))])
def test_steady_variance_under_forgetting(method, expected):
    """tau/(2 Phi^2) and tau (1 - Phi^2 (1 - K)^2)/(2 Phi^2): the paper's method pays twice."""
    _, y, K = records(200, levels=(0.3,), seed=7, segment=6000)
    est = dw.AdaptiveGain(PHI, method=method, memory=dw.ExponentialForgetting(0.996), K0=0.3, x0=0.0)
    found = k_mse(est, y, K)[:, 1500:].mean() / 1000
    assert found == pytest.approx(0.004 * expected, rel=0.07)


# --- several states, inputs, gaps ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "memory, off, ratio",
    [(None, (0.05, 0.02), (1.12, 1.25)), (dw.ExponentialForgetting(0.999), (0.015, 0.005), (1.02, 1.02))],
)
def test_tracker_learns_the_gain_of_the_riccati_equation(memory, off, ratio):
    Q = 0.01 * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]])
    P = solve_discrete_are(TRACKER.T, np.array([[1.0], [0.0]]), Q, np.eye(1))
    best = P[:, 0] / (P[0, 0] + 1)
    np.testing.assert_allclose(gains.kalman_gain(TRACKER, [1.0, 0.0], Q, 1.0), best, rtol=1e-10)
    learnt, nis, ratios, far = [], [], [], []
    for seed in range(20):
        x, y = tracked(4000, seed=seed)
        trace, fixed, known = dw.AdaptiveGain(TRACKER, memory=memory).scan(y), np.zeros(2), np.empty_like(x)
        for t in range(len(y)):
            known[t] = fixed + best * (y[t] - fixed[0])
            fixed = TRACKER @ known[t]
        learnt.append(trace.parameters[-1])
        far.append((trace.parameters[-1] - best) / trace.parameters_std[-1])
        nis.append(np.mean(trace.innovation[2000:] ** 2 / trace.variance[2000:]))
        ratios.append(np.mean((trace.x - x)[2000:] ** 2, axis=0) / np.mean((known - x)[2000:] ** 2, axis=0))
    assert np.all(abs(np.mean(learnt, axis=0) - best) < off)
    assert np.all(np.mean(ratios, axis=0) < ratio)
    assert 0.9 < min(nis) and max(nis) < 1.1
    assert np.sqrt(np.mean(np.square(far))) < 1.5  # the spread of K means what it says


def test_error_bars_of_a_scalar_state():
    x, y, _ = records(40, levels=(0.3,), seed=9, segment=3000)
    traces = [dw.AdaptiveGain(PHI).scan(one) for one in y]
    z = np.array([(tr.x[500:, 0] - one[500:]) / tr.x_std[500:, 0] for tr, one in zip(traces, x)])
    k = np.array([(tr.parameters[500::500, 0] - 0.3) / tr.parameters_std[500::500, 0] for tr in traces])
    assert np.mean(abs(z) < 1.96) == pytest.approx(0.95, abs=0.02)
    assert np.mean(abs(k) < 1.96) > 0.9


def test_a_known_input_is_taken_off_exactly():
    Phi, B = np.array([[0.9, 0.2], [0.0, 0.8]]), np.array([[0.3, 0.0], [1.0, -0.5]])
    rng = np.random.default_rng(0)
    u, quiet = rng.standard_normal((300, 2)), rng.standard_normal(300)
    driven, x = quiet.copy(), np.zeros(2)
    for t in range(300):
        driven[t] += x[0]
        x = Phi @ x + B @ u[t]
    plain = dw.AdaptiveGain(Phi, x0=[0, 0]).scan(quiet)
    moved = dw.AdaptiveGain(Phi, B=B, x0=[0, 0]).scan(driven, u)
    np.testing.assert_allclose(moved.innovation, plain.innovation, atol=1e-12)
    np.testing.assert_allclose(moved.parameters, plain.parameters, atol=1e-12)


def test_a_missing_input_is_held_and_the_next_output_teaches_nothing():
    y, u = np.random.default_rng(0).standard_normal((2, 50))
    u[20] = np.nan
    y[21] = np.nan
    trace = dw.AdaptiveGain(0.9, B=1.0).scan(y, u)
    assert trace.status[20] == dw.Status.MISSING_INPUT and trace.status[22] & dw.Status.SKIPPED
    assert trace.parameters[22, 0] == trace.parameters[20, 0] != trace.parameters[23, 0]
    held = dw.AdaptiveGain(0.9, B=1.0).scan(y[:22], np.append(u[:20], [u[19], u[21]]))
    assert trace.prediction[21] == held.prediction[21]


def test_the_first_outputs_set_the_state_by_dead_beat():
    x, velocity = 1e6, -3.0
    y = x + velocity * np.arange(50)
    trace = dw.AdaptiveGain(TRACKER).scan(y)
    np.testing.assert_allclose(trace.x[1], [y[1], velocity], rtol=1e-9)
    assert abs(trace.innovation[2:]).max() < 1e-6


def test_a_long_gap_of_an_unstable_plant_is_survived():
    y = np.random.default_rng(0).standard_normal(9000)
    y[1000:6000] = np.nan
    est = dw.AdaptiveGain(1.2, detector=dw.detect.GainProbes())
    trace = est.scan(y)
    assert np.flatnonzero(trace.status & dw.Status.LOST).size
    assert np.isfinite(trace.table[:, [0, 2]]).all() and np.isfinite(np.atleast_1d(trace.state).view(float)).all()
    assert np.mean(trace.innovation[-500:] ** 2) < 3  # the best filter of white noise seen so: Phi^2 = 1.44


def test_the_model_out_is_the_innovations_model():
    Phi, B = np.array([[0.9, 0.2], [-0.1, 0.7]]), np.array([[0.3], [1.0]])
    rng = np.random.default_rng(4)
    y, u = rng.standard_normal((2, 200))
    trace = dw.AdaptiveGain(Phi, [1.0, 0.5], B, x0=[0, 0], memory=dw.RandomWalk(0.0), K0=[0.5, 0.2], P0=0.0).scan(y, u)
    model = trace.model()
    a, b = model.form.polynomials(model.values)
    e = trace.innovation
    rebuilt = lfilter(b[0], a, u) + lfilter(model.noise_polynomial, a, e)
    np.testing.assert_allclose(rebuilt, y, atol=1e-10)
    learnt = dw.AdaptiveGain(Phi, [1.0, 0.5], B).scan(y, u).model()
    assert np.all(np.diag(learnt.covariance)[:4] == 0) and np.all(np.diag(learnt.covariance)[4:] > 0)


def test_summary_words_and_file():
    y = records(1, levels=(0.3,), seed=3)[1][0]
    summary = dw.AdaptiveGain(PHI).scan(y).summary()
    assert 0.8 < summary.nis < 1.2 and summary.words
    assert summary.noise_std == pytest.approx(np.sqrt(1 / 0.7), rel=0.2)  # of the innovations: R/(1 - K)


# --- the door --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "settings, words",
    [
        (dict(Phi=np.zeros((2, 3))), "square"),
        (dict(Phi=np.eye(2)), "unobservable"),
        (dict(Phi=[[0.5, 1.0], [0.0, 0.0]]), "singular"),
        (dict(Phi=TRACKER, H=np.eye(2)), "one output"),
        (dict(Phi=TRACKER, B=np.ones((3, 1))), "B must be"),
        (dict(Phi=TRACKER, method="plr"), "one direction"),
        (dict(method="lms"), "rpem"),
        (dict(memory=dw.RestartOnChange()), "detector=VarianceCUSUM"),
        (dict(memory=dw.memory.FuzzyDrift()), r"only to second order; got FuzzyDrift"),
        (dict(memory=dw.memory.Drift(phi=0.9, q=1e-4)), "phi must be 1 here"),
        (dict(memory=dw.AutoMemory(), detector=dw.detect.GainProbes()), "AutoMemory has no answer to alarms"),
        (dict(memory=50.0), "memory must be"),
        (dict(detector=dw.detect.PullTest()), "PullTest"),
        (dict(detector=3.0), "detector must be"),
        (dict(detector=dw.detect.GainProbes([3.0])), "unstable"),
        (dict(detector=dw.detect.GainProbes([[0.1, 0.2]])), "gains"),
        (dict(memory=dw.Constant(), restart=1.0), "samples above 1"),
        (dict(restart=2.0), "share of the prior"),
        (dict(Phi=TRACKER, K0=[0.0, 0.0]), "K0 must keep"),
        (dict(Phi=TRACKER, limits=(0, 1)), "limits"),
        (dict(limits=(-1, 1)), "limits must keep"),
        (dict(scale=dw.models.InverseGamma(-0.5, 1.0)), "InverseGamma"),
        (dict(P0=-1.0), "P0"),
    ],
)
def test_the_door_says_what_is_wrong(settings, words):
    with pytest.raises(dw.InputError, match=words):
        dw.AdaptiveGain(**settings)


def test_a_gain_within_its_limits_is_not_said_to_be_clipped():
    y = 0.3 * np.cumsum(np.random.default_rng(0).standard_normal(500))
    trace = dw.AdaptiveGain(0.9, 3.0, K0=0.1).scan(y)
    gain = 3.0 * trace.parameters[:, 0]
    is_at_limit = (gain < 1e-12) | (gain > 1 - 1e-12)
    assert 0 < is_at_limit.sum() < 400
    np.testing.assert_array_equal(trace.status & PROJECTED > 0, is_at_limit)
