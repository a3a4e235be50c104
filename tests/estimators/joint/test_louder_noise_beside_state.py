"""Louder noise says nothing of parameters: what the filters of a bank knew of them together they know after it."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.status import NOISE

STEP = 350


def record(seed, walk):
    """Return y and u of a plant of order one, b1 of which may walk, while its noise becomes five times as loud."""
    rng = np.random.default_rng(seed)
    a, b, T, x = rng.uniform(-0.8, 0.5), rng.uniform(0.5, 1.5), STEP + 40, 0.0
    u, y = rng.standard_normal(T), np.empty(T)
    for t in range(T):
        y[t] = x + (0.2 if t < STEP else 1.0) * rng.standard_normal()
        x = b * u[t] - a * y[t]
        b += walk * rng.standard_normal()
    return y, u


def told(seed, walk):
    """Return the deviation of b1 before the noise is louder, and once that is told."""
    y, u = record(seed, walk)
    estimator = dw.Joint(1, 1, memory=dw.AutoMemory()).scaled_to(y, u)
    trace = estimator.scan(y[:STEP], u[:STEP])
    before = trace.parameters_std[-1, 1]
    for t in range(STEP, len(y)):
        state = trace.state
        trace = estimator.scan(y[t : t + 1], u[t : t + 1], state=state)
        if int(trace.status[0]) & NOISE:
            return before, trace.parameters_std[-1, 1]
    raise AssertionError("louder noise is not told")


@pytest.mark.parametrize("seed, walk", [(6, 0.0), (7, 0.0), (3, 0.002), (21, 0.002), (8, 0.004), (29, 0.004)])
def test_the_bank_stays_as_sure_whichever_filter_led_before_the_noise_became_louder(seed, walk):
    """A copy of the filter that led was three times less sure than it had been, and knew nothing of the others."""
    before, after = told(seed, walk)
    assert after == pytest.approx(before, rel=0.3)
