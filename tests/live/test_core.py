"""The core of the service: the bits of a fleet, whatever is lost between two commits."""

import numpy as np
from live_plant import found, lines, opened, outputs, states

from driftwise.live.sources.base import Parcel
from driftwise.live.sources.lines import Lines

NOW = 2e9


def parcel(y, first, last):
    chunks, refused = Lines("json").read(lines(y, first, last).encode())
    return Parcel(chunks, None, ("file", last), refused)


def test_states_are_those_of_a_fleet_wherever_it_is_killed(tmp_path):
    y, rng = outputs(20, 300), np.random.default_rng(3)
    core = opened(tmp_path)
    at, kills = 0, 0
    while at < 300:
        last = min(at + int(rng.integers(1, 12)), 300)
        core.take([parcel(y, at, last)], NOW)
        at = last
        if rng.random() < 0.5:
            core.commit()
        if rng.random() < 0.15:  # killed: what was not committed is gone
            core.store.close()
            core = opened(tmp_path)
            at, kills = core.places.get("file", 0), kills + 1
    core.commit()
    assert kills > 3
    assert found(core) == states(y)
    core.store.close()
    again = opened(tmp_path)
    assert found(again) == states(y)
    assert again.picture.line(3)[-120:] == core.picture.line(3)


def test_samples_that_come_twice_count_once(tmp_path):
    y = outputs(3, 200)
    core = opened(tmp_path)
    for at in range(0, 200, 10):
        core.take([parcel(y, max(at - 15, 0), at + 10)], NOW)
    core.commit()
    assert found(core) == states(y)
    assert core.groups[0].tally["duplicate"].sum() > 0


def test_events_keep_their_numbers(tmp_path):
    y = outputs(2, 400)
    y[0, 200:] += 30.0
    y[1, 250:] = y[1, 249]
    core = opened(tmp_path)
    events = core.take([parcel(y, 0, 400)], NOW)
    core.commit()
    assert [event.number for event in events] == list(range(1, len(events) + 1))
    assert ("s1", "stuck") in {(event.key, event.kind) for event in events}
    assert any(event.key == "s0" and event.time >= 1e9 + 200 for event in events)
    core.store.close()
    again = opened(tmp_path)
    assert again.store.events(0, None) == events
    seen = again.store.acknowledge(events[0].number)
    assert seen.acknowledged
    assert again.store.events(0, events[0].key)[0].acknowledged
    assert again.last_event == len(events)
