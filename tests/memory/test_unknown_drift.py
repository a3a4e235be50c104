"""Memories that learn the speed of drift: cases in 50 digits, an oracle that shares no code, published properties."""

import json
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.papers.abid.systems import system
from oracle import drifting, golden
from oracle import drifting_learnt as learnt
from oracle import drifting_matching as matched

import driftwise as dw
from driftwise.cli import specs
from driftwise.engine import compile, ud
from driftwise.memory import auxiliary_filter as auxiliary
from driftwise.memory import covariance_matching as matching
from driftwise.memory import fuzzy_drift as fuzzy
from driftwise.memory import sensitivity
from driftwise.memory.autocovariance_ls import design_size, open_design
from driftwise.memory.gauss_markov import relax
from driftwise.memory.unknown_drift import Sample, open_drift_state, revise

CASES = {c["id"]: c for c in json.loads((Path(__file__).parents[1] / "golden" / "abid.json").read_text())["cases"]}
PHI = (0.5, 0.3, 1.0, 0.09)
CERTAIN = dw.models.InverseGamma(
    1e15, 1e15
)  # sigma^2 is learnt, and known to 1e-12: the same compiled code as for a learnt one


def case(name):
    found = CASES[name]
    return golden.arrays(found["input"]), golden.arrays(found["expected"]), found["rtol"]


def like_the_theory(est, **more):
    """The estimator with the absolute floor of the cases, and P without a cap."""
    policies = list(est.policies)
    memory = policies[2]._replace(floor=1e-8, cap=np.full(4, 1e300), **more)
    policies[2] = memory._replace(learns=0.0) if hasattr(memory, "learns") else memory
    est.policies, est.spec = tuple(policies), est.spec_of(policies)
    return est


def follow(est, y, u):
    """Run uncompiled: filtered parameters, innovations, and q at every sample."""
    rows, outs, found = est._rows(est.start()), np.empty((1, 1, est.n_columns + 8)), []
    for k in range(len(y)):
        compile.plain_driver(*map(type, est.policies))(
            rows, y[None, k : k + 1, None], u[None, k : k + 1], outs, est.spec, est.scratch()
        )
        state = rows.view(est.dtype)
        q = open_drift_state(state["memory_state"].ravel(), 4).q
        found.append((outs[0, 0, est.n_columns : est.n_columns + 4].copy(), outs[0, 0, 1], q.copy()))
    return [np.array(each) for each in zip(*found)]


def sample(given):
    """One sample of a case, in units that clip nothing."""
    P, psi = given["P"], given["psi"]
    b = P @ psi
    unit, phi = np.full(len(psi), 1e3), np.broadcast_to(given.get("Phi", 1.0), len(psi))
    return Sample(psi, b, float(given["eps"]), psi @ b + given["R"], given["R"], 1.0, 100.0, unit, phi)


# --- cases in 50 digits -----------------------------------------------------------------------------------------


def test_fuzzy_table():
    given, expected, tolerance = case("fuzzy_table_linear")
    small, medium, large = given["alpha"]
    rule = fuzzy.FuzzyDriftKernel(
        1.0, (), (), 0.0, 0.0, 1.0, small, medium, large, given["e0"], given["e1"], given["d1"], 0.0, 0.0
    )
    golden.assert_close([fuzzy.table(rule, *x) for x in given["x"]], expected["alpha_i"], tolerance)


def test_published_fuzzy_rule_in_closed_loop():
    given, expected, tolerance = case("fuzzy_kf12")
    memory = dw.memory.FuzzyDrift(tuple(given["alpha"]), (given["e0"], given["e1"]), given["d1"], as_published=True)
    memory = memory._replace(phi=given.get("Phi", 1.0))
    P0 = given.get("P0_diag", 1000.0)
    est = dw.Regression(4, memory=memory, variance=given["sigma2"], P0=P0, at_rest=True)
    theta, eps, q = follow(like_the_theory(est), given["y"], given["psi"])
    for key, got in {"theta_filt": theta, "eps": eps, "q": q}.items():
        golden.assert_close(got, expected[key], tolerance, key)


def test_one_step_of_each_matching_rule():
    given, expected, tolerance = case("covmatch_single_step")
    now, old = sample(given), given["q_old"]
    golden.assert_close(now.T, expected["S"], tolerance)
    rule = matching.CovarianceMatchingKernel(1.0, given["Phi"] * np.ones(2), (), 0.0, 0.0, 1.0, 0.0, given["gain"])
    found = {}
    for key, step in {"q_innovation_EW": matching.match_gain, "online_em_q": matching.climb_em}.items():
        found[key] = old.copy()
        step(rule, now, found[key])
    used = np.diag(given["P"]) - given["prev_PhiPfPhi_diag"]  # q that took P here
    own = np.append(np.zeros(matching.UNIT), old)
    matching.match_myers_tapley(rule, own, now, used)
    found["myers_tapley_q"] = own[matching.UNIT :]
    listener = auxiliary.AuxiliaryFilterKernel(
        1.0, np.ones(2), (), 0.0, 0.0, 1.0, given["lam"], 1.0, np.inf, np.full(2, np.inf)
    )
    own = np.zeros(13)
    second = auxiliary.open_filter(own, 2)
    unit = now.unit
    U, second.D[:] = ud.factor(given["Pq"] / np.outer(unit, unit))
    second.U[:], second.nvr[:], second.unit[:] = U[ud.packed_indices(2)], old / unit, unit
    q = old.copy()
    revise(listener, own, now, None, None, None, q)
    found["aux_q_clamped"] = q
    found["aux_Pq"] = ud.unpack(second.U, second.D) * np.outer(unit, unit)
    for key, value in found.items():
        golden.assert_close(value, expected[key], tolerance, key)


def test_a_variance_that_would_turn_negative_is_clamped():
    given, expected, _ = case("covmatch_negative_guard")
    now, q = sample(given), np.array(given["q_old"], float)
    assert expected["aux_z"] < 0 and matching.excess(now) < 0
    own = np.zeros(matching.UNIT + 2)
    own[matching.UNIT :] = now.unit
    rule = matching.CovarianceMatchingKernel(1.0, np.ones(2), (), 0.0, 0.0, 1.0, 0.0, 1.0)
    for kind in (matching.SCALAR, matching.MYERS):
        revise(rule._replace(rule=float(kind)), own, now, None, None, None, q)
        assert np.all(q == 0)


def test_derivatives_give_the_score():
    """The recursion of theta, P and their derivatives is the gradient of the likelihood, that of log sigma^2 too."""
    given, expected, tolerance = case("score12")
    phi, q, sigma2, N = np.broadcast_to(given.get("Phi", 1.0), 4), given["q"], given["sigma2"], 4
    theta, U, D = np.zeros(N), np.zeros(6), np.broadcast_to(given.get("P0_diag", 1000.0), N).astype(float)
    dtheta, dP, score, d = np.zeros((5, N)), np.zeros((5, 10)), np.zeros(5), [0.0, 0.0, 0.0, 0.0, sigma2]
    f, b, v = np.zeros((3, N))
    for y, psi in zip(given["y"], given["psi"]):
        e = y - psi @ theta
        ud.project(U, psi, f)
        T = ud.correct(U, D, f, sigma2, b)
        theta += b * e / T
        for j in range(5):
            dT = sensitivity.follow_covariance(dP[j], psi, b / T, d[j], 1.0, v)
            de = sensitivity.follow_mean(dtheta[j], psi, b / T, e / T, dT, 1.0, v)
            score[j] -= 0.5 * (dT / T * (1 - e * e / T) + 2 * e * de / T)
            sensitivity.pass_time(dtheta[j], dP[j], phi)
        relax(theta, U, D, phi, b)
        for i in range(N):
            ud.widen(U, D, i, q[i], b)
            sensitivity.add_variance(dP[i], i, q[i])
    golden.assert_close(score, expected["score"], tolerance)


# --- the oracle -------------------------------------------------------------------------------------------------

TWINS: dict[str, tuple] = {
    "fuzzy": (dw.memory.FuzzyDrift(), lambda: drifting.Fuzzy(delayed=False)),
    "fuzzy, published": (dw.memory.FuzzyDrift(as_published=True), drifting.Fuzzy),
    "fuzzy, geometric": (dw.memory.FuzzyDrift(geometric=True), lambda: drifting.Fuzzy(geometric=True, delayed=False)),
    "scalar": (dw.memory.CovarianceMatching(), matched.Scalar),
    "gain": (dw.memory.CovarianceMatching("gain"), matched.Increment),
    "myers-tapley": (dw.memory.CovarianceMatching("myers-tapley"), matched.MyersTapley),
    "em": (dw.memory.CovarianceMatching("em"), matched.OnlineEM),
    "auxiliary": (dw.memory.AuxiliaryFilter(), matched.Auxiliary),
    "correlation": (dw.memory.AutocovarianceLS(), learnt.Correlation),
    "likelihood": (dw.memory.LikelihoodDrift(), learnt.Likelihood),
    "likelihood, shared": (dw.memory.LikelihoodDrift(shared=True), lambda: learnt.Likelihood(shared=True)),
    "variational drift": (dw.memory.VariationalBayes(), lambda: learnt.Huang(fixed=True)),
    "variational noise": (dw.memory.VariationalBayes("noise"), learnt.SarkkaNummenmaa),
    "variational both": (dw.memory.VariationalBayes("both"), learnt.Huang),
}
PRIORS = {"variational noise": 5.0, "variational both": np.exp(4) / 2}  # theirs of sigma^2: weights


@pytest.fixture(scope="module")
def records():
    return {"a": system("a", 1), "c": system("c", 1)}


@pytest.mark.parametrize("name", TWINS)
def test_every_policy_is_its_plain_twin(name, records):
    memory, twin = TWINS[name]
    weight = PRIORS.get(name)
    scale, more = (dw.models.InverseGamma(weight, weight), {}) if weight else (CERTAIN, {"discount": 1.0})
    for which, s in records.items():
        options = dict(memory=memory._replace(phi=tuple(s.phi)), at_rest=True, variance=0.02, scale=scale, P0=1000.0)
        est = dw.ARX(2, 2, **options) if which == "a" else dw.Regression(4, **options)
        y, u, psi = s.y[:, :300], s.u[0, :300], s.psi[:, :300]
        run, trace = drifting.run(twin(), y, psi, s.phi, 0.02), like_the_theory(est, **more).scan(y[0], u)
        np.testing.assert_allclose(trace.parameters, run.theta_f[0], rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(trace.variance, run.S[0], rtol=1e-8)
        np.testing.assert_allclose(trace.parameters_std**2, drifting.diag(run.P_f[0]), rtol=1e-7)


# --- published properties ---------------------------------------------------------------------------------------


def test_fuzzy_covariance_lies_between_those_of_its_extreme_levels(records):
    s, P = records["c"], {}
    est = dw.Regression(4, memory=dw.memory.FuzzyDrift(), variance=0.02, scale=CERTAIN, at_rest=True)
    rule = est.policies[2]
    for level in (None, rule.small, rule.large):
        one = {} if level is None else dict(small=level, medium=level, large=level)
        policies = (*est.policies[:2], rule._replace(**one), *est.policies[3:])
        est.spec = est.spec_of(policies)
        row, found = est.start(), []
        for y, u in zip(s.y[0, :200], s.u[0, :200]):
            row, _ = est.update(row, y, u)
            found.append(ud.unpack(row["U"], row["D"]))
        P[level] = np.array(found)
    for wide, narrow in ((P[None], P[rule.small]), (P[rule.large], P[None])):
        size = np.trace(wide, axis1=1, axis2=2)
        assert np.all(np.linalg.eigvalsh(wide - narrow).min(-1) >= -1e-9 * size)
    assert np.abs(P[None] - P[rule.small]).max() > 0 and np.abs(P[None] - P[rule.large]).max() > 0


@pytest.mark.parametrize("name", TWINS)
def test_a_change_of_units_changes_nothing(name, records):
    s, c, g = records["a"], 1000.0, 0.01
    est = dw.ARX(2, 2, memory=TWINS[name][0])
    other = dw.ARX(2, 2, memory=TWINS[name][0], y_scale=c, u_scale=g)
    y, u = s.y[0, :300], s.u[0, :300]
    one, two = est.scan(y, u), other.scan(c * y, g * u)
    np.testing.assert_allclose(c * one.prediction, two.prediction, rtol=1e-9, atol=1e-9 * c)
    np.testing.assert_allclose(one.parameters * [1, 1, c / g, c / g], two.parameters, rtol=1e-9, atol=1e-8)


def test_covariance_matching_on_unequal_speeds():
    """The published row: S > 0 and P >= 0 always, and errors at most 1.45 times those of the filter that knows."""
    s = system("c", 100)
    for rule in matching.RULES[:3]:
        est = dw.Regression(4, memory=dw.memory.CovarianceMatching(rule), variance=0.02, scale=CERTAIN, at_rest=True)
        rows, outs = est._rows(est.start(100), is_one=False), np.empty((100, 600, est.n_columns + 8))
        est.drive(rows, s.y[..., None], s.u, outs, est.spec, est.scratch())
        assert np.all(outs[..., 2] > 0) and np.all(rows.view(est.dtype)["D"] >= 0)
        error = (outs[..., est.n_columns : est.n_columns + 4] - s.theta)[:, 50:]
        assert np.sqrt(np.mean(error**2)) <= 1.45 * 0.0442  # of the filter that knows


def test_correlation_learns_speeds_where_the_noise_is_unknown():
    """Without being told sigma^2, least squares on correlations orders the speeds of (c): 1e-3, 1e-4, 1e-5, 0."""
    s = system("c", 20)
    est = dw.Regression(4, memory=dw.memory.AutocovarianceLS(), at_rest=True)
    states, _ = est.update_batch(est.start(20), s.y, s.u)
    own = states["memory_state"][:, -design_size(4, 10) :]
    x = np.median([open_design(row, 4, 10).x for row in own], axis=0)
    assert x[0] > 2 * x[1] > 0 and x[1] > 2 * x[2] and x[3] < 1e-3


# --- what is left of a parameter that relaxes ------------------------------------------------------------------------


def test_a_variance_that_relaxes_to_nothing_leaves_no_infinity():
    """Relative to it the column of U would overflow; what the others shared with it stays theirs."""
    theta, U, D, phi, a = np.ones(2), np.array([0.7]), np.array([0.5, 2.0]), np.array([1.0, 0.09]), np.zeros(2)
    for _ in range(1000):
        relax(theta, U, D, phi, a)
    assert np.isfinite([*U, *D]).all() and D[1] == 0
    assert ud.variance(U, D, 0) == pytest.approx(0.5 + 0.7**2 * 2.0, rel=1e-12)


# --- the door ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "memory, words",
    [
        ("ekf", "cross-covariance of theta and log q stays exactly 0"),
        ("likelihood", "words are for --memory"),
        (dw.memory.FuzzyDrift(levels=(1, 0.1, 0.01)), "levels must be 3 numbers that rise"),
        (dw.memory.FuzzyDrift(error=(3, 1)), "error must be 2 numbers that rise"),
        (dw.memory.FuzzyDrift(as_published="yes"), "as_published must be True or False"),
        (dw.memory.CovarianceMatching("sage"), "rule must be one of scalar, gain"),
        (dw.memory.CovarianceMatching(gain=2.0), "gain is a share"),
        (dw.memory.AuxiliaryFilter(forgetting=1.1), "forgetting is a share"),
        (dw.memory.AutocovarianceLS(lags=0), "lags must be a whole number of at least 1"),
        (dw.memory.AutocovarianceLS(lags=10_000_000), "take fewer lags"),
        (dw.memory.LikelihoodDrift(start=100.0), "start lies between least and most"),
        (dw.memory.LikelihoodDrift(phi=1.5), "phi is a share that remains"),
        (dw.memory.VariationalBayes("noise"), "variance=.. says it is known"),
        (dw.memory.VariationalBayes("q"), "rule must be one of noise, both, drift"),
    ],
    ids=repr,
)
def test_what_cannot_be_is_refused_with_the_reason(memory, words):
    with pytest.raises(dw.InputError, match=words.replace("(", r"\(")):
        dw.ARX(2, 2, memory=memory, variance=1.0)


def test_the_command_line_names_them():
    assert specs.memory("fuzzy") == dw.memory.FuzzyDrift()
    assert specs.memory("matching:gain") == dw.memory.CovarianceMatching("gain")
    assert specs.memory("variational:both") == dw.memory.VariationalBayes("both")
    assert specs.memory("drift:1e-3/0.9") == dw.memory.Drift(phi=0.9, nvr=1e-3)
    assert specs.memory("drift:1e-3,1e-4") == dw.memory.Drift(nvr=(1e-3, 1e-4))
    with pytest.raises(dw.InputError, match="log q"):
        specs.memory("ekf")
