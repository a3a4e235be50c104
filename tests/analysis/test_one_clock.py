"""What columns of one clock have in common, beside the seasons of that clock, and where they are counts."""

from __future__ import annotations

import numpy as np
import pytest
from driftwise_studies.score.claims.panels import CLEAR, SEVERAL, STEADY, drawn, error_of, knows, table, told, written

from driftwise.analysis.directions import read_settled
from driftwise.analysis.seasons import unseasoned
from driftwise.analysis.table_together import together_of


@pytest.mark.parametrize("number", [22, 31])
def test_a_change_beside_a_season_is_told(number):
    panel = drawn(0, number, SEVERAL)
    assert told(panel) == [panel.first]


def test_a_change_of_counts_is_told_in_counts(tmp_path):
    panel = drawn(0, 15, SEVERAL)
    path = tmp_path / "counts.csv"
    path.write_text(written(panel))
    reading, segments = read_settled(path)
    (found,) = together_of(segments.table.head, reading)
    assert found.since == panel.first
    for name, by in found.moves.items():
        j = ord(name[-1]) - ord("a")
        level = np.exp(panel.expected[j, : panel.first].mean())
        assert by == pytest.approx(level * np.expm1(panel.sizes[j]), rel=0.35)


def test_the_same_is_told_whichever_is_the_output(tmp_path):
    path = tmp_path / "counts.csv"
    path.write_text(written(drawn(0, 15, SEVERAL)))
    odds = set()
    for output in (None, "series_d", "series_g"):
        reading, segments = read_settled(path, output)
        odds |= {one.odds for one in together_of(segments.table.head, reading)}
    assert len(odds) == 1


def test_readings_of_one_weekday_have_no_week():
    x = np.full(700, np.nan)
    x[3::7] = np.random.default_rng(0).normal(size=100)
    assert unseasoned(x, (7,)) is x


def test_an_error_is_that_of_a_difference_beside_a_season():
    shape = (np.arange(120) >= 60).astype(float)
    alone = error_of(shape, 4 * np.eye(120), 12)
    assert 2 * np.sqrt(2 / 60) < alone < 3 * 2 * np.sqrt(2 / 60)  # a line takes the most of it
    assert error_of(shape, 16 * np.eye(120), 12) == pytest.approx(2 * alone)


def test_a_clear_change_is_of_one_column_and_known():
    panel = drawn(6601, 1, CLEAR)
    assert np.count_nonzero(panel.sizes) == 1
    assert knows(panel, panel.sizes)


def test_who_knows_tells_what_there_is():
    panel, steady = (drawn(0, 15, kind) for kind in (SEVERAL, STEADY))
    assert knows(panel, panel.sizes)
    assert not knows(steady, np.resize(panel.sizes, len(steady.columns)) / 10)
    assert "| steady | 1 | 0 | 0 | 0 |" in table(0, 1)
