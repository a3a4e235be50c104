"""History: in the store, in Parquet, each sample once; days that are too old go."""

from datetime import date

import numpy as np

from driftwise.live.history import History

DAY = 86_400.0


def blob(first, count, step=1000.0, series=0):
    time = 1e9 + step * np.arange(first, first + count)
    return np.column_stack([np.full(count, series), time, time / 1e9, time, np.ones(count), np.zeros(count)]).tobytes()


def test_what_was_written_is_read_once_in_order(tmp_path):
    history = History(tmp_path)
    for number in range(1, 11):
        history.add(number, blob(20 * number, 20, series=number % 2))
    part = history.part()
    history.write(part, ["a", "b"])
    history.write(part, ["a", "b"])  # killed in between: the same again
    assert len(history.read(1, "b", None, None)) == 100  # written, and not forgotten yet
    history.written(part)
    history.add(11, blob(220, 20, series=1))
    rows = history.read(1, "b", None, None)
    assert len(rows) == 120
    assert [row.time for row in rows] == sorted({row.time for row in rows})
    some = history.read(1, "b", rows[5].time, rows[9].time)
    assert [row.time for row in some] == [row.time for row in rows[5:10]]
    assert len({path.parent.name for path in tmp_path.rglob("part-*.parquet")}) >= 3


def test_old_days_go(tmp_path):
    history = History(tmp_path, days=2)
    history.add(1, blob(0, 10, step=DAY / 2))
    history.write(history.part(), ["a"])
    assert history.sweep(date(2001, 9, 12)) == ["2001-09-09"]
    assert (tmp_path / "history" / "2001-09-10").is_dir()


def test_instants_that_are_no_dates(tmp_path):
    history = History(tmp_path)
    history.add(1, np.array([[0.0, 5.0, 1.0, 1.0, 1.0, 0.0]]).tobytes())
    history.write(history.part(), ["a"])
    history.written(history.part())
    assert [row.time for row in history.read(0, "a", 0.0, 9.0)] == [5.0]
