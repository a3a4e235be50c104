"""Noise that falls below the resolution of a sensor leaves rows that repeat themselves; the sensor is not stuck."""

import numpy as np

from driftwise.tables.stuck_sensor import still, stuck
from scripts.stuck_sensors import column, held, tells


def test_noise_below_the_resolution_is_no_stuck_sensor():
    """Of these hundred columns 7 were taken for stuck."""
    rng = np.random.default_rng(88101)
    alone = [one for one in (column(rng) for _ in range(200)) if not one.has_plant]
    assert sum(bool(stuck(one.y, [one.u])) for one in alone) <= 2
    assert sum(bool(still(one.y)) for one in alone) <= 1


def test_a_sensor_that_is_stuck_while_noise_moves_it_elsewhere_is():
    rng = np.random.default_rng(88102)
    coarse = np.round(rng.standard_normal(1500) * 2)
    y, u = held(coarse, 600, 100), rng.standard_normal(1500)
    assert tells(stuck(y, [u]), 600, 100) and tells(still(y), 600, 100)
    assert not stuck(held(coarse, 1400, 100), [u])  # to the end: the noise may have become quiet
    finely = np.round(rng.standard_normal(1500) * 20)
    assert tells(stuck(held(finely, 1400, 100), [u]), 1400, 100)
