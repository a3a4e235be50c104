"""A model that is named sees the rows that `run` sees alone: turned round, of one recording, on the whole clock."""

import json
from datetime import datetime, timedelta

import numpy as np
import pytest

SAMPLES = 400
RNG = np.random.default_rng(3)
U = np.repeat(RNG.integers(0, 5, SAMPLES // 10), 10)
Y = np.zeros(SAMPLES)
for _k in range(1, SAMPLES):
    Y[_k] = 0.9 * Y[_k - 1] + 0.3 * U[_k - 1] + 0.1 * RNG.normal()
HOURS = [datetime(2023, 1, 5) + timedelta(hours=k) for k in range(SAMPLES)]
CELLS = [f"{u},{y:.4f}" for u, y in zip(U, Y)]
SHAPES = {
    "plain": ("stamp", [f"{t}" for t in HOURS]),
    "calendar": ("Year,Month,Day,Hour", [f"{t.year},{t.month},{t.day},{t.hour}" for t in HOURS]),
    "date and time of day": ("Date,Time", [f"{t:%d/%m/%Y},{t:%H:%M}" for t in HOURS]),
    "time of day": ("Time", [f"{t:%H:%M:%S}" for t in HOURS]),
    "minutes": ("Time", [f"{60 * k}:00" for k in range(SAMPLES)]),
    "milliseconds": ("Time [ms]", [str(3_600_000 * k) for k in range(SAMPLES)]),
    "newest first": ("stamp", [f"{t}" for t in HOURS]),
    "two recordings": ("stamp,oven", [f"{t}" for t in HOURS]),
}


def written(folder, shape):
    clock, stamps = SHAPES[shape]
    rows = [f"{stamp},{cells}" for stamp, cells in zip(stamps, CELLS)]
    if shape == "newest first":
        rows = rows[::-1]
    if shape == "two recordings":
        rows = [f"{t},{oven},{u},{f * y:.4f}" for t, u, y in zip(stamps, U, Y) for oven, f in (("A", 1), ("B", -2))]
    (path := folder / "oven.csv").write_text("\n".join([f"{clock},heater,temperature", *rows]) + "\n")
    return str(path)


def found(call, folder, shape, *columns):
    code, out, err = call("run", written(folder, shape), "--model", "arx:1,1,1", *columns, "--json", "-")
    assert code == 0, err
    return json.loads(out)


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if shape != "plain"])
def test_a_named_model_sees_the_same_rows_and_hours_however_they_are_written(call, tmp_path, shape):
    plain, other = (found(call, tmp_path, one) for one in ("plain", shape))
    assert other["summary"] == plain["summary"] and plain["summary"]["samples"] == SAMPLES
    assert "time constant 3.4" in plain["summary"]["words"] and "e+04 s" in plain["summary"]["words"]


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if shape != "two recordings"])
def test_so_does_one_whose_columns_are_named_too(call, tmp_path, shape):
    named = "-o", "temperature", "-i", "heater"
    plain = found(call, tmp_path, "plain")["summary"]
    assert found(call, tmp_path, shape, *named, "-t", SHAPES[shape][0].partition(",")[0])["summary"] == plain
    told = found(call, tmp_path, shape, *named)
    assert told["summary"]["parameters"] == plain["parameters"]  # in samples
    assert (shape == "newest first") == any("turned round" in note for note in told["notes"])


def test_orders_are_compared_on_the_same_rows(call, tmp_path):
    words = []
    for shape in ("plain", "newest first"):
        path = written(tmp_path, shape)
        code, out, err = call("run", path, "-o", "temperature", "-i", "heater", "--order", "auto", "--json", "-")
        assert code == 0, err
        words.append(json.loads(out)["orders"])
    assert words[0] == words[1] is not None
