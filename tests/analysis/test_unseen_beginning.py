"""A record whose first outputs were not measured tells as much of the rest as one that begins there."""

import numpy as np
import pytest
from draws import slow
from scipy.signal import lfilter

from driftwise.analysis.segmentation import hindsight

UNSEEN = 150  # samples, in which every mode of the plant has died out


def nonlinear(seed: int, T: int = 1200):
    """Return y (T,), the first of it NaN, and u (T, 1) of a plant of third order whose input bends."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=T // 5 + 1), 5)[:T]
    r, w = rng.uniform(0.55, 0.8), rng.uniform(0.2, 0.9)
    a = np.convolve([1, -2 * r * np.cos(w), r * r], [1, -rng.uniform(0.5, 0.75)])
    y = lfilter([0, a.sum()], a, u + 0.15 * u * u) + lfilter([1], [1, -0.7], 0.15 * rng.normal(size=T))
    y[:UNSEEN] = np.nan
    return y, u[:, None]


@pytest.mark.parametrize("seed", [104, *map(slow, (109, 112, 114))])
def test_what_the_plant_began_with_is_asked_of_the_first_output_that_was_seen(seed):
    """At the first sample of all it would be known to nobody, and stood in the way of all else that is fitted."""
    response = hindsight(*nonlinear(seed)).response
    start = response.more[response.placed()["start"]]
    assert response.bent == (0,) and not response.dates.size
    assert len(start) and abs(start).max() < 10  # deviations of the output
