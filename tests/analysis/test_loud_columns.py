"""Changes of columns seen in their noise, or beside what all columns share, and those told where parts are named."""

from __future__ import annotations

import numpy as np

import driftwise as dw
from driftwise.analysis.together import together
from driftwise.analysis.together_evidence import loudness, unstuck


def test_noise_that_grows_in_two_columns_is_told_by_its_factor():
    rng, moved = np.random.default_rng(1), (np.arange(900) >= 400) & (np.arange(900) < 700)
    columns = {name: rng.standard_normal(900) * np.where(moved & (name in "bd"), 3.0, 1.0) for name in "abcde"}
    (found,) = together(columns)
    assert abs(found.since - 400) < 30
    assert not found.moves
    assert sorted(found.noises) == ["b", "d"]
    assert all(2.2 < by < 3.8 for by in found.noises.values())


def test_a_change_that_what_all_share_hides_is_told():
    rng, moved = np.random.default_rng(2), np.arange(800) >= 450
    shared = np.cumsum(rng.standard_normal(800)) / 3
    columns = {name: by * shared + rng.standard_normal(800) for name, by in zip("abcdef", (1, 2, -1, 1.5, 2, 1))}
    assert not together(columns)
    columns["b"] = columns["b"] + 4 * moved
    (found,) = together(columns)
    assert abs(found.since - 450) < 30
    assert max(found.moves, key=lambda name: abs(found.moves[name])) == "b"
    assert found.moves["b"] > 0


def test_a_sensor_that_is_stuck_is_not_quiet():
    rng = np.random.default_rng(3)
    x = rng.standard_normal(800)
    x[300:360] = x[300]
    assert np.isnan(unstuck(x)[300:360]).all()
    assert not together({name: x if name == "a" else rng.standard_normal(800) for name in "abcd"})


def test_of_a_sensor_of_few_levels_no_noise_is_heard():
    x = np.round(np.sin(np.arange(800) / 50) + 0.1 * np.random.default_rng(4).standard_normal(800))
    assert loudness(x, 64) is None


def test_a_change_of_another_column_is_told_where_the_output_is_named():
    rng, moved = np.random.default_rng(5), (np.arange(700) >= 350) & (np.arange(700) < 550)
    columns = {name: rng.standard_normal(700) for name in ("Flow", "Pressure", "Current", "Vibration")}
    columns["Pressure"] += 4 * moved
    found = dw.identify(columns, output="Flow")
    (one,) = found.together
    assert list(one.moves) == ["Pressure"]
    assert "'Pressure' rose by" in found.words
    assert not dw.identify(columns, output="Pressure", input=()).together


def test_a_column_that_is_computed_from_others_is_no_trouble():
    a, b = np.random.default_rng(6).standard_normal((2, 400))
    line, turns = np.arange(400) / 400, np.tile([1.0, -1.0], 200)
    assert not together({"a": a, "b": b, "sum": a + b, "tenfold": 10 * a, "line": line, "turns": turns})
