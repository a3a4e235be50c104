"""Four ways in which recursive estimators die elsewhere, for every memory: one NaN, wind-up, huge P0, a long rest."""

import numpy as np
import pytest
from draws import draws
from hypothesis import given, settings
from hypothesis import strategies as st

import driftwise as dw

FORGETFUL = {
    "limited": dw.memory.GainFloor(100),
    "weighted": dw.ExponentialForgetting(0.99),
    "variable": dw.memory.VariableForgetting(100),
    "directional": dw.memory.DirectionalForgetting(0.99),
    "walk": dw.RandomWalk(1e-6),
    "matched": dw.RandomWalk(matched=(0.01, 500)),
    "window": dw.memory.Window(100),
    "run lengths": dw.memory.BayesianChangePoint(0.01, 500, 5),
    "inflated after a jump": dw.RestartOnChange(dw.PageHinkley()),
    # of a told size: a detector of any size alarms in this drift, and a missing sample moves when it does
    "reset after a jump": dw.RestartOnChange(dw.detect.ScoreCUSUM(jump=1.0), dw.memory.GainReset(10)),
}
EVERY = {"never": dw.Constant(), **FORGETFUL}
TRUE = np.array([-1.2, 0.5, 0.7, 0.8])


def regressors(samples=10_000):
    """The common task's regressors: an ARX(2,2) whose parameters drift a little."""
    rng = np.random.default_rng(7)
    th, u, y = np.array([-1.2, 0.5, 1.0, 0.5]), np.sign(rng.standard_normal(samples + 2)), np.zeros(samples + 2)
    phi, spread = np.zeros((samples, 4)), np.sqrt([1e-6, 1e-6, 1e-5, 1e-5])
    for t in range(2, samples + 2):
        th = th + spread * rng.standard_normal(4)
        phi[t - 2] = -y[t - 1], -y[t - 2], u[t - 1], u[t - 2]
        y[t] = phi[t - 2] @ th + 0.2 * rng.standard_normal()
    return phi, y[2:]


@pytest.fixture(scope="module")
def task():
    return regressors()


def is_finite(state):
    return np.isfinite(np.atleast_1d(state).view(float)).all()


@pytest.mark.parametrize("memory", EVERY.values(), ids=EVERY)
@pytest.mark.parametrize("reach", ["target", "target and regressors"])
def test_one_nan_costs_one_sample(task, memory, reach):
    phi, y = task[0][4000:7000].copy(), task[1][4000:7000].copy()
    est = dw.Regression(4, memory=memory, variance=0.04, P0=100.0)
    whole = est.scan(y, phi)
    y[1000] = np.nan
    if reach != "target":
        phi[1001, 0] = phi[1002, 1] = np.nan
    trace = est.scan(y, phi)
    assert is_finite(trace.state) and np.isfinite(trace.table[:, [0, 2, 3, 4]]).all()
    assert np.isnan(trace.innovation).sum() == 1 and trace.status[1000] & dw.Status.MISSING_OUTPUT
    if reach != "target":
        assert np.all(trace.status[1001:1003] & dw.Status.MISSING_INPUT)
    # it lost what three samples of thousands (or of a window of a hundred) would have said
    assert np.max(np.abs(trace.parameters - whole.parameters)[1003:] / whole.parameters_std[1003:]) < 3.0
    assert np.max(np.abs(trace.parameters[-1] - whole.parameters[-1])) < 0.02


@pytest.mark.parametrize("memory", EVERY.values(), ids=EVERY)
def test_collinear_regressors_for_ever(task, memory):
    """Nothing tells theta3 from theta4; a hundred thousand samples with a prior variance of 1e6."""
    phi = np.tile(task[0], (10, 1))
    phi[:, 3] = phi[:, 2]
    y = phi @ TRUE + 0.2 * np.random.default_rng(5).standard_normal(len(phi))
    est = dw.Regression(4, memory=memory, P0=1e6)
    trace = est.scan(y, phi)
    assert is_finite(trace.state) and np.all(trace.state["D"] >= 0)
    P = np.diag(est.covariance(trace.state))
    assert np.all(P <= 1e6 * (1 + 1e-9))
    rms = np.sqrt(np.mean(trace.innovation[-1000:] ** 2))
    assert 0.19 < rms < 0.215, rms
    assert abs(trace.parameters[-1, 2:].sum() - 1.5) < 0.1


def exact(phi, y, P0, R):
    """theta after each row and the last P, least squares with a ridge, in fifty digits."""
    import mpmath as mp

    with mp.workdps(50):
        P, theta, thetas = mp.eye(4) * P0, mp.zeros(4, 1), []
        for row, value in zip(phi, y):
            h = mp.matrix([mp.mpf(float(v)) for v in row])
            Ph = P * h
            S = (h.T * Ph)[0] + mp.mpf(R)
            theta += Ph * ((mp.mpf(float(value)) - (h.T * theta)[0]) / S)
            P -= Ph * Ph.T / S
            thetas.append([float(v) for v in theta])
        return np.array(thetas), np.array(P.tolist(), float)


def test_a_huge_prior_and_nearly_collinear_regressors(task):
    """P0 = 1e6, R = 1e-8, columns equal to 1e-5: theta to 1e-9, bars to 1e-6 where a memory has nothing to do."""
    phi = task[0][:400].copy()
    phi[:, 3] = phi[:, 2] + 1e-5 * np.random.default_rng(1).standard_normal(400)
    y = phi @ TRUE
    thetas, P = exact(phi, y, 1e6, 1e-8)
    idle = [
        dw.Constant(),
        dw.ExponentialForgetting(1.0),
        dw.RandomWalk(0.0),
        dw.memory.DirectionalForgetting(1.0),
        dw.memory.Window(400),
    ]
    for memory in [*idle, dw.memory.VariableForgetting(least=1.0), dw.memory.BayesianChangePoint(1.0, 1e30, 2)]:
        est = dw.Regression(4, memory=memory, variance=1e-8, P0=1e6)
        trace = est.scan(y, phi)
        assert np.max(np.abs(trace.parameters - thetas)[100:]) < 1e-9, memory
        ours = est.covariance(trace.state)
        assert np.all(trace.state["D"] >= 0)
        if not isinstance(memory, dw.memory.BayesianChangePoint):
            np.testing.assert_allclose(np.diag(ours), np.diag(P), rtol=1e-6, err_msg=str(memory))
    for memory in FORGETFUL.values():
        est = dw.Regression(4, memory=memory, variance=1e-8, P0=1e6)
        trace = est.scan(y, phi)
        assert is_finite(trace.state) and np.all(trace.state["D"] >= 0), memory
        assert np.sqrt(np.mean(trace.innovation[100:] ** 2)) < 1e-3, memory


def rest(seed, samples=5000):
    """y = .8 y1 + u1 + e; from sample 1000 to 3999 the input rests and the noise nearly does."""
    rng = np.random.default_rng(seed)
    u, spread = rng.standard_normal(samples), np.full(samples, 0.05)
    u[1000:4000], spread[1000:4000] = 0.0, 0.001
    e, y = spread * rng.standard_normal(samples), np.zeros(samples)
    for t in range(1, samples):
        y[t] = 0.8 * y[t - 1] + u[t - 1] + e[t]
    return y, u


# memory; largest parameter error in the 50 samples after the rest (50 seeds); NIS in the rest, or None where the learnt
# variance remembers the louder times (bars too wide), and in the time after it
RESTED = {
    "never": (dw.Constant(), 0.01, None, 3.2),
    "limited": (dw.memory.GainFloor(50), 0.09, (0.85, 1.1), 1.15),
    "weighted": (dw.ExponentialForgetting(0.98), 0.09, (0.85, 1.1), 1.15),
    "variable": (dw.memory.VariableForgetting(50), 0.05, None, 1.15),
    "directional": (dw.memory.DirectionalForgetting(0.98), 0.06, (0.85, 1.1), 1.15),
    "walk": (dw.RandomWalk(2e-4), 0.07, None, 3.2),
    "matched": (dw.RandomWalk(matched=(0.1, 500)), 0.4, None, 3.2),
    "run lengths": (dw.memory.BayesianChangePoint(0.2, 500), 0.5, None, 3.2),
    "window": (dw.memory.Window(50), 2.0, (0.7, 1.15), 1.15),
}


@draws("records", 15, 50)
@pytest.mark.parametrize("memory, worst, inside, after", RESTED.values(), ids=RESTED)
def test_a_long_rest(memory, worst, inside, after, records):
    """Trace P of plain forgetting reaches 4e24 here, its errors 40; the bounds are what was measured, and a little."""
    est, errors, nis = dw.ARX(1, 1, memory=memory, P0=100.0), [], []
    for seed in range(15 if isinstance(memory, dw.memory.BayesianChangePoint) else records):
        trace = est.scan(*rest(seed))
        assert is_finite(trace.state)
        errors.append(np.max(np.abs(trace.parameters - [-0.8, 1.0])[4000:4050]))
        ratio = trace.innovation**2 / trace.variance
        nis.append([ratio[200:1000].mean(), ratio[1200:4000].mean(), ratio[4100:].mean()])
        P = np.diag(est.covariance(trace.state))
        assert np.all(P <= 100 * (1 + 1e-9))
        if isinstance(memory, dw.memory.GainFloor | dw.ExponentialForgetting | dw.memory.DirectionalForgetting):
            assert np.mean(trace.status[1500:4000] & dw.Status.CAPPED > 0) > 0.99  # it says so
    before, within, later = np.mean(nis, axis=0)
    assert max(errors) < worst
    expected = (
        0.88 if isinstance(memory, dw.memory.BayesianChangePoint) else 1.0
    )  # its bars hold the jump that does not come
    assert abs(before - expected) < 0.1 and later < after
    assert within < 0.05 if inside is None else inside[0] < within < inside[1]


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(sorted(EVERY)),
    seed=st.integers(0, 2**32 - 1),
    live=st.integers(0, 3),
    size=st.sampled_from([1e-8, 1e-3, 1.0, 1e4]),
    wait=st.integers(1, 400),
)
def test_whatever_is_not_excited_stays_within_its_prior(name, seed, live, size, wait):
    """Regressors that die, shrink, burst or become collinear: finite, non-negative, never wider than the prior."""
    rng = np.random.default_rng(seed)
    phi = rng.standard_normal((wait + 600, 3))
    phi[wait:, live:] = 0.0 if seed % 2 else size * phi[wait:, :1]
    y = phi @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(len(phi))
    est = dw.Regression(3, memory=EVERY[name])
    trace = est.scan(y, phi, keep="covariance")
    assert is_finite(trace.state) and np.all(trace.state["D"] >= 0)
    assert np.all(np.diag(est.covariance(trace.state)) <= np.diag(est.prior_covariance) * (1 + 1e-9))
    assert np.isfinite(trace.parameters).all()


def test_forgetting_survives_a_burst():
    """One absurd regressor does not freeze what is learnt afterwards: the ceiling is an average of logarithms.

    Kulhavy's rule forgets such a direction slowly (as the square root of what is known of it too much).
    """
    for memory, size in (
        (dw.ExponentialForgetting(0.98), 1e3),
        (dw.memory.GainFloor(50), 1e3),
        (dw.memory.DirectionalForgetting(0.98), 30.0),
    ):
        rng = np.random.default_rng(0)
        phi = rng.standard_normal((4000, 2))
        phi[1000] *= size
        theta = np.where(np.arange(4000)[:, None] < 2000, [1.0, -1.0], [0.5, 0.0])
        y = np.sum(phi * theta, axis=1) + 0.1 * rng.standard_normal(4000)
        trace = dw.Regression(2, memory=memory).scan(y, phi)
        assert np.max(np.abs(trace.parameters - theta)[2300:]) < 0.1, memory
