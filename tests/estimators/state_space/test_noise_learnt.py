"""Q and R of unknown size: learnt as samples come, or from a record; honest on drawn worlds."""

import numpy as np
import pytest
from oracle.linear_gaussian import of, random_system

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.memory.likelihood_drift import open_learner

F, H, Q = np.array([[1.0, 1.0], [0.0, 1.0]]), [1.0, 0.0], 0.01 * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]])


def drawn(seed, T=1500, factor=1.0, loud=1.0):
    """Return states and outputs of a position whose speed wanders; the last third is ``loud`` times as loud."""
    rng = np.random.default_rng(seed)
    x, states = np.zeros(2), np.zeros((T, 2))
    level = np.where(np.arange(T) < 2 * T // 3, 1.0, loud)
    L = np.linalg.cholesky(factor * Q)
    for t in range(T):
        x = F @ x + level[t] * (L @ rng.standard_normal(2))
        states[t] = x
    return states, states[:, 0] + level * rng.standard_normal(T)


def test_the_derivatives_are_those_of_the_filter():
    compared = 0
    for seed in range(40):
        system = random_system(seed, T=3)
        est, y, u = of(system, memory=dw.memory.LikelihoodDrift())
        state = est.scan(y, u).state
        learner = open_learner(np.array(state["memory_state"]), est.model.n, 1)
        assert (learner.eta[0] == 0.0) == (state["observed"] <= 2 * est.model.n + 1)
        if learner.eta[0] != 0.0:  # it has begun to learn: another Q than that of one factor
            continue
        h, ends, compared = 1e-5, [], compared + 1
        for way in (h, -h):
            other, y, u = of((*system[:4], np.exp(way) * system[4], *system[5:]))
            ends.append((other.mean(end := other.scan(y, u).state), other.covariance(end)))
        n = est.model.n
        dP = np.zeros((n, n))
        for j in range(n):
            for i in range(j + 1):
                dP[i, j] = dP[j, i] = learner.dP[j * (j + 1) // 2 + i]
        np.testing.assert_allclose(learner.dtheta, (ends[0][0] - ends[1][0]) / (2 * h), rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(dP, (ends[0][1] - ends[1][1]) / (2 * h), rtol=1e-6, atol=1e-7)
    assert compared > 15


@pytest.mark.parametrize(
    "options",
    [
        dict(memory=dw.memory.LikelihoodDrift()),
        dict(memory=dw.memory.LikelihoodDrift(), scale=dw.models.InverseGamma(2.0, 2.0), scale_samples=100.0),
    ],
    ids=["factor", "factor and scale"],
)
def test_it_keeps_the_laws(options):
    dw.check_estimator(dw.StateSpace(F, H=np.eye(2), Q=Q, R=[[1.0, 0.3], [0.3, 2.0]], P0=1.0, **options))


def test_a_factor_of_a_hundred_is_learnt_as_samples_come_and_bars_are_right():
    states, y = drawn(1, T=3000)
    known = dw.StateSpace(F, H=H, Q=Q, R=1.0, P0=1.0)
    for wrong in (0.01, 100.0):
        est = dw.StateSpace(F, H=H, Q=wrong * Q, R=1.0, P0=1.0, memory=dw.memory.LikelihoodDrift())
        trace, best = est.scan(y), known.scan(y)
        factor, deviation = est.noise_factor(trace.state)
        assert abs(np.log(factor * wrong)) < 2 * deviation < 1.5
        late = slice(1000, None)
        rms = [np.sqrt(np.mean((one.estimates[late] - states[late]) ** 2, axis=0)) for one in (trace, best)]
        assert np.all(rms[0] < 1.05 * rms[1]) and 0.93 < np.mean(trace.nis[late]) < 1.07
        idle = dw.StateSpace(F, H=H, Q=wrong * Q, R=1.0, P0=1.0).scan(y)
        assert not 0.8 < np.mean(idle.nis[late]) < 1.25


def test_a_level_of_noise_that_changes_is_followed():
    states, y = drawn(2, T=3000, loud=3.0)
    est = dw.StateSpace(F, H=H, Q=Q, R=1.0, P0=1.0, scale=dw.models.InverseGamma(2.0, 2.0), scale_samples=150.0)
    trace = est.scan(y)
    assert est.sigma2(trace.state) == pytest.approx(9.0, rel=0.35)
    assert est.replace(scale_samples=np.inf).sigma2(est.replace(scale_samples=np.inf).scan(y).state) < 5.0
    assert trace.dof[-1] == pytest.approx(4.0 + 149.0, rel=1e-6)
    half = est.scan(y[:1200])
    np.testing.assert_array_equal(est.scan(y[1200:], state=half.state).dof, trace.dof[1200:])
    late = slice(2300, None)
    inside = np.abs(trace.estimates[late] - states[late]) < 1.96 * trace.std[late]
    assert 0.9 < inside.mean() < 0.99


def test_a_record_says_how_large_q_and_r_are():
    _, y = drawn(3)
    est = dw.StateSpace(F, H=H, Q=30 * Q, R=0.1, P0=1.0)
    found = est.tune(y)
    for name, truth in (("Q", 1 / 30), ("R", 10.0)):
        assert abs(np.log(found.tuned.factors[name] / truth)) < 2.5 * found.tuned.deviations[name] < 1.0
    assert found.tuned.loglik == pytest.approx(found.loglik(found.scan(y).state))
    assert found.tuned.gain == pytest.approx(found.tuned.loglik - est.loglik(est.scan(y).state))
    assert found.tuned.gain > 100 and found.tuned.words.startswith("Q is 0.0")
    relative = est.replace(scale=dw.models.InverseGamma(2.0, 2.0)).tune(y)
    assert list(relative.tuned.factors) == ["Q"] and same(relative.system.R, est.system.R)
    still = dw.StateSpace(1.0, Q=1.0, R=1.0, P0=1.0).tune(np.random.default_rng(4).standard_normal(200), which="Q")
    assert "of Q the record shows nothing" in still.tuned.words.lower().replace("of q", "of Q")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: dw.StateSpace(1.0, Q=1.0, R=0.0).tune(np.ones(9)), "R is zero, and a factor of it"),
        (lambda: dw.StateSpace(1.0, Q=1.0, R=1.0).tune(np.ones(9), which="P"), "which names what is tuned"),
        (lambda: dw.StateSpace(1.0, Q=1.0, R=1.0).tune([1.0, np.nan]), "too few to say how loud"),
        (
            lambda: dw.StateSpace(1.0, Q=1.0, R=1.0, scale=dw.models.InverseGamma(1.0, 1.0)).tune(
                np.ones(9), which="R"
            ),
            "of the two tune Q alone",
        ),
        (lambda: dw.StateSpace(1.0, Q=1.0, R=1.0, scale_samples=10.0), "none is learnt: give scale"),
        (lambda: dw.StateSpace(1.0, Q=1.0, R=1.0, memory=dw.memory.LikelihoodDrift(phi=0.9)), "here F says how"),
        (lambda: dw.StateSpace(1.0, Q=1.0, R=1.0, memory=dw.memory.CovarianceMatching()), "the others are about par"),
    ],
)
def test_what_does_not_fit_is_a_sentence(make, words):
    with pytest.raises(dw.InputError, match=words):
        make()


@pytest.mark.slow
def test_bars_of_what_is_learnt_hold_over_many_records():
    inside = {"tuned": [], "state": [], "nis": []}
    for seed in range(100, 160):
        states, y = drawn(seed)
        est = dw.StateSpace(F, H=H, Q=20 * Q, R=3.0, P0=1.0)
        tuned = est.tune(y).tuned
        for name, truth in (("Q", 1 / 20), ("R", 1 / 3)):
            inside["tuned"].append(abs(np.log(tuned.factors[name] / truth)) < 1.96 * tuned.deviations[name])
        learns = est.replace(memory=dw.memory.LikelihoodDrift(), scale=dw.models.InverseGamma(1.0, 3.0), R=1.0)
        trace = learns.scan(y)
        inside["state"].append(np.mean(np.abs(trace.estimates[500:] - states[500:]) < 1.96 * trace.std[500:]))
        inside["nis"].append(np.mean(trace.nis[500:]))
    assert 0.90 <= np.mean(inside["tuned"]) <= 0.99
    assert 0.92 <= np.mean(inside["state"]) <= 0.97
    assert 0.97 <= np.mean(inside["nis"]) <= 1.05
