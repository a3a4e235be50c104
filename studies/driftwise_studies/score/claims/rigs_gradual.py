"""Faults that take their time, on drawn benches: what is told of them, and what somebody could who knows all.

Run: python -m driftwise_studies.score.claims.rigs_gradual [--records 25] [--seed 0]

The benches of `rigs_bench`, steady, and what somebody does to them, or what wears, from .35 to .6 of the record on,
for a fifth to two fifths of it; it moves columns by half to twenty deviations of what is quick in them, and their noise
by a factor of 1.3 to 6. "By hand": a valve is closed within 10 to 90 rows, in one to six moves of unlike sizes, and
opened again the same way; one to four columns and the noise of up to two. "By hand, one": of one column alone. "Comes
and goes": it is there for two to five stretches. "Grows": the mean of up to two columns and the noise of one to three
grow all the while, along a line, ever faster or ever slower, and stop at once. "Drains": along a line to its end, and
back within the 10 to 200 rows in which it is filled. "Steady": the same benches without a fault.

"Who knows" is told every covariance, size and shape: all but the date; it tells what has odds of 20:1 against none.
Told is a fault of which a change begins within sixty rows of it; "elsewhere" counts faults of which changes are told,
none of them there; "in the interval" how many of the dates that are told are in theirs.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from driftwise.analysis.together import Together, together

from .command import show
from .rigs_bench import BOTH, NEAR, Bench, drawn, knows

KINDS = HAND, ALONE, GOES, GROWS, DRAINS = "by hand", "by hand, one", "comes and goes", "grows", "drains"
SIZES, FACTORS = (0.5, 20.0), (1.3, 6.0)


def moves(rng, lasts: int) -> np.ndarray:
    """Return what somebody does within some rows, from 0 to 1, in one to six moves, (lasts,)."""
    n = int(rng.integers(1, 7))
    begin = np.sort(rng.integers(0, lasts, n))
    begin[0] = 0
    within = np.maximum(np.diff([*begin, lasts]) * rng.uniform(0.1, 1, n), 1)
    share = rng.dirichlet(np.full(n, 2.0))
    return np.sum(share * np.clip((np.arange(lasts)[:, None] - begin + 1) / within, 0, 1), axis=1)


def pattern(rng, kind: str, length: int) -> np.ndarray:
    """Return what is there of a fault of a kind from its first row on, ending with nothing."""
    if kind in (HAND, ALONE):
        closed, opened = (moves(rng, int(rng.integers(10, 91))) for _ in range(2))
        return np.concatenate([closed, np.ones(max(length - len(closed), 0)), 1 - opened, [0.0]])
    there = np.arange(1, length + 1) / length
    if kind == GOES:
        edges = np.sort(rng.uniform(0, 1, 2 * int(rng.integers(2, 6)) - 2))
        return np.append(np.searchsorted(edges, there, "right") % 2 == 0, False).astype(float)
    if kind == GROWS:
        bend = rng.choice([0.0, 4.0, -4.0])
        return np.append(there if bend == 0 else np.expm1(bend * there) / math.expm1(bend), 0.0)
    return np.concatenate([there, np.linspace(1, 0, int(rng.integers(10, 200)))])


def faulty(seed: int, number: int, kind: str) -> Bench:
    """Return a bench with a fault of a kind."""
    bench = steady(seed, number)
    rng = np.random.default_rng([seed, number, KINDS.index(kind), 53])
    p, T = bench.columns.shape
    means, noisy = {
        HAND: (int(rng.integers(1, 5)), int(rng.integers(0, 3))), ALONE: (1, 0),
        GROWS: (int(rng.integers(0, 3)), int(rng.integers(1, 4))),
    }.get(kind, (int(rng.integers(1, 4)), int(rng.integers(0, 2))))  # fmt: skip
    quick = np.hypot(bench.white, np.where(bench.keeps < 0.95, bench.own, 0.0))
    by = np.exp(rng.uniform(math.log(SIZES[0]), math.log(SIZES[1]), p)) * rng.choice([-1, 1], p)
    sizes = quick * by * (rng.permutation(p) < means)
    factors = np.exp(rng.uniform(math.log(FACTORS[0]), math.log(FACTORS[1]), p) * (rng.permutation(p) < noisy))
    one = bench._replace(sizes=sizes, factors=factors, pattern=pattern(rng, kind, bench.length))
    moved = one.moved(np.arange(T) - bench.first)
    louder = bench.white[:, None] * np.sqrt(np.maximum(factors[:, None] ** (2 * moved) - 1, 0.0))
    x = bench.columns + sizes[:, None] * moved + louder * rng.standard_normal((p, T))
    levels = bench.columns[:, :1]
    return one._replace(columns=np.round((x - levels) / bench.units[:, None]) * bench.units[:, None] + levels)


def steady(seed: int, number: int) -> Bench:
    """Return a bench without a fault."""
    bench = drawn(seed, number, BOTH, False)
    T = bench.columns.shape[1]
    return bench._replace(length=min(bench.length, int(0.35 * T)))


def told(bench: Bench) -> list[Together]:
    """Return the changes that are told of a bench."""
    return together({f"{name} {j}": x for j, (name, x) in enumerate(zip(bench.sensors, bench.columns))})


def count(bench: Bench, seen: Counter) -> None:
    """Count what is told of a bench with a fault."""
    found = told(bench)
    near = [one for one in found if abs(one.since - bench.first) <= NEAR]
    seen["told"] += bool(near)
    seen["elsewhere"] += bool(found) and not near
    seen["dated"] += any(one.interval[0] <= bench.first <= one.interval[1] for one in near)
    seen["changes"] += len(found)


def table(seed: int, records: int, kinds=KINDS, is_known: bool = True) -> str:
    """Return what is told of each kind, as a table of Markdown."""
    rows = [
        "| fault | benches | told | in the interval | elsewhere | changes told | who knows |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind in kinds:
        seen = Counter[str]()
        for number in range(records):
            fault = faulty(seed, number, kind)
            count(fault, seen)
            if is_known:
                seen["known"] += knows(fault, fault)[1]
        rows.append(
            f"| {kind} | {records} | {seen['told']} | {seen['dated']} | {seen['elsewhere']} | {seen['changes']} "
            f"| {seen['known'] if is_known else ''} |"
        )
    found = [told(steady(seed, number)) for number in range(records)]
    rows.append(f"| steady | {records} | {sum(map(bool, found))} | | | {sum(map(len, found))} | |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 25)
