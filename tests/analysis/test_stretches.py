"""A level that changes and comes back: both ends at once, against least squares of every pair."""

from itertools import combinations

import numpy as np
import pytest
from driftwise_studies.score.claims.passing import KINDS, passing, told

from driftwise.analysis.change_places import PLACES
from driftwise.analysis.noise_jumps import LEAST
from driftwise.analysis.response_orders import begin
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import hindsight
from driftwise.analysis.stretches import stretch


def passes(seed: int, size: float, samples: int = 400, first: int = 180, last: int = 260):
    y = np.random.default_rng(seed).standard_normal(samples)
    y[first:last] += size
    return y


def least_pair(y) -> tuple[int, int]:
    """Return the two places of the grid whose steps leave least squares, by trying them all."""
    t = np.arange(len(y))
    grid = np.unique(t[LEAST:-LEAST][np.linspace(0, len(y) - 2 * LEAST - 1, PLACES).astype(int)])
    left = {}
    for a, b in combinations(grid.tolist(), 2):
        if b - a >= LEAST:
            X = np.column_stack([np.ones(len(y)), t >= a, t >= b])
            left[a, b] = np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2)
    return min(left, key=lambda pair: left[pair])


def test_the_ends_are_those_that_leave_least():
    y = passes(1, 1.5)
    found = stretch(begin(recorded(y, np.zeros((len(y), 0)))[0]))
    assert found is not None
    np.testing.assert_allclose(found, least_pair(y), atol=6)  # samples far off count less here
    assert stretch(begin(recorded(passes(1, 0.0), np.zeros((len(y), 0)))[0])) is None


@pytest.mark.parametrize("is_missing", [False, True])
def test_a_level_that_comes_back_is_told_at_both_ends(is_missing):
    for seed in range(3):
        y = passes(seed, 1.0, 1200, 560, 900)
        if is_missing:
            y[np.random.default_rng(seed).random(len(y)) < 0.05] = np.nan
        down, up = hindsight(y, np.zeros((len(y), 0))).jumps()
        assert abs(down.at - 560) < 15 and abs(up.at - 900) < 15 and down.after > 0 > up.after


def test_drawn_levels_that_come_back_are_told_twice_as_often_as_by_one_step_after_the_other():
    found = [told(*passing(0, number, KINDS[1])) for number in range(20)]
    assert sum(ends == 2 for ends, _ in found) >= 9 and not sum(false for _, false in found)
