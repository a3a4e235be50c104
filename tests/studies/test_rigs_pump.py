"""A pump on a loop of water: what its physics does to each column, and what is told of it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from driftwise_studies.score.claims.rigs_pump import (
    FRICTION,
    IMBALANCE,
    KINDS,
    SET_POINT,
    STEADY,
    VALVE,
    count,
    drawn,
    flows,
    signals,
    table,
    usual,
)


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_begins_where_it_says(kind):
    one, T = drawn(3, 1, kind), len(drawn(3, 1, kind).columns["flow"])
    assert 0 < one.first < one.first + one.length < T
    assert all(np.isfinite(x).all() and np.ptp(x) > 0 for x in one.columns.values())


def test_nothing_moves_a_steady_one():
    assert drawn(3, 1, STEADY).length == 0
    assert all(np.allclose(x, x[0]) for x in signals(usual(50), False, (10.0, 20.0)).values())


def test_a_valve_that_closes_takes_flow_and_adds_pressure():
    rest, closed = usual(50), usual(50)._replace(resists=np.full(50, 2.0))
    before, after = (signals(one, False, (10.0, 20.0)) for one in (rest, closed))
    assert after["flow"][0] < before["flow"][0]
    assert after["pressure"][0] > before["pressure"][0]
    assert after["current"][0] < before["current"][0]


def test_who_holds_the_flow_turns_faster_when_a_valve_closes_or_water_falls():
    for what in (usual(5)._replace(resists=np.full(5, 2.0)), usual(5)._replace(head=np.full(5, 0.8))):
        flow, speed = flows(what, True)
        assert (flow == 1).all() and (speed > 1).all()
        assert (flows(what, False)[0] < 1).all()


def test_what_is_seen_at_once_is_told():
    seen = Counter()
    for number in range(2):
        count(drawn(1, number, IMBALANCE), seen)
    assert seen["begins"] == 2 and seen["beside"] == 0


def test_a_bearing_that_takes_more_is_told_where_the_flow_is_named():
    seen = Counter()
    count(drawn(6601, 0, FRICTION), seen)  # its current moves, and the flow does not
    assert seen["begins"] == seen["named"] == 1


def test_what_is_told_is_counted():
    assert f"| {STEADY} | 1 | 0 | 0 | 0 | 0 | 0 |" in table(1, 1, (STEADY,))
    assert SET_POINT in KINDS and VALVE in KINDS
