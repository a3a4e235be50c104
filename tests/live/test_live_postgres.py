"""PostgreSQL as the store: the bits of a fleet, whatever is killed, the server too."""

import json
import random
import time
from dataclasses import replace

import numpy as np
import pytest
from broker import Broker
from database import Database
from live_plant import configuration, estimator, found, lines, outputs, parcel, states
from live_process import ended, started

from driftwise.engine.errors import InputError
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.sources.base import Parcel
from driftwise.live.sources.lines import Lines
from driftwise.live.store.base import StoreFull

pytestmark = pytest.mark.service
SAMPLES, SERIES, KILLS, RESTARTS = 400, 12, 10, 3


@pytest.fixture(scope="module")
def server():
    database = Database()
    yield database
    database.stop()


@pytest.fixture
def database(server):
    yield server
    server.ask("DROP SCHEMA IF EXISTS driftwise CASCADE")


def opened(database, folder, model='model = "ar:2"'):
    from driftwise.live.store.postgres import PostgresStore

    config = parse(f'[model]\n{model}\n[store]\npath = "{folder}"\n')
    return Core(config, PostgresStore(database.url, is_safe=True), estimator)


def test_a_file_is_followed_through_kills_of_service_and_server(tmp_path, database):
    y, drawn = outputs(SERIES, SAMPLES), random.Random(5)
    data = tmp_path / "samples.jsonl"
    data.touch()
    config = configuration(
        tmp_path, f'[[source]]\nkind = "file"\npath = "{data}"\n', f'url = "{database.url}"\nfsync = 0'
    )
    process, step = started(config), SAMPLES // KILLS
    for kill in range(KILLS):
        text = lines(y, kill * step, (kill + 1) * step)
        cut = drawn.randrange(len(text))
        for part in (text[:cut], text[cut:]):
            with data.open("a") as file:
                file.write(part)
            time.sleep(drawn.uniform(0.0, 0.6))
        if kill in (2, 5, 8)[:RESTARTS]:
            database.restart()  # the service goes on by itself
        else:
            process.kill()
            process.wait()
            process = started(config)

    end = {"offset": data.stat().st_size}
    Broker.wait(lambda: any(end.items() <= json.loads(row[0]).items() for row in _places(database)))
    assert ended(process) == 0
    core = opened(database, tmp_path / "store")
    assert found(core) == states(y)
    assert sum(len(rows) for _, rows in core.history.recent) == SERIES * SAMPLES
    core.store.close()


def _places(database):
    rows = database.ask("SELECT json FROM driftwise.places") or []
    return [row for row in rows if row[0].startswith("{")]


@pytest.mark.parametrize("model", ['model = "ar:2"', 'model = "auto"\nidentify = 5000'])
def test_a_commit_whose_answer_is_lost_counts_once(tmp_path, database, model):
    y = outputs(3, 120)
    core = opened(database, tmp_path, model)
    core.take([parcel(y, 0, 60)], 2e9)
    core.commit()
    core.take([parcel(y, 60, 90)], 2e9)
    numbers = core.store._numbers

    def lost():
        core.store.base.close()
        raise StoreFull("the server has it, and we have no answer")

    core.store._numbers = lost
    with pytest.raises(StoreFull):
        core.commit()
    core.store._numbers = numbers
    core.take([parcel(y, 90, 120)], 2e9)
    core.commit()
    core.store.close()
    again = opened(database, tmp_path, model)
    assert sum(len(rows) for _, rows in again.history.recent) == (360 if again.roster.groups else 0)
    assert again.roster.groups or [len(one.samples) for one in again.roster.by_slot] == [120] * 3
    if again.roster.groups:
        assert found(again) == states(y)
    again.store.close()


def test_one_service_at_a_time(tmp_path, database, monkeypatch):
    from driftwise.live.store import postgres

    monkeypatch.setattr(postgres, "PATIENCE", 0.3)
    core = opened(database, tmp_path)
    with pytest.raises(InputError, match="another service"):
        opened(database, tmp_path)
    core.take([parcel(outputs(2, 50), 0, 50)], 2e9)
    core.commit()
    core.store.base.close()  # the connection breaks, and another service takes over
    other = opened(database, tmp_path)
    other.store.close()
    core.take([parcel(outputs(2, 60), 50, 60)], 2e9)
    with pytest.raises(StoreFull, match="meanwhile"):
        core.commit()
    assert postgres.counted(database.url)[0] == "2 series"


def test_what_is_kept_is_what_sqlite_keeps(tmp_path, database):
    from live_plant import opened as embedded

    y = outputs(4, 300)
    y[0, 200:] += 30.0
    cores = [opened(database, tmp_path / "a"), embedded(tmp_path / "b")]
    for core in cores:
        core.take([parcel(y, 0, 300)], 2e9)
        core.place("file", {"offset": 7})
        core.commit()
        core.store.acknowledge(1)
    one, two = (core.store.load() for core in cores)
    assert one == two and one.open_events
    assert cores[0].store.events(0, "s0") == cores[1].store.events(0, "s0")
    recent = [np.concatenate([np.frombuffer(blob) for _, blob in core.store.recent()]) for core in cores]
    assert np.array_equal(*recent, equal_nan=True)
    with pytest.raises(KeyError):
        cores[0].store.acknowledge(10**6)
    for core in cores:
        core.store.close()


def test_series_at_rest_come_back_with_their_bits(tmp_path, database):
    """Also where the server is killed while it is asked about them."""
    y, core = outputs(8, 80), opened(database, tmp_path)
    core.config = replace(core.config, store=replace(core.config.store, most=3))
    for at in (0, 40):
        for i in range(8):
            if (at, i) == (40, 4):
                database.restart()
            said = lines(y[i : i + 1], at, at + 40).replace('"s0"', f'"s{i}"')
            core.take([Parcel(Lines("json").read(said.encode())[0])], 2e9 + at + i)
            Broker.wait(lambda: committed(core))
    assert len(core.series) == 3 and core.resting == 5 and core.counters["woken"] == 8
    kept = {}
    for i in range(8):
        series = core.find(f"s{i}")
        kept[series.key] = core.roster.groups[series.group].fleet.state(series.key).tobytes()
        core.commit()
    assert kept == states(y)
    core.store.close()


def committed(core):
    """Try as a service does; say whether it came to pass."""
    try:
        core.take([], 2e9)
        core.commit()
    except StoreFull:
        return False
    return True
