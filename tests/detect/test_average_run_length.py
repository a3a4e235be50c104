"""Run lengths of cumulative sums against golden cases, 40 digits, and simulations."""

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from draws import slow
from scipy.stats import norm
from scipy.stats import t as student

import driftwise as dw
from driftwise.detect import average_run_length as rl
from driftwise.detect import brownian

FILE = Path(__file__).parents[1] / "golden" / "perriot.json"
CASES = {case["name"]: case for case in json.loads(FILE.read_text())["cases"]}


def assert_golden(name, key, got):
    case = CASES[name]
    got, expected = np.asarray(got, float), np.asarray(case["expected"][key], float)
    assert got.shape == expected.shape
    assert np.max(np.abs(got - expected) / np.maximum(np.abs(expected), 1e-3)) <= case["rtol"]


def gaussian(std=1.0, mean=0.0):
    """White samples, for a simulation."""

    def signal(generator, runs):
        while True:
            going = yield mean + std * generator.standard_normal(runs)
            runs = np.count_nonzero(going)

    return signal


# closed forms


def test_golden_brownian():
    cases = CASES["T1_mean_time_between_false_alarms"]["input"]["cases"]
    assert_golden("T1_mean_time_between_false_alarms", "T1", [rl.brownian_run_length(*case) for case in cases])
    cases = CASES["R_D_detection_delay"]["input"]["cases"]
    assert_golden("R_D_detection_delay", "reflected", [rl.brownian_run_length(-m, h, G) for m, h, G in cases])
    assert_golden("R_D_detection_delay", "steady", [rl.brownian_delay(m, m, h, G) for m, h, G in cases])


@pytest.mark.parametrize(
    "x", [s * 10.0**p for s in (1, -1) for p in (-300, -20, -9, -5, -4, -1, 0, 1, 2)] + [0.5, -0.5]
)
def test_phi_functions_keep_their_digits(x):
    with mp.workdps(700):
        e, x_ = mp.exp(mp.mpf(x)), mp.mpf(x)
        first, second = float((e - 1) / x_), float((e - 1 - x_) / x_**2)
    assert brownian.phi1(x) == pytest.approx(first, rel=1e-15)
    assert brownian.phi2(x) == pytest.approx(second, rel=1e-14)


@pytest.mark.parametrize("drift", [1e-12, 1e-6, -1e-6, 0.3, -0.3, -40.0, 4.0])
@pytest.mark.parametrize("h", [1e-3, 3.0, 50.0])
def test_brownian_run_length_over_wide_ranges(drift, h):
    with mp.workdps(60):
        x = 2 * mp.mpf(drift) * mp.mpf(h) / mp.mpf(1.3) ** 2
        expected = float(mp.mpf(1.3) ** 2 / (2 * mp.mpf(drift) ** 2) * (mp.exp(x) - 1 - x))
    assert rl.brownian_run_length(drift, h, 1.3) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("drift", [0.0, 1e-12, 1e-6, -1e-6, 0.3, -0.3, -40.0, 4.0])
@pytest.mark.parametrize("length", [1e-3, 1.0, 500.0, 1e12])
def test_the_threshold_of_a_brownian_run_length(drift, length):
    """G^2/(2 d^2) (e^x - 1 - x) = T, x = 2 d h/G^2, solved by bisection in fifty digits."""
    with mp.workdps(50):
        d, G, T = mp.mpf(drift), mp.mpf(1.3), mp.mpf(length)

        def short(h):
            if not drift:
                return h * h / G**2 < T
            x = 2 * d * h / G**2
            return G**2 / (2 * d**2) * (mp.exp(x) - 1 - x) < T

        low, high = mp.mpf(0), mp.mpf(1)
        while short(high):
            low, high = high, 2 * high
        for _ in range(120):
            middle = (low + high) / 2
            low, high = (middle, high) if short(middle) else (low, middle)
        expected = float(low)
    assert rl.brownian_threshold(length, drift, 1.3) == pytest.approx(expected, rel=1e-9)


def test_a_promise_in_words_and_what_no_threshold_is():
    h = rl.brownian_threshold(rl.rate("1 per 1000"), 0.25)
    assert rl.brownian_run_length(0.25, h) == pytest.approx(1000, rel=1e-12)
    for wrong in ((0.0, 0.1, 1.0), (-5.0, 0.1, 1.0), (10.0, np.nan, 1.0), (10.0, 0.1, 0.0)):
        with pytest.raises(dw.InputError, match=r"must be (positive|finite)"):
            rl.brownian_threshold(*wrong)


def test_brownian_limits():
    assert rl.brownian_run_length(0.0, 3.0, 2.0) == 2.25
    assert rl.brownian_run_length(5.0, 1e4) == np.inf
    assert rl.brownian_run_length(-1e5, 1e5) == pytest.approx(1.0, rel=1e-9)
    assert rl.brownian_run_length(np.array([0.1, -0.1]), 3.0).shape == (2,)


@pytest.mark.parametrize(
    "after, before, h",
    [(0.01, 1e-6, 2.0), (1e-6, 0.1, 5.0), (2.0, 0.02, 60.0), (0.3, 1.0, 100.0), (0.5, 1.0, 1e5)],  # far from the last
)
def test_steady_delay_is_the_mean_over_where_the_detector_stands(after, before, h):
    with mp.workdps(40):
        k, q, m, H = 2 * mp.mpf(after), 2 * mp.mpf(before), mp.mpf(after), mp.mpf(h)
        rest = 1 - mp.exp(-q * H)
        E_x = 1 / q - H * mp.exp(-q * H) / rest
        E_e = q / (q + k) * (1 - mp.exp(-(q + k) * H)) / rest
        expected = float((H - E_x) / m - (E_e - mp.exp(-k * H)) / (m * k))
    assert rl.brownian_delay(after, before, h) == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_brownian_motion_of_small_steps():
    """18.05 at drift 0.3, threshold 3: mean run lengths of steps dt approach it like sqrt(dt)."""

    def simulated(dt):
        return dt * rl.simulate_run_length(gaussian(np.sqrt(dt)), 0.3 * dt, [3.0], runs=60_000, seed=3)[0]

    limit = 2 * simulated(0.01) - simulated(0.04)
    assert limit == pytest.approx(rl.brownian_run_length(0.3, 3.0), rel=0.02)  # two standard errors; 38.05 as printed


# exact run lengths


def test_golden_gaussian():
    given = CASES["arl_gaussian_cusum"]["input"]
    cases = list(zip(given["k"], given["h"], given["sigma"]))
    assert_golden("arl_gaussian_cusum", "nystrom", [rl.run_length(h, k, G) for k, h, G in cases])
    corrected = [rl.brownian_run_length(k, h + rl.OVERSHOOT * G, G) for k, h, G in cases]
    assert_golden("arl_gaussian_cusum", "siegmund", corrected)


def test_rare_alarms_keep_their_digits():
    """The integral equation with 60 nodes in 40 digits, where 1 - A is singular to doubles."""
    h, k, n = 9.0, 1.5, 60
    with mp.workdps(40):
        roots = np.polynomial.legendre.leggauss(n)[0]
        s, w = [mp.mpf(0)], []
        for z in map(mp.mpf, roots):  # polish to 40 digits
            for _ in range(3):
                p0, p1 = mp.mpf(1), z
                for m in range(2, n + 1):
                    p0, p1 = p1, ((2 * m - 1) * z * p1 - (m - 1) * p0) / m
                slope = n * (z * p1 - p0) / (z * z - 1)
                z -= p1 / slope
            s.append(h * (z + 1) / 2)
            w.append(h / ((1 - z * z) * slope**2))
        A = mp.matrix(n + 1, n + 1)
        for i in range(n + 1):
            A[i, 0] = -mp.ncdf(k - s[i])
            for j in range(n):
                A[i, j + 1] = -w[j] * mp.npdf(s[j + 1] - s[i] + k)
            A[i, i] += 1
        expected = float(mp.lu_solve(A, mp.matrix([1] * (n + 1)))[0])
    assert expected > 1e12
    assert rl.run_length(h, k) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("k, h, G", [(0.5, 4, 1.0), (0.1, 5, 1.0), (1.0, 3, 1.3)])
def test_markov_chain_agrees_with_the_integral_equation(k, h, G):
    assert rl.run_length_of(norm(0, G).cdf, h, k) == pytest.approx(rl.run_length(h, k, G), rel=2e-6)
    delay = rl.run_length(h, k, G, mean=2 * k)
    assert rl.run_length_of(norm(0, G).cdf, h, k, mean=2 * k) == pytest.approx(delay, rel=2e-6)


def test_two_states_by_hand():
    """A sum in {0, 1} that goes up or down by 1 with equal chances, and alarms at 2: L0 = 6, L1 = 4."""
    A = np.array([[0.5, 0.5], [0.5, 0.0]])
    assert rl._times(A, np.array([0.0, 0.5])).tolist() == [6.0, 4.0]


@pytest.mark.parametrize("k, h, G", [(0.5, 4, 1.0), slow(0.15, 15, 1.01), (0.07, 20, 1.01)])
def test_gaussian_run_length_against_simulation(k, h, G):
    simulated = rl.simulate_run_length(gaussian(G), k, [h], runs=40_000, seed=11)[0]
    assert rl.run_length(h, k, G) == pytest.approx(simulated, rel=0.02)  # four standard errors


def test_delays_against_simulation():
    """From 0: (0.07, 20) takes 204 samples (286 as printed); in the steady state 173.5, and (0.15, 15) 75.8."""
    after = rl.simulate_run_length(gaussian(1.01, 0.14), 0.07, [20.0], runs=10_000, seed=5)[0]
    assert after == pytest.approx(204, rel=0.02)
    assert rl.run_length(20, 0.07, 1.01, mean=0.14) == pytest.approx(after, rel=0.02)
    assert rl.brownian_run_length(-0.07, 20 + 1.01 * rl.OVERSHOOT, 1.01) == pytest.approx(after, rel=0.02)
    assert rl.run_length(20, 0.07, 1.01, mean=0.14, start="steady") == pytest.approx(173.5, rel=0.02)
    assert rl.run_length(15, 0.15, 1.01, mean=0.3, start="steady") == pytest.approx(75.8, rel=0.02)


def test_heavy_tails_against_simulation():
    def signal(generator, runs):
        while True:
            going = yield generator.standard_t(4, runs) / 2**0.5
            runs = np.count_nonzero(going)

    simulated = rl.simulate_run_length(signal, 0.5, [5.0], runs=10_000, seed=7)[0]
    exact = rl.run_length_of(lambda x: student.cdf(x * 2**0.5, 4), 5.0, 0.5)
    assert exact == pytest.approx(simulated, rel=0.04)  # four standard errors
    assert exact < 0.6 * rl.run_length(5.0, 0.5)


# thresholds


@pytest.mark.parametrize(
    "T, k, G", [(1000, 0.5, 1.0), (2000, 0.07, 1.01), (2.3, 0.1, 1.0), (1e4, 0.0, 1.0), (1e12, 1.0, 3.0)]
)
def test_threshold_is_the_inverse(T, k, G):
    h = dw.detect.threshold_for(T, k, G)
    assert dw.detect.run_length(h, k, G) == pytest.approx(T, rel=1e-6)


def test_threshold_scales_with_the_signal():
    assert dw.detect.threshold_for(5000, 500.0, 1000.0) == pytest.approx(
        1000 * dw.detect.threshold_for(5000, 0.5), rel=1e-9
    )


def test_threshold_of_two_sides():
    """Each side at twice the wanted run length keeps the promise of both, 1000."""
    h = rl.threshold_for(2000, 0.5)

    rng, total, runs = np.random.default_rng(4), 0, 20_000
    up, down = np.zeros(runs), np.zeros(runs)
    for _ in range(4000):
        total += len(up)
        z = rng.standard_normal(len(up))
        up, down = np.maximum(0, up + z - 0.5), np.maximum(0, down - z - 0.5)
        goes_on = (up < h) & (down < h)
        up, down = up[goes_on], down[goes_on]
    lost = len(up) / runs  # exponential: what runs on after the record
    assert total / runs / (1 - lost) == pytest.approx(1000, rel=0.03)


def test_threshold_of_a_distribution():
    assert rl.threshold_of(norm.cdf, 1000, 0.5) == pytest.approx(rl.threshold_for(1000, 0.5), rel=1e-6)
    h = rl.threshold_of(student(4).cdf, "1 per 1000", 0.5)  # the search begins far too low
    assert rl.run_length_of(student(4).cdf, h, 0.5) == pytest.approx(1000, rel=1e-8)


def test_impossible_promises_are_refused():
    with pytest.raises(dw.InputError, match=r"impossible.*3\.24"):
        dw.detect.threshold_for(2, 0.5)
    with pytest.raises(dw.InputError, match="impossible"):
        rl.threshold_of(norm.cdf, 3.2, 0.5)
    with pytest.raises(dw.InputError, match="never exceeds"):
        rl.threshold_of(lambda x: np.where(x < 0, 0.5, 1.0), 100, 0.5)
    with pytest.raises(dw.InputError, match="never an alarm"):
        rl.run_length_of(lambda x: np.clip(x + 0.5, 0, 1), 3.0, 0.6)
    with pytest.raises(dw.InputError, match="never an alarm"):
        dw.detect.run_length(900.0, 1.0)


@pytest.mark.parametrize(
    "call",
    [
        lambda: dw.detect.run_length(-1.0, 0.5),
        lambda: dw.detect.run_length(3.0, 0.5, std=0.0),
        lambda: dw.detect.run_length(3.0, np.nan),
        lambda: dw.detect.run_length("high", 0.5),
        lambda: dw.detect.run_length(3.0, 0.5, start="warm"),
        lambda: dw.detect.run_length(2000.0, 0.01),
        lambda: dw.detect.threshold_for(100, -0.5),
        lambda: rl.run_length_of(norm.pdf, 3.0, 0.5, states=5),
        lambda: rl.run_length_of(lambda x: 3 * norm.pdf(x), 3.0, 0.5),
        lambda: rl.brownian_delay(-0.1, 0.1, 3.0),
        lambda: rl.extrapolate_run_length([8, 6], [100, 200], 0.1),
        lambda: rl.extrapolate_run_length([8, 10], [200, 200], 0.1),
    ],
)
def test_bad_settings_are_refused(call):
    with pytest.raises(dw.InputError):
        call()


@pytest.mark.parametrize(
    "text, samples",
    [
        ("1 per 10_000", 1e4),
        ("1/2000", 2000),
        ("3 in 1e5", 1e5 / 3),
        ("2 per 500 samples", 250),
        (1e4, 1e4),
        ("1e4", 1e4),
        (np.int64(50), 50),
    ],
)
def test_rates(text, samples):
    assert rl.rate(text) == pytest.approx(samples, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "0 per 100",
        "-1 per 100",
        "100 per 1",
        "often",
        "",
        "1 per",
        "1 per 0",
        0,
        -5,
        1,
        np.inf,
        np.nan,
        None,
        True,
        "1..2",
    ],
)
def test_nonsense_rates(text):
    with pytest.raises(dw.InputError, match="rate of false alarms"):
        rl.rate(text)


# correlated signals


def test_golden_product_exponent():
    name = "cramer_exponent_lag1_product"
    assert_golden(name, "lam", [rl.product_exponent(mu) for mu in CASES[name]["input"]["mu"]])
    assert rl.product_exponent(1e-9) == pytest.approx(2e-9, rel=1e-6)
    assert rl.product_exponent(0.7) == 0.5


def test_fit_recovers_its_own_law():
    truth = rl.RunLengthFit(0.37, 1.4, 0.21)
    fit = rl.extrapolate_run_length([4, 9], truth.run_length(np.array([4.0, 9.0])), 0.21)
    assert (fit.exponent, fit.overshoot) == pytest.approx((0.37, 1.4), rel=1e-9)
    assert fit.threshold(truth.run_length(40.0)) == pytest.approx(40.0, rel=1e-9)
    assert rl.RunLengthFit(0.6, 0.0, 0.3).run_length(3.0) == pytest.approx(rl.brownian_run_length(0.3, 3.0), rel=1e-14)
    with pytest.raises(dw.InputError, match="below what any threshold"):
        fit.threshold(1.0)


def test_lag_one_product_by_two_points():
    """Low thresholds 8 and 15 foretell the 30 768 +- 930 samples simulated at 25."""
    G = 1 / 0.99
    low = rl.simulate_run_length(rl.lagged_products, 0.15 / G, [8 / G, 15 / G], runs=20_000, seed=0)
    assert low[1] == pytest.approx(2057, rel=0.04)  # 2057 +- 14, and as many runs here
    fit = rl.extrapolate_run_length([8, 15], low, 0.15)
    assert fit.run_length(25.0) == pytest.approx(30768, rel=0.1)
    assert fit.exponent == pytest.approx(rl.product_exponent(0.15 / G) / G, rel=0.03)
    assert rl.product_run_length(25.0, 0.15, G) == pytest.approx(30768, rel=0.1)
    assert rl.brownian_run_length(0.15, 25.0, G) == pytest.approx(1.14 * 30768, rel=0.01)
    assert rl.brownian_run_length(0.15, 25 + G * rl.OVERSHOOT, G) == pytest.approx(1.62 * 30768, rel=0.01)


@pytest.mark.slow
def test_lag_one_product_at_the_high_threshold():
    G = 1 / 0.99
    T = rl.simulate_run_length(rl.lagged_products, 0.15 / G, [25 / G], runs=1000, seed=21)[0]
    assert T == pytest.approx(30768, rel=0.13)  # three standard errors of a difference


def test_simulation_is_seeded_and_watches_its_signal():
    T = [rl.simulate_run_length(rl.lagged_products, 0.2, [2, 4], runs=50, seed=s) for s in (1, 1, 2)]
    assert (T[0] == T[1]).all() and (T[0] != T[2]).all()

    def forgets(generator, runs):
        while True:
            yield generator.standard_normal(runs)

    def nan(generator, runs):
        while True:
            yield np.full(runs, np.nan)

    for bad in (forgets, nan):
        with pytest.raises(dw.InputError, match="one finite sample"):
            rl.simulate_run_length(bad, 0.2, [2.0], runs=50)


def test_growth():
    assert rl.growth(0.25) == pytest.approx(2.2) and rl.growth(0.25, 2.0) == pytest.approx(8.8)
