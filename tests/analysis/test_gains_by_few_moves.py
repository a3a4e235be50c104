"""A gain that few moves after it show is told where all moves of the record say how they are missed."""

import pytest
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record

from driftwise.analysis.segmentation import GAIN, hindsight


def test_a_gain_is_told_by_few_moves_after_it_where_those_before_say_how_moves_are_missed():
    """By the moves after it alone the odds were below one, at 445 nats of who knows the plant."""
    data = record(draw(510002, 4), 510002)
    (jump,) = hindsight(data.y, data.u).jumps()
    assert jump.kind == GAIN and jump.input == 1 and abs(jump.at - 529) < 5
    assert jump.after / jump.before == pytest.approx(2.0, abs=0.2)
