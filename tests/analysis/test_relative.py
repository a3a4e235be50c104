"""Counts and amounts are read by their logarithms where these are likelier; changes are told in units and shares."""

import numpy as np
import pytest
from draws import slow
from driftwise_studies.score.claims.seasonal_steps import STEADY, STEP, YEAR, counts

from driftwise.analysis.change_log import moved
from driftwise.analysis.relative import read, read_relative
from driftwise.analysis.response_orders import plainest
from driftwise.analysis.segmentation import LEVEL, Jump, hindsight

SEASONS = (YEAR,)


def plant(seed: int, middle: float):
    """Return y, u of a plant of first order about a level, with noise of one size."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 60), 10)
    x = np.zeros(600)
    for t in range(1, 600):
        x[t] = 0.8 * x[t - 1] + 0.2 * u[t - 1]
    return middle + x + 0.1 * rng.standard_normal(600), u[:, None]


@pytest.mark.parametrize("number", [20, slow(33)])
def test_a_fall_of_what_is_multiplied_is_told(number):
    """In units it stood out of a season and a noise that grow with the level."""
    y, u, at = counts(1, number, STEP)
    found = hindsight(y, u, seasons=SEASONS)
    (told,) = found.jumps()
    assert found.units.is_relative and told.kind == LEVEL and abs(told.at - at) <= 1
    assert -0.35 < told.share < -0.1 and told.after == pytest.approx(told.share * np.median(y), rel=1e-3)


def test_what_adds_stays_in_its_units():
    for seed in range(3):
        y, u = plant(seed, 4.0)
        found = hindsight(y, u)
        assert read_relative(*read(y, u)) is not None
        assert not found.units.is_relative and not found.growth().power and found.jumps() == []


def test_what_is_not_above_zero_or_hardly_moves_has_no_logarithm():
    for middle in (0.5, 300.0):
        assert read_relative(*read(*plant(0, middle))) is None


def test_the_unit_of_the_output_decides_nothing():
    y, u, _ = counts(1, 33, STEP)
    one, other = (hindsight(scale * y, u, seasons=SEASONS) for scale in (1.0, 1024.0))
    assert one.units.is_relative and other.units.is_relative
    (a,), (b,) = one.jumps(), other.jumps()
    assert b.share == pytest.approx(a.share, rel=1e-6) and b.after == pytest.approx(1024 * a.after, rel=1e-6)
    assert other.visible().level == pytest.approx(1024 * one.visible().level, rel=1e-6)


def test_a_record_of_logarithms_has_the_rounding_and_the_units_of_what_was_counted():
    y = np.round(50 * np.exp(np.random.default_rng(0).standard_normal(400) / 4))
    record, units = read_relative(*read(y, np.zeros((400, 0))))
    assert record.floor * units.y_scale == pytest.approx(1 / np.sqrt(12), rel=0.01)
    assert units.at(record.y) * units.y_middle / units.y_scale == pytest.approx(y)
    assert units.size(np.log(1.1) * units.y_middle / units.y_scale) == pytest.approx(0.1 * units.y_middle)
    assert plainest(record).measured == 400


def test_a_share_is_told_beside_the_size():
    jump = Jump(100, (99, 101), 9.0, LEVEL, 0, 0.0, -320.0, share=-0.18)
    assert moved(jump, ()) == "the level fell by 320 (18 %)"
    assert moved(jump._replace(share=None), ()) == "the level fell by 320"


def test_samples_that_a_first_response_took_for_outliers_come_back():
    """Three months stood out of a response without a season."""
    y, u, _ = counts(1, 7, STEADY)
    found = hindsight(y, u, seasons=SEASONS)
    assert found.units.is_relative and found.response.used.all()
