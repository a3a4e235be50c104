"""A column that steps once says when something was done: a change at that date is looked for, and told with it."""

import numpy as np
import pytest
from draws import draws

import driftwise as dw
from driftwise.analysis.events import Event, events_of, samples
from driftwise.analysis.table_together import together_words
from driftwise.analysis.together import together
from driftwise.tables.one_column import seldom_steps

T, AT, STEP = 400, 260, 0.9


def record(seed, step=STEP, at=AT, **more):
    """Return a plant's table; its level falls by so many deviations of its noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([0.0, 1.0], T // 20), 20)
    e = rng.standard_normal(T)
    y = np.zeros(T)
    for k in range(1, T):
        y[k] = 0.6 * y[k - 1] + 0.8 * u[k - 1]
    return {"heater": u, "temperature": 20 + y + 0.5 * e - 0.5 * step * (np.arange(T) >= at), **more}


def mark(at, before=0.0, after=1.0):
    return np.where(np.arange(T) < at, before, after)


def found(data, **more):
    return dw.identify(data, "temperature", "heater", **more)


def test_which_columns_are_events():
    assert seldom_steps(mark(100)) == [100]
    assert seldom_steps(np.repeat([1.0, 4.0, 2.0], [50, 50, 50])) == [50, 100]
    for other in (np.repeat([0.0, 1.0, 0.0], [50, 1, 50]), mark(3), np.arange(50.0), np.tile([0.0, 1.0], 50)):
        assert seldom_steps(other) == []


@draws("seeds", range(1, 4), range(1, 13))
def test_more_changes_are_told_at_dates_that_the_table_marks(seeds):
    marked, told = 0, 0
    for seed in seeds:
        other, here = found(record(seed, law=mark(90))), found(record(seed, law=mark(AT)))
        told += sum("level fell" in one.moved for one in other.changes)
        for one in here.changes:
            assert "level fell" in one.moved and one.interval[0] <= AT <= one.interval[1]
            assert one.events == (Event("law", float(AT), 0.0, 1.0),)
            assert "when 'law' went from 0 to 1 (odds" in here.words
        marked += len(here.changes)
    assert marked >= told + len(seeds) / 4


def test_an_event_is_no_input():
    answer = dw.identify(record(1, step=4.0, law=mark(AT)))
    assert (answer.table.output, answer.table.inputs) == ("temperature", ("heater",))
    assert answer.table["law"].role == "event" and "'law' (says when something was done)" in answer.words
    assert answer.changes[0].events


def test_what_steps_once_and_is_all_that_may_have_driven_the_output_is_its_input():
    data = record(1, step=4.0, column1=mark(AT))
    assert dw.identify({name: data[name] for name in ("temperature", "column1")}).table.inputs == ("column1",)


@draws("seeds", range(4, 6), range(4, 10))
def test_a_mark_at_which_nothing_changed_tells_nothing(seeds):
    assert not any(found(record(seed, step=0.0, law=mark(AT, 2.0, 7.0))).changes for seed in seeds)


def test_what_somebody_marked_by_looking_is_no_event():
    answer = found(record(1, step=4.0, anomaly=mark(AT)))
    assert answer.table["anomaly"].role == "label" and not any(one.events for one in answer.changes)


@draws("seeds", range(4), range(8))
def test_columns_that_change_together_are_told_sooner_at_a_date_that_the_table_marks(seeds):
    told = dict.fromkeys((90, AT), 0)
    for seed in seeds:
        rng = np.random.default_rng([7, seed])
        columns = {name: rng.standard_normal(T) + 0.75 * (np.arange(T) >= AT) for name in "abc"}
        for at in told:
            found = together(columns, [at])
            assert all(abs(one.since - AT) < 20 for one in found)
            told[at] += len(found)
    assert told[AT] >= told[90] + len(seeds) / 4


def test_a_question_is_asked_with_what_changed_when_something_was_done(tmp_path):
    rng = np.random.default_rng(8)
    columns = {name: rng.standard_normal(T).cumsum() * 0.05 + rng.standard_normal(T) for name in ("p", "q", "r")}
    columns["q"] = columns["q"] - 3.0 * (np.arange(T) >= AT)
    answer = dw.identify({**columns, "law": mark(AT)})
    (told,), table = answer.together, answer.table
    assert told.events == (Event("law", float(AT), 0.0, 1.0),)
    said = together_words(told, table)
    assert "'q' fell by 3" in said and "when 'law' went from 0 to 1 (odds" in said and "does not say" not in said


@pytest.mark.parametrize("clock", [{"dt": 60.0}, {}])
def test_an_event_has_the_time_of_its_row(clock):
    stamps = {} if clock else {"time": np.datetime64("2024-01-01") + 60 * np.arange(T).astype("timedelta64[s]")}
    answer = found(record(1, step=4.0, law=mark(AT), **stamps), **clock)
    (event,) = answer.changes[0].events
    assert event.time == 60.0 * AT == answer.trace.time[AT]


def test_samples_of_events_on_an_irregular_clock():
    time = np.array([0.0, 1.0, 2.5, 7.0])
    events = [Event("law", at, 0.0, 1.0) for at in (-1.0, 0.0, 2.0, 7.0, 9.0)]
    assert samples(events, time) == (2, 3)


def test_recordings_one_below_the_other_have_no_events():
    clock = np.tile(np.arange(T / 2), 2)
    answer = found(record(1, step=4.0, law=mark(AT), time=clock), time="time")
    assert answer.table.sampling.restarts and not any(one.events for one in answer.changes)
    assert events_of({}, answer.table) == ()
