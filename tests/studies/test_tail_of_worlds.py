"""What a memory loses is shared out among places, and who is told everything has nothing left to lose."""

from functools import cache

import numpy as np
from drawn_worlds import DRAWN
from driftwise_studies.score import worlds
from driftwise_studies.score.worlds import tail, told


@cache
def loud():
    """Return the first system whose noise becomes louder, and nothing else."""
    return next(s for s in DRAWN if s.na < 0 and s.steps and s.steps[0] > 4 and not s.outliers[0] and not s.jumps)


@cache
def wrong():
    """Return the first that jumps beside outliers of what was measured."""
    return next(s for s in DRAWN if s.na > 0 and s.outliers[0] and s.jumps and not s.of_process)


def test_the_parts_of_the_excess_are_all_of_it():
    for system in (loud(), wrong()):
        r = worlds.records(system, range(2))
        known = told.told(system, r)
        assert np.isclose(tail.reference(system, r, known)[:, told.SKIP :].mean(), known.reference**2)
        ratio, parts, cures = tail.rungs(system, r, known)
        assert np.isclose(sum(parts), ratio**2 - 1) and len(cures) == len(tail.CURES)
        assert all((tail.places(system, r, s)[:, told.SKIP :].sum(axis=0) == 1).all() for s in range(2))


def test_who_finds_out_what_happens_loses_to_who_is_told_all_but_the_dates_and_little_if_shy_of_jumps():
    dates, _, shy, _ = tail.mixtures(loud(), 1)
    assert 0.9 < dates < 1.1 and shy < 1.35
