"""Plants whose output is recorded in steps, and stands still at first: what a memory makes of it.

Nothing moves for some hours, then noise of .06 to 3 steps and an input do. `draw` of the judged systems draws none of
these. A plant's opponent is least squares with constant parameters on the same record, as its parameters are.

Run: python -m driftwise_studies.score.worlds.recorded [--seed 0] [--plants 40]
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import driftwise as dw

from .field import geometric, mean, table

SAMPLES = 1500
SIZES = 0.0, 0.3, 1.0, np.inf  # of the noise, in steps: rows of the table


class Recorded(NamedTuple):
    """A drawn plant's record."""

    y: np.ndarray  # (T,), multiples of step
    u: np.ndarray  # (T, 1)
    order: int
    step: float
    still: int  # samples in which nothing moves
    sigma: float  # of the noise, in steps


def draw(seed: int, number: int) -> Recorded:
    """Return plant ``number`` of ``seed``.

    Examples
    --------
    >>> from driftwise_studies.score.worlds import recorded
    >>> one = recorded.draw(0, 1)
    >>> one.order, one.step, one.still, len(set(one.y[: one.still]))
    (1, 10.0, 84, 1)
    """
    rng = np.random.default_rng([seed, number, 29])
    a = np.poly(rng.uniform(0.8, 0.98, int(rng.integers(1, 3))))[1:]
    order, sigma = len(a), 10 ** rng.uniform(-1.2, 0.5)
    step = float(10.0 ** rng.integers(-2, 2) * rng.choice([1, 2, 5]))
    still, level = int(rng.integers(30, 200)), rng.uniform(5, 300)
    e, u = rng.standard_normal((2, SAMPLES))
    e[:still] = u[:still] = 0.0
    b, x = rng.uniform(0.5, 2.0) * sigma, np.zeros(SAMPLES)
    for t in range(order, SAMPLES):
        x[t] = -a @ x[t - order : t][::-1] + b * u[t - 1] + sigma * e[t]
    return Recorded(np.round(x + level) * step, u[:, None], order, step, still, sigma)


class Measured(NamedTuple):
    """What came out of a record, from where it moves."""

    ratio: float  # root mean square error, over that of least squares
    outliers: float  # share of the samples told
    jumps: int
    inside: float  # share that the 95 % bars hold
    sigma: float  # over that of noise and rounding together


def measure(one: Recorded, memory=None) -> Measured:
    """Run a memory over a record."""
    est = dw.ARX(one.order, 1, offset=True, memory=memory or dw.AutoMemory())
    trace, plain = est.scan(one.y, one.u), dw.ARX(one.order, 1, offset=True).scan(one.y, one.u)
    e, was, status = (found[one.still :] for found in (trace.innovation, plain.innovation, trace.status))
    there = one.step * np.sqrt(one.sigma**2 + 1 / 12)
    return Measured(
        float(np.sqrt(np.mean(e**2) / np.mean(was**2))),
        float(np.mean(status & int(dw.Status.OUTLIER) != 0)),
        int(np.sum(status & int(dw.Status.JUMP) != 0)),
        float(np.mean(np.abs(e) < 1.96 * np.sqrt(trace.variance[one.still :]))),
        float(np.sqrt(est.sigma2(trace.state))) / there,
    )


def summary(seed: int, plants: int) -> str:
    """Return the table, by how loud the noise is."""
    drawn = [draw(seed, number) for number in range(plants)]
    found = [(one.sigma, measure(one)) for one in drawn]
    rows = []
    for low, high in [(0.0, np.inf), *pairwise(SIZES)]:
        some = [m for sigma, m in found if low <= sigma < high]
        rows.append(
            [
                "all" if low == 0.0 and high == np.inf else f"{low:g} to {high:g}",
                f"{len(some)}",
                f"{geometric([m.ratio for m in some]):.3f} / {max(m.ratio for m in some):.2f}",
                f"{mean([m.outliers for m in some]):.4f}",
                f"{mean([m.jumps for m in some]):.2f}",
                f"{mean([m.inside for m in some]):.3f}",
                f"{geometric([m.sigma for m in some]):.2g}",
            ]
        )
    return table(("noise, in steps", "plants", "ratio / worst", "outliers", "jumps", "bars hold", "sigma"), rows)


def main(arguments=None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--plants", type=int, default=40)
    asked = parser.parse_args(arguments)
    print(summary(asked.seed, asked.plants))


if __name__ == "__main__":
    main()
