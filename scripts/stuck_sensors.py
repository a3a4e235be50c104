"""Columns whose noise falls below their resolution, and sensors that are stuck: how many are taken for stuck.

    python scripts/stuck_sensors.py [columns [seed]]

Noise, white or coloured, falls to a twentieth to two fifths of itself within a record of 300 to 2000 rows (or rises),
alone or beside a plant that a held input drives, and is read in steps of a fifth to four of its first deviations. Then
60 to 150 of the rows repeat the first of them. Last, the plants of the claims audit, whose sensors are stuck in some
files; in the others the last fifth of the rows is made to repeat itself.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record
from scipy.signal import lfilter

from driftwise.tables.stuck_sensor import Segment, still, stuck


class Column(NamedTuple):
    """Readings (T,), what drives them, and whether a plant does."""

    y: np.ndarray
    u: np.ndarray
    has_plant: bool


def column(rng) -> Column:
    """Return a column whose noise becomes quiet, or is quiet at first."""
    T = int(rng.integers(300, 2000))
    at, share = int(T * rng.uniform(0.25, 0.75)), rng.uniform(0.05, 0.4)
    e = rng.standard_normal(T)
    e = lfilter([1], [1, -0.7], e) if rng.random() < 0.5 else e
    e[at:] *= share
    u, x, has_plant = rng.standard_normal(T), np.zeros(T), bool(rng.random() < 0.5)
    if has_plant:
        p, hold = np.exp(-1 / np.exp(rng.uniform(np.log(3), np.log(30)))), int(rng.integers(10, 80))
        u = np.repeat(rng.standard_normal(T // hold + 1), hold)[:T]
        x = lfilter([0, 1 - p], [1, -p], u)
        x *= rng.uniform(0.2, 5) / x.std()
    y = x + e / e[:at].std() + rng.uniform(-1.5, 1.5)
    step, way = np.exp(rng.uniform(np.log(0.2), np.log(4))), -1 if rng.random() < 0.3 else 1
    return Column((np.round(y / step) * step)[::way], u[::way], has_plant)


def held(y, first: int, length: int) -> np.ndarray:
    """Return readings of which so many repeat the last before them that was read."""
    y = y.copy()
    y[first : first + length] = y[np.flatnonzero(np.isfinite(y[: first + 1]))[-1]]
    return y


def tells(found: list[Segment], first: int, length: int) -> bool:
    """Whether a segment among those found has all of the rows."""
    return any(one.start <= first + 2 and one.stop >= first + length - 2 for one in found)


def both(y, others) -> list[list[Segment]]:
    """Return what is found by the column itself, and beside others."""
    return [still(y), stuck(y, others)]


def main(columns: int = 2000, seed: int = 77040) -> None:
    rng = np.random.default_rng(seed)
    false, told = {True: [], False: []}, []
    for one in (column(rng) for _ in range(columns)):
        false[one.has_plant].append([bool(found) for found in both(one.y, [one.u])])
        first, length = int(len(one.y) * rng.uniform(0.1, 0.6)), min(int(rng.integers(60, 150)), len(one.y) // 4)
        told.append([tells(found, first, length) for found in both(held(one.y, first, length), [one.u])])
    rows = [("noise that is quiet, false", false[False]), ("beside a plant, false", false[True]), ("held, told", told)]
    found, ends = [], []
    for number in range(columns // 5):
        plant = draw(seed, number)
        data, (first, length) = record(plant, seed), plant.stuck
        u, T = list(data.u.T), len(data.y)
        if length:
            found.append([tells(one, first, length) for one in both(data.y, u)])
        else:
            ends.append([bool(one) for one in both(held(data.y, T - T // 5, T // 5), u)])
    rows += [("plants of the audit, stuck, told", found), ("the others, stuck to the end, told", ends)]
    print("| columns | number | by itself | beside others |\n|---|---|---|---|")
    for name, counts in rows:
        print(f"| {name} | {len(counts)} | {' | '.join(map(str, np.sum(counts, axis=0)))} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
