"""What a stuck sensor reads is missing; what rests for good reasons is not."""

import numpy as np
import pytest
from plants_of_tables import NaN, noisy

from driftwise.tables.autoread import read
from driftwise.tables.recognise import recognise
from driftwise.tables.stuck_sensor import still


@pytest.mark.parametrize("first, last, where", [(1301, 1500, "from row 1301 on"), (701, 730, "from row 701 to 730")])
def test_what_a_stuck_sensor_reads_is_missing_and_the_rest_is_not(first, last, where):
    u, y, _ = noisy()
    y[first - 1 : last] = y[first - 1]
    table = recognise({"valve": u, "level": y})
    assert (table.output, table.inputs) == ("level", ("valve",))
    assert table.notes[0] == f"'level' reads {y[first - 1]:.6g} {where}: stuck, and taken as missing there."
    for rows in (7, 100, 2000):
        segments = read({"valve": u, "level": y}, chunk_rows=rows)[1]
        lost = np.flatnonzero(np.isnan(np.concatenate([part[1] for part in segments])))
        assert lost.tolist() == list(range(first - 1, last))


@pytest.mark.parametrize("rows", [7, 100, 2000])
def test_a_stuck_sensor_is_one_beside_missing_cells_and_coarse_steps(rows):
    """Cells that are missing meanwhile are no readings; steps repeat themselves, but not for as long."""
    u, y, rng = noisy()
    coarse = np.round(y + 0.15 * rng.standard_normal(1500), 1)
    with_gaps = np.where(rng.random(1500) < 0.2, NaN, y)
    for level in (with_gaps, coarse):
        level[700:800] = np.where(np.isnan(level[700:800]), NaN, level[np.flatnonzero(np.isfinite(level))[500]])
        table = recognise({"valve": u, "level": level})
        assert table["level"].stuck and "stuck, and taken as missing there" in " ".join(table.notes)
        segments = read({"valve": u, "level": level}, chunk_rows=rows)[1]
        lost = np.isnan(np.concatenate([part[1] for part in segments]))
        assert lost[700:800].all() and np.array_equal(lost[:700], np.isnan(level[:700]))


def test_what_rests_for_good_reasons_is_not_stuck():
    u, y, rng = noisy()
    k = np.arange(1500)
    at = slice(400, 460)
    rests = {
        "coarse": np.round(y, 1), "switch": np.repeat(rng.choice([0.0, 1.0], 50), 30),
        "ramp": np.clip(np.abs((k % 500) - 250), 100, 200) + 1e-3 * k, "shut": np.maximum(y - np.quantile(y, 0.1), 0.0),
    }  # fmt: skip
    rests["shut"][at] = 0.0
    rests["again"] = y.copy()
    rests["again"][at] = rests["again"][900:960] = 20.0
    for name, values in rests.items():
        assert not recognise({"valve": u, name: values}, output=name)[name].stuck, name
    y[at] = y[400]
    u[at] = 0.0
    assert not recognise({"valve": u, "level": y})["level"].stuck  # nothing moved meanwhile


def test_readings_that_repeat_themselves_say_nothing_where_noise_stops_or_they_end_by_a_leap():
    white = np.random.default_rng(4).standard_normal(1500)
    white[1400:1440] = white[np.argmin(abs(white))]
    assert [one[:2] for one in still(white)] == [(1400, 1440)]
    turned = np.sin(np.arange(1500) / 20)  # without noise
    held = turned.copy()
    held[460:560] = held[460]
    assert [one[:2] for one in still(held)] == [(460, 560)]
    for start in (474, 477, 480):  # what it moved by before the leap is no part of that
        held = turned.copy()
        held[start : start + 100] = held[start]
        assert [one[:2] for one in still(held)] == [(start, start + 100)]
    rests = np.concatenate([turned[:461], np.full(100, turned[460]), turned[461:]])
    assert still(rests) == [] and still(held[:550]) == [] and still(turned) == []


@pytest.mark.parametrize("start", [474, 477, 480])
def test_a_smooth_sensor_that_leaves_by_a_leap_is_told_to_be_stuck(start):
    u, y = np.repeat(np.random.default_rng(3).normal(size=60), 25), np.sin(np.arange(1500) / 20)
    assert not recognise({"valve": u, "level": y}, output="level")["level"].stuck
    y[start : start + 100] = y[start]
    assert [one[:2] for one in recognise({"valve": u, "level": y}, output="level")["level"].stuck] == [
        (start, start + 100)
    ]
    u[start : start + 100] = u[start]
    assert not recognise({"valve": u, "level": y}, output="level")["level"].stuck  # nothing moved meanwhile
