"""Drawn rigs are what their seed says, move, and have gaps only where they are meant to."""

import numpy as np
import pytest
from driftwise_studies.score.rigs import KINDS, draw

from driftwise.analysis.identifier import Identifier


@pytest.mark.parametrize("name", KINDS)
def test_a_rig_is_what_its_seed_says(name):
    (y, u), (again, _), (other, _) = draw(name, 3, 0), draw(name, 3, 0), draw(name, 4, 0)
    assert np.array_equal(y, again, equal_nan=True) and not np.array_equal(y, other, equal_nan=True)
    assert y.ndim == 1 and u.ndim == 2 and len(u) == len(y) and np.isfinite(u).all() and np.ptp(u, axis=0).any()
    assert np.isfinite(y).all() != (name in ("gaps", "drowsy", "batches", "skipped")) and np.nanstd(y) > 0


def test_after_a_rest_where_members_disagree_the_variance_is_as_large_as_errors_are():
    """Cells between pulses: all that was right at rest says nothing of the first sample after it."""
    records = [draw("battery", 7, number) for number in range(4)]
    found = [Identifier(u.shape[1], 1.0).add(y, u).nis(len(y) // 2) for y, u in records]
    assert 0.8 < np.median(found) < 1.25 and max(found) < 1.25  # 17.7 where only the density's variance counts


def test_where_members_disagree_and_their_mean_is_good_the_variance_is_no_larger_than_errors_are():
    """An arm almost without noise: models of low order are far off, and nobody listens to them."""
    y, u = draw("arm", 1, 9)
    trace, half = Identifier(u.shape[1], 1.0).add(y, u), len(y) // 2
    assert 0.8 < trace.nis(half) < 1.25  # .55 where one share of the disagreement counts everywhere


def test_across_a_gap_who_claims_to_know_little_counts_little():
    """Plants whose output is read every few samples: who forgets fast may be likely, and knows little of them."""
    ratios = []
    for number in (8, 18, 23, 28):
        y, u = draw("gaps", 7, number)
        seen = np.flatnonzero(np.isfinite(y))
        late, off = seen[seen >= len(y) // 2], Identifier(u.shape[1], 1.0).add(y, u).innovation
        last = y[seen[np.searchsorted(seen, late) - 1]]
        ratios.append(np.sqrt(np.mean(off[late] ** 2) / np.mean((y[late] - last) ** 2)))
    assert np.exp(np.mean(np.log(ratios))) < 0.08  # .067; .115 where they counted by likelihood alone


def test_of_runs_that_end_where_the_next_does_not_begin_the_average_learns_what_comes_after_a_break():
    """Who is likely within a run is far off after it, again and again; the last value is no guess of a fresh cell."""
    for number in range(4):
        y, u = draw("batches", 7, number)
        seen = np.flatnonzero(np.isfinite(y))
        late, off = seen[seen >= len(y) // 2], Identifier(u.shape[1], 1.0).add(y, u).innovation
        last = y[seen[np.searchsorted(seen, late) - 1]]
        ratio = np.sqrt(np.mean(off[late] ** 2) / np.mean((y[late] - last) ** 2))
        assert ratio < 0.8  # .2 to .4; 1.1 to 2.6 where nothing is learnt across breaks
