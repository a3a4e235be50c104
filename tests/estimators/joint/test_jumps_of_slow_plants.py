"""A jump in a plant with a memory of its own: what the old parameters did to the state is none of the new ones'."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.memory.at_rest import HEARD_BOTH
from driftwise.memory.auto import AutoMemoryKernel
from driftwise.memory.less_noise import HEARD
from driftwise.memory.retrospect import retrospect_size
from driftwise.results import upgrade

JUMP, SAMPLES, AFTER = 250, 500, 300


def slow_plant(seed):
    """Return y, u and parameters of a plant with poles of .6 to .85 and little output noise, whose gains jump."""
    rng = np.random.default_rng(seed)
    a, b = np.poly(rng.uniform(0.6, 0.85, 2))[1:], rng.uniform(0.5, 1.5, 2) * rng.choice([-1.0, 1.0], 2)
    jump, u, x = 0.5 * rng.choice([-1.0, 1.0], 2), rng.standard_normal(SAMPLES), np.zeros(2)
    y, theta = np.empty(SAMPLES), np.empty((SAMPLES, 4))
    for t in range(SAMPLES):
        now = b + jump * (t >= JUMP)
        y[t], theta[t] = x[0] + 0.05 * rng.standard_normal(), [*a, *now]
        x = np.append(x[1:], 0.0) - a * x[0] + now * u[t]
    return y, u, theta


def automatic(y, u):
    return dw.Joint(2, 1, noise=dw.models.OutputError(), memory=dw.AutoMemory()).scaled_to(y, u)


@pytest.mark.parametrize("first", [0, 200])
def test_parameters_are_found_after_a_jump(first):
    """Slopes of a past that was the old parameters' told the filter the wrong ones, and so surely that it kept them."""
    squares, of_bars = [], []
    for seed in range(first, first + 12):
        y, u, theta = slow_plant(seed)
        trace = automatic(y, u).scan(y, u)
        off = (trace.parameters - theta)[AFTER:]
        squares.append(np.mean(off**2))
        of_bars.append(np.mean((off / trace.parameters_std[AFTER:]) ** 2))
    assert np.sqrt(np.mean(squares)) < 0.05  # .11 and .14 before
    assert np.mean(of_bars) < 8.0  # 40 and 450 before


def test_a_state_saved_without_them_goes_on():
    y, u, _ = slow_plant(1)
    est = automatic(y, u)
    state = est.scan(y[:200], u[:200]).state
    row = np.atleast_1d(state).view(float)
    end = est.dtype.fields["memory_state"][1] // 8 + state["memory_state"].size
    (memory,) = [one for part in est.parts for one in part.policies if isinstance(one, AutoMemoryKernel)]
    heard = HEARD + retrospect_size(memory.cap.size, int(memory.stakes)) + HEARD_BOTH
    later = [*range(end - heard, end), *range(row.shape[-1] - state["fresh"].size, row.shape[-1])]
    found = upgrade.rows(est, np.delete(row, later, axis=-1))
    assert found.shape == row.shape and not found[..., later].any()
    np.testing.assert_array_equal(np.delete(found, later, axis=-1), np.delete(row, later, axis=-1))
