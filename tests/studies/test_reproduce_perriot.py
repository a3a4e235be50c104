"""`driftwise reproduce perriot1981`: the whole command with few records, and its loops against slow and golden ones."""

import json
import re

import numpy as np
import pytest
from driftwise_studies.papers.page import escape
from driftwise_studies.papers.perriot import (
    claims,
    detectors,
    diffusion,
    engine,
    equations,
    hampton,
    lengths,
    linear,
    paying,
    plates,
    score,
    walks,
)
from driftwise_studies.papers.verdict import Reproduction, Section, Statement
from test_perriot_engine import CASES, assert_case
from test_reproduce import KEYS, assert_cited, call

PHI = hampton.PHI
MUST = [  # one check at least for each line of the acceptance list
    "recursive least squares",
    "U-D factors are the R form",
    "the order of the equations",
    "Hampton's filter as a member",
    "theta a posteriori in (2)",
    "the generic gradient",
    "another theta than the state",
    "central differences",
    "random walk in U-D form",
    "T1 of the Brownian motion",
    "one alarm in 1000 samples",
    "one alarm in 2 samples",
    "R_D (Δμ 0.07, h 20) from 0",
    "clean data",
    "products of neighbours (Δμ .15, h 25)",
    "Hampton, p = .996",
    "ARMA(1, 1), pseudo-linear",
    "K-MSE of Plate 1",
    "K-MSE of Plate 2",
    "K-MSE of Plate 3",
    "Hampton's variance as printed, without its term",
    "K-MSE of the first segment",
    "starts from one sample",
    "the decrease, Q jumps",
    "run-length mixture",
    "a growing threshold",
    "a fixed threshold",
    "the criterion J as printed",
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The whole command with 40 records: (exit code, what --json wrote, the page's folder)."""
    folder = tmp_path_factory.mktemp("perriot")
    code = call("reproduce", "perriot1981", "--seeds", 40, "--json", folder / "r.json", "--figures", folder / "page")
    return code, json.loads((folder / "r.json").read_text()), folder / "page"


@pytest.mark.slow
def test_every_check_holds_and_the_exit_code_says_so(run):
    code, found, _ = run
    assert [row["name"] for row in found["verdicts"] if not row["pass"] or row["skipped"]] == []
    assert code == 0


@pytest.mark.slow
def test_the_json_keeps_its_contract(run):
    _, found, _ = run
    assert found["name"] == "perriot1981" and found["seeds"] == 40
    names = [row["name"] for row in found["verdicts"]]
    assert len(set(names)) == len(names)
    for row in found["verdicts"]:
        assert set(row) == KEYS
        assert all(isinstance(row[key], str) and row[key] for key in ("name", "value", "expected", "source"))
        assert row["source"].startswith(("Perriot-Mathonna 1981, section", "this package's "))
        assert_cited(row["source"])
    assert [part for part in MUST if not any(part in name for name in names)] == []


@pytest.mark.slow
def test_the_page_is_self_contained(run):
    page = (run[2] / "perriot1981.html").read_text()
    assert "http" not in page and "<script" not in page
    sources = re.findall(r'src="([^"]{1,22})', page)
    assert len(sources) == 5 == len(list(run[2].glob("*.png")))
    assert "7 statements of the paper do not hold" in page


# --- checks can fail ------------------------------------------------------------------------------------------


def test_checks_catch_the_printed_variance(monkeypatch):
    """Plate 1 without the term that forgets: 40 instead of 13."""
    honest = hampton.Averaging.update

    def printed(self, K, f, nu):
        self.printed = True
        return honest(self, K, f, nu)

    monkeypatch.setattr(hampton.Averaging, "update", printed)
    failed = {verdict.name for verdict in plates.section(100).verdicts if verdict.fails}
    assert {"K-MSE of Plate 1: 1/n", "K-MSE of Plate 2: forgetting .996"} <= failed


def test_checks_catch_the_order_of_the_equations(monkeypatch):
    def late(self, g, rows, e):
        change = g * np.linalg.solve(self.R, rows.T @ e)
        self.R = self.R + g * (rows.T @ rows - self.R)
        return change

    monkeypatch.setattr(engine.Information, "__call__", late)
    least_squares, _ = equations._regression()
    assert least_squares.fails and equations._order(40).fails


def test_a_statement_does_not_hold_only_where_its_finding_is_confirmed(monkeypatch):
    """A criterion that has its minimum inside the grid leaves the paper right and the finding unconfirmed."""
    design = paying.design_restart(0.2, linear.EVERY)
    assert paying._printed(design).confirmed and paying._printed(design).refutes is claims.CRITERION
    monkeypatch.setattr(paying, "printed_criterion", lambda h, N0, *_: np.log(h) ** 2 + np.log(N0) ** 2)
    verdict = paying._printed(design)
    found = Reproduction("x", "X", "", 10, [Section("part", verdicts=[verdict])])
    assert verdict.fails and found.refuted == [] and found.against == ""


@pytest.mark.slow
def test_every_statement_of_the_paper_is_shown_with_its_number(run):
    """Convergence with a fixed threshold, R_D among energies, the sign of T1 and the rest, each with what it is now."""
    page = (run[2] / "perriot1981.html").read_text()
    top = page[page.index('id="against"') : page.index("<nav>")]
    said = [value for value in vars(claims).values() if isinstance(value, Statement)]
    assert len(said) == top.count("<tr>") - 1
    values = {row["value"] for row in run[1]["verdicts"]}
    assert all(escape(one.paper) in top and escape(one.truth) in top for one in said)
    assert sum(escape(value) in top for value in values) >= len(said)


# --- the filters against plain loops --------------------------------------------------------------------------


def record(jumps="Q", levels=hampton.LEVELS, length=100):
    return hampton.records(hampton.plant(levels, jumps, length), 3, 0)[1]


def test_levels_are_those_of_the_mean_field():
    given, expected = CASES["hampton_theory"]["input"], CASES["hampton_theory"]["expected"]
    assert given["Phi"] == PHI
    for K_opt, K, Q, mean in zip(given["K_opt"], given["K"], expected["Q"], expected["meanZ"]):
        assert hampton.ratio(K_opt) == pytest.approx(Q, rel=1e-12)
        assert hampton.mean_of_Z(K, K_opt) == pytest.approx(mean, rel=1e-10)
    levels = hampton.plant([0.1, 0.3], "R")
    assert np.ptp(levels.Q) == 0 and levels.R[0] == pytest.approx(1) and levels.R[-1] < 1


@pytest.mark.parametrize("jumps", ["Q", "R"])
def test_the_optimal_filter_has_the_optimal_gain(jumps):
    """Its steady gain is the level: the error of the filter with that fixed gain is the same."""
    levels = hampton.plant([0.3], jumps, 4000)
    x, y = hampton.records(levels, 20, 1)
    best, fixed, xp = hampton.kalman(levels, y), np.empty_like(y), np.zeros(20)
    for n in range(len(y)):
        fixed[n] = xp + 0.3 * (y[n] - xp)
        xp = PHI * fixed[n]
    assert np.abs(best - fixed)[1000:].max() < 1e-9
    assert np.mean((fixed - x)[1000:] ** 2) == pytest.approx(0.3, rel=0.03)  # P(n | n) = K R


@pytest.mark.parametrize("gradient", [False, True])
def test_the_filter_is_the_recursion_of_the_paper(gradient):
    """1/n, R from 0: g = 1 at the second sample, then 1/2, ...; K within [0, 1]."""
    y = record()
    found = hampton.follow(y, hampton.Averaging(score=gradient)).K
    for i in range(y.shape[1]):
        gains = np.concatenate([[0.0], 1 / np.arange(1.0, len(y))])
        f, K, prediction, nu, psi, R = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for n, g in enumerate(gains):
            e = y[n, i] - prediction
            f = psi if gradient else PHI * nu
            if n:
                R += g * (f * f - R)
                K = min(1.0, max(0.0, K + g * f * e / R))
            assert found[n, i] == pytest.approx(K, rel=1e-9, abs=1e-12)
            psi = PHI * (1 - K) * psi + PHI * e
            prediction, nu = PHI * (prediction + K * e), e


def test_a_random_walk_is_the_engines():
    """Many records at once against the generic recursion in U-D form; no limits for K."""
    y = record()
    found = hampton.follow(y, hampton.Walk(8e-5, prior=(5.0, 1.0)), limits=(-np.inf, np.inf)).K
    change = engine.Walking(8e-5, 0.04 - 8e-5, prior=(5.0, 1.0))  # it widens P at the first sample too
    none = np.zeros((len(y), 1))
    K = engine.run(engine.hampton(PHI), y[:, :1], none, none[:, 0], change, 0.0, posterior=False, gradient=True).theta
    assert found[:, 0] == pytest.approx(K[:, 0, 0], rel=1e-10, abs=1e-12)


def test_a_restart_is_a_gain_of_one_over_N0():
    class Once(plates.AtTheJumps):
        N0 = (7.0, 3.0)

        def look(self, s):
            return np.full(len(s.y), {40: 1, 60: -1}.get(s.n, 0))

    gains = []

    def noted(t):
        gains.append(1 / t[0])
        return 1 / t

    path = hampton.follow(record(), hampton.Averaging(noted), Once())
    assert gains[39] == pytest.approx(1 / 40)  # the sample that alarms keeps its gain
    assert gains[40:43] == pytest.approx([1 / 7, 1 / 8, 1 / 9]) and gains[60] == pytest.approx(1 / 3)
    assert (path.alarms != 0).sum() == 2 * path.alarms.shape[1]


def sample(n, Z):
    one = np.atleast_1d(np.asarray(Z, float))
    return hampton.Sample(n + hampton.QUIET + 1, one, one, one, one, one, None)


def test_hinkley_is_golden():
    given, expected = CASES["hinkley_two_sided"]["input"], CASES["hinkley_two_sided"]["expected"]
    pair = (given["dmu"], given["h"])
    test, found = detectors.Hinkley(lambda s: s.nu, pair, pair), []
    test.start(1)
    for n, Z in enumerate(given["Z"]):
        fired = int(test.look(sample(n, Z))[0])
        found += [[n + 1, fired]] if fired else []
    assert found == expected["alarms_with_reset"]
    lame = detectors.Hinkley(lambda s: s.nu, (0.25, 2.0), (0.25, 50.0))
    lame.start(1)
    assert [n for n, Z in enumerate(given["Z"]) if lame.look(sample(n, Z))[0]] == [5]  # never a decrease


@pytest.mark.parametrize("mixture", [False, True])
def test_windows_are_sums_of_the_last_signals(mixture):
    """Signals one by one against every window written out; the buffer is emptied at each alarm, and as it gets full."""
    Z = np.random.default_rng(2).standard_normal(700) + 0.4
    Z[300:560] -= 0.4  # longer than the longest window
    threshold = np.exp(6.0) if mixture else 8.0
    test, since, count = detectors.Windows(lambda s: s.nu, threshold, mixture), 0, 0
    test.start(1)
    for n in range(len(Z)):
        fired = test.look(sample(n, Z[n]))[0]
        A = np.cumsum(Z[since : n + 1][::-1])[:200]
        m = np.arange(1, len(A) + 1)
        if mixture:
            size = np.sum(np.exp(0.09 * A**2 / (2 * (1 + 0.09 * m))) / np.sqrt(1 + 0.09 * m))
        else:
            size = np.max(A**2 / (2 * m))
        assert (fired != 0) == (size >= threshold)
        if fired:
            since, count = n + 1, count + 1
    assert count > 1


def test_probes_are_filters_with_fixed_gains():
    """One record in plain Python, step by step as the algorithm is written."""
    levels = hampton.plant(hampton.LEVELS)
    y = hampton.records(levels, 1, 8)[1]
    found = hampton.follow(y, hampton.Averaging(), detectors.Probes(6.17))
    grid, K, R, t, xp, before, c = (0.05, 0.12, 0.25, 0.45, 0.75), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    probes, g, alarms = [0.0] * 5, [0.0] * 5, np.zeros(len(y))
    for n, value in enumerate(y[:, 0]):
        nu, new = value - xp, K
        if n == 0:
            c = nu * nu
        else:
            f = PHI * before
            R += (f * f - R) / t
            new = K + f * nu / R / t
            t += 1
        if n > 20:
            g = [max(0.0, old + (nu**2 - (value - p) ** 2) / (2 * c)) for old, p in zip(g, probes)]
            if max(g) >= 6.17:
                alarms[n] = 1 if grid[g.index(max(g))] > K else -1
                t, g = 26.5, [0.0] * 5
        K = min(1.0, max(0.0, new))
        c += max(1 / 50, 1 / (n + 1)) * (nu * nu - c)
        xp, before = PHI * (xp + K * nu), nu
        probes = [PHI * (p + k * (value - p)) for p, k in zip(probes, grid)]
        assert found.K[n, 0] == pytest.approx(K, rel=1e-8, abs=1e-10)
    assert np.array_equal(found.alarms[:, 0], alarms) and alarms.any()


def test_alarms_are_counted():
    levels = hampton.plant(hampton.LEVELS)
    alarms = np.zeros((2000, 2), np.int8)
    alarms[510, 0] = alarms[700, 0] = 1  # one of them is superfluous
    alarms[1100, :] = -1
    alarms[1600, 1] = -1  # the wrong direction
    seen, delay, false = score.detection(alarms, levels)
    assert seen == pytest.approx([0.5, 1.0, 0.0])
    assert delay[:2] == pytest.approx([10, 100]) and np.isnan(delay[2])
    assert false == pytest.approx(1.0)


# --- run lengths and the linear case ---------------------------------------------------------------------------


def test_the_printed_T1_is_a_negative_control():
    assert lengths.printed(0.3, 3.0) == pytest.approx(38.05, abs=0.01)


def test_simulated_run_lengths():
    """4000 runs: 1.6 % each, so 8 % is five standard errors."""
    assert lengths.simulated(walks.products, 8.0, 0.15, lengths.G, 4000).mean() == pytest.approx(260, rel=0.08)
    assert lengths.simulated(walks.two_sided, 4.0, 0.5, 1.0, 4000).mean() == pytest.approx(335.4 / 2, rel=0.08)


def test_moments_of_the_moving_average():
    a, c = diffusion.A, diffusion.C
    phi_phi, phi_psi, psi_psi = diffusion.moments()
    assert_case(phi_phi, [[(1 + 2 * a * c + c * c) / (1 - a * a), 1], [1, 1]], 1e-12)
    cross = 1 / (1 + a * c)  # of 1/(1 - a/q) and 1/(1 + c/q)
    assert_case(psi_psi, [[1 / (1 - a * a), cross], [cross, 1 / (1 - c * c)]], 1e-12)
    assert_case(phi_psi[1], [1, 1], 1e-12)  # e_{n-1} is new to both filters


def test_loops_compiled_and_not():
    y, theta = linear.series(1.0, 2)
    y, theta = np.ascontiguousarray(y[:, :1500]), np.ascontiguousarray(theta[:, :1500])
    for loop, given in (
        (linear.walk_loop, (0.002, 1.0, 100)),
        (linear.fortescue_loop, (40.0, 100)),
        (linear.hinkley_loop, (0.5, 5.6, 2.07, True, 100)),
        (linear.mixture_loop, (1.0, 500.0, 20, 100)),
    ):
        assert walks.compiled(loop)(y, theta, *given) == pytest.approx(loop(y, theta, *given), rel=1e-12)
    plain, fast = (
        one(np.random.default_rng(1), 2.0, 0.3, 1.0, 50) for one in (walks.products, walks.compiled(walks.products))
    )
    assert np.array_equal(plain, fast)


def test_without_jumps_every_way_is_the_mean():
    """Gains 1/2, 1/3, ... are the mean with one prior sample at 0."""
    y = np.random.default_rng(3).standard_normal((2, 400))
    expected = np.mean((np.cumsum(y, axis=1) / np.arange(2, 402))[:, 100:] ** 2)
    theta = np.zeros_like(y)
    assert linear.walk_loop(y, theta, 0.0, 1.0, 100) == pytest.approx(expected, rel=1e-10)
    assert linear.constant_loop(y, theta, 1e-9, 100) == pytest.approx(expected, rel=1e-10)
    assert linear.hinkley_loop(y, theta, 0.5, 1e9, 5.0, False, 100) == pytest.approx(expected, rel=1e-10)
    assert linear.fortescue_loop(y, theta, 1e12, 100) == pytest.approx(expected, rel=1e-6)
    assert linear.mixture_loop(y, theta, 1.0, 1e15, 60, 100) == pytest.approx(expected, rel=1e-6)


def test_a_warm_start_is_the_posterior_given_the_change_time():
    """One jump of d at a known sample, prior variance d^2: (sum of y)/(L + 1/d^2) about the old estimate."""
    d, L = 2.0, 6
    y = np.concatenate([np.zeros(30), np.full(L, 2.5)])[None]
    theta = np.zeros_like(y)
    h = L * (2.5 - d / 2) - 1e-9 - 0.5 * 2.5  # the sum reaches it with the last sample; x moves a little meanwhile
    ends = [linear.hinkley_loop(y[:, :n], theta[:, :n], d / 2, h, 1 + 1 / d**2, True, n - 1) ** 0.5 for n in (30 + L,)]
    x, t = 0.0, 32.0
    for _ in range(L - 1):
        x, t = x + (2.5 - x) / t, t + 1
    assert ends[0] == pytest.approx(x + L / (L + 1 / d**2) * (2.5 - x), rel=1e-12)
