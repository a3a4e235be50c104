"""Banks of speeds, and `AutoMemory`: equal to plain NumPy that shares no code, and to cases in 50 digits."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from draws import slow
from driftwise_studies.papers.abid.systems import system
from oracle import auto, banks, golden
from scipy import stats

import driftwise as dw
from driftwise.engine import compile
from driftwise.memory.bank import open_bank
from driftwise.memory.modes import CHI2, FREEDOM, WEIGHT, fall, height, mode, outlier
from driftwise.memory.unknown_drift import open_drift_state

CASES = {c["id"]: c for c in json.loads((Path(__file__).parents[1] / "golden" / "abid.json").read_text())["cases"]}
BITS = {"jump": dw.Status.JUMP, "noise level": dw.Status.NOISE, "outlier": dw.Status.OUTLIER}
SERIES, TOLD = 3, 0.02
# How much of a system is enough to reach what it is there for: its jumps, its outliers, its rest and what follows.
SAMPLES = {"a": np.r_[:150], "c": np.r_[:350], "d": np.r_[:460], "rest": np.r_[:400, 1150:1400]}


def drive(est, y, psi, plain=False):
    """Columns of many series at once: innovation, T, filtered parameters and their variances, status, statistic."""
    rows, outs = est._rows(est.start(len(y)), is_one=False), np.empty((*y.shape, est.n_columns + 8))
    run = compile.plain_driver(*map(type, est.policies)) if plain else est.drive
    run(rows, np.ascontiguousarray(y[..., None]), np.ascontiguousarray(psi), outs, est.spec, est.scratch())
    theta, std = outs[..., est.n_columns : est.n_columns + 4], outs[..., est.n_columns + 4 :]
    return outs[..., 1], outs[..., 2], theta, std**2, outs[..., 3].astype(int), outs[..., 5]


@cache
def records(early=100.0):
    """Records that reach every branch: gaps, outliers early and late, jumps, louder noise, a plant at rest."""
    found = {}
    for name, samples in SAMPLES.items():
        s, rng = system(name, SERIES), np.random.default_rng(7)
        y, psi = s.y[:, samples], s.psi[:, samples]
        y[:, 1:][rng.uniform(size=y[:, 1:].shape) < 0.02] = np.nan
        y[1] += 3.0 * (rng.uniform(size=y.shape[1]) < 0.03)
        y[1, 2], y[2, 6], y[0, -10] = 30.0, early, 30.0
        if name == "c":
            y[0, 250:] += 0.6 * rng.standard_normal(y.shape[1] - 250)
        if name == "d":  # a burst that looks like louder noise, and more of its kind
            y[2, 310:322] += 6.0 * np.array([1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1])
            y[2, 340:410:15] += 6.0
        found[name] = y, psi, s.phi
    return found


def compare(est, y, psi, run, plain=False):
    eps, T, theta, P, status, statistic = drive(est, y, psi, plain)
    np.testing.assert_allclose(theta, run.theta, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(T, run.S, rtol=1e-7)
    np.testing.assert_allclose(P, run.P, rtol=1e-7)
    np.testing.assert_allclose(eps, run.eps, rtol=1e-7, atol=1e-7)
    return status, statistic


@pytest.mark.parametrize(
    "expect, told",
    [("both", None), ("both", TOLD), ("jumps", None), ("outliers", None), slow("jumps", TOLD), slow("outliers", TOLD)],
)
def test_auto_is_its_plain_twin(expect, told):
    kinds = set()
    # where every sample counts one 700 deviations off leaves the weights to differences of numbers 1e5 times as large
    for y, psi, phi in records(100.0 if told is None else 30.0).values():
        P0 = 1e4 if told is None else 1e3
        est = dw.Regression(4, memory=dw.AutoMemory(expect, phi=tuple(phi)), at_rest=True, P0=P0, variance=told)
        run = auto.run_auto(y, psi, phi, told, expect=expect, P0=P0 / (told or 1.0))
        status, statistic = compare(est, y, psi, run)
        seen = np.isfinite(y)
        np.testing.assert_allclose(statistic[seen], run.odds[seen], rtol=1e-7, atol=1e-7)
        seen = [(int(s), int(k), kind) for kind, bit in BITS.items() for s, k in zip(*np.nonzero(status & bit))]
        assert sorted(seen) == sorted(run.events)
        kinds |= {kind for *_, kind in seen}
    expected = {"both": set(BITS), "jumps": {"jump", "noise level"}, "outliers": {"outlier", "noise level"}}[expect]
    assert kinds == expected - ({"noise level"} if told else set())


@pytest.mark.parametrize("seed", [1, 5])
def test_auto_is_its_plain_twin_where_noise_becomes_louder_among_outliers(seed):
    """In five of these eight series the filter with louder noise takes over."""
    rng, size = np.random.default_rng(seed), (4, 520)
    psi, sigma = rng.standard_normal((*size, 4)), np.where(np.arange(520) < 380, 1.0, 2.0)
    e = rng.standard_normal(size) + 20.0 * rng.choice([-1.0, 1.0], size) * (rng.random(size) < 0.04)
    y = psi.sum(axis=2) + sigma * e
    run = auto.run_auto(y, psi, np.ones(4))
    status, _ = compare(dw.Regression(4, memory=dw.AutoMemory(), at_rest=True, P0=1e4), y, psi, run)
    told = [(int(s), int(k), "noise level") for s, k in zip(*np.nonzero(status & BITS["noise level"]))]
    assert len(told) == 4 and told == sorted(event for event in run.events if event[2] == "noise level")


BANKS = {
    "bank": (dw.memory.MultipleModel(), banks.LEVELS, None),
    "interacting": (dw.memory.IMM(stay=0.98, jumps=0.0), banks.LEVELS, banks.staying(7, 0.98)),
    "with a jump mode": (dw.memory.IMM(), (*banks.LEVELS, 1.0), banks.staying_with_jump(8)),
}


@pytest.mark.parametrize("name", BANKS)
@pytest.mark.parametrize("told", [None, TOLD], ids=["noise learnt", "noise known"])
def test_every_bank_is_its_plain_twin(name, told):
    memory, levels, A = BANKS[name]
    for which, (y, psi, phi) in records().items():
        P0, M = 1e4 if told is None else 1e3, len(levels)
        est = dw.Regression(4, memory=memory._replace(phi=tuple(phi)), at_rest=True, P0=P0, variance=told)
        relative = P0 / (told or 1.0)
        first = dict(nu=-3.0, chi2=0.0) if told is None else dict(nu=2.0, chi2=2 * told)
        first, cap = banks.start(SERIES, M, 4, relative, **first), 2 * relative
        if told is None:
            compare(est, y, psi, banks.run_bank(y, psi, phi, first, levels=levels, learnt=True, A=A, cap=cap))
        elif which == "d":  # uncompiled
            short = slice(0, 60)
            part = banks.run_bank(y[:, short], psi[:, short], phi, first, levels=levels, learnt=False, A=A, cap=cap)
            compare(est, y[:, short], psi[:, short], part, plain=True)


def test_bank_of_two_is_the_case_in_50_digits():
    case = CASES["bank2_normal_invgamma"]
    given, expected = golden.arrays(case["input"]), golden.arrays(case["expected"])
    memory, scale = dw.memory.MultipleModel(levels=(0.0, 1e-2)), dw.models.InverseGamma(0.5, 0.5)
    est = dw.Regression(2, memory=memory, variance=0.02, scale=scale, P0=1.0, at_rest=True)
    policies = list(est.policies)  # the absolute floor of the case, no cap, no guard
    policies[2] = policies[2]._replace(floor=1e-8, cap=np.full(2, 1e300), moving=0.0)
    est.policies, est.spec = tuple(policies), est.spec_of(policies)
    state, after = est.start(), expected["weights_after_update"] ** 0.99
    faded = after / after.sum(axis=1, keepdims=True)
    for k, (y, psi) in enumerate(zip(given["y"], given["psi"])):
        state, _ = est.update(state, y, psi)
        own = open_bank(open_drift_state(state["memory_state"].ravel(), 2).own, 2, 2)
        each = np.array([mode(own.bank, m, 2).own for m in range(2)])
        golden.assert_close(each[:, WEIGHT], faded[k], case["rtol"], f"weights of sample {k}")
        golden.assert_close(0.02 * each[:, CHI2] / each[:, FREEDOM], expected["sigma2_each"][k], case["rtol"])
    theta = est.scan(given["y"], given["psi"]).parameters
    golden.assert_close(theta, expected["theta_mixture"], case["rtol"])


def test_the_density_is_that_of_student():
    for nu in (1.0, 7.5, 49.9, 50.0, 60.0, 199.0):
        for z in (0.0, 45.0, 1250.0):
            expected = stats.t.logpdf(np.sqrt(z), nu) + 0.5 * np.log(2.0 * np.pi)
            assert height(nu) + fall(nu, z) == pytest.approx(expected, abs=2e-12)
    assert height(np.inf) + fall(np.inf, 4.5) == -2.25


def test_an_error_is_an_outlier_by_the_odds_of_two_densities():
    narrow, share = 1.0 / 400.0, 0.01
    for nu in (1.0, 7.5, 60.0, np.inf):
        for z in (0.0, 1.0, 9.0, 45.0, 1250.0):
            log_p, factor, rho = outlier(nu, z, narrow, share)
            plain = (1.0 - share) * np.exp(height(nu) + fall(nu, z))
            wild = share * np.sqrt(narrow) * np.exp(height(nu) + fall(nu, z * narrow))
            assert log_p + np.log(factor) == pytest.approx(np.log(plain + wild), abs=1e-13)
            assert rho == pytest.approx(wild / (plain + wild), rel=1e-13)


def test_interacting_tells_jumps_where_they_are():
    """Nowhere else; a large one now and then twice, as its mode falls below one half and rises again."""
    series = 60
    s = system("d", series)
    status, statistic = drive(dw.Regression(4, memory=dw.memory.IMM(), at_rest=True), s.y, s.psi)[-2:]
    told = (status & dw.Status.JUMP) > 0
    found = [told[:, k : k + 21] for k in s.jumps]
    assert all(f.any(axis=1).mean() >= 0.92 for f in found)
    assert told.sum() == sum(f.sum() for f in found) <= 1.5 * 2 * series
    assert np.all(statistic[told] > 1) and not np.any(told[:, 1:] & told[:, :-1])


def test_weight_is_how_many_samples_count():
    """n over the mean leverage psi' P psi/S, which sigma^2 = .02 gives away."""
    s = system("c", 1)
    trace = dw.Regression(4, memory=dw.AutoMemory(), variance=TOLD, at_rest=True).scan(s.y[0], s.psi[0])
    mean, weights = 0.0, []
    for k, leverage in enumerate(1 - TOLD / trace.variance):
        mean += max(1 / (k + 1), 0.05) * (leverage - mean)
        weights.append(4 / mean)
    np.testing.assert_allclose(trace.weight, weights, rtol=1e-9)
