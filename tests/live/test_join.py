"""Messages that come apart are joined, in whatever order they come within the lag."""

import json
import math
import random

import pytest

from driftwise.live.join import Clock, Row, Waiting, join


def rows(messages, clock, inputs=1, state=None):
    state = state or Waiting()
    found = []
    for time, output, *given in messages:
        given = [None if value is None else [value] for value in given] or [None] * inputs
        found += join(state, clock, [time], None if output is None else [output], given)
    return found


def test_all_in_one_message_goes_at_once():
    assert rows([(1.0, 5.0, 7.0), (2.0, 6.0, 8.0)], Clock()) == [Row(1.0, 5.0, (7.0,)), Row(2.0, 6.0, (8.0,))]


def test_an_input_is_held_and_becomes_old():
    clock = Clock(hold=2.0)
    found = rows([(0.0, None, 3.0), (1.0, 5.0, None), (2.0, 6.0, None), (3.0, 7.0, None), (9.0, None, 4.0)], clock)
    assert [row.inputs[0] for row in found[:2]] == [3.0, 3.0]
    assert math.isnan(found[2].inputs[0])


def test_an_input_may_be_later_within_the_tolerance():
    found = rows([(1.0, 5.0, None), (1.2, None, 3.0), (2.0, None, 9.0)], Clock(tolerance=0.5))
    assert found == [Row(1.0, 5.0, (3.0,))]


@pytest.mark.parametrize("seed", range(20))
def test_order_within_the_lag_does_not_matter(seed):
    drawn, clock = random.Random(seed), Clock(tolerance=0.3, hold=3.0, lag=2.0)
    messages = [(float(t), float(t), None) for t in range(60)] + [(t + 0.2, None, 10.0 + t) for t in range(60)]
    messages.sort()
    mixed = sorted(messages, key=lambda message: message[0] + drawn.uniform(0.0, 1.9))
    end = [(100.0, None, 0.0)]
    assert rows(mixed + end, clock) == rows(messages + end, clock)
    assert [row.time for row in rows(mixed + end, clock)] == [float(t) for t in range(60)]


def test_what_waits_survives_as_json():
    clock, messages = Clock(tolerance=1.0, lag=3.0), [(float(t), float(t), None) for t in range(9)]
    state = Waiting()
    first = rows(messages[:5], clock, state=state)
    state = Waiting.of(json.loads(json.dumps(state.as_json())))
    again = first + rows(messages[5:], clock, state=state)
    assert repr(again) == repr(rows(messages, clock))


def test_late_rows_go_at_once_to_be_counted():
    found = rows([(10.0, 1.0, None), (20.0, 2.0, None), (3.0, 0.0, None)], Clock(lag=5.0))
    assert [row.time for row in found] == [10.0, 3.0]
