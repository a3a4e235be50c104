"""How much of a loop can be named at all: the test of `validate` beside those of who is told all of it but its gain.

    python scripts/feedback_bound.py [draws [first seed [longest delay]]]

The loops are those of `identify_families.py`. Told are the plant, so that the noise of y is known sample by sample, the
order and the correlation of the excitation, and that the controller takes a share of y one sample ago: one number is
open, its gain. Whether it is none is asked by the t test of one regression of u(t), at the level of `validate`. To one
the response of y to the input is part of the input's own past: an input that nobody steers may have any law, with
echoes of itself as late as the plant's. To the other the excitation has no law but the one told, so that the response
counts as well as the noise: no recording says that.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from identify_families import FAMILIES, Draw, draw, names_feedback
from scipy.stats import t as student

from driftwise.analysis.forecast_verdicts import LEVEL
from driftwise.analysis.residual_tests import feedback

EDGES = 0.0, 1e-12, 1e-3, 3e-3, 1e-2, 2.0  # of the input's variance, that comes of the noise
CLEAR = 0.01  # share from which a loop is more than hardly another input


class Loop(NamedTuple):
    """The share of an input's variance that comes of the noise, and who names it."""

    fed_back: float
    correlated: bool
    named: bool
    plant_told: bool
    law_told: bool


def correlated(d: Draw) -> bool:
    """Say whether the correlation of what is new in the input with the past of the output names a loop."""
    (back,) = feedback(d.y[: d.samples], d.u[: d.samples, None], LEVEL, [True])
    return bool(back.largest > back.limit)


def named_if_told(d: Draw, has_law: bool) -> bool:
    """Say whether who is told all but the gain of the controller names it; of the excitation its law, or its order."""
    T, v = d.samples, d.noise[: d.samples]
    u, x = d.u[:T], d.y[:T] - v

    def new(z):
        return z[1:-1] - d.rho * z[:-2]

    parts = [new(x + v)] if has_law else [new(x), new(v)]
    X = np.column_stack([np.ones(T - 2), u[1:-1], *parts])
    size = np.sqrt(np.sum(X * X, axis=0))
    Q = np.linalg.qr(X / size)[0]  # the last column: what the noise tells beyond the others
    theta = Q.T @ u[2:]
    left = u[2:] - Q @ theta
    statistic = abs(theta[-1]) / np.sqrt(left @ left / (T - 2 - X.shape[1]))
    return bool(2 * student.sf(statistic, T - 2 - X.shape[1]) < 1 - LEVEL)


def loops(draws: int, first: int, longest: int) -> list[Loop]:
    """Return what becomes of the draws of some seeds that have an input; every other one is steered."""
    found = []
    for seed in range(first, first + draws):
        family = FAMILIES[seed % len(FAMILIES)]
        if family != "AR":
            d = draw(family, np.random.default_rng(seed), longest, seed // len(FAMILIES) % 2 == 1)
            told = (named_if_told(d, has_law) for has_law in (False, True))
            found.append(Loop(d.fed_back, correlated(d), names_feedback(d), *told))
    return found


def row(what: str, some: list[Loop]) -> str:
    """Return a row of the table."""
    n = max(len(some), 1)
    counts = (sum(getattr(one, who) for one in some) for who in Loop._fields[1:])
    return f"| {what} | {len(some)} | {' | '.join(f'{count} ({count / n:.2f})' for count in counts)} |"


def main(draws: int = 720, first: int = 20000, longest: int = 40) -> None:
    """Print the table."""
    found = loops(draws, first, longest)
    who = "by correlation", "named", "plant told", "law of the excitation, too"
    print(f"| of the input's variance, by the noise | draws | {' | '.join(who)} |\n|---|---|---|---|---|---|")
    for low, high in pairwise(EDGES):
        what = f"{100 * low:.1g} to {min(100 * high, 100):.3g} %" if low else "no loop"
        print(row(what, [one for one in found if low <= one.fed_back < high]))
    print(row("less than 1 %, all", [one for one in found if 0 < one.fed_back < CLEAR]))
    print(row("all loops", [one for one in found if one.fed_back > 0]))


if __name__ == "__main__":
    main(*(int(value) for value in sys.argv[1:]))
