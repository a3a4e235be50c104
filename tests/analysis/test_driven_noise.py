"""What a response leaves after moves of an input: as loud as it is there, and no step of the level by itself."""

import numpy as np
import pytest
from draws import draws
from driftwise_studies.score.claims.wander import wandering
from scipy.signal import lfilter

from driftwise.analysis import segmentation
from driftwise.analysis.driven_noise import AFTER, loudness
from driftwise.analysis.response_orders import begin
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import GAIN, LEVEL, hindsight


def moved(seed: int, late: float, level: float = 0.0):
    """Return y, u of a plant of first order whose input acts up to ``late`` of its step wrong at each move."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, 40), 40)
    wrong = late * rng.standard_normal(len(u)) * np.append(0.0, np.diff(u))
    y = lfilter([0.0, 0.1], [1, -0.9], u + wrong) + 0.002 * rng.standard_normal(len(u))
    return y + level * (np.arange(len(u)) >= 800), u[:, None]


@pytest.mark.parametrize("late", [0.0, 1.0])
def test_noise_is_louder_after_moves_where_they_are_missed_and_only_there(late):
    y, u = moved(1, late)
    now = begin(recorded(y, u)[0])
    by_row = np.full(len(y), np.nan)
    by_row[now.rows] = loudness(now, 802)
    after, elsewhere = by_row[800 : 800 + AFTER + now.nk[0]], np.append(by_row[:800], by_row[820:])
    assert np.nanmax(after) > 4 if late else np.nanmax(after) < 3
    assert np.nanmax(elsewhere) == 1


def test_a_level_that_steps_as_an_input_moves_is_told_where_moves_are_not_missed():
    told = hindsight(*moved(2, 0.0, 0.05)).jumps()
    assert [jump.kind for jump in told] == [LEVEL] and abs(told[0].at - 800) < 5


def gains(seed: int, factor: float):
    """Return y, u of the same plant, missed at each move, whose gain changes by a factor in the middle."""
    y, u = moved(seed, 1.0)
    return y + lfilter([0.0, 0.1], [1, -0.9], (factor - 1) * u[:, 0] * (np.arange(len(u)) >= 800)), u


@draws("numbers", [30], [12, 15, 30])
def test_a_gain_that_is_another_for_a_few_moves_is_told_of_no_plant_that_misses_them(numbers, monkeypatch):
    seen = [hindsight(*wandering(0, number, "late moves")) for number in numbers]
    assert not any(one.jumps() for one in seen)
    assert all(one.visible().gains[0] == np.inf for one in seen)
    monkeypatch.setattr(segmentation, "by_moves", lambda now, j, where: where)
    assert GAIN in {jump.kind for jump in seen[-1].jumps()}


@draws("seeds", [1], range(4))
def test_a_gain_that_falls_for_good_is_told_though_moves_are_missed(seeds):
    told = [[jump for jump in hindsight(*gains(seed, 0.4)).jumps() if jump.kind == GAIN] for seed in seeds]
    assert sum(len(one) == 1 and abs(one[0].at - 800) < 45 for one in told) >= 0.75 * len(seeds)
