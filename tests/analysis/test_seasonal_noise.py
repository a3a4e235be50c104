"""Noise that comes and goes with the day is no noise that jumps; one that jumps beside it is found all the same."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.segmentation import NOISE, hindsight


def sun(seed, louder=1.0):
    """Return a sun behind clouds, nought by night, the samples of its day, and when its clouds become louder."""
    rng = np.random.default_rng([seed, 78])
    day, days = int(rng.choice([24, 48, 96])), int(rng.integers(8, 20))
    t = np.arange(days * day + rng.integers(day)) + rng.integers(day)
    at = len(t) // 2
    clouds = lfilter([0.44], [1, -0.9], rng.standard_normal(len(t)) * np.where(np.arange(len(t)) < at, 1.0, louder))
    height = np.maximum(np.sin(2 * np.pi * t / day) - 0.1, 0)
    return 100 * height * np.clip(0.75 + rng.uniform(0.1, 0.4) / louder * clouds, 0.05, 1), day, at


def told(y, *seasons):
    found = hindsight(y, np.zeros((len(y), 0)), seasons=seasons)
    return [jump.at for jump in found.jumps() if jump.kind == NOISE]


@pytest.mark.parametrize("seed", [5, 34])  # of the first forty those in which the noise was taken to jump
def test_a_sun_that_sets_is_no_noise_that_falls(seed):
    y, day, _ = sun(seed)
    assert told(y) and not told(y, day)


def test_louder_clouds_are_found_beside_the_day():
    found = [(told(y, day), day, at) for y, day, at in (sun(seed, 8.0) for seed in range(1, 9))]
    assert sum(any(abs(one - at) <= day for one in jumps) for jumps, day, at in found) >= 7
