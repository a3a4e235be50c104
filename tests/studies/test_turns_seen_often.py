"""A turn is told however often it is seen: who is seen every second moves little from plot to plot."""

import pytest
from driftwise_studies.score.motions.turns import told


@pytest.mark.parametrize(("scan", "deviation", "rate"), [(1.0, 30.0, 3.0), (1.0, 30.0, 1.5), (2.0, 50.0, 3.0)])
def test_turns_at_a_rate_are_told_without_false_onsets(scan, deviation, rate):
    """Of a standard turn at a second and 30 m half were told, of one at half that rate none."""
    row = told(4, 5, scan, deviation, rate)  # seed, flights: 20 turns
    assert float(row[3]) >= 0.95
    assert float(row[4]) < 16 and float(row[5]) <= 1.0
