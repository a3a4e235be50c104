"""The filter of a user's matrices against the dense joint Gaussian, which knows no recursion, and other libraries."""

import numpy as np
import pytest
from oracle.linear_gaussian import SYSTEMS, dense, each, of, random_system

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.models.scale import InverseGamma


def test_it_is_the_dense_joint_gaussian_with_gaps():
    for seed in SYSTEMS:
        system = random_system(seed)
        est, y, u = of(system)
        state = est.scan(y, u).state
        x, P, loglik = dense(*each(system[:6], len(y)), *system[6:])
        np.testing.assert_allclose(est.mean(state), x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(est.covariance(state), P, rtol=1e-9, atol=1e-9)
        assert est.loglik(state) == pytest.approx(loglik, rel=1e-9, abs=1e-9)


def test_matrices_of_every_sample_are_those_of_the_dense_joint_gaussian():
    for seed in range(60):
        F, G, H, D, Q, R, x0, P0, y, u = random_system(seed)
        rng, T = np.random.default_rng(seed), len(y)
        factors = 1 + 0.5 * rng.random((6, T, 1, 1))
        own = [M * f for M, f in zip(each((F, G, H, D, Q, R), T), factors)]
        est, ys, us = of((F, G, H, D, Q, R, x0, P0, y, u))
        names = ["F", "H", "Q", "R"] if us is None else ["F", "G", "H", "D", "Q", "R"]
        matrices = {name: own["FGHDQR".index(name)] for name in names}
        trace = est.scan(ys, us, **matrices)
        x, P, loglik = dense(*own, x0, P0, y, u)
        np.testing.assert_allclose(est.mean(trace.state), x, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(est.covariance(trace.state), P, rtol=1e-9, atol=1e-9)
        assert est.loglik(trace.state) == pytest.approx(loglik, rel=1e-9, abs=1e-9)
        state = est.start()  # one by one: the same bits
        for t in range(T):
            at = {name: M[t] for name, M in matrices.items()}
            state, _ = est.update(state, ys[t], None if us is None else us[t], **at)
        assert same(state, trace.state)


def test_it_is_filterpy():
    filterpy = pytest.importorskip("filterpy.kalman")
    for seed in SYSTEMS:
        F, _, H, _, Q, R, x0, P0, y, _ = random_system(seed)
        y = np.where(np.isnan(y), 0.5, y)  # filterpy takes a measurement as a whole, or none
        y[2] = np.nan
        kf = filterpy.KalmanFilter(len(F), len(H))
        kf.F, kf.H, kf.Q, kf.R, kf.x, kf.P = F, H, Q, R, x0[:, None].copy(), P0.copy()
        est = dw.StateSpace(F, H=H, Q=Q, R=R, x0=x0, P0=P0)
        trace = est.scan(y[:, 0] if len(H) == 1 else y)
        for t in range(len(y)):
            if t:
                kf.predict()
            kf.update(None if t == 2 else y[t][:, None])
            np.testing.assert_allclose(trace.estimates[t], kf.x[:, 0], rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(trace.std[t] ** 2, np.diag(kf.P), rtol=1e-9, atol=1e-9)


def test_it_is_statsmodels_with_gaps():
    KalmanFilter = pytest.importorskip("statsmodels.tsa.statespace.kalman_filter").KalmanFilter
    for seed in SYSTEMS:
        F, _, H, _, Q, R, x0, P0, y, _ = random_system(seed)
        n, p = len(F), len(H)
        kf = KalmanFilter(p, n, k_posdef=n, tolerance=0)  # 0: its gain is never taken for settled
        kf.bind(y.copy())
        kf["transition"], kf["design"], kf["state_cov"], kf["obs_cov"] = F, H, Q, R
        kf["selection"] = np.eye(n)
        kf.initialize_known(x0, P0)
        found = kf.filter()
        est = dw.StateSpace(F, H=H, Q=Q, R=R, x0=x0, P0=P0)
        trace = est.scan(y[:, 0] if p == 1 else y)
        np.testing.assert_allclose(trace.estimates, found.filtered_state.T, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(est.covariance(trace.state), found.filtered_state_cov[..., -1], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(trace.log_density, found.llf_obs, rtol=1e-9, atol=1e-9)


TWO = dict(F=[[0.9, 0.1], [0, 0.8]], H=[[1, 0], [1, 1]], Q=0.1, R=[[1, 0.3], [0.3, 2]], P0=1.0)


@pytest.mark.parametrize(
    "options",
    [
        TWO | dict(G=[[1.0], [0.5]]),
        TWO | dict(gate=dw.InnovationGate(3.0, settle=5), memory=dw.ExponentialForgetting(0.98)),
        TWO | dict(scale=InverseGamma(2.0, 2.0), detector=dw.PageHinkley()),
        dict(F=1.0, Q=0.1, R=1.0, P0=10.0),
        dict(F=[[1, 1], [0, 1]], G=[[0.5], [1]], H=[1, 0], D=0.3, Q=[0.1, 0.1], R=0.0, P0=10.0),
    ],
    ids=["two outputs", "gate and fading", "learnt scale", "walk", "exact"],
)
def test_it_keeps_the_laws(options):
    dw.check_estimator(dw.StateSpace(**options))


def test_a_learnt_scale_makes_the_evidence_that_of_a_students_t():
    from scipy.stats import multivariate_t

    y = np.array([0.3, np.nan, -1.2, 2.0])
    est = dw.StateSpace(0.9, Q=0.5, R=1.0, P0=2.0, scale=InverseGamma(2.0, 3.0))
    M = np.array(
        [
            [
                2.0 * 0.9 ** (s + t) + sum(0.5 * 0.9 ** (s + t - 2 * i) for i in range(1, min(s, t) + 1))
                for s in range(4)
            ]
            for t in range(4)
        ]
    )
    S, seen = M + np.eye(4), [0, 2, 3]
    truth = multivariate_t(shape=1.5 * S[np.ix_(seen, seen)], df=4).logpdf(y[seen])
    assert est.loglik(est.scan(y).state) == pytest.approx(truth, rel=1e-10)


def test_the_gate_keeps_an_outlier_of_one_output_out_and_takes_the_other():
    est = dw.StateSpace(**TWO, gate=dw.InnovationGate(4.0, settle=0))
    rng = np.random.default_rng(1)
    y = rng.standard_normal((50, 2))
    y[30, 0] = 1e3
    without = y.copy()
    without[30, 0] = np.nan
    trace, other = est.scan(y), est.scan(without)
    assert trace.status[30].tolist() == [int(dw.Status.REJECTED), 0]
    np.testing.assert_array_equal(trace.estimates[30], other.estimates[30])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(F=np.ones((2, 3))), "F must be square"),
        (dict(H=np.ones((2, 3))), "H must be \\(p, 2\\)"),
        (dict(G=np.ones((3, 1))), "G must be \\(2, k\\)"),
        (dict(D=1.0), "without G there are no inputs"),
        (dict(Q=[[1, 2], [2, 1]]), "Q must be a covariance, and it has the negative eigenvalue -1"),
        (dict(R=[[1, 0.5], [0, 1]]), "R must be symmetric"),
        (dict(R=None), "R must be given"),
        (dict(F=[[1, np.nan], [0, 1]]), "F\\[0, 1\\] is nan"),
        (dict(P0=[[1, 2], [2, 1]]), "P0 must be a covariance"),
        (dict(memory=dw.RandomWalk(0.1)), "how the state moves is what F and Q say"),
    ],
)
def test_what_does_not_fit_is_a_sentence(change, words):
    with pytest.raises(dw.InputError, match=words):
        dw.StateSpace(**TWO | change)


@pytest.mark.parametrize(
    ("matrices", "words"),
    [
        (dict(F=np.ones((5, 2, 2))), "F has matrices for 5 samples, and y has 10"),
        (dict(B=np.eye(2)), "'B' is no matrix of a sample"),
        (dict(Q=-np.eye(2)), "Q\\[0\\] must be a covariance"),
        (dict(H=np.full((2, 2), np.nan)), "H\\[0, 0\\] is nan"),
    ],
)
def test_matrices_of_a_sample_that_do_not_fit_are_a_sentence(matrices, words):
    with pytest.raises(dw.InputError, match=words):
        dw.StateSpace(**TWO).scan(np.zeros((10, 2)), **matrices)


def test_a_state_that_no_output_shows_is_told_and_no_error():
    est = dw.StateSpace([[1, 0], [0, 0.5]], H=[1, 0], Q=0.1, R=1.0, states=("level", "hidden"))
    assert "hidden cannot be told from y" in est.notes[0]
    assert not dw.StateSpace([[1, 1], [0, 1]], H=[1, 0], Q=0.1, R=1.0).notes
