"""Changes that were found and not told, or told and not there: levels beside slow noise, two of one date, walks."""

import numpy as np
import pytest
from draws import slow
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record
from driftwise_studies.score.claims.wander import wandering

from driftwise.analysis import segmentation
from driftwise.analysis.change_places import levelled
from driftwise.analysis.segmentation import GAIN, LEVEL, hindsight
from driftwise.analysis.walks import walk


def found(seed: int, number: int):
    """Return the jumps that are told of a drawn record."""
    data = record(draw(seed, number), seed)
    return hindsight(data.y, data.u).jumps()


def test_a_level_that_steps_while_nothing_is_seen_is_told_beside_a_noise_that_takes_it_for_its_colour():
    """Eight past values of the noise nearly integrate, and what the level is wrong by counted as white noise."""
    told = found(480101, 145)
    assert [jump.kind for jump in told] == [LEVEL] and told[0].interval[0] <= 294 <= told[0].interval[1]


def test_of_two_gains_that_have_come_to_one_date_one_is_told():
    """Either explained the other, and none was told."""
    told = found(480202, 5)
    assert [jump.kind for jump in told] == [GAIN] and told[0].interval[0] <= 704 <= told[0].interval[1]


@pytest.mark.parametrize("number", [8, slow(41)])
def test_a_gain_that_wanders_is_weighed_as_its_jump_is(number, monkeypatch):
    """Poles that are fitted anew take a part of what wanders."""
    seen = hindsight(*wandering(480301, number, "gain"))
    assert not seen.jumps()
    monkeypatch.setattr(
        segmentation,
        "walked",
        lambda now, part, j, calm: walk(now.without(part, j).refined(), now.gains[j][0], calm),
    )
    assert GAIN in {jump.kind for jump in seen.jumps()}


def test_a_level_that_is_known_is_not_fitted_anew():
    y, u = np.random.default_rng(3).standard_normal(400), np.zeros((400, 0))
    now = hindsight(y, u).response
    assert levelled(now) is now
