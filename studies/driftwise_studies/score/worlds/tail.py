"""Where do the systems of the tail lose, and what knowledge would cure them?

Of the systems on which the default memory has the largest ratios: its excess of squares over the reference by place -
the start, a hundred samples after the noise or parameters have changed, the samples that have an outlier in their rows,
and all others - and its ratio where it is told the outliers, those of the start alone, sigma at every sample, both, or
that nothing jumps. The reference knows all of it. Systems without such a trouble keep their ratio.

How much of that nobody can have: a mixture that is told Q, the noise at first and the law of outliers, and finds out
what jumps and when the noise becomes another one (`attainable.follow`). What it shows is its mean, in which a jump
counts a part of its probability. It runs on the systems whose regressors are all known and whose noise steps, on other
records, since in those by which they were picked chance was against the memory; and, to show the price, on as many
drawn systems whose parameters do jump.

Run: python -m driftwise_studies.score.worlds.tail [--seed 0] [--systems 300] [--records 10] [--worst 30] [--mixture 3]
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise

import numpy as np

import driftwise as dw

from . import attainable
from .drawing import draw
from .field import geometric, table
from .judged import CHOOSING
from .simulation import FIRST, Records, records, regressors
from .system import System
from .told import SKIP, WIDE, Told, error, estimator, follow, told, walk, without_outliers

AFTER = 100  # samples after a change that count as its
PLACES = "start", "noise", "jumps", "outliers", "else"
CURES = "outliers", "those of the start", "sigma", "outliers and sigma", "that nothing jumps"
MOST, NEW = 300, 100  # hypotheses of the mixture; first of the records that it gets
SHY = 1 / 8, 1 / 50  # what a jump counts in its mean, over its probability


def squares(system: System, theta, truth) -> np.ndarray:
    """Return the mean square error of each sample, in deviations."""
    return (((theta - truth) / np.array(system.deviations)) ** 2).mean(axis=-1)


def reference(system: System, r: Records, known: Told) -> np.ndarray:
    """Return the squares (S, T) of the filter that the ratio is over."""
    (y, sigma), q = without_outliers(system, r), walk(system, r.y.shape[1])
    if system.jumps:
        who, nvr = known.which.split()
        moving = np.isin(np.arange(len(system.theta)), [i for _, which in system.jumps for i in which])
        q = q + float(nvr) * np.array(system.deviations) ** 2 * (moving if who == "some" else 1.0)
    paths = [follow(system, y[s], r.u[s], sigma[s], q)[0] for s in range(len(y))]
    return squares(system, np.array(paths), r.theta)


def driven(r: Records, s: int):
    """Return the inputs of a record, none if there are none."""
    return r.u[s] if r.u.shape[2] else None


def ours(system: System, r: Records, y, memory=None) -> np.ndarray:
    """Return the squares of a memory, the default one if none is given, on these outputs."""
    est = estimator(system, memory or dw.AutoMemory())
    return squares(system, np.array([est.scan(y[s], driven(r, s)).parameters for s in range(len(y))]), r.theta)


def told_sigma(system: System, r: Records, y) -> np.ndarray:
    """Return the squares of the default where it is told sigma at every sample."""
    if system.na < 0:
        est, weighed = estimator(system, dw.AutoMemory(), variance=1.0), r.u / r.sigma[..., None]
        paths = [est.scan(y[s] / r.sigma[s], weighed[s]).parameters for s in range(len(y))]
        return squares(system, np.array(paths), r.theta)
    paths = []
    for s in range(len(y)):
        state, parts = None, list[np.ndarray]()
        for a, b in pairwise([0, *np.flatnonzero(np.diff(r.sigma[s])) + 1, y.shape[1]]):
            est, u = estimator(system, dw.AutoMemory(), variance=float(r.sigma[s, a] ** 2)), driven(r, s)
            trace = est.scan(y[s, a:b], None if u is None else u[a:b], state=state)
            state, parts = trace.state, [*parts, trace.parameters]
        paths.append(np.concatenate(parts))
    return squares(system, np.array(paths), r.theta)


def places(system: System, r: Records, s: int) -> np.ndarray:
    """Return which samples of a record belong to each of `PLACES`; each belongs to the first that has it."""
    samples = r.y.shape[1]
    found = np.zeros((len(PLACES), samples), bool)
    found[0, :FIRST] = found[-1] = True
    for row, dates, length in (
        (1, np.flatnonzero(np.diff(r.sigma[s])) + 1, AFTER),
        (2, r.jumps[s], AFTER),
        (3, np.flatnonzero(r.outliers[s]), 3 + len(system.theta)),
    ):
        for k in dates:
            found[row, k : k + length] = True
    found &= np.cumsum(found, axis=0) == 1
    found[:, :SKIP] = False
    return found


def rungs(system: System, r: Records, known: Told) -> tuple[float, list[float], list[float]]:
    """Return ratio of the default, its excess of squares by place over all of the reference, and what cures give."""
    found = ours(system, r, r.y)
    excess, whole = found - reference(system, r, known), known.reference**2 * found[:, SKIP:].size
    parts = sum((places(system, r, s) * excess[s]).sum(axis=1) for s in range(len(found))) / whole

    def ratio(some) -> float:
        return float(np.sqrt(some[:, SKIP:].mean()) / known.reference)

    clean = r.y if system.of_process else np.where(r.outliers, np.nan, r.y)
    begun = np.where(np.arange(r.y.shape[1]) < FIRST, clean, r.y)
    cures = [ours(system, r, clean), ours(system, r, begun), told_sigma(system, r, r.y), told_sigma(system, r, clean)]
    calm = found if system.jumps else ours(system, r, r.y, dw.AutoMemory("outliers"))
    return ratio(found), parts.tolist(), [ratio(some) for some in (*cures, calm)]


def mixtures(system: System, count: int) -> list[float]:
    """Return ratios on other records: told all but the dates; but what happens, for each of `SHY`; the default's."""
    r = records(system, range(NEW, NEW + count))
    known, psi, rng = told(system, r), regressors(system, r.y, r.u), np.random.default_rng([system.number, 31])
    start, lags = WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0), max(system.na, *system.nb, 1)
    hypotheses = [([system], attainable.KEPT, 1.0), *(([system] * 2, MOST, shy) for shy in SHY)]  # two: not told what
    found = np.zeros((len(hypotheses), count))
    for s in range(count):
        y, sigma = r.y[s].copy(), attainable.quiet(system, r.sigma[s])
        y[: lags if system.na > 0 else 0] = np.nan
        for i, (which, most, shy) in enumerate(hypotheses):
            may = attainable.worlds(which, len(y))
            theta = attainable.follow(may, psi[s], y, sigma, start, most, rng, False, shy)
            found[i, s] = error(system, theta, r.theta[s])
    each = [*found.mean(axis=1), ours(system, r, r.y)[:, SKIP:].mean()]
    return [float(np.sqrt(value)) / known.reference for value in each]


def main(arguments=None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=CHOOSING)
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=10)
    parser.add_argument("--worst", type=int, default=30)
    parser.add_argument("--mixture", type=int, default=0, help="records of each for the mixtures, which take long")
    asked = parser.parse_args(arguments)
    every = []
    for number in range(asked.systems):
        system = draw(asked.seed, number)
        r = records(system, range(asked.records))
        known = told(system, r)
        every.append((float(np.sqrt(ours(system, r, r.y)[:, SKIP:].mean())) / known.reference, system, r, known))
    worst = sorted(every, key=lambda one: -one[0])[: asked.worst]
    found = [(system, *rungs(system, r, known)) for _, system, r, known in worst]
    head = ("ratio", *PLACES, *(f"told {words}" for words in CURES), "system")
    print(table(head, [
        [f"{ratio:.2f}", *(f"{v:+.2f}" for v in parts), *(f"{v:.2f}" for v in cures), system.about]
        for system, ratio, parts, cures in found
    ]))  # fmt: skip
    means = np.mean([parts for _, _, parts, _ in found], axis=0), np.array([cures for *_, cures in found]).T
    cells = [*(f"{v:+.2f}" for v in means[0]), *(f"{geometric(v):.2f}" for v in means[1])]
    print(table(head[:-1], [[f"{geometric([ratio for _, ratio, _, _ in found]):.2f}", *cells]]))
    loud = [system for system, *_ in found if attainable.has_exact(system) and system.steps]
    jumping = [system for _, system, *_ in every if attainable.has_exact(system) and system.jumps]
    rows = []
    for system in (*loud, *jumping[: len(loud)]) if asked.mixture else ():
        rows.append([*(f"{v:.2f}" for v in mixtures(system, asked.mixture)), system.about])
        print(*rows[-1], file=sys.stderr, flush=True)
    if rows:
        shy = (f"all but what and when, a jump counts 1/{1 / v:.0f}" for v in SHY)
        print(table(("all but the dates", *shy, "default", "system"), rows))


if __name__ == "__main__":
    main()
