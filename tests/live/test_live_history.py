"""History: in the store, in Parquet, each sample once; days that are too old go."""

from datetime import date

import numpy as np
import pyarrow.parquet as pq
from live_plant import opened, outputs, parcel

from driftwise.live.history import History
from driftwise.live.view import LiveBoard

DAY = 86_400.0


def blob(first, count, step=1000.0, series=0):
    time = 1e9 + step * np.arange(first, first + count)
    return np.column_stack([np.full(count, series), time, time / 1e9, time, np.ones(count), np.zeros(count)]).tobytes()


def test_what_was_written_is_read_once_in_order(tmp_path):
    history = History(tmp_path)
    for number in range(1, 11):
        history.add(number, blob(20 * number, 20, series=number % 2))
    part = history.part()
    history.write(part, {0: "a", 1: "b"})
    history.write(part, {0: "a", 1: "b"})  # killed in between: the same again
    assert len(history.read(1, "b", None, None)) == 100  # written, and not forgotten yet
    history.written(part)
    history.add(11, blob(220, 20, series=1))
    rows = history.read(1, "b", None, None)
    assert len(rows) == 120
    assert rows[:, 0].tolist() == sorted(set(rows[:, 0]))
    some = history.read(1, "b", rows[5, 0], rows[9, 0])
    assert some.tolist() == rows[5:10].tolist()
    assert len({path.parent.name for path in tmp_path.rglob("part-*.parquet")}) >= 3


def test_old_days_go(tmp_path):
    history = History(tmp_path, days=2)
    history.add(1, blob(0, 10, step=DAY / 2))
    history.write(history.part(), {0: "a"})
    assert history.sweep(date(2001, 9, 12)) == ["2001-09-09"]
    assert (tmp_path / "history" / "2001-09-10").is_dir()


def test_instants_that_are_no_dates(tmp_path):
    history = History(tmp_path)
    history.add(1, np.array([[0.0, 5.0, 1.0, 1.0, 1.0, 0.0]]).tobytes())
    history.write(history.part(), {0: "a"})
    history.written(history.part())
    assert history.read(0, "a", 0.0, 9.0)[:, 0].tolist() == [5.0]


def test_parameters_have_a_past(tmp_path):
    """Every 100 samples, after a jump, and once a minute; through a kill, and in Parquet with their names."""
    y = outputs(2, 400)
    y[0, 250:] += 60.0
    core, now = opened(tmp_path), 2e9
    seen = {}
    for at in range(0, 400, 50):
        core.take([parcel(y, at, at + 50)], now + 0.1 * at)
        if at == 250:
            core.take([], now)
            core.commit()
            core.store.close()
            core = opened(tmp_path)
            history, past = core.history.part(), core.past.part()
            names = [rows.drift.parameters for rows in core.roster.groups]
            core.past.write(past, core.keys(past.numbers), names)
            core.store.forget(past.last, "past")
            core.past.written(past)
            assert len(history.rows) == 600
        fleet = core.roster.groups[0].fleet
        for key in ("s0", "s1"):
            theta, P = fleet.estimator_of(key).parameters_of(fleet.state(key))
            seen[key, 1e9 + at + 49] = theta.tolist(), np.sqrt(np.diag(P)).tolist()
    core.commit()
    board = LiveBoard(core, None)
    for key in ("s0", "s1"):
        rows = board.parameters(key)
        assert [row.name for row in rows[:3]] == core.roster.groups[0].drift.parameters
        found = {}
        for row in rows:
            found.setdefault(row.time, ([], []))[0].append(row.value)
            found[row.time][1].append(row.std)
        times = sorted(found)
        assert {1e9 + t for t in (99, 199, 299, 399)} <= found.keys()
        assert (1e9 + 49 in found) and (1e9 + 149 not in found), "the first, and then once a minute"
        assert all(found[time] == seen[key, time] for time in times if (key, time) in seen)
    jumped = {event.time for event in core.store.events(0, "s0") if event.kind == "jump"}
    assert jumped and min(jumped) <= min(t for t in {row.time for row in board.parameters("s0")} if t >= 1e9 + 250)
    assert [row.time for row in board.parameters("s1", 1e9 + 150, 1e9 + 250)] == [1e9 + 199] * 3
    (file,) = (tmp_path / "parameters").rglob("part-*.parquet")
    table = pq.read_table(file)
    assert table.column_names == ["key", "time", "group", "index", "value", "std", "name"]
    assert set(table["name"].to_pylist()) == set(core.roster.groups[0].drift.parameters)
