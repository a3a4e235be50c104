"""The core of the service: the bits of a fleet, whatever is lost between two commits."""

import json

import numpy as np
import pytest
from live_plant import found, lines, opened, outputs, parcel, states

from driftwise.engine.errors import InputError
from driftwise.live.sources.base import Parcel
from driftwise.live.sources.lines import Lines
from driftwise.live.store.base import StoreFull
from driftwise.live.store.sqlite import SqliteStore, counted

NOW = 2e9


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
    assert core.roster.groups[0].tally["duplicate"].sum() > 0


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
    assert again.store.events(0, None, 2) == events[:2] and again.store.events(0, None, 2, latest=True) == events[-2:]
    seen = again.store.acknowledge(events[0].number)
    assert seen.acknowledged
    assert again.store.events(0, events[0].key)[0].acknowledged
    assert again.last_event == len(events)


class Full:
    """A store whose disk is full for a while."""

    def __init__(self, store):
        self.store, self.is_full = store, False

    def commit(self, change):
        if self.is_full:
            raise StoreFull("database or disk is full")
        return self.store.commit(change)

    def __getattr__(self, name):
        return getattr(self.store, name)


def test_a_full_disk_costs_nothing_that_is_not_killed(tmp_path):
    y = outputs(4, 200)
    core = opened(tmp_path)
    core.store = Full(core.store)
    for at in range(0, 200, 10):
        core.store.is_full = 60 <= at < 150
        core.take([parcel(y, at, at + 10)], NOW)
        try:
            core.commit()
        except StoreFull:
            assert core.store.is_full
    core.store.close()
    again = opened(tmp_path)
    assert found(again) == states(y)
    assert sum(len(rows) for _, rows in again.history.recent) == 800


def test_bad_input_is_counted_and_hurts_nobody(tmp_path):
    y = outputs(2, 100)
    core = opened(tmp_path)
    for at in range(0, 100, 10):
        text = lines(y, at, at + 10)
        bad = 'x\n{"key": "s0", "value": "u"}\n{"key": "s0", "time": 1e12, "value": 1}\n{"key": "s1", "value": [[]]}\n'
        chunks, refused = Lines("json").read((bad + text).encode())
        core.take([Parcel(chunks, None, None, refused)], NOW)
    core.commit()
    assert found(core) == states(y)
    assert core.counters["refused"] == 40
    assert core.counters["future"] == 10


def test_half_a_character_is_refused(tmp_path):
    """JSON may hold it, and neither a database nor a page can."""
    core = opened(tmp_path)
    text = b'{"key": "\\ud800", "value": 1}\n{"key": "a", "\\ud800": 1}\n{"key": "\\ud800", "value": "x"}\n'
    chunks, refused = Lines("json").read(text)
    core.take([Parcel(chunks, None, None, refused)], NOW)
    core.commit()
    assert list(core.series) == ["a"] and core.counters["refused"] == 2
    json.dumps(core.reasons, ensure_ascii=False).encode()


def test_a_store_that_cannot_be_opened_is_left_free(tmp_path):
    (tmp_path / "live.sqlite").write_bytes(b"no store " * 500)
    with pytest.raises(InputError, match="is no store"):
        SqliteStore(tmp_path)
    (tmp_path / "live.sqlite").unlink()
    first = SqliteStore(tmp_path)
    with pytest.raises(InputError, match="another service runs on the store"):
        SqliteStore(tmp_path)
    first.close()
    SqliteStore(tmp_path).close()


@pytest.mark.parametrize("damage", [b"", b"no store " * 500, "half", "flipped"])
def test_a_damaged_store_is_a_sentence(tmp_path, damage):
    SqliteStore(tmp_path).close()
    path = tmp_path / "live.sqlite"
    data = bytearray(path.read_bytes())
    if damage == "flipped":
        data[200:4000] = bytes(byte ^ 255 for byte in data[200:4000])
    path.write_bytes(data[: len(data) // 2] if damage == "half" else data if damage == "flipped" else damage)
    with pytest.raises(InputError, match=r"live\.sqlite cannot be read"):
        counted(tmp_path)


def test_a_sender_whose_clock_is_ahead_loses_nothing_and_it_is_told(tmp_path):
    """As if its clock were right from the first of its stamps on, through a kill, and where it is set right again."""
    y, late = outputs(1, 120)[0], 5 * 3600.0
    core = opened(tmp_path / "ahead")
    said = []
    for t, value in enumerate(y.tolist()):
        if t == 60:
            core.commit()
            core.store.close()
            core = opened(tmp_path / "ahead")
        ahead = 0.0 if t >= 100 else late
        text = json.dumps({"key": "s0", "time": NOW + t + ahead, "value": value})
        said += core.take([Parcel(Lines("json").read(text.encode() + b"\n")[0], None)], NOW + t)
    core.commit()
    assert [event.sentence for event in said if event.kind == "clock"] == [
        "its clock is 5 h ahead of the one here; so much is taken off its stamps"
    ]
    assert core.counters["refused"] == 0 and core.roster.groups[0].tally["late"].sum() == 0
    np.testing.assert_array_equal(np.concatenate([rows[:, 1] for _, rows in core.history.recent]), NOW + np.arange(120))


def test_a_file_that_is_played_faster_than_time_goes_keeps_its_stamps(tmp_path):
    core = opened(tmp_path)
    for t, value in enumerate(outputs(1, 100)[0].tolist()):
        text = json.dumps({"key": "s0", "time": NOW + 60 * t, "value": value})
        assert not core.take([Parcel(Lines("json").read(text.encode() + b"\n")[0], None)], NOW)
    core.commit()
    np.testing.assert_array_equal(
        np.concatenate([rows[:, 1] for _, rows in core.history.recent]), NOW + 60 * np.arange(100)
    )
