"""How far from the machine's limit: operations counted, bytes moved, time measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import driftwise as dw

from .clock import alternate
from .counting import Work, work
from .fleets import Feed, seconds_of
from .lanes import Lanes, operations
from .peaks import Peaks, peaks
from .plant import VARIANCE
from .verdicts import Table, Verdict, not_measured

SOURCE = "bench/roofline.py"
LIMITS = ("sums and products", "the divider", "the chain", "memory")
SERIES, TICKS = "series after series", "tick after tick"
MACHINE, STEPS = "What one core can do", "What a sample asks for, and gets"
COLUMNS = (
    "estimator", "fed as", "operations", "divisions", "bytes", "ns", "GFLOP/s", "GB/s",
    "ns: sums, products", "ns: divider", "ns: chain", "ns: memory", "what binds", "measured over it",
)  # fmt: skip


class Point(NamedTuple):
    """One estimator, one way of feeding it: per sample of one series."""

    name: str
    way: str
    operations: float
    divisions: float
    moved: float  # bytes that must be read or written
    seconds: float
    limits: dict[str, float]  # seconds that each limit alone would take

    def row(self) -> tuple:
        """Return it as a row of the table."""
        binds = max(self.limits, key=self.limits.__getitem__)
        return (
            self.name, self.way, self.operations, self.divisions, self.moved, 1e9 * self.seconds,
            1e-9 * self.operations / self.seconds, 1e-9 * self.moved / self.seconds,
            *(1e9 * self.limits[name] if name in self.limits else None for name in LIMITS),
            binds, self.seconds / self.limits[binds],
        )  # fmt: skip


def limits(top: Peaks, asked: Work, moved: float) -> dict[str, float]:
    """Return the seconds that each part of the machine needs for a sample, if nothing else took time."""
    plain = asked.done.get("sum", 0.0) + asked.done.get("product", 0.0)
    divider = sum(asked.done.get(kind, 0.0) * seconds for kind, seconds in top.interval.items())
    return dict(zip(LIMITS, (plain / top.scalar, divider, asked.chain, moved / top.bandwidth["memory"])))


def verdicts(series: int = 100_000) -> Iterator[Table | Verdict]:
    """Yield the machine's limits, and estimators beside them."""
    try:
        top = peaks()
    except OSError as error:
        yield not_measured("the machine's limits", "no budget", SOURCE, str(error))
        return
    yield _machine(top)
    kinds = {
        "Joint(3)": dw.Joint(3),
        "Joint(3), input, direct": dw.Joint(3, inputs=1, direct=True),
        "ARX(2, 2)": dw.ARX(2, 2),
        "ARX(2, 2), AutoMemory": dw.ARX(2, 2, memory=dw.AutoMemory()),
    }
    points = [point for name, est in kinds.items() for point in _points(name, est, top, series)]
    in_c = _in_c(top)
    yield Table(STEPS, COLUMNS, [point.row() for point in (*points, in_c)], _words(points, in_c, top))


def _machine(top: Peaks) -> Table:
    ghz, ns = 1e-9, 1e9
    rows: list[tuple] = [
        ("sums and products, one number at a time", top.scalar * ghz, "GFLOP/s"),
        ("the same in vectors, fused", top.vector * ghz, "GFLOP/s"),
        *((f"a {kind}, until its result may be used", seconds * ns, "ns") for kind, seconds in top.latency.items()),
        *((f"a {kind}, until the next may begin", seconds * ns, "ns") for kind, seconds in top.interval.items()),
        ("one of eight divisions at once", top.lane * ns, "ns"),
        *((f"triad, arrays in {where}", rate * ghz, "GB/s") for where, rate in top.bandwidth.items()),
    ]
    return Table(MACHINE, ("limit", "measured", "unit"), rows, "`bench/peaks.c`, the best of three rounds.")


def _points(name: str, est, top: Peaks, series: int) -> Iterator[Point]:
    """Yield a record of one series, and a fleet that takes a sample of each in turn."""
    ticks = 3 if est.dtype.itemsize > 1000 else 12
    feed = Feed(est, series, ticks)
    samples = Feed(est, 1, 60)
    state = samples.fleet(1).states[0]
    _, ys, us = next(samples.batches())
    asked = work(est, ys, us, state, top.latency)
    one = 8.0 * (est.model.inputs + 1 + 4)  # a sample and what it showed
    moved = {SERIES: one, TICKS: one + 2.0 * est.dtype.itemsize}
    fleets = {
        SERIES: (Feed(est, 100, 1000).fleet(1), Feed(est, 100, 1000).batches(20_000, is_sorted=True)),
        TICKS: (feed.fleet(1), feed.batches(series)),
    }
    for way, (fleet, batches) in fleets.items():
        seconds = float(np.median(seconds_of(fleet, batches)))
        found = limits(top, asked, moved[way])
        yield Point(name, way, asked.operations, asked.done.get("division", 0.0), moved[way], seconds, found)


def _in_c(top: Peaks, samples: int = 500) -> Point:
    """Return C with eight series in the lanes of a vector: how near one can come."""
    est = dw.Joint(3, noise=dw.models.EquationError(VARIANCE))
    y = dw.simulate([-1.5, 0.9, -0.3], samples=samples, noise_std=0.1, seed=1)[0]
    run = Lanes(est, np.tile(y, (64, 1)), 8)
    seconds = float(np.median(alternate(run, rounds=15))) / (64 * samples)
    plain, divisions, moved = operations(3) - 6, 6.0, 8.0 * 4
    found = {
        "sums and products": plain / top.vector,
        "the divider": divisions * top.lane,
        "memory": moved / top.bandwidth["memory"],
    }
    return Point("lanes.c, n = 3", "eight series", plain + divisions, divisions, moved, seconds, found)


def _words(points: list[Point], in_c: Point, top: Peaks) -> str:
    """Return what the table says, in three sentences, and how to read it."""
    first = points[0]
    binds = max(first.limits, key=first.limits.__getitem__)
    memory = max(point.limits["memory"] / point.seconds for point in points)
    return WORDS.format(
        name=first.name, operations=first.operations, divisions=first.divisions, ns=1e9 * first.seconds, way=first.way,
        over=first.seconds / first.limits[binds], binds=binds, memory=100 * memory,
        vectors=top.vector / top.scalar,
        in_c=1e9 * in_c.seconds, here=SOURCE.rsplit("/", 1)[0],
    )  # fmt: skip


WORDS = """A sample of {name} asks for {operations:.0f} operations, {divisions:.0f} of them divisions, and takes
{ns:.0f} ns fed {way}: {over:.1f} times what {binds} alone would take. Moving states and samples would take at
most {memory:.0f} % of the measured time, even tick after tick in a fleet whose states lie outside the caches. Vector
units do {vectors:.0f} times as much as single numbers: C with eight series side by side takes {in_c:.1f} ns a sample.

Operations are those of the plain Python step as it is written, run on numbers that count (`{here}/counting.py`); what
the compiler saves is not known to it. The chain is the time from one state to the next if only operations that wait for
each other took time. Bytes are those that must move: samples, results, and, tick after tick, the state out and in.
The operations of `{here}/lanes.c` are counted by hand.

![Roofline](figures/roofline.svg)"""
