"""What odds has a documented step of a short record against none, for who knows its model but not the date?

A record is a level that walks (or rests) beside white noise, a season by months, what inputs do at once, and perhaps
one step: the local linear model of Harvey and Durbin (1986, J. R. Statist. Soc. A 149, 187-227), of which the law on
seat belts is the example. The ratio of both variances is where the record makes it likeliest, without a step and with
one; all else is integrated out (flat), sigma in its logarithm. *At most* the step has the size that fits best, which
nobody knows beforehand; *by sizes* it is normal, of 6 variances of the noise. At unknown dates each row is as likely.

Run: DRIFTWISE_DATA=../shared/data python -m driftwise_studies.score.documented
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.linalg import solve_triangular
from scipy.optimize import minimize_scalar

from .worlds.field import table

SIZE = 6.0  # variance of a step, in that of the noise
EDGE = 6  # rows from either end, nearer than which no step is looked for
RATIOS = math.log(1e-8), math.log(1e3)  # of the variance of the walk to that of the noise


def evidence(y, known, ratio: float, size: float | None = None) -> tuple[float, np.ndarray]:
    """Return the log likelihood without a step, and the gain of one from each row on, (T,); ``size`` None: the best."""
    T = len(y)
    rows = np.arange(T)
    K = ratio * np.minimum.outer(rows + 1.0, rows + 1.0) + np.eye(T)
    L = np.linalg.cholesky(K)
    steps = (rows[:, None] >= rows).astype(float)
    white = solve_triangular(L, np.column_stack([known, y, steps]), lower=True)
    Q, R = np.linalg.qr(white[:, : known.shape[1]])
    rest = white[:, known.shape[1] :] - Q @ (Q.T @ white[:, known.shape[1] :])
    z, S, free = rest[:, 0], rest[:, 1:], T - known.shape[1]
    none = -np.log(np.diag(L)).sum() - np.log(abs(np.diag(R))).sum() - 0.5 * free * math.log(z @ z)
    squares, along = (S**2).sum(axis=0), S.T @ z
    prior = 0.0 if size is None else 1.0 / size
    left = np.maximum(z @ z - along**2 / np.maximum(squares + prior, 1e-12), 1e-300)
    gain = -0.5 * free * np.log(left / (z @ z))
    gain -= 0.0 if size is None else 0.5 * np.log1p(size * squares)
    gain[: EDGE + 1] = gain[T - EDGE :] = -math.inf
    return none, gain


def best(y, known, of) -> float:
    """Return the ratio of variances under which a number of the evidence is largest."""
    grid = np.linspace(*RATIOS, 30)
    start = grid[np.argmax([of(*evidence(y, known, math.exp(q), SIZE)) for q in grid])]
    found = minimize_scalar(lambda q: -of(*evidence(y, known, math.exp(q), SIZE)), bounds=(start - 1, start + 1))
    return math.exp(found.x)


def odds(y, known, at: int) -> dict[str, float]:
    """Return what a step at a row says: size in deviations of its error, odds there, and anywhere."""
    resting = best(y, known, lambda none, gain: none)
    stepped = best(y, known, lambda none, gain: none + np.logaddexp.reduce(gain))
    without = evidence(y, known, resting)[0]
    found: dict[str, float] = {}
    for name, size in (("at most", None), ("by sizes", SIZE)):
        none, gain = evidence(y, known, stepped, size)
        gain = gain + none - without
        count = np.isfinite(gain).sum()
        found |= {
            f"{name}, there": float(gain[at]),
            f"{name}, anywhere": float(np.logaddexp.reduce(gain)) - math.log(count),
        }
    return found


def months(count: int) -> np.ndarray:
    """Return the twelve levels of a year, (count, 12)."""
    return np.eye(12)[np.arange(count) % 12]


def main() -> None:
    """Print the table."""
    where = Path(os.environ.get("DRIFTWISE_DATA", "../shared/data")) / "sysid"
    nile = pd.read_csv(where / "nile.csv", comment="#").iloc[:, -1].to_numpy(float)
    rows = [("Nile, 1899", nile, np.ones((len(nile), 1)), 28)]
    belts = pd.read_csv(where / "second/uk_seatbelts.csv", comment="#")
    law, driven = int(np.argmax(belts["law"].to_numpy() > 0)), np.log(belts[["kms", "PetrolPrice"]].to_numpy(float))
    for name in ("drivers", "DriversKilled", "front", "rear", "VanKilled"):
        y = np.log(belts[name].to_numpy(float))
        rows.append((f"{name}, the law", y, months(len(y)), law))
        rows.append((f"{name}, the law, beside kms and PetrolPrice", y, np.column_stack([months(len(y)), driven]), law))
    found = [(name, odds(y, known, at)) for name, y, known, at in rows]
    head = ("record", *(f"{words}, odds to one" for words in found[0][1]))
    print(table(head, [[name, *(f"{math.exp(min(v, 30.0)):.2g}" for v in one.values())] for name, one in found]))


if __name__ == "__main__":
    main()
