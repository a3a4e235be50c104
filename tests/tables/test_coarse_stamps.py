"""Stamps that show too few digits: rows that share one are samples at their pace, whatever the chunks."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from driftwise.tables.autoread import read
from driftwise.tables.coarse_stamps import Coarse, coarse
from driftwise.tables.sampling import Regular, judge_sampling

START = datetime(2024, 3, 1, 8, 0, 37)


def plant(T=600, seed=3):
    rng = np.random.default_rng(seed)
    u, y = np.repeat(rng.normal(size=T // 10), 10), np.zeros(T)
    for t in range(1, T):
        y[t] = 0.8 * y[t - 1] + u[t - 1] + 0.1 * rng.normal()
    return u, y


def written(path, stamps, u, y, times=1):
    rows = [f"{stamp},{a:.4f},{b:.4f}" for stamp, a, b in zip(stamps, u, y) for _ in range(times)]
    path.write_text("\n".join(["time,valve,level", *rows]))
    return path


@pytest.mark.parametrize(
    "step, form, dt",
    [
        (15.0, "%Y-%m-%d %H:%M", 15.0), (0.1, "%Y-%m-%d %H:%M:%S", 0.1), (7.0, "%Y-%m-%d %H:%M", 7.0),
        (55.0, "%d.%m.%Y %H:%M", 55.0), (10.0, "%H:%M", 10.0), (3600.0, "%Y-%m-%d", 3600.0),
    ],
    ids=["minutes", "seconds", "no divisor", "few", "times of day", "dates"],
)  # fmt: skip
def test_rows_that_share_stamps_keep_their_pace(tmp_path, step, form, dt):
    u, y = plant()
    stamps = [(START + timedelta(seconds=step * k)).strftime(form) for k in range(len(y))]
    table, segments = read(written(tmp_path / "t.csv", stamps, u, y))
    assert (table.sampling.kind, table.dt) == ("regular", pytest.approx(dt, rel=2e-3))
    assert sum("Rows share stamps of 'time'" in note for note in table.notes) == 1
    rows = np.concatenate([segments.rows for _ in segments])
    assert np.count_nonzero(rows < 0) == 0 and np.count_nonzero(rows >= 0) == len(y)


def test_lost_rows_are_put_in_again(tmp_path):
    u, y = plant()
    kept = [k for k in range(600) if k % 97 not in (3, 4)]
    stamps = [(START + timedelta(seconds=10 * k)).strftime("%Y-%m-%d %H:%M") for k in kept]
    table, segments = read(written(tmp_path / "t.csv", stamps, u[kept], y[kept]))
    rows = np.concatenate([segments.rows for _ in segments])
    assert table.dt == 10.0 and abs(np.count_nonzero(rows < 0) - (600 - len(kept))) <= 4


def test_rows_that_are_there_twice_count_once(tmp_path):
    u, y = plant()
    stamps = [(START + timedelta(minutes=k)).strftime("%Y-%m-%d %H:%M") for k in range(600)]
    table, segments = read(written(tmp_path / "t.csv", stamps, u, y, times=2))
    assert table.sampling.shared is None and (table.dt, table.sampling.duplicates) == (60.0, 600)
    assert sum(len(y) for _, y, _ in segments) == 600


def test_things_that_share_stamps_are_no_samples_of_one(tmp_path):
    u, y = plant()
    rows = np.column_stack((y, y + 40.0)).ravel()  # two sensors in turns
    stamps = [(START + timedelta(minutes=k // 2)).strftime("%Y-%m-%d %H:%M") for k in range(1200)]
    table, _ = read(written(tmp_path / "t.csv", stamps, np.repeat(u, 2), rows))
    assert table.sampling.shared is None and table.dt == 60.0


def test_few_repetitions_are_no_coarse_clock():
    stamps = 60.0 * np.arange(300)
    stamps[[20, 90]] = stamps[[19, 89]]
    assert coarse(stamps, 60.0) is None and judge_sampling(stamps).duplicates == 2


@pytest.mark.parametrize("rows", [1, 7, 1000])
@pytest.mark.parametrize("is_even", [True, False])
def test_what_comes_out_does_not_depend_on_the_chunks(is_even, rows):
    rng = np.random.default_rng(1)
    time = 15.0 * np.cumsum(np.ones(400) if is_even else rng.geometric(0.25, 400))
    stamps, values = 60.0 * (time // 60.0), np.column_stack((time, -time))
    sampling = judge_sampling(stamps, values, values)
    assert sampling.shared is not None and sampling.kind == ("regular" if is_even else "irregular")
    whole, parts = ([], []), ([], [])
    for size, found in ((400, whole), (rows, parts)):
        clock = Regular(sampling, [False, True])
        for k in range(0, 400, size):
            found[0].append(clock.push(stamps[k : k + size], values[k : k + size]))
        found[0].append(clock.flush())
    for a, b in zip(zip(*whole[0]), zip(*parts[0])):
        np.testing.assert_array_equal(np.concatenate(a), np.concatenate(b))
    came = sampling.shared.spread(stamps)
    assert np.all(np.diff(came) > 0) and np.all((came >= stamps) & (came < stamps + 60.0))
    assert np.std(came - time) < (0.1 if is_even else 0.95) * np.std(stamps - time)


def test_late_rows_keep_their_stamps():
    assert Coarse(60.0, 20.0).spread([0.0, 0, 60, 0, 60, 60, 60]).tolist() == [0.0, 20, 60, 0, 80, 100, 110]
