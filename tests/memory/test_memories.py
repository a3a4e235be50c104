"""Every memory against a textbook twin in plain NumPy; gains and forgetting are two words for one recursion."""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from oracle.tracking import golden, regressors, stochastic_approximation
from records_to_forget import excite, record

import driftwise as dw
from driftwise.analysis.laws import same
from driftwise.detect.watch import OWN, SINCE, STATISTIC, WHICH, watch
from driftwise.memory.exponential_forgetting import ExponentialForgettingKernel
from driftwise.memory.questions import time_update

MEMORIES = {
    "never": dw.Constant(),
    "limited": dw.memory.GainFloor(50),
    "weighted": dw.ExponentialForgetting(0.98),
    "variable": dw.memory.VariableForgetting(50),
    "directional": dw.memory.DirectionalForgetting(0.98),
    "walk": dw.RandomWalk(2e-4),
    "matched": dw.RandomWalk(matched=(0.2, 500)),
    "window": dw.memory.Window(50),
    "run lengths": dw.memory.BayesianChangePoint(0.2, 500, 8),
}


class At(NamedTuple):
    """Alarm at the n-th sample that is looked at (the first one never is), about one parameter."""

    n: float
    about: float = -1.0

    def state_size(self, parameters):
        return OWN + 1


@watch.on(At)
def _(detector, marks, z, slope):
    marks[OWN] += 1.0
    marks[STATISTIC] = marks[OWN] / detector.n
    if marks[OWN] != detector.n:
        return 0.0
    marks[SINCE], marks[WHICH] = 1.0, detector.about
    return 1.0


# --- gains and forgetting --------------------------------------------------------------------------------------


def started(est, weight):
    """A state whose prior counts as so many samples."""
    state = est.start()
    state["weight"] = weight
    return state


SEQUENCES = {
    "step_limit": dw.memory.GainFloor(5),
    "one_over_n": dw.Constant(),
    "forgetting_08": dw.ExponentialForgetting(0.8),
    "forgetting_0996": dw.ExponentialForgetting(0.996),
}


@pytest.mark.parametrize("name, memory", SEQUENCES.items(), ids=str)
def test_golden_gains(name, memory):
    given, expected = golden("gain_sequences")
    y, u = record(1000)
    trace = dw.ARX(1, 1, memory=memory, at_rest=True).scan(y, u)
    gains = 1 / trace.table[given["n"].astype(int) - 1, 4]
    np.testing.assert_allclose(gains, expected[name], rtol=1e-10)


def test_forgetting_begins_before_anything_was_seen():
    """A weight of zero: nothing to divide by, and nothing to forget."""
    kernel, U, D = ExponentialForgettingKernel(0.9, 50.0, 1e3, np.ones(1)), np.zeros(0), np.ones(1)
    view = SimpleNamespace(weight=np.float64(0.0), surprise=np.nan, U=U, D=D)
    with np.errstate(all="raise"):
        assert time_update(kernel, np.zeros(2), 1.0, view) == (1.0, 0) and D[0] == 1.0


@pytest.mark.parametrize("lam", [0.5, 0.99])
def test_from_the_first_sample_on_forgetting_does_not_exceed_the_prior(lam):
    """One direction is never excited: nobody knows less of it than before the first sample."""
    est = dw.Regression(2, memory=dw.ExponentialForgetting(lam), variance=1.0, P0=[4.0, 9.0], at_rest=True)
    state, rng = est.start(), np.random.default_rng(2)
    for _ in range(30):
        state, _ = est.update(state, rng.standard_normal(), [1.0, 0.0])
        spread = np.array([[1.0, state["U"][0]], [0.0, 1.0]])
        assert (spread @ np.diag(state["D"]) @ spread.T)[1, 1] <= 9.0 * (1 + 1e-12)


CASES = {
    "arx11_decreasing": dw.Constant(),
    "reset_gain_equals_forgetting_factor": dw.RestartOnChange(At(4), dw.memory.GainReset(3), settle=0),
}


@pytest.mark.parametrize("case, memory", CASES.items(), ids=str)
def test_golden_recursions(case, memory):
    """The alarm comes at sample 5, which is processed with its old gain; sample 6 has the gain 1/3."""
    given, expected = golden(case)
    P0 = given["gamma0"] * np.linalg.inv(given["R0"])
    est = dw.ARX(1, 1, memory=memory, at_rest=True, variance=1.0, P0=10 * P0)  # a wide cap; the state starts at P0
    state = started(est, 1.0)
    state["D"] /= 10
    trace = est.scan(given["y"], given["u"], state=state)
    theta = trace.parameters * [-1.0, 1.0]
    np.testing.assert_allclose(theta, expected["theta"][:, 0], rtol=1e-10, atol=1e-13)
    np.testing.assert_allclose(1 / trace.table[:, 4], given["gamma"], rtol=1e-12)
    if "eps" in expected:
        np.testing.assert_allclose(trace.innovation, expected["eps"][:, 0], rtol=1e-10)


def gains(kind, n):
    k = np.arange(2, n + 2)
    if kind == "limited":
        return np.maximum(1 / k, 1 / 30)
    if kind == "weighted":
        return (1 - 0.97) / (1 - 0.97**k)
    reset = np.where(k < 102, 1 / k, 1 / np.maximum(k - 98, 1))
    return 1 / k if kind == "never" else reset


GAINS = {
    "never": dw.ExponentialForgetting(1.0),
    "limited": dw.memory.GainFloor(30),
    "weighted": dw.ExponentialForgetting(0.97),
    "reset": dw.RestartOnChange(At(99), dw.memory.GainReset(4), settle=0),
}


@pytest.mark.parametrize("kind, memory", GAINS.items(), ids=str)
def test_gains_and_forgetting_are_one_recursion(kind, memory):
    """theta and P of the compiled estimator are those of R <- R + g (nu nu' - R), P = g R^-1, to 1e-12."""
    y, u = record()
    nu, g = regressors(y, u, 2, 2), gains(kind, len(y))
    thetas, R = stochastic_approximation(nu, y, g, np.eye(4), np.zeros(4))
    lam = 0.97 if kind == "weighted" else 1.0  # the state carries P of the next sample
    est = dw.ARX(2, 2, memory=memory, at_rest=True, variance=1.0, P0=1e6)
    state = started(est, lam)
    state["D"] = 1 / lam
    trace = est.scan(y, u, state=state)
    assert np.max(np.abs(trace.parameters - thetas)) < 1e-12
    after = {"limited": 29 / 30, "weighted": 0.97}.get(kind, 1.0)
    P = g[-1] * np.linalg.inv(R) / after
    assert np.max(np.abs(est.covariance(trace.state) - P)) < 1e-12 * np.max(P)
    np.testing.assert_allclose(1 / trace.table[:, 4], g, rtol=1e-12)


def after_twenty(memory, phi, y):
    """Learn twenty samples without forgetting (at first the prior would cap P), the rest with the memory."""
    calm, est = (dw.Regression(3, memory=m, variance=0.25, P0=4.0) for m in (dw.Constant(), memory))
    learnt, state = calm.scan(y[:20], phi[:20]).state, est.start()
    for name in ("theta", "U", "D", "weight"):
        state[name] = learnt[name]
    return calm.mean(learnt), calm.covariance(learnt), est.scan(y[20:], phi[20:], state=state)


def test_variable_forgetting_is_fortescues():
    """lambda from the last error, against dense recursive least squares; known noise, memory 40, at least 0.9."""
    phi, y = excite(1)
    y[150:] += phi[150:] @ [1.0, 0.0, 0.0]
    theta, P, trace = after_twenty(dw.memory.VariableForgetting(40, 0.9), phi, y)
    lambdas = []
    for t, (row, value) in enumerate(zip(phi[20:], y[20:])):
        S = row @ P @ row + 0.25
        e, K = value - row @ theta, P @ row / S
        theta, P = theta + K * e, P - np.outer(K, K) * S
        lambdas.append(max(0.9, 1 - (1 - row @ K) * e**2 / (0.25 * 40)))
        P = P / lambdas[-1]
        assert np.max(np.abs(theta - trace.parameters[t])) < 1e-10
    assert min(lambdas[130:135]) == 0.9 < np.median(lambdas)
    assert not np.any(trace.status)


def test_directional_forgetting_equals_its_information_form():
    """Kulhavy's rule: P^-1 <- P^-1 - (1 - p) psi psi' / (psi' P psi) + psi psi' / R."""
    phi, y = excite(2)
    theta, P, trace = after_twenty(dw.memory.DirectionalForgetting(0.9), phi, y)
    I = np.linalg.inv(P)
    for t, (row, value) in enumerate(zip(phi[20:], y[20:])):
        I = I - 0.1 * np.outer(row, row) / (row @ np.linalg.solve(I, row)) + np.outer(row, row) / 0.25
        theta = theta + np.linalg.solve(I, row) * (value - row @ theta) / 0.25
        assert np.max(np.abs(theta - trace.parameters[t])) < 1e-10
    assert not np.any(trace.status)


def test_directional_forgetting_remembers_a_memory_for_each_direction():
    """Excited on all sides, whatever the units, P settles at (1 - p)/N of the inverse second moment of psi."""
    rng, p, scales = np.random.default_rng(12), 0.98, np.array([1.0, 100.0, 0.1])
    phi = rng.standard_normal((64, 1500, 3)) @ np.array([[1.0, 0.5, 0.2], [0.0, 1.0, 0.3], [0.0, 0.0, 1.0]]) * scales
    y = phi @ (1 / scales) + 0.5 * rng.standard_normal((64, 1500))
    est = dw.Regression(3, memory=dw.memory.DirectionalForgetting(p), variance=0.25, P0=1e6)
    states, _ = est.update_batch(est.start(64), y, phi)
    moment = np.mean([phi[i].T @ phi[i] / 1500 for i in range(64)], axis=0)
    traces = [np.trace(est.covariance(state) @ moment) / 0.25 for state in states]
    assert abs(np.mean(traces) / (1 - p) - 1) < 0.1  # N directions, (1 - p)/N each


@pytest.mark.parametrize(
    "memory, p", [(dw.ExponentialForgetting(0.995), 0.995), (dw.memory.GainFloor(200), 0.995)], ids=str
)
def test_forgetting_makes_the_bars_of_constants_too_wide_by_its_formula(memory, p):
    """The variance of the estimate is P/(1 + p), P after the correction; the state's is that over p."""
    rng = np.random.default_rng(21)
    phi = rng.standard_normal((1000, 1500, 3))
    y = phi @ [1.0, 2.0, 3.0] + 0.5 * rng.standard_normal((1000, 1500))
    est = dw.Regression(3, memory=memory, variance=0.25)
    states, _ = est.update_batch(est.start(1000), y, phi)
    P = p * np.array([np.diag(est.covariance(state)) for state in states])
    squares = np.mean((states["theta"] - [1.0, 2.0, 3.0]) ** 2 / P)
    assert abs(squares * (1 + p) - 1) < 2.58 * np.sqrt(2 / 3000)  # 99 %: 3000 normalised squares


def test_the_noise_is_learnt_before_anything_is_forgotten():
    """Two samples per parameter (six for a mixture) count in full; the one after them is the first to fade."""
    phi, y = excite(13, 40)
    for memory, first in ((dw.memory.VariableForgetting(50), 6), (dw.memory.BayesianChangePoint(0.2, 500, 8), 18)):
        weight = dw.Regression(3, memory=memory).scan(y, phi).weight
        assert np.array_equal(weight[: first + 1], np.arange(1.0, first + 2)), memory
        assert weight[first + 1] < first + 2, memory


def test_a_variance_is_held_at_that_of_one_typical_sample():
    """That is the geometric mean of weight * P so far; while held it rises e-fold in a hundred memories."""
    phi, y = excite(14, 700, 1)
    phi[300:] = 0.0
    trace = dw.Regression(1, memory=dw.ExponentialForgetting(0.98), variance=0.25, P0=1e3).scan(y, phi)
    P, first = trace.parameters_std[:, 0] ** 2, np.flatnonzero(trace.status & dw.Status.CAPPED)[0]
    assert first > 300
    assert P[first + 1] == pytest.approx(np.exp(np.mean(np.log(trace.weight * P)[:first])), rel=1e-9)
    np.testing.assert_allclose(P[first + 2 :] / P[first + 1 : -1], np.exp(0.02 / 100), rtol=1e-9)


def test_a_walk_that_reaches_the_prior_says_so():
    est = dw.Regression(3, memory=dw.RandomWalk([0.0002, 0.0008, 0.0]), variance=0.25, P0=4.0)
    status = est.scan(np.full(10, np.nan), np.zeros((10, 3))).status & dw.Status.CAPPED
    assert np.all(status)
    phi, y = excite(4)
    assert not np.any(est.scan(y, phi).status[10:])


# --- alarms ----------------------------------------------------------------------------------------------------


def until(restart, about=-1.0, n=49):
    return dw.RestartOnChange(At(n, about), restart, settle=0)


def test_an_alarm_frees_all_or_the_one_that_is_named():
    phi, y = excite(8)
    calm = dw.Regression(3, variance=0.25, P0=4.0).scan(y[:50], phi[:50]).state
    for restart, about, gained in (
        (dw.memory.CovarianceInflation(0.5), 1.0, [0.25, 0.25, 0.25]),
        (dw.memory.CovarianceInflation([0.5, 0.2, 0.0]), -1.0, [0.25, 0.04, 0.0]),
        (dw.memory.CovarianceInflation(0.5, only_named=True), 1.0, [0.0, 0.25, 0.0]),
        (dw.memory.CovarianceInflation(0.5, only_named=True), -1.0, [0.25, 0.25, 0.25]),
        (
            dw.memory.CovarianceInflation(100.0),
            -1.0,
            4.0 - np.diag(dw.Regression(3, variance=0.25, P0=4.0).covariance(calm)),
        ),
    ):
        est = dw.Regression(3, variance=0.25, P0=4.0, memory=until(restart, about))
        trace = est.scan(y[:50], phi[:50])
        assert trace.status[-1] == dw.Status.JUMP and np.array_equal(trace.table[-1, 6:8], [1.0, about])
        np.testing.assert_allclose(np.diag(est.covariance(trace.state) - est.covariance(calm)), gained, atol=1e-12)
        wider = np.linalg.det(est.covariance(trace.state)) / np.linalg.det(est.covariance(calm))
        np.testing.assert_allclose(trace.state["weight"], 50 * wider ** (-1 / 3), rtol=1e-9)


def test_a_reset_scales_the_covariance_and_stays_below_the_prior():
    phi, y = excite(9)
    calm = dw.Regression(3, variance=0.25, P0=4.0).scan(y[:50], phi[:50]).state
    est = dw.Regression(3, variance=0.25, P0=4.0, memory=until(dw.memory.GainReset(6)))
    state = est.scan(y[:50], phi[:50]).state
    assert state["weight"] == 5
    np.testing.assert_allclose(est.covariance(state), 10 * est.covariance(calm), rtol=1e-12)
    young = dw.Regression(3, variance=0.25, P0=4.0, memory=until(dw.memory.GainReset(60)))  # nothing to forget yet
    state = young.scan(y[:50], phi[:50]).state
    assert state["weight"] == 50 and np.array_equal(young.covariance(state), est.covariance(calm))
    tight = dw.Regression(3, variance=0.25, P0=0.01, memory=until(dw.memory.GainReset(1.001)))
    assert np.all(np.diag(tight.covariance(tight.scan(y[:50], phi[:50]).state)) <= 0.01 * (1 + 1e-12))


# --- nothing to do, nothing changes ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "idle",
    [
        dw.ExponentialForgetting(1.0),
        dw.memory.GainFloor(1e9),
        dw.RandomWalk(0.0),
        dw.memory.VariableForgetting(least=1.0),
        dw.memory.DirectionalForgetting(1.0),
        until(dw.memory.GainReset(2), n=1e9),
        until(dw.memory.CovarianceInflation(1.0), n=1e9),
    ],
    ids=str,
)
def test_a_memory_with_nothing_to_do_changes_nothing(idle):
    y, u = record()
    plain, other = dw.ARX(2, 2).scan(y, u), dw.ARX(2, 2, memory=idle).scan(y, u)
    columns = [0, 1, 2, 3, 4, *range(8, 17)]  # all but what the detector says
    assert same(plain.table[:, columns], other.table[:, columns])


def test_runs_that_never_end_are_no_runs():
    y, u = record()
    one = dw.ARX(2, 2, variance=0.09).scan(y, u)
    two = dw.ARX(2, 2, variance=0.09, memory=dw.memory.BayesianChangePoint(0.1, 1e15)).scan(y, u)
    np.testing.assert_allclose(one.table[:, 8:], two.table[:, 8:], rtol=1e-8)


# --- words -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "memory, words",
    [
        (dw.memory.GainFloor(1.0), "samples must exceed 1"),
        (dw.ExponentialForgetting(1.2), "at most 1"),
        (dw.memory.DirectionalForgetting(0.0), "positive"),
        (dw.memory.VariableForgetting(1.0), "samples must exceed 1"),
        (dw.memory.VariableForgetting(least=1.5), "least is the smallest lambda"),
        (dw.memory.Window(4), "needs 5 samples"),
        (dw.memory.Window(0), "whole number"),
        (dw.RandomWalk(-1.0), "must not be negative"),
        (dw.RandomWalk(1e-3, matched=(1.0, 100)), "either q or matched"),
        (dw.RandomWalk(matched=(0.0, 100)), "jump is the size"),
        (dw.memory.BayesianChangePoint(0.0, 100), "jump is the size"),
        (dw.memory.BayesianChangePoint(1.0, 1.0), "every must exceed 1"),
        (dw.memory.BayesianChangePoint(1.0, 100, 1), "hypotheses must be a whole number of at least 2"),
        (dw.RestartOnChange(3.0), "detector must be"),
        (dw.RestartOnChange(At(3), response=3.0), r"CovarianceInflation\(step\) or GainReset"),
        (dw.RestartOnChange(At(3), dw.memory.GainReset(1.0)), "samples must exceed 1"),
        (0.99, "memory must be"),
    ],
)
def test_bad_settings_are_told(memory, words):
    with pytest.raises(dw.InputError, match=words):
        dw.ARX(2, 2, memory=memory)


def test_the_joint_filter_says_what_it_cannot():
    walks = dw.models.NoiseCovariance(np.diag([0.2, 0.1, 1e-4, 1e-4, 1e-4, 1e-4]), np.zeros(6), 0.5)
    with pytest.raises(dw.InputError, match="noise that reaches the parameters is how they drift"):
        dw.Joint(2, 1, noise=walks, P0=10.0, memory=dw.AutoMemory())
    with pytest.raises(dw.InputError, match="forget_state=True is for memories that forget"):
        dw.Joint(2, 1, memory=dw.AutoMemory(), forget_state=True)
    with pytest.raises(dw.InputError, match="a memory that is given"):
        dw.Joint(2, 1, memory=dw.AutoMemory()).smooth(*record())


@pytest.mark.parametrize("name", MEMORIES)
def test_memories_pass_the_public_check(name):
    dw.check_policy(MEMORIES[name])


@pytest.mark.parametrize(
    "est", [dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98)), dw.ARMAX(2, 2, 2)], ids=["weighted", "young"]
)
def test_the_likelihood_of_a_fading_memory_is_that_of_its_predictions(est):
    """What has faded is not in chi2 any more, so the closed form of constant parameters does not hold."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=500, noise_std=0.3, missing=0.1, seed=1)
    trace = est.scaled_to(y, u).scan(y, u)
    e, T = trace.innovation[trace.is_used], trace.variance[trace.is_used]
    expected = -0.5 * np.sum(np.log(2 * np.pi * T) + e**2 / T)
    assert trace.estimator.loglik(trace.state) == pytest.approx(expected, rel=1e-12)


def test_never_is_batch_least_squares():
    """theta, and its covariance where the variance is known, to 1e-12 of NumPy's least squares."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=2000, noise_std=0.1, seed=1)
    trace = dw.ARX(2, 2, variance=0.01, P0=1e4).scan(y, u, keep="covariance")
    X = np.column_stack([-y[1:-1], -y[:-2], u[1:-1], u[:-2]])  # from the first sample whose lags are all in the record
    theta = np.linalg.lstsq(np.vstack([X, 1e-3 * np.eye(4)]), np.append(y[2:], np.zeros(4)), rcond=None)[0]
    np.testing.assert_allclose(trace.parameters[-1], theta, rtol=1e-12)
    P = np.linalg.inv(X.T @ X / 0.01 + 1e-4 * np.eye(4))
    np.testing.assert_allclose(trace.covariance[-1], P, rtol=1e-10)
