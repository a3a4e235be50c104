"""The gain under memories that see whitened rows: dense recursions in plain NumPy, louder noise, bars."""

import numpy as np
import pytest
from scipy.linalg import solve_triangular

import driftwise as dw

PHI = 0.99


def noisy(samples, gains, loud=None, seed=0):
    """A state and its measurement; the best gain is ``gains``, both noises are ``loud`` times as large as without."""
    rng = np.random.default_rng(seed)
    K, loud = np.broadcast_to(gains, samples), np.ones(samples) if loud is None else loud
    Q = K / (1 - K) * (1 - PHI**2 * (1 - K)) * loud**2
    x = np.zeros(samples)
    for t in range(1, samples):
        x[t] = PHI * x[t - 1] + np.sqrt(Q[t - 1]) * rng.standard_normal()
    return x, x + loud * rng.standard_normal(samples)


def whitened(y, K, learn, wait=5, memory=100):
    """The gain of a scalar state: ``learn`` takes row and innovation over sqrt(c) and returns what K then is."""
    x = W = c = count = 0.0
    found = np.empty(len(y))
    for t, z in enumerate(y):
        e, psi = z - x, W
        if count >= wait and psi != 0:
            K = min(max(learn(psi / np.sqrt(c), e / np.sqrt(c), K), 0.0), 1.0)
        c, count = c + max(1 / memory, 1 / (count + 1)) * (e * e - c), count + 1
        W, x = PHI * ((1 - K) * W + e), PHI * (x + K * e)
        found[t] = K
    return found


def test_a_drift_is_a_kalman_filter_of_whitened_rows():
    """q counts relative to sigma^2, which begins as ten samples of 1 and takes in e^2/T: only P and T know of it."""
    _, y = noisy(600, 0.3, seed=3)
    P0, K0, q = 0.09, 0.4, 1e-4
    P = P0 + 5 * q  # it walks while the innovation variance is waited for

    def learn(psi, e, K):
        nonlocal P
        T = psi * P * psi + 1
        K, P = K + P * psi * e / T, P - (P * psi) ** 2 / T
        P = min(P + q, max(P, 2 * P0))
        return K

    est = dw.AdaptiveGain(PHI, memory=dw.memory.Drift(q=q), K0=K0, P0=P0, x0=0.0)
    np.testing.assert_allclose(est.scan(y).parameters[:, 0], whitened(y, K0, learn), atol=1e-12)


def test_a_window_is_least_squares_on_its_whitened_rows():
    _, y = noisy(300, 0.3, seed=4)
    rows, P0, K0 = [], 0.09, 0.4

    def learn(psi, e, K):
        rows.append((psi, e + psi * K))
        a = np.array([(1 / np.sqrt(P0), K0 / np.sqrt(P0)), *rows[-40:]])
        R = np.linalg.qr(a, mode="r")
        return float(solve_triangular(R[:1, :1], R[:1, 1])[0])

    est = dw.AdaptiveGain(PHI, memory=dw.memory.Window(40), K0=K0, P0=P0, x0=0.0)
    np.testing.assert_allclose(est.scan(y).parameters[:, 0], whitened(y, K0, learn), atol=1e-9)


def test_noise_that_becomes_louder_is_no_jump_of_the_gain():
    """Q and R grow 25 times at once: the best gain rests, and `AutoMemory` lets it rest."""
    loud = np.repeat([1.0, 5.0], 1000)
    told, error = 0, []
    for seed in range(12):
        _, y = noisy(2000, 0.3, loud, seed)
        trace = dw.AdaptiveGain(PHI, memory=dw.AutoMemory()).scan(y)
        told += len(trace.jumps())
        error.append(trace.parameters[1000:, 0] - 0.3)
    assert told <= 2 and np.sqrt(np.mean(np.square(error))) < 0.1


@pytest.mark.parametrize(
    "memory", [dw.memory.MultipleModel(), dw.AutoMemory(), dw.memory.BayesianChangePoint(0.3, 1000, 10)], ids=repr
)
def test_a_gain_that_jumps_far_is_followed(memory):
    """From .05 to .7: half a memory later the gain is nearer the new value than a gain that never forgets."""
    gains, error, constant = np.repeat([0.05, 0.7], 1000), [], []
    for seed in range(8):
        _, y = noisy(2000, gains, seed=seed)
        for m, found in ((memory, error), (dw.Constant(), constant)):
            found.append(dw.AdaptiveGain(PHI, memory=m).scan(y).parameters[1100:, 0] - 0.7)
    assert np.sqrt(np.mean(np.square(error))) < 0.5 * np.sqrt(np.mean(np.square(constant)))


@pytest.mark.parametrize("memory", [dw.memory.MultipleModel(), dw.memory.Drift(q=1e-5), dw.memory.LikelihoodDrift()])
def test_bars_of_a_gain_that_rests(memory):
    ratios = []
    for seed in range(30):
        _, y = noisy(1500, 0.3, seed=100 + seed)
        trace = dw.AdaptiveGain(PHI, memory=memory).scan(y)
        ratios.append((trace.parameters[-1, 0] - 0.3) / trace.parameters_std[-1, 0])
    assert 0.4 < np.sqrt(np.mean(np.square(ratios))) < 1.5


@pytest.mark.parametrize("memory", [None, dw.Constant(), dw.AutoMemory()], ids=repr)
def test_bars_are_the_same_wherever_they_are_read(memory):
    """In a trace, a summary and a model, whatever the units of y."""
    _, y = noisy(400, 0.3, seed=5)
    trace = dw.AdaptiveGain(PHI, memory=memory).scan(100 * y)
    est, state = trace.estimator, trace.state
    _, P = est.parameters_of(state)
    assert trace.summary().parameters[0][2] == pytest.approx(np.sqrt(P[0, 0]))
    assert est.model_of(state).covariance[1, 1] == pytest.approx(PHI**2 * P[0, 0])
    assert np.sqrt(P[0, 0]) == pytest.approx(trace.parameters_std[-1, 0], rel=0.1)  # one time update later


def test_a_memory_without_jumps_of_its_own_answers_an_alarm():
    """Variable and directional forgetting free the gain as the other gain sequences do."""
    _, y = noisy(1500, np.repeat([0.05, 0.6, 0.6], 500), seed=6)
    for memory in (dw.memory.VariableForgetting(500), dw.memory.DirectionalForgetting(0.998)):
        trace = dw.AdaptiveGain(PHI, memory=memory, detector=dw.detect.GainProbes()).scan(y)
        at = trace.jumps()[0].sample
        assert trace.weight[at + 1] < 30 < trace.weight[at]
