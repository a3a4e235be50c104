"""Changes of columns that grow and stop at once, how far each of several moves, and lines among the noises."""

from __future__ import annotations

import numpy as np

from driftwise.analysis.together import together
from driftwise.analysis.together_noise import RAMPS, covariances, edges, shapes_of


def test_what_grows_and_stops_at_once_is_told_where_it_begins_and_where_it_stops():
    rng, t = np.random.default_rng(5), np.arange(1000)
    grows = np.where((t >= 400) & (t < 700), (t - 400) / 300, 0.0)
    columns = {name: rng.standard_normal(1000) + 5 * grows * (name in "ac") for name in "abcde"}
    (found,) = together(columns)
    assert abs(found.since - 400) <= 40
    assert found.until is not None and abs(found.until - 700) <= 20
    assert sorted(found.moves) == ["a", "c"]
    assert all(3.5 < by < 6.5 for by in found.moves.values())


def test_a_shape_that_grows_is_a_line_from_nothing_to_one():
    shapes = shapes_of(64)
    k = int(np.flatnonzero((shapes.ramp == len(RAMPS)) & (shapes.dates[shapes.begin] == 20))[10])
    first, last = shapes.dates[shapes.begin[k]], shapes.dates[shapes.end[k]]
    found = shapes.shape(k, 64)
    assert shapes.lasts(k, 64) == 0
    assert not found[:first].any() and abs(found[last + 1 :]).max() < 1e-6
    assert np.allclose(np.diff(found[first:last]), 1 / (last - first))
    assert np.allclose(shapes.of_steps(edges(64, shapes.dates).T, [k])[0], found)


def test_noises_are_as_likely_as_one_together_and_shapes_are():
    assert abs(sum(chance for _, chance in covariances(64)) - 1) < 1e-12
    assert abs(np.exp(shapes_of(64).chance).sum() - 1) < 1e-12


def test_columns_that_move_together_are_told_by_how_far_each_moves():
    """Not by what each does beside the other, which is half of it."""
    rng, there = np.random.default_rng(5), (np.arange(1000) >= 400) & (np.arange(1000) < 700)
    columns = {name: rng.standard_normal(1000) + 5 * there * (name in "ac") for name in "abcde"}
    (found,) = together(columns)
    assert sorted(found.moves) == ["a", "c"]
    assert all(4.5 < by < 5.5 for by in found.moves.values())


def test_a_line_is_one_of_the_noises():
    line = np.arange(64) / 64
    assert any(_is_line(K, line) for K, _ in covariances(64))


def _is_line(K, line) -> bool:
    """Whether a covariance is that of white noise and a line about its middle."""
    about = line - line.mean()
    return np.trace(K) > 65 and np.allclose((K - np.eye(64)) @ about, about * np.trace(K - np.eye(64)), rtol=1e-6)
