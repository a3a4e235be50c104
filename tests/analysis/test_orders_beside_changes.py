"""Changes that show beside another order than the one that is likeliest without them, or beside moves that are few."""

import pytest
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record

from driftwise.analysis import beginnings, segmentation
from driftwise.analysis.segmentation import GAIN, SPEED, hindsight


def seen(seed: int, number: int):
    """Return what is told of a drawn plant."""
    data = record(draw(seed, number), seed)
    return hindsight(data.y, data.u)


def test_a_plant_of_first_order_that_becomes_faster_is_none_of_second_order_that_does_not(monkeypatch):
    (jump,) = seen(510001, 204).jumps()
    assert jump.kind == SPEED and abs(jump.at - 251) < 10
    assert jump.after == pytest.approx(0.82, abs=0.03)
    monkeypatch.setattr(beginnings, "beside_speeds", lambda found: [])
    assert seen(510001, 204).jumps() == []


def test_a_plant_of_many_modes_is_looked_at_again_beside_all_of_them(monkeypatch):
    (jump,) = seen(510002, 116).jumps()
    assert jump.kind == SPEED and abs(jump.at - 1444) < 53  # its date is early: an input bends, and that is not found
    monkeypatch.setattr(segmentation, "looked_again", lambda now, order: now)
    assert seen(510002, 116).jumps() == []


def test_a_gain_is_told_by_few_moves_after_it_where_those_before_say_how_moves_are_missed():
    """By the moves after it alone the odds were below one, at 445 nats of who knows the plant."""
    (jump,) = seen(510002, 4).jumps()
    assert jump.kind == GAIN and jump.input == 1 and abs(jump.at - 529) < 5
    assert jump.after / jump.before == pytest.approx(2.0, abs=0.2)
