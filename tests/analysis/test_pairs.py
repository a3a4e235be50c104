"""Two changes close together: what both take is that of least squares, and both are dated where they are."""

import numpy as np
import pytest
from draws import draws
from driftwise_studies.score.claims.close import close, told

from driftwise.analysis.change_effects import GAIN, LEVEL
from driftwise.analysis.pairs import both, directions
from driftwise.analysis.response_orders import begin
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import hindsight


def plant(level=400, gain=406, samples=900):
    """Return y, u of a plant of first order whose level, and whose gain, are others from two samples on."""
    rng = np.random.default_rng(4)
    u, x = np.repeat(rng.choice([-1.0, 0.0, 1.0], samples // 10), 10), np.zeros(samples)
    for t in range(1, samples):
        x[t] = 0.8 * x[t - 1] + 0.2 * (2.0 if t >= gain else 1.0) * u[t - 1]
    return x + 1.5 * (np.arange(samples) >= level) + 0.1 * rng.standard_normal(samples), u[:, None]


def test_what_two_changes_take_is_what_least_squares_take():
    now = begin(recorded(*plant())[0])
    dates = np.array([380, 400]), np.array([300, 406, 500])
    ways = [directions(now, what, places) for what, places in zip(((LEVEL, 0), (GAIN, 0)), dates)]
    taken = both(now, ((LEVEL, 0), (GAIN, 0)), dates, *ways)
    r = now.left * now.weight
    for p in range(2):
        for q in range(3):
            X = np.column_stack([now.basis, *ways[0][:, p], *ways[1][:, q]])
            left = r - X @ np.linalg.lstsq(X, r, rcond=None)[0]
            beside = r - now.basis @ (now.basis.T @ r)
            assert taken[p, q] == pytest.approx(0.5 * (beside @ beside - left @ left), rel=1e-3)


@pytest.mark.parametrize(("level", "gain"), [(400, 406), (412, 400)])
def test_a_level_and_a_gain_a_few_samples_apart_are_both_told_where_they_are(level, gain):
    jumps = {jump.kind: jump for jump in hindsight(*plant(level, gain)).jumps()}
    assert jumps[LEVEL].at == level and jumps[GAIN].interval[0] <= gain <= jumps[GAIN].interval[1]
    assert jumps[GAIN].interval[1] - jumps[GAIN].interval[0] < 40


@draws("numbers", [13], [13, 23, 26, 28])
def test_drawn_changes_close_together_lie_in_the_intervals_of_their_dates(numbers):
    for number in numbers:
        many, held, _ = told(*close(1, number))
        assert (many, held) == (2, 2)
