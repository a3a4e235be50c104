"""Columns that become louder: what is drawn, and of how many it is said."""

from __future__ import annotations

import numpy as np
from driftwise_studies.score.claims.rigs_louder import DRAWN, FIRST, LAST, STILL, WANDERS, WHITE, odds, table

from driftwise.analysis.together import SURE


def test_one_column_of_white_noise_is_louder_for_a_while():
    (heard,) = DRAWN[WHITE](3, 0)
    inside, outside = heard.columns["0"][FIRST:LAST], heard.columns["0"][:FIRST]
    assert heard.louder == {"0"}
    assert 1.2 < np.std(inside) / np.std(outside) < 2.7


def test_steady_columns_and_noise_that_wanders_have_none_that_is_louder():
    for kind in (STILL, WANDERS):
        heard = list(DRAWN[kind](3, 0))
        assert all(not one.louder and one.first is None for one in heard)
        found = [odds(one, name) for one in heard[:2] for name in list(one.columns)[:3]]
        assert all(by is None or by < SURE for by in found)


def test_the_table_counts_what_is_told():
    rows = table(3, 1, (WHITE, WANDERS)).splitlines()
    assert rows[2].startswith(f"| {WHITE} | 1 |")
    assert rows[3].startswith(f"| {WANDERS} | 12 | 0 |")
