"""Series beyond those that memory has room for are on the disk alone, and come back with their bits."""

import json
from dataclasses import replace

import numpy as np
import pytest
from draws import slow
from live_plant import estimator, lines, outputs, states

from driftwise.live import core as cores
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.decode import Chunk
from driftwise.live.sources.base import Parcel
from driftwise.live.sources.lines import Lines
from driftwise.live.store.base import StoreFull
from driftwise.live.store.sqlite import SqliteStore, counted

NOW = 2e9


def opened(folder, most=5, model='model = "ar:2"'):
    """Return the core of a store that has room for few series."""
    config = parse(f'[model]\n{model}\n[store]\npath = "{folder}"\nmost = {most}\n')
    return Core(config, SqliteStore(folder), estimator)


def told(core, y, series, first, last, now=NOW):
    """Let one series say its samples between two instants."""
    found = lines(y[series : series + 1], first, last).replace('"s0"', f'"s{series}"')
    return core.take([Parcel(Lines("json").read(found.encode())[0])], now)


def all_states(core, series):
    """Return the states of all series, whose memory has room for one after the other."""
    found = {}
    for i in range(series):
        one = core.find(f"s{i}")
        found[one.key] = core.roster.groups[one.group].fleet.state(one.key).tobytes()
        core.commit()
    return found


@pytest.mark.parametrize("stretch", [slow(1), 7, 40])
def test_series_come_back_with_their_bits(tmp_path, stretch):
    """Also while their first samples are held back (stretches of 1 and 7), and wherever it is killed."""
    rng, y = np.random.default_rng(stretch), outputs(17, 40 * (5 if stretch == 40 else 2))
    core, at = opened(tmp_path), np.zeros(17, int)
    kept, kills, woken = at.copy(), 0, 0
    while (at < y.shape[1]).any():
        some = int(rng.choice(np.flatnonzero(at < y.shape[1])))
        last = min(at[some] + stretch, y.shape[1])
        told(core, y, some, at[some], last, NOW + at.sum())
        at[some] = last
        if rng.random() < 0.5:
            core.commit()
            kept = at.copy()
            assert len(core.series) <= 5 and len(core.series) + core.resting == core.last_series + 1
        if rng.random() < 0.05:
            core.store.close()
            woken += core.counters["woken"]
            core, at, kills = opened(tmp_path), kept.copy(), kills + 1
    core.commit()
    assert kills > 1 and woken > 5 and core.resting == 12
    assert all_states(core, 17) == states(y)
    assert len(core.roster.by_slot) < 17  # slots are used again
    assert sum(len(rows) for _, rows in core.history.recent) == y.size
    part = core.history.part()
    assert core.keys(part.numbers) == {i: core.store.keys([i])[i] for i in range(17)}
    core.commit()  # that the last has gone to rest is kept with the next commit
    core.store.close()
    assert counted(tmp_path)[1] == "12 of them at rest"


def test_the_oldest_at_rest_go_first(tmp_path):
    y, core = outputs(8, 40), opened(tmp_path, most=6)
    for i in [0, 1, 2, 3, 4, 5, 0, 1]:
        told(core, y, i, 0, 40, NOW + i + 10 * (i < 2))
    core.commit()
    for i in (6, 7):
        told(core, y, i, 0, 40, NOW + 20)
    core.commit()
    assert list(core.series) == ["s0", "s1", "s4", "s5", "s6", "s7"]


def test_keys_by_the_million_are_bounded(tmp_path, monkeypatch):
    """What is in memory does not grow with the keys that ever came (of which here are six thousand)."""
    monkeypatch.setattr(cores, "SPARE", 1000)
    core = opened(tmp_path, most=500)
    for first in range(0, 6000, 1000):
        chunks = [Chunk(f"k{i}", [1e9], {"value": [1.0]}) for i in range(first, first + 1000)]
        core.take([Parcel(chunks)], NOW + first)
        core.commit()
        assert len(core.series) <= 500 and len(core.roster.by_slot) <= 1500 and len(core.roster.groups[0].fleet) <= 500
    core.commit()
    assert len(core.series) + core.resting == 6000 and core.counters["keys_refused"] == 0
    core.store.close()
    again = opened(tmp_path, most=500)
    assert len(again.series) <= 500 and again.resting == core.resting
    again.take([Parcel([Chunk("k7", [1e9, 1e9 + 1], {"value": [1.0, 2.0]})])], NOW)
    rows = again.roster.groups[again.series["k7"].group]
    assert rows.tally["duplicate"][again.series["k7"].code] == 1  # it knows what it had


def test_while_nothing_can_be_kept_keys_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(cores, "SPARE", 3)
    core = opened(tmp_path)
    core.take([Parcel([Chunk(f"k{i}", [1e9], {"value": [1.0]}) for i in range(10)])], NOW)
    assert len(core.series) == 8 and core.counters["keys_refused"] == 2


def test_a_store_that_cannot_be_asked_is_asked_again(tmp_path, monkeypatch):
    y, core = outputs(8, 60), opened(tmp_path)
    for i in range(8):
        told(core, y, i, 0, 40, NOW + i)
    core.commit()
    asleep, known = core.store.asleep, core.series.copy()

    def gone(key):
        raise StoreFull("the server is gone")

    monkeypatch.setattr(core.store, "asleep", gone)
    told(core, y, 0, 40, 50)
    told(core, y, 7, 40, 60)
    assert "s0" not in known and "s7" in known and core.is_dirty
    with pytest.raises(StoreFull):
        core.commit()
    monkeypatch.setattr(core.store, "asleep", asleep)
    core.take([], NOW)
    core.commit()
    core.commit()
    told(core, y, 0, 50, 60)
    for i in range(1, 7):
        told(core, y, i, 40, 60)
    core.commit()
    assert all_states(core, 8) == states(y)


def test_what_waits_to_be_joined_rests_too(tmp_path):
    core = opened(tmp_path, 1, 'model = "arx:1,1"\ninputs = ["u"]\ntolerance = 1.0')
    core.models.estimator_of = lambda config: __import__("driftwise").ARX(1, 1)

    def say(key, **values):
        text = json.dumps({"key": key, **values}).encode()
        core.take([Parcel(Lines("json").read(text)[0])], NOW + values["time"])
        core.commit()

    say("a", time=1.0, value=5.0)
    say("b", time=1.0, value=6.0)
    say("c", time=1.0, value=7.0)
    assert core.resting == 2
    say("a", time=1.5, u=2.0)
    assert core.series["a"].waiting.rows == [[1.0, 5.0]]
    say("a", time=3.0, u=3.0)
    group = core.roster.groups[core.series["a"].group]
    held = group.intake.held(np.array([core.series["a"].code]))
    assert held.ys.tolist() == [[5.0]] and held.us.tolist() == [[2.0]]


def test_a_silence_that_is_watched_is_told_before_it_rests(tmp_path):
    y, core = outputs(3, 80), opened(tmp_path, 1)
    core.config = replace(core.config, model=replace(core.config.model, silence=10.0))
    for i in range(2):
        told(core, y, i, 0, 40, NOW + i)
    core.commit()
    assert len(core.series) == 2
    assert [event.key for event in core.silent(NOW + 20)] == ["s0", "s1"]
    core.commit()
    assert core.resting == 1
    (sleeper,) = {"s0", "s1"} - core.series.keys()
    events = told(core, y, int(sleeper[1]), 40, 50, NOW + 21)
    assert [(event.key, event.kind) for event in events] == [(sleeper, "back")]
