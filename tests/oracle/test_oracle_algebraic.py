"""The oracles of algebraic estimation against cases in exact and in long arithmetic, and against one another."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from oracle import algebraic as oracle
from oracle import algebraic_identification as identification
from oracle import algebraic_theorem as theorem
from oracle.algebraic_motor import K1, OSCILLATOR, VOLTS, augmented, by_exponential, dc_motor

FILE = Path(__file__).parents[1] / "golden" / "tian.json"
CASES = {case["name"]: case for case in json.loads(FILE.read_text())["cases"]}
SIGMA = 0.015 / np.sqrt(3)


def case(name):
    found = CASES[name]
    return found["given"], found["expect"], found["tol"]


def numbers(table):
    return {int(power): Fraction(c) for power, c in table.items()}


def motor_window(L, end=1000, *, noise=True, **options):
    """What `window_estimate` takes for the last L samples up to `end`: exact sine input, the case's own noise."""
    k = np.arange(end - L + 1, end + 1)
    t = k / 1000
    y = dc_motor(t, **options.pop("plant", {})).x[:, 0]
    if noise:
        y = y + 0.015 * (2 * ((k + 1) * (np.sqrt(5) - 1) / 2 % 1) - 1)
    A, B, H = augmented(**options)
    v = VOLTS * np.column_stack([np.sin(t), np.cos(t)])
    return (A, H, t, y, SIGMA), dict(B=np.hstack([B, 0 * B]), G=OSCILLATOR, v=v)


MODES = {"hard4": dict(frequency=None), "hard6": {}, "soft6": {}}
SOFT = np.array([np.inf] * 3 + [2.0] * 3)


def motor_estimate(setup, L, estimate=oracle.window_estimate, **more):
    given, options = motor_window(L, **MODES[setup], **more)
    return estimate(*given, **options, prior=SOFT if setup == "soft6" else None)


def test_coefficients_of_the_theorem():
    given, expected, _ = case("theorem_dc_motor")
    found = theorem.Theorem(**given)
    assert expected["N"] == found.N and theorem.powers(found.D1) == numbers(expected["D1"])
    for j, coefficients in expected["cjD1j"].items():
        assert theorem.powers(found.cD1(int(j))) == numbers(coefficients)
    alpha = {f"{mu},{h}": found.alpha(mu, h) for mu in range(1, 4) for h in range(mu)}
    assert {key: c for key, c in alpha.items() if c} == {key: numbers(c) for key, c in expected["alpha"].items()}
    beta = {f"{mu},{h}": found.beta(mu, h) for mu in range(4) for h in range(mu + 1)}
    assert {key: c for key, c in beta.items() if c} == {key: numbers(c) for key, c in expected["beta"].items()}
    constants = {
        f"{mu},{j},{q}": k
        for mu in range(4)
        for j in range(1, found.N + 1)
        for q, k in enumerate(found.y_parts(mu, j)[0])
        if k
    }
    assert constants == {key: Fraction(k) for key, k in expected["kq"].items()}


@pytest.mark.parametrize(
    "model",
    [
        theorem.Theorem([0, 2, 10, 1], [2], 0, [7]),
        theorem.Theorem([3, 5, 4, 1], [2, -1, 3], 1, [3]),  # u enters at relative degree 1
        theorem.Theorem([2, 1], [4]),
    ],
)
def test_theorem_holds_on_signals_of_the_model(model):
    """u = sin 1.3 t passes through the plant, the disturbance is whatever D1 lets pass: all derivatives come out."""
    n, s = len(model.a) - 1, 1.3j
    gain = np.polyval(model.b[::-1], s) / np.polyval(model.a[::-1], s)
    roots = np.roots([float(c) for c in model.D1][::-1])
    modes, weights = roots[np.abs(roots) > 1e-4], 0.3 + 0.1 * np.arange(len(roots))

    def y(t, order=0):
        t = np.asarray(t, dtype=float)[..., None]
        free = (weights[: len(modes)] * modes**order * np.exp(modes * t)).sum(-1)
        ramp = (0.7 + 0.4 * t[..., 0], 0.4)[order] if order < 2 and model.g >= 1 else 0.7 * (order == 0 <= model.g)
        return (gain * s**order * np.exp(s * t[..., 0])).imag + free.real + ramp

    u = [lambda t, h=h: (s**h * np.exp(s * np.asarray(t))).imag for h in range(n + 1)]
    got = model.derivatives(1.4, y, u, n + 1)
    truth = np.array([y(1.4, order) for order in range(n + 1)])
    assert np.abs(got - truth).max() < 1e-9 * np.abs(truth).max()


def test_kernel():
    given, expected, tolerance = case("kernel_values")
    model = theorem.Theorem([int(c) for c in given["D1"][::-1]], [1])
    got = [model.kernel(t, [tau])[0] for t, tau in given["points"]]
    np.testing.assert_allclose(got, expected["k"], rtol=0, atol=tolerance)
    x, weight = np.polynomial.legendre.leggauss(60)
    tau, weight = x + 1, weight  # [0, 2]
    kernels = model.kernels(2.0, tau, 3)
    np.testing.assert_allclose(kernels[0], model.kernel(2.0, tau), rtol=0, atol=1e-10)
    for root in np.roots(given["D1"]):  # every mode of D1 passes unchanged, with its derivatives
        got = (kernels * weight) @ np.exp(root * tau)
        np.testing.assert_allclose(got, root ** np.arange(3) * np.exp(2 * root), rtol=0, atol=1e-9)


def test_polynomial_kernels_are_least_squares():
    given, expected, _ = case("polynomial_kernels")
    for N in given["N"]:
        shown = [[Fraction(c) for c in k] for k in expected[f"N={N}"].values()]
        assert theorem.theorem_polynomials(N, N) == shown
        assert [theorem.least_squares_kernel(N, m) for m in range(N)] == shown


def test_variance_table():
    given, expected, _ = case("polynomial_variance")
    for (N, m), shown in zip(given["pairs"], expected["V"], strict=True):
        assert theorem.least_squares_variance(N, m) == theorem.closed_variance(N, m) == int(shown)


def test_motor_without_noise():
    _, expected, _ = case("dc_motor_noise_free")
    t = np.array([float(key) for key in expected["x"]])
    got = dc_motor(t)
    np.testing.assert_allclose(got.x, list(expected["x"].values()), rtol=0, atol=1e-12)
    np.testing.assert_allclose(got.y3, list(expected["y3"].values()), rtol=0, atol=1e-11)


def test_motor_with_other_plants():
    """The closed form against an exponential; a jump that changes nothing; a drift in small steps of R."""
    plant = dict(R=1.3, q1=0.4, q2=3.0, w=17.0, torque=0.6)
    np.testing.assert_allclose(dc_motor([0.0, 2.7], **plant).x[1], by_exponential(2.7, **plant), rtol=1e-12)
    t = np.linspace(0, 2, 21)
    plain = dc_motor(t, **plant)
    np.testing.assert_allclose(dc_motor(t, jump=(0.93, 1.3), **plant).x, plain.x, rtol=1e-11)
    np.testing.assert_allclose(dc_motor(t, drift=1e-300, **plant).x, plain.x, rtol=0, atol=1e-9)
    jumped = dc_motor(t, jump=(1.0, 2.0), **plant)
    assert np.array_equal(jumped.x[t < 1], plain.x[t < 1]) and np.abs(jumped.x - plain.x)[-1].max() > 0.1
    slope = np.gradient(dc_motor(np.linspace(0.9, 0.901, 3), drift=0.3).x[:, 2], 0.0005)[1] * K1 / 5
    np.testing.assert_allclose(dc_motor([0.9005], drift=0.3).y3[0], slope, rtol=1e-3)


@pytest.mark.parametrize("estimate", [oracle.window_estimate, oracle.window_estimate_exact])
def test_windows_of_the_motor(estimate):
    _, expected, tolerance = case("window_least_squares")
    for name, shown in expected["estimate"].items():
        setup, L = name.split("_L")
        if estimate is oracle.window_estimate_exact and int(L) > 500:
            continue
        got = motor_estimate(setup, int(L), estimate)
        np.testing.assert_allclose(got.z, shown, rtol=tolerance["rtol"], err_msg=name)
        np.testing.assert_allclose(got.std, expected["std"][name], rtol=tolerance["rtol"], err_msg=name)


def test_windows_without_noise_are_exact():
    _, expected, tolerance = case("dc_motor_noise_free")
    for key, x in expected["x"].items():
        end = round(1000 * float(key))
        got = motor_estimate("hard6", end + 1, end=end, noise=False)
        assert (np.abs(got.z[:3] - x) <= tolerance["exact_least_squares_from_50_samples"]).all(), key


def test_soft_prior_beats_hard():
    _, expected, tolerance = case("soft_beats_hard")
    hard6, soft6, hard4 = (motor_estimate(setup, 500).std[2] for setup in ("hard6", "soft6", "hard4"))
    np.testing.assert_allclose(hard6 / soft6, expected["hard6_over_soft6"], rtol=tolerance["rtol"])
    np.testing.assert_allclose(hard6 / hard4, expected["hard6_over_hard4"], rtol=tolerance["rtol"])


def test_gains_of_the_double_integrator():
    given, expected, tolerance = case("double_integrator_fir")
    A, H = np.array([[0, 1], [0, 0]]), np.array([[1, 0]])
    for L in given["L"]:
        t = given["h"] * np.arange(L)
        gains = np.array([oracle.window_estimate(A, H, t, unit, 1.0).z for unit in np.eye(L)]).T
        shown = [[float(Fraction(g)) for g in row] for row in expected[f"L={L}"]]
        np.testing.assert_allclose(gains, shown, rtol=0, atol=tolerance)


def test_load_torque():
    """The same exact samples read by the model with the torque, and by the paper's with a voltage in its place."""
    given, expected, tolerance = case("load_torque")
    plant = dict(q1=0.0, torque=given["p"])
    truth = dc_motor([1.0], **plant).x[0]
    for setup, key, near in (
        (dict(constant=False, torque=True), "augmented_error", tolerance["augmented"]),
        ({}, "paper_readout_error", tolerance["paper"]),
    ):
        window, options = motor_window(1000, noise=False, plant=plant, **setup)
        got = oracle.window_estimate(*window, **options).z[:3] - truth
        np.testing.assert_allclose(got, expected[key], rtol=0, atol=near)


def test_hidden_modes():
    _, expected, _ = case("observability_verdicts")
    A, _, H = augmented()
    constant, _, _ = augmented(frequency=None)
    both, _, _ = augmented(frequency=None, torque=True)
    models = [
        (A, H),
        (constant, np.eye(4)[[1]]),
        (constant[1:, 1:], np.eye(3)[[1]]),
        (both, np.eye(5)[[0]]),
    ]
    for model, seen, mode in zip(models, expected["observable"], expected["hidden_mode"], strict=True):
        found = theorem.hidden_modes(*model)
        assert (len(found) == 0) == seen
        assert seen or np.abs(found - mode).max() < 1e-9


@pytest.mark.parametrize("estimate", [oracle.window_estimate, oracle.window_estimate_exact])
def test_irregular_and_missing(estimate):
    given, expected, tolerance = case("irregular_missing")
    A, B, H = np.array([[0, 1, 0], [-4, -0.6, 1], [0, 0, 0]]), np.array([[0.0], [2], [0]]), np.eye(3)[[0]]
    y = np.array(given["y"], dtype=float)
    got = estimate(A, H, given["t"], y, 1.0, B=B, v=np.array(given["u"], dtype=float)[:, None])
    np.testing.assert_allclose(got.z, expected["estimate"], rtol=0, atol=tolerance)
    np.testing.assert_allclose(np.diag(got.P), expected["cov_diag_unit_noise"], rtol=0, atol=tolerance)


def test_parameters():
    given, expected, tolerance = case("parameter_identification")
    theta = np.array(list(expected["theta"].values()))
    u = identification.square_wave(401, given["h"], 1.0)
    a0, a1, b0 = theta
    y = identification.simulated(a0, a1, b0, 0.5, [0.3, -0.4], u, given["h"])
    np.testing.assert_allclose(y[:5], given["y_first"], rtol=0, atol=1e-14)
    np.testing.assert_allclose(y[-3:], given["y_last"], rtol=0, atol=1e-13)
    closed = identification.algebraic(y, u, given["h"])
    np.testing.assert_allclose(closed, theta, rtol=tolerance["rtol_algebraic"])
    refined = identification.fitted(y, u, given["h"], 1.2 * closed[:2])
    np.testing.assert_allclose(refined, theta, rtol=tolerance["rtol_after_gauss_newton"])


def test_smallest_windows():
    _, expected, tolerance = case("auto_epsilon")
    allowed = [0.015, 0.25, 1.2]

    def first(setup, grid):
        good = (T for T in grid if (motor_estimate(setup, round(1000 * T), noise=False).std[:3] <= allowed).all())
        return next(good)

    assert abs(first("hard4", np.arange(0.3, 0.5, 0.01)) - expected["hard4"]) <= tolerance
    assert abs(first("soft6", np.arange(0.1, 0.3, 0.01)) - expected["soft6_prior2"]) <= tolerance
    for seconds, passes in ((16.0, False), (16.5, True)):
        L = round(1000 * seconds)
        assert (motor_estimate("hard6", L, end=L, noise=False).std[:3] <= allowed).all() == passes


def test_price_of_the_theorem_on_undamped_modes():
    given, expected, tolerance = case("efficiency_undamped_mode")
    model = theorem.Theorem([0, 2, 10, 1], [2], 0, [50])
    for t, shown in zip(given["t"], expected["ratio"], strict=True):
        tau = np.arange(1, round(1000 * t) + 1) / 1000
        kernel = model.kernels(t, tau, 3)[2]
        mine = SIGMA * 5 * np.sqrt((kernel**2).sum()) / 1000
        assert abs(mine / motor_estimate("hard6", len(tau), end=len(tau), noise=False).std[2] - shown) <= tolerance


def test_end_point_weights():
    given, expected, tolerance = case("savgol_conditioning")
    got = oracle.polynomial_weights(given["L"], given["degree"], given["L"] - 1)
    shown = [expected["sum"], expected["last"], expected["first"]]
    np.testing.assert_allclose([got.sum(), got[-1], got[0]], shown, rtol=0, atol=tolerance)
    t = np.arange(21.0)
    for order, truth in enumerate([20**3 - 20, 3 * 20**2 - 1, 6 * 20]):  # t^3 - t at its end
        assert abs(oracle.polynomial_weights(21, 4, 20, order) @ (t**3 - t) - truth) < 1e-8 * abs(truth)


def test_growing_estimate_without_walk_is_the_window():
    (A, H, t, y, sigma), options = motor_window(30, frequency=None)
    prior = np.array([10.0, 10, 30, 2])
    for each in (None, prior):
        grown = oracle.growing_estimates(A, H, t, y, sigma, np.zeros(4), **options, prior=each)[-1]
        window = oracle.window_estimate(A, H, t, y, sigma, **options, prior=each)
        np.testing.assert_allclose(grown.z, window.z, rtol=1e-5)
        np.testing.assert_allclose(grown.P, window.P, rtol=1e-5)


def test_growing_estimate_is_the_kalman_filter():
    """A walking disturbance, irregular times, gaps: a covariance recursion from the prior gives the same."""
    rng = np.random.default_rng(0)
    A, H = np.array([[0, 1, 0], [-4, -0.6, 1], [0, 0, 0]]), np.eye(3)[[0]]
    t = np.cumsum(rng.exponential(0.1, 25))
    y = np.where(rng.random(25) < 0.2, np.nan, rng.standard_normal(25))
    walk, prior = np.array([0.0, 0.0, 0.8]), np.array([1.0, 2.0, 3.0])
    grown = oracle.growing_estimates(A, H, t, y, 0.3, walk, prior=prior)
    Phi, _ = oracle.transitions(A, np.zeros((3, 1)), np.zeros((1, 1)), t)
    z, P = np.zeros(3), np.diag(prior**2)
    for k in range(25):
        if k:
            z = Phi[k - 1] @ z
            P = Phi[k - 1] @ P @ Phi[k - 1].T + oracle.process_noise(A, walk, t[k] - t[k - 1])
        if np.isfinite(y[k]):
            gain = P @ H[0] / (P[0, 0] + 0.09)
            z, P = z + gain * (y[k] - z[0]), P - np.outer(gain, P[0])
        np.testing.assert_allclose(grown[k].z, z, rtol=0, atol=1e-10)
        np.testing.assert_allclose(grown[k].P, P, rtol=0, atol=1e-10)
    undetermined = [each is None for each in oracle.growing_estimates(A, H, t[:8], y[:8], 0.3, walk)]
    assert undetermined == [bool(np.isfinite(y[: k + 1]).sum() < 3) for k in range(8)]


def test_two_windows():
    """chi2 on what fits one model; a jump between the windows shows."""
    given, options = motor_window(500, frequency=None, noise=False, plant=dict(q2=0.0))
    rng = np.random.default_rng(1)
    A, H, t, y, _ = given
    found = []
    for _ in range(100):
        noisy = y + rng.uniform(-0.015, 0.015, 500)
        found.append(oracle.two_window_parity(A, H, t, noisy, SIGMA, 250, **options)[0])
    assert 3.2 < np.mean(found) < 4.8
    stepped = y + 0.05 * (t > t[249])
    assert oracle.two_window_parity(A, H, t, stepped, SIGMA, 250, **options)[0] > 40
