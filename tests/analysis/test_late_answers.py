"""A fall of counts is no late answer to an input that walks, though what waits for it leaves the first rows out."""

import math

import numpy as np
import pytest
from draws import slow
from driftwise_studies.score.claims.falls import NONE, ONCE, TWICE, YEAR, counts

from driftwise.analysis.response_orders import linear, plainest
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import LEVEL, hindsight


@pytest.mark.parametrize("number", [6, slow(34)])
def test_a_fall_is_no_late_answer_to_a_price_that_walks(number):
    y, u, (at,) = counts(14, number, ONCE)
    (told,) = hindsight(y, u, seasons=(YEAR,)).jumps()
    assert told.kind == LEVEL and abs(told.at - at) <= 1


def test_a_fall_is_not_told_in_two_halves_of_which_one_is_unsure():
    y, u, dates = counts(15, 16, TWICE)
    told = hindsight(y, u, seasons=(YEAR,)).jumps()
    assert [(jump.kind, jump.at) for jump in told] == [(LEVEL, at) for at in dates]


@pytest.mark.parametrize("number", [1, 2])
def test_no_fall_is_told_of_steady_counts(number):
    y, u, _ = counts(14, number, NONE)
    assert hindsight(y, u, seasons=(YEAR,)).jumps() == []


def test_what_waits_for_an_input_pays_for_rows_before_it():
    """A level that steps there is not left out: the criterion grows by what these rows are louder."""
    rng, T, late = np.random.default_rng(0), 200, 30
    u, e = np.cumsum(rng.standard_normal(T)), rng.standard_normal(T)
    found = []
    for size in (0.0, 8.0):
        record = recorded(e + size * (np.arange(T) < 15), u[:, None])[0]
        plain = plainest(record)
        now = linear(plain, [], (late,), 2)
        found.append(now)
    calm, stepped = (one.loudness_before for one in found)
    assert calm[0] == stepped[0] == late + 1
    assert math.log(stepped[1]) > math.log(calm[1]) + 0.5
