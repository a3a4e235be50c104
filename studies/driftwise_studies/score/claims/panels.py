"""Statistics of several things by the hour, day or month, which come again with the clock: what is told of a change.

Run: python -m driftwise_studies.score.claims.panels [--records 25] [--seed 0]

Three to eight columns of one clock: a level with a season of its own, by a few harmonics of a day, a week or a year,
up to six deviations of what is quick; a line and something slow; noise, white and of the first order. All of that is
added, or, of every other panel, what is added are logarithms of counts and amounts, which are as loud as they are
large. Once something changes for good, or for some time, by half to five deviations of what is quick, in one column, in
several or, "steady", in none; "clear": in one column, by six to eight standard errors of who knows its noise and the
date, and not its level, line and season.

"Who knows" is told the law of each column, its season, and size and shape of the change: all but the date; it tells
what has odds of 20:1 against none. Told is a change that begins where the true one does, within a season or a fiftieth.
"""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, toeplitz

from driftwise.analysis.directions import read_settled
from driftwise.analysis.table_together import together_of

from .command import show
from .rigs_bench import first_order

CLOCKS = ("hour", 24, (200, 1500)), ("day", 7, (150, 900)), ("month", 12, (132, 320))  # season and length, samples
KINDS = ONE, SEVERAL, STEADY, CLEAR = "one column", "several columns", "steady", "clear"
ERRORS = 6.0, 8.0  # of a clear change, that it is large
SURE, EDGE = math.log(20.0), 0.06  # of who knows: the odds, and the share of the record at an end without a change
STARTS = {"hour": "2021-03-01T00:00", "day": "2019-05-06", "month": "1990-01"}


class Panel(NamedTuple):
    """Columns (p, T), what is known of them, and what changes.

    is_relative : whether the laws are those of logarithms
    first, lasts : row at which it does, and for how many rows
    sizes : what is added to each column, (p,)
    expected : (p, T), line and season
    white, own, keeps : deviations of the white noise (p,), of what is slow and of what is quick, and what these keep
        from one row to the next (2, p)
    """

    clock: str
    season: int
    columns: np.ndarray
    is_relative: bool
    first: int
    lasts: int
    sizes: np.ndarray
    expected: np.ndarray
    white: np.ndarray
    own: np.ndarray
    keeps: np.ndarray


def drawn(seed: int, number: int, kind: str) -> Panel:
    """Return the statistics of one clock."""
    rng = np.random.default_rng([seed, number, KINDS.index(kind), 53])
    clock, season, lengths = CLOCKS[rng.integers(len(CLOCKS))]
    T, p = int(np.exp(rng.uniform(*np.log(lengths)))), int(rng.integers(3, 9))
    t = np.arange(T)
    level, is_relative = rng.uniform(1, 8, p), bool(rng.uniform() < 0.5)  # logarithms
    white = np.exp(rng.uniform(math.log(0.03), math.log(0.2), p)) * (1.0 if is_relative else np.exp(level))
    shape = np.zeros((p, T))
    for k in range(1, 4):
        size = rng.exponential(1 / k, (p, 1))
        shape += size * np.cos(2 * np.pi * (k * t / season + rng.uniform(size=(p, 1))))
    shape *= rng.choice([0, 1, 1, 1], (p, 1)) * rng.uniform(0, 4, (p, 1))
    slow = np.exp(-1 / (T * rng.uniform(0.1, 0.5, p)))
    line = rng.normal(0, 2, (p, 1)) * (t / T - 0.5)
    drift = white * rng.choice([0, 0.5, 1], p)
    expected = (level if is_relative else np.exp(level))[:, None] + white[:, None] * (shape + line)
    own, keeps = np.array([drift, white * rng.choice([0, 0.5, 1], p)]), np.array([slow, rng.uniform(0, 0.7, p)])
    order, many = rng.permutation(p), {SEVERAL: int(rng.integers(2, p + 1)), STEADY: 0}.get(kind, 1)
    sizes = np.hypot(white, own[1]) * np.exp(rng.uniform(math.log(0.5), math.log(5), p)) * rng.choice([-1, 1], p)
    sizes *= order < many
    first, lasts = int(T * rng.uniform(0.25, 0.9)), T if rng.uniform() < 0.7 else int(T * rng.uniform(0.1, 0.3))
    if kind == CLEAR:
        j, shape = int(np.flatnonzero(sizes)[0]), moved(t, first, lasts)
        rounded = math.exp(-2 * level[j]) / 12 if is_relative else 0.0  # of whole counts
        K = covariance(T, math.sqrt(white[j] ** 2 + rounded), own[:, j], keeps[:, j])
        sizes[j] = np.sign(sizes[j]) * rng.uniform(*ERRORS) * error_of(shape, K, season)
    x = expected + sizes[:, None] * moved(t, first, lasts) + white[:, None] * rng.standard_normal((p, T))
    x += sum(own[i, :, None] * np.array([first_order(rng, T, keep) for keep in keeps[i]]) for i in range(2))
    x = np.maximum(np.round(np.exp(x)), 1.0) if is_relative else x
    return Panel(clock, season, x, is_relative, first, lasts, sizes, expected, white, own, keeps)


def moved(t, first, lasts: int) -> np.ndarray:
    """Return 1 where the change is."""
    return ((t >= first) & (t < first + lasts)).astype(float)


def covariance(T: int, white, own, keeps) -> np.ndarray:
    """Return that of a column (T,) beside its line and season, of which noises keep some from row to row."""
    return white**2 * np.eye(T) + sum(by**2 * toeplitz(keep ** np.arange(T)) for by, keep in zip(own, keeps))


def error_of(shape, K, season: int) -> float:
    """Return the standard error of the size of a shape (T,) beside a level, a line and a season that nobody knows."""
    t = np.arange(len(shape))
    X = np.column_stack([shape, t / len(t), t[:, None] % season == np.arange(season)])
    return float(np.sqrt(np.linalg.inv(X.T @ cho_solve(cho_factor(K), X))[0, 0]))


def knows(panel: Panel, sizes) -> bool:
    """Return whether who knows all but the date tells that the columns changed by ``sizes``."""
    T = panel.columns.shape[1]
    dates = np.arange(math.ceil(EDGE * T), T - math.ceil(EDGE * T))
    shapes = moved(np.arange(T), dates[:, None], panel.lasts).T
    odds, x = np.zeros(len(dates)), np.log(panel.columns) if panel.is_relative else panel.columns
    for j in np.flatnonzero(sizes):
        K = covariance(T, panel.white[j], panel.own[:, j], panel.keeps[:, j])
        white = cho_solve(cho_factor(K), np.column_stack([x[j] - panel.expected[j], shapes]))
        odds += sizes[j] * shapes.T @ white[:, 0] - sizes[j] ** 2 * np.sum(shapes * white[:, 1:], axis=0) / 2
    return float(np.logaddexp.reduce(odds)) - math.log(len(odds)) > SURE


def written(panel: Panel) -> str:
    """Return a table as a statistics office or a logger writes it."""
    step = {"hour": "h", "day": "D", "month": "M"}[panel.clock]
    stamps = np.array(STARTS[panel.clock], f"datetime64[{step}]") + np.arange(panel.columns.shape[1])
    text = io.StringIO()
    out = csv.writer(text)
    out.writerow([panel.clock, *(f"series_{chr(97 + j)}" for j in range(len(panel.columns)))])
    out.writerows([str(stamp), *(f"{x:.6g}" for x in row)] for stamp, row in zip(stamps, panel.columns.T))
    return text.getvalue()


def told(panel: Panel) -> list[int]:
    """Return the rows from which on its columns are told to have changed."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "panel.csv"
        file.write_text(written(panel))
        table, segments = read_settled(file)
        return [one.since for one in together_of(segments.table.head, table)]


def count(panel: Panel, seen: Counter) -> None:
    """Count what is told of a panel, and whether who knows tells it."""
    found = told(panel)
    near = max(panel.season, panel.columns.shape[1] // 50)
    seen["told"] += bool(panel.sizes.any()) and any(abs(row - panel.first) <= near for row in found)
    seen["any"] += bool(found)
    seen["known"] += bool(panel.sizes.any()) and knows(panel, panel.sizes)


def table(seed: int, records: int) -> str:
    """Return what is told of each kind, as a table of Markdown."""
    rows = ["| change | panels | told and dated | any | who knows |", "| --- | --- | --- | --- | --- |"]
    for kind in KINDS:
        seen = Counter[str]()
        for number in range(records):
            count(drawn(seed, number, kind), seen)
        rows.append(f"| {kind} | {records} | {seen['told']} | {seen['any']} | {seen['known']} |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 25)
