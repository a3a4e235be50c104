"""Beside a state `AutoMemory` sets copies free at several samples and by two sizes, and none farther than is stable."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.memory.robust_start import rows_size
from driftwise.memory.set_free import set_free_size, sets_of


def record(seed, at=300, after=30):
    """Return y, u and the state of a plant of order two whose parameters jump."""
    rng = np.random.default_rng(seed)
    a = np.poly(rng.uniform(0.3, 0.85, 2))[1:]
    b = rng.uniform(0.5, 1.5, 2) * rng.choice([-1.0, 1.0], 2)
    T = at + after
    u, v = rng.standard_normal(T), 0.2 * rng.standard_normal(T)
    x, y, states = np.zeros(2), np.empty(T), np.empty((T, 2))
    for t in range(T):
        if t == at:
            moved, b = a + 0.1 * rng.standard_normal(2), b + 0.5 * rng.choice([-1.0, 1.0], 2)
            a = moved if max(abs(np.roots(np.r_[1.0, moved]))) < 0.97 else a
        states[t], y[t] = x, x[0] + v[t]
        x = np.array([x[1], 0.0]) - a * y[t] + b * u[t]
    return y, u, states


def test_a_state_is_found_sooner_after_a_jump():
    """One copy, set free at the first surprise by four deviations, loses a seventh more (mean logarithm).

    So it does where the mean waits as long as that of a regression.
    """
    lost = []
    for seed in range(60):
        y, u, x = record(seed)
        trace = dw.Joint(2, 1, memory=dw.AutoMemory()).scaled_to(y, u).scan(y, u)
        lost.append(((trace.x - x)[300:] ** 2).sum())
    assert np.mean(np.log(lost)) < 1.25


@pytest.mark.parametrize("N", [1, 2, 3, 4, 6, 9, 10, 12, 20, 60])
def test_copies_have_room_where_a_regression_keeps_its_rows(N):
    """No state is longer than it was; the number of rows so far stands before them."""
    assert 1 + set_free_size(N) <= rows_size(N) and 3 <= sets_of(N) <= 4
