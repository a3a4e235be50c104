"""Faults that take their time: what is drawn, and what is told of one column beside what all share."""

from __future__ import annotations

from collections import Counter

import numpy as np
from driftwise_studies.score.claims.rigs_gradual import ALONE, HAND, KINDS, count, faulty, pattern, steady, table


def test_a_fault_begins_where_it_says_and_ends_with_nothing():
    for kind in KINDS:
        one, none = faulty(3, 1, kind), steady(3, 1)
        assert np.allclose(one.columns[:, : one.first], none.columns[:, : one.first])
        assert not one.is_steady and none.is_steady
        there = pattern(np.random.default_rng(0), kind, 300)
        assert abs(there[-1]) < 1e-9 and there[0] >= 0.0 and abs(there.max() - 1) < 1e-9
    assert np.count_nonzero(faulty(3, 1, ALONE).sizes) == 1


def test_a_valve_that_is_closed_by_hand_is_told_of_its_column_alone():
    """By three deviations of what is quick, within rows, beside mains and load that all columns follow."""
    seen, one = Counter(), faulty(1, 17, ALONE)
    count(one, seen)
    assert seen["told"] == 1 and seen["elsewhere"] == 0


def test_a_change_that_is_far_above_the_noise_is_sure():
    """However it comes: the level of a pressure, eight deviations and more, that nothing else shows."""
    seen = Counter()
    count(faulty(1, 0, ALONE), seen)
    assert seen["told"] == 1


def test_what_is_told_is_counted():
    assert f"| {HAND} | 1 | 1 | " in table(1, 1, (HAND,), is_known=False)
