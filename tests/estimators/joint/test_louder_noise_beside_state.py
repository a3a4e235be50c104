"""Louder noise says nothing of parameters: what the filter that never forgets knew of them it knows after it."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.status import NOISE
from driftwise.memory.auto_state import open_parts
from driftwise.memory.modes import mode, own_sigma2
from driftwise.memory.trial_state import LEADER

STEP = 350


def record(seed):
    """Return y and u of a plant of order one that rests while its noise becomes five times as loud."""
    rng = np.random.default_rng(seed)
    a, b, T, x = rng.uniform(-0.8, 0.5), rng.uniform(0.5, 1.5), STEP + 40, 0.0
    u, y = rng.standard_normal(T), np.empty(T)
    for t in range(T):
        y[t] = x + (0.2 if t < STEP else 1.0) * rng.standard_normal()
        x = b * u[t] - a * y[t]
    return y, u


def of_the_slow(estimator, state):
    """Return how well the filter that never forgets knows b1, and whether another one leads the trial."""
    memory = estimator.policies[2]
    parts = open_parts(memory, np.ravel(state["memory_state"]).copy(), 2)
    slow = mode(parts.own.bank, 0, 2)
    return own_sigma2(memory, slow.own) * slow.D[1], parts.trial.head[LEADER] > 0.0


@pytest.mark.parametrize("seed", [6, 20, 39, 56])
def test_who_never_forgets_stays_as_sure_when_another_filter_led_before_the_noise_became_louder(seed):
    """As a copy of the one that led it was ten times less sure, or six times surer than it had been."""
    y, u = record(seed)
    estimator = dw.Joint(1, 1, memory=dw.AutoMemory()).scaled_to(y, u)
    state = estimator.scan(y[:STEP], u[:STEP]).state
    for t in range(STEP, len(y)):
        before, another_led = of_the_slow(estimator, state)
        trace = estimator.scan(y[t : t + 1], u[t : t + 1], state=state)
        state = trace.state
        if int(trace.status[0]) & NOISE:
            break
    assert another_led and int(trace.status[0]) & NOISE
    assert of_the_slow(estimator, state)[0] == pytest.approx(before, rel=0.3)
