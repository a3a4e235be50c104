"""Where outliers come is told: where an input moves, or the output is far out, the model is wrong, not the sensor."""

import numpy as np
import pytest

import driftwise as dw


def plant(louder, seed: int, hold: int = 20, T: int = 2000):
    """Return y, u of a plant of first order; ``louder(moved, y)`` is by what its noise is louder at a sample."""
    rng = np.random.default_rng(seed)
    u = np.repeat(2 * rng.standard_normal(T // hold), hold)
    y, moved = np.zeros(T), np.abs(np.diff(u, prepend=u[0])) > 0
    for t in range(1, T):
        y[t] = 0.8 * y[t - 1] + 0.2 * u[t - 1] + 0.05 * louder(moved[t], y[t - 1]) * rng.standard_normal()
    return y, u, rng


def said_of(y, u) -> str:
    found = dw.ARX(1, 1, memory=dw.AutoMemory()).scan(y, u).diagnose()
    return next(verdict.advice for verdict in found if verdict.name == "rejected")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_outliers_where_an_input_moves_are_none_of_the_sensor(seed):
    y, u, _ = plant(lambda moved, _: 10 if moved else 1, seed)
    assert "most where an input moves: there the model is wrong" in said_of(y, u)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_outliers_where_the_output_is_far_out_are_none_of_the_sensor(seed):
    y, u, _ = plant(lambda _, before: 10 if abs(before) > 1.2 else 1, seed, hold=1)
    assert "most where the output is far out: there the model is wrong" in said_of(y, u)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_outliers_anywhere_are_laid_to_the_sensor_first(seed):
    y, u, rng = plant(lambda *_: 1, seed)
    y += (rng.random(len(y)) < 0.03) * rng.choice([-2, 2], len(y))
    assert "look at the sensor" in said_of(y, u)
