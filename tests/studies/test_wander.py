"""Records in which nothing changes at once: what wanders is as slow and as large as it is said to be."""

import numpy as np
import pytest
from driftwise_studies.score.claims.wander import DYNAMICS, KINDS, LEVELS, long_memory, slow, table, wandering


def test_what_wanders_has_its_size_and_its_memory():
    T = 4000
    sizes = [np.mean([made(np.random.default_rng(k), T).var() for k in range(40)]) for made in (slow, long_memory)]
    assert 0.6 < sizes[0] < 1.2 and sizes[1] == pytest.approx(1.0)
    x = np.array([long_memory(np.random.default_rng(k), T) for k in range(40)])
    far = [np.mean(x[:, lag:] * x[:, :-lag]) for lag in (25, 100)]
    assert 0.5 < far[1] / far[0] < 1.0  # a power law: 4^(2 d - 1) of d in .3 to .45; a first order's would be a 50th
    assert abs(np.diff(slow(np.random.default_rng(1), T))).max() < 0.5


def test_records_are_those_of_the_claims_and_the_same_seed_gives_the_same():
    for kind in KINDS:
        (y, u), (again, _) = (wandering(3, 5, kind) for _ in range(2))
        np.testing.assert_array_equal(y, again)
        assert len(y) == len(u) and np.isfinite(y).all()
    assert "jumps" not in DYNAMICS and set(LEVELS) < set(KINDS)


def test_the_table_counts_records():
    rows = table(0, 1).splitlines()
    assert len(rows) == 2 + len(KINDS) and all(row.count("|") == 7 for row in rows)
