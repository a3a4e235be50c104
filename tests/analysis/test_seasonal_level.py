"""A level with the season of its clock: a step beside it is told, a season that grows is no louder noise."""

import numpy as np
import pytest
from draws import slow
from driftwise_studies.score.claims.seasonal_steps import STEADY, STEP, YEAR, counts
from driftwise_studies.score.seasonal_worlds import WORLDS

from driftwise import identify
from driftwise.analysis.seasonal_level import waves
from driftwise.analysis.segmentation import LEVEL, hindsight


@pytest.mark.parametrize("number", [4, slow(13)])
def test_a_step_beside_a_season_is_told_where_the_clock_says_the_season(number):
    """The colour of the noise had taken the season, and a step of the counts with it."""
    y, u, at = counts(1, number, STEP)
    assert hindsight(y, u).jumps() == []
    (told,) = hindsight(y, u, seasons=(YEAR,)).jumps()
    assert told.kind == LEVEL and told.at == at and told.after < 0


@pytest.mark.parametrize("number", [0, slow(12), slow(29)])
def test_a_step_is_no_late_answer_of_an_input_that_walks(number):
    """A walk that is waited for long enough falls where the output does; an input that acts at once needs no pole."""
    y, u, at = counts(7, number, STEP)
    found = hindsight(y, u, seasons=(YEAR,))
    (told,) = found.jumps()
    assert told.kind == LEVEL and abs(told.at - at) <= 1 and told.after < 0
    assert max(found.response.nk) <= 1 and not len(found.response.a)


def test_identify_tells_the_step_of_months_that_have_their_dates():
    y, u, at = counts(1, 0, STEP)
    month = np.datetime64("1990-01") + np.arange(len(y))
    found = identify({"month": month.astype("datetime64[D]"), "price": u[:, 1], "deaths": y}, output="deaths")
    assert [abs(change.since - at) <= 1 for change in found.changes] == [True]


def test_nothing_is_told_of_counts_that_are_steady():
    assert not any(hindsight(*counts(1, number, STEADY)[:2], seasons=(YEAR,)).jumps() for number in range(3))


def test_a_season_that_grows_is_no_louder_noise():
    """What a season of one size leaves of it is larger later."""
    y = WORLDS["growing_months"](np.random.default_rng([1, 13, 1]))[0]
    assert hindsight(y, np.zeros((len(y), 0)), seasons=(YEAR,)).jumps() == []


def test_a_season_of_few_samples_has_no_wave_twice():
    for season, many in ((12, 11), (4, 3), (7, 6), (5, 4)):
        found = waves(season, 6, 84)
        assert found.shape == (many, 84) and np.linalg.matrix_rank(found) == many
