"""Columns that become louder, or quieter, and columns that do not: of how many that is said where each stands alone.

Run: python -m driftwise_studies.score.claims.rigs_louder [--records 8] [--seed 0]

"Louder": the columns of drawn benches and pumps whose noise a fault changes, while it lasts or growing all the while
(`rigs_bench`, `rigs_gradual`, `rigs_pump`); "white": one of four columns of white noise that is 1.3 to 2.5 times as
loud for three tenths of 1000 rows. "Steady": the columns of the same benches and pumps, of `rigs_together` (those whose
sensors are not louder for a while) and of `panels`, without a change. "Wanders": white noise of which the logarithm of
how loud it is forgets, or comes in bursts, or which is a share of a level that forgets.

"Told" counts columns that are louder at odds of 100:1, one of the columns of its table, which moves alone, being as
likely beforehand as none: where a fault is, at a beginning within sixty rows of its own. The odds are those of the
noise alone (`together_evidence`), so that a fault of several columns, or one that moves a level as well, is surer.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from driftwise.analysis.together import BLOCKS, NOISE, SURE, is_usable
from driftwise.analysis.together_evidence import STEADY, evidence, loudness, unstuck
from driftwise.analysis.together_noise import shapes_of
from driftwise.analysis.together_white import whitened

from . import panels, rigs_bench, rigs_gradual, rigs_pump, rigs_together
from .command import show
from .rigs_bench import NEAR, first_order

KINDS = LOUDER, WHITE, STILL, WANDERS = "louder", "white", "steady", "wanders"
ROWS, FIRST, LAST = 1000, 400, 700  # of white noise, and of what it does


class Heard(NamedTuple):
    """Columns of a table, those of them that become louder, and the row at which they do; None: none does."""

    columns: dict[str, np.ndarray]
    louder: set[str]
    first: int | None


def by_name(columns) -> dict[str, np.ndarray]:
    """Return columns (p, T) by their places."""
    return {str(j): x for j, x in enumerate(columns)}


def louder(seed: int, number: int) -> Iterator[Heard]:
    """Return benches and pumps with a fault that changes noises."""
    benches = [rigs_bench.drawn(seed, number, kind, True) for kind in (rigs_bench.NOISE, rigs_bench.BOTH)]
    for bench in (*benches, rigs_gradual.faulty(seed, number, rigs_gradual.GROWS)):
        yield Heard(by_name(bench.columns), {str(j) for j in np.flatnonzero(bench.factors != 1)}, bench.first)
    for kind, names in rigs_pump.LOUDER.items():
        pump = rigs_pump.drawn(seed, number, kind)
        yield Heard(pump.columns, {*names}, pump.first)


def white(seed: int, number: int) -> Iterator[Heard]:
    """Return white noise, of which one column is louder for a while."""
    rng = np.random.default_rng([seed, number, 61])
    x = rng.standard_normal((4, ROWS))
    x[0, FIRST:LAST] *= math.exp(rng.uniform(math.log(1.3), math.log(2.5)))
    yield Heard(by_name(x), {"0"}, FIRST)


def still(seed: int, number: int) -> Iterator[Heard]:
    """Return tables of which no column is louder."""
    yield Heard(by_name(rigs_bench.drawn(seed, number, rigs_bench.BOTH, False).columns), set(), None)
    yield Heard(rigs_pump.drawn(seed, number, rigs_pump.STEADY).columns, set(), None)
    for kind in rigs_together.KINDS[1:]:
        rig = rigs_together.drawn(seed, number, kind, False)
        yield Heard({str(j): x for j, x in enumerate(rig.columns) if rig.louder[j] < 0}, set(), None)
    yield Heard(by_name(panels.drawn(seed, number, panels.STEADY).columns), set(), None)


def wanders(seed: int, number: int) -> Iterator[Heard]:
    """Return noise that is now louder, now less."""
    rng = np.random.default_rng([seed, number, 67])
    slow = np.array([first_order(rng, ROWS, math.exp(-1 / (ROWS * rng.uniform(0.02, 0.2)))) for _ in range(8)])
    noise = rng.standard_normal((12, ROWS))
    bursts = np.zeros((4, ROWS))
    for one in bursts:
        for first in rng.integers(0, ROWS, int(rng.integers(5, 20))):
            one[first : first + int(rng.integers(5, 60))] += math.log(rng.uniform(1.5, 3))
    yield Heard(by_name(np.exp(rng.uniform(0.1, 0.7, (4, 1)) * slow[:4]) * noise[:4]), set(), None)
    yield Heard(by_name(np.exp(bursts) * noise[4:8]), set(), None)
    level = np.exp(0.4 * slow[4:])
    yield Heard(by_name(level * (20 + noise[8:])), set(), None)


DRAWN = dict(zip(KINDS, (louder, white, still, wanders)))


def odds(heard: Heard, name: str) -> float | None:
    """Return the log odds that a column is louder, or quieter, alone; None where it is not heard."""
    x = heard.columns[name]
    found = loudness(unstuck(x), BLOCKS) if len(x) >= 2 * BLOCKS and is_usable(x) else None
    if found is None:
        return None
    shapes, T = shapes_of(BLOCKS), len(x)
    by = evidence(whitened(found.blocks[:, None]), steady=STEADY, halves=found.halves).odds + shapes.chance
    if heard.first is not None:
        by = by[abs(shapes.dates[shapes.begin] * T / BLOCKS - heard.first) <= NEAR + T / BLOCKS]
    return float(np.logaddexp.reduce(by)) + NOISE - math.log(2 * len(heard.columns))


def table(seed: int, records: int, kinds=KINDS) -> str:
    """Return of how many columns it is said, as a table of Markdown."""
    rows = ["| columns | heard | told | median of the log odds | most |", "| --- " * 5 + "|"]
    for kind in kinds:
        seen, all_odds = Counter[str](), list[float]()
        for number in range(records):
            for heard in DRAWN[kind](seed, number):
                for name in heard.columns if heard.first is None else heard.louder:
                    by = odds(heard, name)
                    if by is not None:
                        all_odds.append(by)
                        seen["told"] += by > SURE
        middle, most = (f"{value:.1f}" for value in (np.median(all_odds), np.max(all_odds)))
        rows.append(f"| {kind} | {len(all_odds)} | {seen['told']} | {middle} | {most} |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 8)
