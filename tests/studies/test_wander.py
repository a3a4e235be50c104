"""Records in which nothing changes at once: what wanders is as slow and as large as it is said to be."""

import numpy as np
import pytest
from driftwise_studies.score.claims import wander
from driftwise_studies.score.claims.wander import DYNAMICS, KINDS, LEVELS, long_memory, slow, table, walking, wandering


def test_what_wanders_has_its_size_and_its_memory():
    T = 4000
    sizes = [np.mean([made(np.random.default_rng(k), T).var() for k in range(40)]) for made in (slow, long_memory)]
    assert 0.6 < sizes[0] < 1.2 and sizes[1] == pytest.approx(1.0)
    x = np.array([long_memory(np.random.default_rng(k), T) for k in range(40)])
    far = [np.mean(x[:, lag:] * x[:, :-lag]) for lag in (25, 100)]
    assert 0.5 < far[1] / far[0] < 1.0  # a power law: 4^(2 d - 1) of d in .3 to .45; a first order's would be a 50th
    assert abs(np.diff(slow(np.random.default_rng(1), T))).max() < 0.5


def test_walks_grow_with_the_root_of_the_time_and_their_noise_is_of_deviation_one():
    def spread(kind, lag):
        draws = np.array([walking(np.random.default_rng(k), 1600, kind) for k in range(60)])
        return np.median(np.mean((draws[:, lag:] - draws[:, :-lag]) ** 2, axis=1))

    for kind, low, high in ((wander.WALK, 3.0, 5.0), (wander.COLOURED_WALK, 3.0, 5.0), (wander.SLOPE, 10.0, 17.0)):
        far = spread(kind, 400) - 2.0, spread(kind, 100) - 2.0  # twice the variance of the noise is in both
        assert low < far[0] / far[1] < high, kind
    calm = min(np.var(np.diff(walking(np.random.default_rng(k), 1600, wander.SLOPE))) for k in range(60))
    assert calm == pytest.approx(2.0, abs=0.3)


def test_half_of_the_walks_have_inputs():
    assert [wandering(3, number, kind)[1].shape[1] > 0 for kind in wander.WALKS for number in (4, 5)] == [
        True,
        False,
    ] * 3


def test_records_are_those_of_the_claims_and_the_same_seed_gives_the_same():
    for kind in KINDS:
        (y, u), (again, _) = (wandering(3, 5, kind) for _ in range(2))
        np.testing.assert_array_equal(y, again)
        assert len(y) == len(u) and np.isfinite(y).all()
    assert "jumps" not in DYNAMICS and set(LEVELS) < set(KINDS)


def test_the_table_counts_records():
    rows = table(0, 1).splitlines()
    assert len(rows) == 2 + len(KINDS) and all(row.count("|") == 7 for row in rows)
