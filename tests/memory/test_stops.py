"""An output that rests at a level and leaves it at once: predictions stay where y was, the next level is followed."""

import numpy as np
import pytest
from driftwise_studies.score.worlds import stops

import driftwise as dw

LEVEL, NOISE = 100.0, 2.0


def flow(seed, samples=800):
    """Return a flow about the mean of its first samples; within two of them a pump stops, later it goes on."""
    rng = np.random.default_rng(seed)
    stop, drop = 300 + int(rng.integers(0, 100)), rng.uniform(40, 90)
    level = np.full(samples, LEVEL)
    level[stop] -= drop * rng.uniform(0.2, 0.9)
    level[stop + 1 : stop + 60] -= drop
    y = level + NOISE * rng.standard_normal(samples)
    return stops.Stops(y - y[:50].mean(), np.zeros((samples, 0)), np.array([stop, stop + 60]), NOISE)


@pytest.mark.parametrize("order", [1, 3])
def test_no_prediction_leaves_the_range_of_y_by_its_width(order):
    """What a surprise frees is no wider than a stable plant leaves lags, though y at rest hardly said what they are."""
    memory = dw.memory.AutoMemory()
    found = [stops.errors(r, stops.predictions(r, order, memory)) for r in (flow((77, k)) for k in range(30, 60))]
    assert max(one.outside for one in found) < 0.5  # 1.7 and 1.4 where a jump is as wide as deviations are
    assert max(one.ratio for one in found) < 2.0


def test_a_level_that_comes_back_is_followed():
    """At the old level regressors are as small as those of a plant at rest; the constant still acts."""
    rng = np.random.default_rng(5)
    y = 0.2 * rng.standard_normal(600)
    y[200:400] -= 9.0
    trace = dw.ARX(1, [], offset=True, memory=dw.AutoMemory()).scan(y)
    assert np.abs(y - trace.prediction)[408:].max() < 1.0
