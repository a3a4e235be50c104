"""A step beside an input that walks or grows is a step, not an answer of the plant as long as the record."""

from driftwise_studies.score.claims.falls import NONE, TWICE, counts, known
from driftwise_studies.score.claims.seasonal_steps import YEAR

from driftwise.analysis.beginnings import is_slow
from driftwise.analysis.segmentation import LEVEL, hindsight


def test_falls_are_no_slow_answer_of_a_price_that_walks():
    """One pole near one had both of them; beside it none was likelier alone."""
    y, u, dates = counts(1, 4, TWICE)
    found = hindsight(y, u, seasons=(YEAR,))
    told = found.jumps()
    assert known(y, u, dates) == 2 and not is_slow(found.response)
    assert [jump.kind for jump in told] == [LEVEL, LEVEL]
    assert all(abs(jump.at - at) <= 1 for jump, at in zip(told, dates))


def test_who_knows_tells_no_fall_where_there_is_none():
    assert all(known(*counts(1, number, NONE)) == 0 for number in range(3))
