"""A level that steps in the last eighth of a short record is told; outliers there, and a start-up, are none."""

import numpy as np

from driftwise.analysis.segmentation import hindsight

T = 160
AFTER = 6, 8, 10, 14  # rows of a step


def records(rows: int):
    """Return six records (T,) of white noise, and what a step of its last rows adds."""
    return np.random.default_rng(rows).standard_normal((6, T)), np.arange(T) >= T - rows


def dates(y) -> list[int]:
    """Return where changes are told of y (T,)."""
    found = hindsight(y, np.zeros((T, 0)))
    return [jump.at for jump in found.jumps()] if found else []


def test_a_step_near_the_end_is_told():
    told = others = 0
    for rows in AFTER:
        noise, step = records(rows)
        for e in noise:
            at = dates(e + 6 * step)
            told += any(abs(one - T + rows) <= 2 for one in at)
            others += sum(abs(one - T + rows) > 2 for one in at)
    assert told >= 20 and others == 0


def test_nothing_else_there_is_a_step():
    t = np.arange(T)
    for rows in AFTER:
        noise, _ = records(rows)
        for k, e in enumerate(noise):
            lone = (t == T - rows) + (t == T - 2)  # two outliers on the same side
            assert not dates(e) and not dates(e + 10 * lone)
            assert min(dates(e + 12 * (0.6 + 0.05 * k) ** t), default=T) >= 20  # what it begins with dies out
