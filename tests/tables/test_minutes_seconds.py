"""Clocks of minutes and seconds, which look like hours and minutes."""

import numpy as np
import pytest

from driftwise.tables.autoread import read
from driftwise.tables.record import open_record


def clock_of(folder, name, cells):
    rng = np.random.default_rng(3)
    u = rng.normal(size=len(cells))
    y = np.convolve(u, 0.8 ** np.arange(20))[: len(cells)]
    rows = [f"{cell},{a:.4f},{b:.4f}" for cell, a, b in zip(cells, u, y)]
    (path := folder / "a.csv").write_text("\n".join([f"{name},valve,level", *rows]) + "\n")
    table, segments = read(path)
    return table.time, table.dt, sum(len(piece[0]) for piece in segments)


ROWS = range(4000)
WRITTEN = {
    "a unit": ("Time [mm:ss]", [f"{k // 60 % 20:02d}:{k % 60:02d}" for k in range(1000)]),
    "a remark": ("Zeit (min:s)", [f"{k // 60:02d}:{k % 60:02d}" for k in range(1000)]),
    "more than a day has hours": ("Time", [f"{k // 60:02d}:{k % 60:02d}" for k in ROWS]),
    "a spreadsheet's, which begins anew each hour": ("Time", [f"{k // 60 % 60:02d}:{k % 60:02d}.0" for k in ROWS]),
}


@pytest.mark.parametrize("how", WRITTEN)
def test_minutes_and_seconds_are_no_hours(tmp_path, how):
    name, cells = WRITTEN[how]
    assert clock_of(tmp_path, name, cells) == (name, 1.0, len(cells))


def test_hours_and_minutes_stay_what_they_are(tmp_path):
    cells = [f"{k // 60 % 24:02d}:{k % 60:02d}" for k in ROWS]
    assert clock_of(tmp_path, "Time", cells) == ("Time", 60.0, len(cells))
    cells = [f"{k // 3600}:{k // 60 % 60:02d}:{k % 60:02d}" for k in range(358_000, 362_000)]  # beyond 99 hours
    assert clock_of(tmp_path, "elapsed", cells) == ("elapsed", 1.0, len(cells))


def test_a_time_with_its_letter_is_a_clock(tmp_path):
    assert clock_of(tmp_path, "Time t [s]", [f"{0.5 * k:g}" for k in range(500)]) == ("Time t [s]", 0.5, 500)


@pytest.mark.parametrize("head, cell", [("t", "{:02d}:{:02d}.0"), ("t [mm:ss]", "{:02d}:{:02d}")])
def test_a_record_read_as_it_stands_counts_minutes_and_seconds_on_over_the_hour(head, cell, tmp_path):
    times = np.arange(0, 9000, 30)
    rows = [f"{cell.format(s // 60 % 60, s % 60)},{np.sin(s)}" for s in times]
    (path := tmp_path / "pump.csv").write_text("\n".join([f"{head},y", *rows]) + "\n")
    record = open_record(str(path), "y", (), head, chunk_rows=50)
    assert np.concatenate([chunk.columns[head] for chunk in record]).tolist() == times.tolist()
