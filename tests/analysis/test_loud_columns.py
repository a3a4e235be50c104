"""Changes of columns seen in their noise, or beside what all columns share, and those told where parts are named."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import driftwise as dw
from driftwise.analysis.together import together
from driftwise.analysis.together_evidence import loudness, unstuck
from driftwise.analysis.together_loudness import errors, of_halves
from driftwise.analysis.together_noise import noises


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


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_noise_that_grows_to_twice_in_one_column_is_told(seed):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((4, 1000))
    x[1, 400:700] *= 1.9
    (found,) = together(dict(zip("abcd", x)))
    assert found.names == ("b",)
    assert abs(found.since - 400) <= 40
    assert 1.5 < found.noises["b"] < 2.3


def test_how_loud_a_column_is_is_told_by_its_errors_not_by_what_is_slow_in_it():
    rng = np.random.default_rng(7)
    noise = rng.standard_normal(5000)
    slow = lfilter([1.0], [1.0, -1.6, 0.64], noise)
    assert np.allclose(errors(slow)[5:], noise[6:], atol=0.1)
    drift = np.cumsum(rng.standard_normal(5000)) / 10  # ten times as loud as the noise, in the end
    assert abs(np.std(errors(noise + drift)) - 1) < 0.2


def test_halves_of_blocks_differ_as_blocks_do_where_noise_is_white_and_less_where_it_is_slow():
    found, (constant, *_) = of_halves(64), noises(64)
    assert found.shape == constant.shape
    assert np.isclose(found[0], 64 / 63)
    assert (found[1 : len(found) // 3] < found[0]).all()


def test_chance_in_how_loud_white_noise_is_is_known_from_halves():
    rng = np.random.default_rng(8)
    heard = [loudness(rng.standard_normal(1280), 64) for _ in range(20)]
    ratio = np.mean([one.halves**2 for one in heard]) / np.mean([one.blocks.var() for one in heard])
    assert 0.9 < ratio < 1.3


def test_halves_that_are_short_are_not_heard():
    assert not len(loudness(np.random.default_rng(9).standard_normal(300), 64).halves)


@pytest.mark.parametrize("seed", range(4))
def test_where_a_sensor_is_stuck_nothing_is_louder_or_quieter(seed):
    """One block at its edge, loud by chance, does not stand for all that are not heard."""
    x = np.random.default_rng(seed).standard_normal((4, 670))
    x[0, 390:510] = np.nan
    x[0, 387:390] *= 0.1
    heard = loudness(x[0], 64)
    assert abs(heard.blocks[38:48] - np.median(heard.blocks)).max() < 0.5
    assert not together(dict(zip("abcd", x)))
