"""A fault that moves several columns of a rig at once: how often somebody who is told all but the date dates it.

Run: python -m driftwise_studies.score.claims.common_dates [--records 25] [--seed 11]

A rig of eight columns, 600 to 1000 samples, each noise of the first order and, two of three, a slow process of its own.
For a fifth to a third of the record a fault moves the first column and half of the others, by half to four of the
noise's deviations, within 1 to 60 samples; "steady" rigs have none. Known are the covariance of each column's noise,
how long the fault lasts and how it comes. "Sizes told": what it does to each column, too. "Sizes not told": each column
takes part with even odds, by a size of variance `SIZE`. Told is what has odds of 1000:1 against no fault, each date
being as likely, and is dated within 60 samples: by the first column alone, and by all.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular, toeplitz

from .command import show

COLUMNS, NEAR, STEP, EDGE = 8, 60, 4, 30  # STEP: samples between dates that are tried, EDGE: from an end, at least
SIZE = 2.0  # variance of what a fault does to a column, where nobody is told
SURE = math.log(1000.0)


class Rig(NamedTuple):
    """Columns (8, T), a root of each one's covariance, what a fault does to each, where it begins, and its shapes."""

    columns: np.ndarray
    roots: list[np.ndarray]
    sizes: np.ndarray
    first: int
    dates: np.ndarray
    shapes: np.ndarray  # (T, dates)


def rig(seed: int, number: int, is_faulty: bool) -> Rig:
    """Return a rig, with a fault or steady."""
    rng = np.random.default_rng([seed, number, 41])
    T = int(rng.integers(600, 1000))
    first, length = int(T * rng.uniform(0.35, 0.6)), int(T * rng.uniform(0.2, 0.33))
    lasts, t = float(np.exp(rng.uniform(0, np.log(60)))), np.arange(T)
    dates = np.arange(EDGE, T - length - EDGE, STEP)
    phi, slow = rng.uniform(0, 0.8, COLUMNS), rng.choice([0, 0.3, 1.0], COLUMNS) * rng.uniform(0.5, 1.5, COLUMNS)
    time = T * rng.uniform(0.05, 0.3, COLUMNS)
    takes = np.append(True, rng.uniform(size=COLUMNS - 1) < 0.5)
    sizes = takes * np.exp(rng.uniform(np.log(0.5), np.log(4), COLUMNS)) * rng.choice([-1, 1], COLUMNS)
    covariances = [toeplitz(p**t + s * s * np.exp(-t / wait)) for p, s, wait in zip(phi, slow, time)]
    roots = [np.linalg.cholesky(covariance + 1e-9 * np.eye(T)) for covariance in covariances]
    columns = np.array([root @ rng.standard_normal(T) for root in roots])
    shapes = np.column_stack([shape(t - date, lasts, length) for date in (first, *dates)])
    if is_faulty:
        columns += sizes[:, None] * shapes[:, 0]
    return Rig(columns, roots, sizes, first, dates, shapes[:, 1:])


def shape(since, lasts: float, length: int) -> np.ndarray:
    """Return what comes within some samples, and goes again after ``length``."""
    return np.clip(since / lasts, 0, 1) - np.clip((since - length) / lasts, 0, 1)


def evidence(one: Rig, j: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the log likelihood ratio of the fault at each date by column j: its size told, and not told."""
    level = np.ones((len(one.shapes), 1))
    white = solve_triangular(one.roots[j], np.column_stack([level, one.columns[j], one.shapes]), lower=True)
    own = white[:, 0] / np.linalg.norm(white[:, 0])
    white = white[:, 1:] - np.outer(own, own @ white[:, 1:])  # beside a level that nobody knows
    x, D = white[:, 0], white[:, 1:]
    free, product = np.einsum("td,td->d", D, D), D.T @ x
    told = one.sizes[j] * product - 0.5 * one.sizes[j] ** 2 * free
    untold = 0.5 * product**2 / (free + 1 / SIZE) - 0.5 * np.log1p(SIZE * free)
    return told, np.logaddexp(untold, 0.0) - math.log(2)


def dated(one: Rig, odds) -> tuple[bool, bool]:
    """Return whether a fault is told, each date being as likely, and whether it is dated as well."""
    most = int(np.argmax(odds))
    whole = float(np.logaddexp.reduce(odds)) - math.log(len(odds))
    return whole > SURE, whole > SURE and abs(int(one.dates[most]) - one.first) <= NEAR


def table(seed: int, records: int) -> str:
    """Return the faults that are told, and the steady rigs of which one is, as a table of Markdown."""
    right, false = Counter[str](), Counter[str]()
    for number in range(records):
        for is_faulty in (True, False):
            one = rig(seed, number, is_faulty)
            by = [evidence(one, j) for j in range(COLUMNS)]
            for k, what in enumerate(("sizes told", "sizes not told")):
                for name, odds in (("first column", by[0][k]), ("all columns", sum(pair[k] for pair in by))):
                    is_told, is_dated = dated(one, odds)
                    (right if is_faulty else false)[f"{what}, {name}"] += is_dated if is_faulty else is_told
    rows = ["| who knows | rigs | faults told and dated | steady rigs with one |", "| --- | --- | --- | --- |"]
    rows += [f"| {name} | {records} | {right[name]} | {false[name]} |" for name in right]
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 25)
