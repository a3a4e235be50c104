"""A position that stays behind and catches up is no manoeuvre, though its plots err to one side."""

from driftwise_studies.score.motions import behind
from driftwise_studies.score.motions.field import Total


def test_positions_that_stay_behind_are_no_manoeuvres():
    """Fourteen onsets of 7283 quiet plots were told."""
    total = Total(behind.play(21, 70))
    assert total.quiet > 7000
    assert total.false_rate < 1.0 and total.told > 0.8
