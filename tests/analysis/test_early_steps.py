"""A step of the level in the first eighth of a short record is told; one that begins elsewhere and settles is none."""

import numpy as np
from draws import draws

from driftwise.analysis.segmentation import LEVEL, hindsight

T = 160
BEFORE = 8, 10, 14, 18  # rows before a step


def dates(y) -> list[int]:
    """Return where the level is told to step."""
    found = hindsight(y, np.zeros((len(y), 0)))
    return [jump.at for jump in found.jumps() if jump.kind == LEVEL] if found else []


def noise(rows: int) -> np.ndarray:
    """Return six records of white noise, (6, T)."""
    return np.random.default_rng([rows, 3]).standard_normal((6, T))


@draws("dates_of_steps", BEFORE[2:3], BEFORE)
def test_a_step_near_the_beginning_is_told(dates_of_steps):
    told = others = 0
    for rows in dates_of_steps:
        for e in noise(rows):
            at = dates(e + 8 * (np.arange(T) >= rows))
            told += any(abs(one - rows) <= 2 for one in at)
            others += sum(abs(one - rows) > 2 for one in at)
    assert told >= 4.5 * len(dates_of_steps) and others == 0


@draws("times", [6.0], [3.0, 6.0, 10.0, 20.0])
def test_a_level_that_begins_elsewhere_and_settles_does_not_step(times):
    t, told = np.arange(T), 0
    for tau in times:
        told += sum(len(dates(e + 8 * np.exp(-t / tau))) for e in noise(int(tau)))
    assert told <= len(times) // 4
