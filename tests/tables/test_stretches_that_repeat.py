"""A sensor that repeats itself is taken out of a table though cells of it are lost meanwhile."""

import numpy as np
import pytest
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record
from scipy.signal import lfilter

from driftwise.tables.autoread import read
from driftwise.tables.cleaning import Belief, doubtful
from driftwise.tables.stuck_sensor import stuck


def test_a_code_within_a_stretch_that_repeats_does_not_end_it():
    """The stretch was said to be taken as missing, and was not: a code for a lost cell split it in two."""
    rng = np.random.default_rng(480301)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0, 2.0], 60), 15)
    level = 20 + lfilter([0.0, 0.1], [1, -0.9], u) + 0.05 * rng.standard_normal(900)
    level[400:500] = level[400]
    level[[120, 440, 471, 700]] = -999.0
    table, segments = read({"valve": u, "level": level})
    assert table["level"].stuck
    lost = np.flatnonzero(np.isnan(np.concatenate([part[1] for part in segments])))
    assert lost.tolist() == [120, *range(400, 500), 700]


def test_two_short_stretches_about_a_code_are_one():
    values = np.array([1.0, 2, 3, 3, 3, -999, 3, 3, 4, 5])
    doubt = doubtful(values, Belief(1.0, 5.0, codes=(-999.0,), still=5))
    assert np.flatnonzero(doubt).tolist() == [2, 3, 4, 5, 6, 7]


@pytest.mark.parametrize("number", [88, 130])
def test_a_smooth_sensor_that_is_written_in_steps_is_known_to_be_stuck(number):
    """It rests at most rows, so that it turns round at few; of its moves it does so at one in five, or thirteen."""
    plant = draw(480202, number)
    data, (first, length) = record(plant, 480202), plant.stuck
    (one,) = stuck(data.y, list(data.u.T))
    assert one.start <= first and one.stop >= first + length and one.stop - one.start < length + 5


def test_a_ramp_in_steps_that_waits_is_not_stuck():
    k = np.arange(1500)
    ramp = np.floor(np.interp(k, [0, 700, 800, 1500], [0.0, 350.0, 350.0, 700.0]))
    assert not stuck(ramp, [np.sin(k / 20)])
