"""A plant at rest says nothing of how fast it drifts, however quiet it is there: the filters keep their weights."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.memory.auto_state import MODES, open_parts
from driftwise.memory.modes import WEIGHT, mode

FROM, TO, SAMPLES, N = 600, 1100, 1200, 3
SEEDS = range(6)


def at_rest(seed: int, left: float):
    """Return outputs and inputs of an ARX(1, 2) that rests for 500 samples, with ``left`` of its noise."""
    rng, t = np.random.default_rng(seed), np.arange(SAMPLES)
    is_resting = (t >= FROM) & (t < TO)
    u, y = rng.standard_normal(SAMPLES) * ~is_resting, np.zeros(SAMPLES)
    e = 0.6 * rng.standard_normal(SAMPLES) * np.where(is_resting, left, 1.0)
    for k in range(2, SAMPLES):
        y[k] = 0.5 * y[k - 1] + u[k - 1] - 0.4 * u[k - 2] + e[k]
    return y, u


def weights(est, state) -> np.ndarray:
    """Return the weights of the filters of the bank."""
    bank = open_parts(est.memory, np.ravel(state["memory_state"]), N).own.bank
    return np.array([mode(bank, m, N).own[WEIGHT] for m in range(MODES)])


@pytest.mark.parametrize("expect", ["both", "outliers"])
def test_no_filter_wins_by_a_smaller_variance_of_its_noise(expect):
    est = dw.ARX(1, 2, memory=dw.AutoMemory(expect))
    for seed in SEEDS:
        y, u = at_rest(seed, 0.01)
        states = [est.scan(y[:k], u[:k]).state for k in (FROM + 40, TO - 1)]
        np.testing.assert_allclose(weights(est, states[0]), weights(est, states[1]), rtol=1e-9)


def test_a_quiet_rest_moves_no_parameter():
    """Some moved by half a deviation, and were learnt again afterwards by the fast filter."""
    est = dw.ARX(1, 2, memory=dw.AutoMemory())
    for seed in SEEDS:
        y, u = at_rest(seed, 0.01)
        trace = est.scan(y, u)
        assert np.mean((trace.status[FROM + 40 : TO] & int(dw.Status.AT_REST)) > 0) == 1.0
        assert np.ptp(trace.parameters[FROM + 40 : TO], axis=0).max() < 0.005
