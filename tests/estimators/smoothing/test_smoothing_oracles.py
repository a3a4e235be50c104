"""Drift learnt from a record, and smoothing under it, against 50-digit cases, dense Gaussians and other libraries."""

import json
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.papers.abid.systems import system

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten
from driftwise.estimators.smoothing import likelihood, moments, passes
from driftwise.estimators.smoothing.fit import BOUNDS, most_likely
from driftwise.estimators.smoothing.likelihood import Likelihood
from driftwise.estimators.smoothing.record import Record

CASES = {
    case["id"]: case for case in json.loads((Path(__file__).parents[2] / "golden" / "abid.json").read_text())["cases"]
}


def golden(name):
    """Return the record of an exact case, its Q over sigma^2 and what is expected."""
    given, expected = CASES[name]["input"], CASES[name]["expected"]
    y, s2, n = np.array(given["y"], float), given["sigma2"], len(given["Phi"])
    prior = np.array(given.get("theta0", np.zeros(n)), float), np.eye(n) * given["P0_diag"] / s2
    q = np.broadcast_to(np.array(given.get("q", 0.0), float) / s2, (len(y), n))
    return Record(y, np.array(given["psi"]), prior, np.array(given["Phi"]), s2, skip=0), q, expected


def under(record, q):
    """Return the likelihood of a record whose Q is given for each sample."""
    found = Likelihood(record, "walk")
    found.extra = np.array(q)
    return found


class TestExactCases:
    @pytest.mark.parametrize("name", ["kf10_paper_correct", "kf10_tvQ_missing"])
    def test_likelihood(self, name):
        record, q, expected = golden(name)
        found = under(record, q).at(np.zeros(4), with_gradient=False).loglik
        assert found == pytest.approx(expected["loglik"], rel=1e-10)

    def test_likelihood_has_an_interior_maximum(self):
        record, _, expected = golden("likelihood_profile")
        rows = np.array(expected["rows_log10q_ll_eq14"])
        found = [under(record, np.full((40, 4), 10.0**q / 0.02)).at(np.zeros(4), False).loglik for q in rows[:, 0]]
        np.testing.assert_allclose(found, rows[:, 1], rtol=1e-9)
        assert 0 < np.argmax(found) < len(found) - 1

    def test_score(self):
        record, q, expected = golden("score12")
        point = Likelihood(record, "walk").at(q[0] * record.power)
        assert point.loglik == pytest.approx(expected["loglik"], rel=1e-10)
        np.testing.assert_allclose(point.gradient, expected["score"][:4], rtol=1e-9, atol=1e-12)

    def test_smoother_and_a_step_of_expectation_maximisation(self):
        """The mean square of the smoothed steps, from r and N: q + q (r^2/s2 - N) q."""
        record, q, expected = golden("rts12_em")
        found, s2 = under(record, q), record.variance
        _, out = found.moments(np.zeros(4))
        diagonal = [4, 6, 9, 13]
        np.testing.assert_allclose(out[:, :4], expected["theta_smooth"], rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(s2 * out[:, diagonal], expected["P_smooth_diag"], rtol=1e-10)
        r, N = (of_each[:-1] for of_each in found.disturbances(np.zeros(4)))
        np.testing.assert_allclose(s2 * np.mean(q[:-1] + q[:-1] ** 2 * (r**2 / s2 - N), axis=0), expected["em_q"])
        P = np.zeros((len(out), 4, 4))
        j, i = np.tril_indices(4)
        P[:, i, j] = P[:, j, i] = out[:, 4:]
        spread = s2 * np.einsum("ti,tij,tj->t", record.psi, P, record.psi)
        error = record.y - (record.psi * out[:, :4]).sum(axis=1)
        assert np.mean(error**2 + spread) == pytest.approx(expected["em_sigma2"], rel=1e-10)


def small(rng, T=14, n=2, phi=(1.0, 1.0), variance=0.3):
    """Return a record with gaps and correlated prior."""
    y, psi = rng.standard_normal(T), rng.standard_normal((T, n))
    y[[3, 4]] = np.nan
    psi[[3, 4]] = 0.0
    prior = rng.standard_normal(n), np.array([[2.0, 0.5], [0.5, 1.0]]) / variance
    return Record(y, psi, prior, np.array(phi), variance, skip=0)


def stacked(found, nvr, ends):
    """Return log L, and theta and P of each sample given those up to ``ends``: one Gaussian of all states."""
    record, n, m, T = found.record, found.n, found.m, len(found.rows)
    A = np.eye(m)
    A[:n, :n] = np.diag(record.phi)
    A[:n, n:] = np.eye(n)[:, : m - n]
    q = found.variances(nvr)
    mean, P = np.zeros(m), np.zeros((m, m))
    mean[:n], P[:n, :n] = record.prior
    P[range(n, m), range(n, m)] = likelihood.SLOPE * found.unit[: m - n]
    means, C = [], np.zeros((T * m, T * m))
    for t in range(T):
        at = slice(t * m, t * m + m)
        means.append(mean)
        C[at, at] = P
        for past in range(t):
            before = slice(past * m, past * m + m)
            C[at, before] = A @ C[(t - 1) * m : t * m, before]
            C[before, at] = C[at, before].T
        mean, P = A @ mean, A @ P @ A.T + np.diag(q[t])
    H = np.zeros((T, T * m))
    for t in range(T):
        H[t, t * m : t * m + m] = found.rows[t, 1:]
    means, theta, cov = np.concatenate(means), [], []
    for t, end in enumerate(ends):
        seen = record.known & (np.arange(T) <= end)
        S = H[seen] @ C @ H[seen].T + np.eye(seen.sum())
        e = record.y[seen] - H[seen] @ means
        at, gain = slice(t * m, t * m + n), np.linalg.solve(S, H[seen] @ C).T
        theta.append((means + gain @ e)[at])
        cov.append((C - gain @ H[seen] @ C)[at, at])
    s2 = record.variance
    loglik = -0.5 * (np.linalg.slogdet(2 * np.pi * s2 * S)[1] + e @ np.linalg.solve(S, e) / s2)
    return loglik, np.array(theta), np.array(cov)


SETTINGS = [
    ("walk", (1.0, 1.0), (0.3, 0.0), ()),
    ("walk", (0.6, 0.0), (0.2, 0.1), (8,)),
    ("integrated", (1.0, 1.0), (0.02, 0.0), (9,)),
    ("integrated", (0.9, 1.0), (0.0, 0.05), ()),
]


@pytest.mark.parametrize(("drift", "phi", "nvr", "jumped"), SETTINGS, ids=str)
def test_moments_and_likelihood_are_those_of_one_gaussian(drift, phi, nvr, jumped):
    """Gaps, parameters that do not drift, jumps, and both horizons."""
    record = small(np.random.default_rng(1), phi=phi)
    found, nvr, T = Likelihood(record, drift, jumped), np.array(nvr), len(record.y)
    for lag, ends in ((None, np.full(T, T - 1)), (3, np.minimum(np.arange(T) + 3, T - 1))):
        loglik, theta, P = stacked(found, nvr, ends)
        _, out = found.moments(nvr, lag)
        np.testing.assert_allclose(out[:, :2], theta, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(out[:, 2:], P[:, [0, 0, 1], [0, 1, 1]], rtol=1e-9, atol=1e-10)
        if lag is None:
            assert found.at(nvr).loglik == pytest.approx(loglik, rel=1e-11)


@pytest.mark.parametrize("drift", ["walk", "integrated"])
@pytest.mark.parametrize("variance", [0.3, None], ids=["known", "learnt"])
def test_gradient_and_information_are_derivatives(drift, variance):
    """Both by central differences, sigma^2 concentrated out or not; the first rows skipped; a gap and a jump."""
    record = small(np.random.default_rng(2), T=40, phi=(1.0, 0.9))
    record = Record(record.y, record.psi, record.prior, record.phi, variance, skip=5)
    found, z, h = Likelihood(record, drift, (20,)), np.log([0.2, 0.03]), 1e-4
    point = found.at(np.exp(z))
    e, S = (found.kept[found.counted, i].copy() for i in (passes.EPS, passes.VARIANCE))
    slopes, de, dS = [], [], []
    for step in h * np.eye(2):
        side = []
        for sign in (1, -1):
            loglik = found.at(np.exp(z + sign * step)).loglik
            side.append((loglik, *(found.kept[found.counted, i].copy() for i in (passes.EPS, passes.VARIANCE))))
        loglik, e_slope, S_slope = ((up - down) / (2 * h) for up, down in zip(*side))
        slopes.append(loglik), de.append(e_slope), dS.append(S_slope)
    np.testing.assert_allclose(point.gradient, slopes, rtol=1e-6)
    dS, de = np.array([*dS, S]), np.array([*de, 0 * e])
    expected = 0.5 * (dS / S**2) @ dS.T + (de / S) @ de.T / point.s2
    np.testing.assert_allclose(found.information(np.exp(z), point.s2), expected, rtol=1e-6)


def test_compiled_passes_are_the_plain_ones():
    record = small(np.random.default_rng(3), T=30)
    found, nvr = Likelihood(record, "integrated", (12,)), np.array([1e-3, 0.0])
    kept, out = found.moments(nvr, lag=2)
    q = found.variances(nvr)
    tasks = {
        passes.Forward: (passes.Forward(*found.motion), np.empty_like(kept), passes.NONE, found.start.copy()),
        passes.Disturbances: (passes.Disturbances(*found.motion), kept, found.room, found.scratch),
        moments.Backward: (moments.Backward(*found.motion, 2.0), kept, np.empty_like(out), np.empty(200)),
        passes.Information: (
            passes.Information(*found.motion, nvr * found.unit, 0.3, 4.0), kept, np.zeros((3, 3)), np.zeros(200),
        ),
    }  # fmt: skip
    for kind, (task, notes, result, numbers) in tasks.items():
        both = []
        for run in (compile.passage(kind), compile.plain_passage(kind)):
            arrays = notes.copy(), result.copy(), numbers.copy()
            run(found.rows, q, *arrays, flatten((task,)))
            both.append(arrays)
        for one, other in zip(*both):
            np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("name", ["c", "d"])
def test_most_likely_drift_is_that_of_l_bfgs(name):
    """One start each: SciPy's optimiser on the same likelihood finds nothing better."""
    from scipy.optimize import minimize

    found = dw.Regression(4).smooth(system(name, 1).y[0], system(name, 1).psi[0], drift="walk", jumps=None)
    cost = found.hindsight.fit.likelihood

    def negative(z):
        point = cost.at(np.exp(z))
        return -point.loglik, -point.gradient

    box = [tuple(np.log(BOUNDS["walk"]))] * 4
    other = minimize(negative, np.full(4, np.log(1e-2)), jac=True, method="L-BFGS-B", bounds=box)
    assert found.loglik > -other.fun - 1e-4


def test_statsmodels_agrees():
    """States, log-likelihood and the maximum of it, by a model built by hand from the same matrices."""
    mlemodel = pytest.importorskip("statsmodels.tsa.statespace.mlemodel")
    made = system("c", 1)
    y, psi, n = made.y[0], made.psi[0], 4
    record = Record(y, psi, (np.zeros(n), np.eye(n) * 1e6), np.ones(n), skip=2 * n)
    found = most_likely(Likelihood(record, "walk"))

    class Walks(mlemodel.MLEModel):
        def __init__(self):
            super().__init__(y, k_states=n, k_posdef=n, loglikelihood_burn=2 * n)
            self["design"] = psi.T[None]
            self["transition"] = self["selection"] = np.eye(n)

        start_params = np.zeros(n + 1)

        def update(self, params, **options):
            super().update(params, **options)
            q, s2 = np.exp(params[:n]) * found.likelihood.unit, np.exp(params[n])
            self["obs_cov", 0, 0], self["state_cov"] = s2, np.diag(q * s2)
            self.ssm.initialize_known(np.zeros(n), np.eye(n) * 1e6 * s2)

    model = Walks()
    model.ssm.tolerance = 0  # exact: no switch to a steady state
    with np.errstate(divide="ignore"):
        at = np.append(np.log(np.maximum(found.nvr, 1e-9)), np.log(found.s2))
    theirs = model.smooth(at, cov_type="none")
    point = found.likelihood.at(np.exp(at[:n]))
    assert point.loglik == pytest.approx(theirs.llf, abs=1e-8)
    _, out = found.likelihood.moments(np.exp(at[:n]))
    np.testing.assert_allclose(out[:, :n], theirs.smoothed_state.T, rtol=0, atol=1e-8)
    best = model.fit(at + 0.3, disp=False, maxiter=200, cov_type="none")
    assert found.loglik >= best.llf - 1e-3
