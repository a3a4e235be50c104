"""Tables that are drawn hold what they are said to hold, in every way of writing time, and are recognised."""

from __future__ import annotations

import numpy as np
import pytest
from draws import draws
from driftwise_studies.score.claims.columns import drawn, judged
from driftwise_studies.score.claims.table_stamps import WAYS, fitting
from driftwise_studies.score.claims.tables import KINDS, write_table

from driftwise.tables.autoread import read

OF_OTHERS = {"since 1970, ms", "days of Excel"}  # numbers that are dates


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_what_was_drawn(kind, tmp_path):
    rng = np.random.default_rng(7)
    y, u = drawn(rng)
    truth = write_table(tmp_path / "t.csv", y, u, rng, kind=kind, beside=0)
    _, segments = read(truth.path, truth.outputs[0], list(truth.inputs))
    parts = list(segments)
    values = np.concatenate([np.column_stack(part[1:]) for part in parts])
    rows = np.isfinite(values).all(axis=1)
    for j, name in enumerate((truth.outputs[0], *truth.inputs)):
        a, b = truth.affine[name]
        signal = np.column_stack((y, u))[:, j]
        size = 1e-3 * abs(b) * signal.std()
        if len(values) == len(signal):
            np.testing.assert_allclose(values[rows, j], (a + b * signal)[rows], atol=size)
    assert len(truth.inputs) == u.shape[1] and rows.mean() > 0.9


@pytest.mark.parametrize("way", sorted(set(WAYS) - OF_OTHERS))
def test_clocks_of_every_way(way, tmp_path):
    rng = np.random.default_rng(1)
    y, u = drawn(rng)
    y, u = y[:290], u[:290]
    truth = write_table(tmp_path / "t.csv", y, u, rng, kind="plain", way=way, beside=0)
    assert judged(truth)["clock"], way


def test_a_step_that_is_asked_for_is_written():
    assert "iso days" not in fitting(0.1) and "iso T Z" in fitting(0.1) and "months" not in fitting(3600.0)


@draws("tables", 20, 60)
def test_recognition_of_knowable_tables(tables, tmp_path):
    """95 in a hundred, by the names and units of the vocabulary; what names do not say is seldom taken for certain."""
    right = {True: [], False: []}
    for i in range(tables):
        rng = np.random.default_rng((77, i))
        y, u = drawn(rng)
        truth = write_table(tmp_path / f"{i}.csv", y, u, rng)
        found = judged(truth)
        right[truth.knows_output].append(found.get("asked", False) or (found.get("output") and found.get("inputs")))
    assert np.mean(right[True]) >= 0.95 and np.mean(right[False]) >= 0.7


def test_of_copies_without_names_either_is_the_output(tmp_path):
    rng = np.random.default_rng(3)
    truth = write_table(tmp_path / "t.csv", *drawn(rng), rng, kind="numbers only", beside=9)
    copy = next(name for name, what in truth.beside.items() if what == "other unit")
    read = truth.read_with(copy)
    a, b = truth.affine[truth.outputs[0]]
    assert read.outputs == (copy,) and read.affine[copy] == (1000 * a, 1000 * b)
    assert read.beside[truth.outputs[0]] == "copy" and copy not in read.beside
    assert truth.read_with(truth.inputs[0]) == truth
