"""Changes at a date that the table marks, and marks at which nothing changed: what is told with the mark, and without.

Run: python -m driftwise_studies.score.claims.events [--records 40] [--seed 1]

Records are monthly counts that fall once (`falls`, the season known), plants of the claims without troubles but a gain
or a level that jumps by less than there (`weak`), records that wander (`wander`, all kinds in turn), in which nothing
comes at once, and benches of six to ten columns, with a fault and without (`rigs_bench`, all kinds in turn). "There": a
column steps at the change. "Elsewhere": it steps at some other sample; so it does where nothing changes. Told is what
is within `falls.NEAR` samples, or a hundredth of the record; of benches within `rigs_bench.NEAR`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from driftwise.analysis.segmentation import hindsight
from driftwise.analysis.together import together

from . import falls, rigs_bench, wander
from .command import show
from .drawing import draw
from .plant import Jump, Plant
from .seasonal_steps import YEAR
from .simulation import record

MARKS = "none", "there", "elsewhere"
COUNTS, WEAK, WANDERS = KINDS = "counts that fall", "plants", "what wanders"
EDGE = 0.05  # of a record, in which nothing is marked


@cache
def drawn(kind: str, seed: int, number: int) -> tuple:
    """Return y (T,), u (T, k), the seasons, and the samples of changes."""
    if kind == COUNTS:
        y, u, dates = falls.counts(seed, number, falls.ONCE)
        return y, u, (YEAR,), dates
    if kind == WANDERS:
        return *wander.wandering(seed, number, wander.KINDS[number % len(wander.KINDS)]), (), ()
    return weak(seed, number)


def weak(seed: int, number: int):
    """Return y (T,), u (T, k), no seasons, and the sample at which a level or a gain jumps by little."""
    plant, rng = draw(seed, number), np.random.default_rng([seed, number, 37])
    plant = Plant(number, frozenset(), *(getattr(plant, name) for name in wander.DYNAMICS))
    at = int(plant.samples * rng.uniform(0.2, 0.85))
    size = float(np.exp(rng.uniform(np.log(0.03), np.log(0.5)))) * rng.choice([-1.0, 1.0])
    jump = Jump("level", at, size) if number % 2 else Jump("gain", at, 1 + size, int(rng.integers(len(plant.gains))))
    data = record(replace(plant, jumps=(jump,)), seed)
    return data.y, data.u, (), (at,)


def marks(seed: int, number: int, where: str, T: int, dates) -> tuple[int, ...]:
    """Return the sample at which a column steps, () for none."""
    rng = np.random.default_rng([seed, number, 38])
    other = int(T * rng.uniform(EDGE, 1 - EDGE))
    return {"none": (), "there": tuple(dates[:1]), "elsewhere": (other,)}[where]


def rows(seed: int, records: int) -> Iterator[str]:
    """Yield the lines of the table."""
    for kind in KINDS:
        for where in MARKS if kind != WANDERS else ("none", "elsewhere"):
            changes = right = others = 0
            for number in range(records):
                y, u, seasons, dates = drawn(kind, seed, number)
                found = hindsight(y, u, seasons=seasons, events=marks(seed, number, where, len(y), dates))
                told = [jump.at for jump in found.jumps()] if found else []
                near = max(falls.NEAR, len(y) // 100)
                hits = sum(any(abs(one - at) <= near for one in told) for at in dates)
                changes, right, others = changes + len(dates), right + hits, others + len(told) - hits
            yield f"| {kind} | {records} | {where} | {changes} | {right} | {others} |"


def benches(seed: int, records: int) -> Iterator[str]:
    """Yield the lines of changes that columns have in common."""
    for is_faulty in (True, False):
        for where in MARKS if is_faulty else ("none", "elsewhere"):
            right = others = 0
            for number in range(records):
                kind = rigs_bench.KINDS[number % len(rigs_bench.KINDS)]
                bench = rigs_bench.drawn(seed, number, kind, is_faulty)
                done = marks(seed, number, where, bench.columns.shape[1], (bench.first,))
                found = together({str(j): x for j, x in enumerate(bench.columns)}, done)
                hit = is_faulty and any(abs(one.since - bench.first) <= rigs_bench.NEAR for one in found)
                right, others = right + hit, others + len(found) - hit
            what = "benches with a fault" if is_faulty else "steady benches"
            yield f"| {what} | {records} | {where} | {records * is_faulty} | {right} | {others} |"


def table(seed: int, records: int) -> str:
    """Return changes that are told, and others, as a table of Markdown."""
    head = "| records | of them | mark | changes | told | others |", "| --- " * 6 + "|"
    return "\n".join([*head, *rows(seed, records), *benches(seed, records)])


if __name__ == "__main__":
    show(table, __doc__, 40)
