"""How cost grows: with the order, the record, the number of series, the batch, and the threads."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import alternate
from .counting import work
from .fleets import Feed, seconds_of
from .verdicts import Table, Verdict, at_most

SOURCE = "bench/scaling.py"
JOINTS, SAMPLES = range(1, 9), 10_000
ORDERS = (1, 2, 3, 4, 6, 8)  # of ARX(n, n): N = 2 n
LENGTHS = (1_000, 10_000, 100_000, 1_000_000)
SERIES = (100, 1_000, 10_000, 100_000, 1_000_000)
BATCHES = (1 << 10, 1 << 12, 1 << 14, 1 << 16, 1 << 18, 1 << 20)


def verdicts() -> Iterator[Table | Verdict]:
    """Yield a table of each."""
    yield _orders("Joint(n), no input", "n", {n: dw.Joint(n) for n in JOINTS})
    yield _orders("ARX(n, n)", "n", {n: dw.ARX(n, n) for n in ORDERS})
    yield from _lengths()
    yield _series()
    yield _batches()
    yield _threads()


def _orders(what: str, letter: str, kinds: dict[int, object]) -> Table:
    """Return the cost of a sample of each order, and the exponent with which it grows."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=SAMPLES, noise_std=0.1, seed=1)
    runs = [lambda est=est: est.scan(y, u if est.model.inputs else None, keep="innovations") for est in kinds.values()]
    nanoseconds = np.median(alternate(*runs, rounds=7), axis=0) / SAMPLES * 1e9
    unknowns = np.array([est.model.N for est in kinds.values()])
    operations = np.array([_operations(est, y[:60], u[:60]) for est in kinds.values()])
    half = slice(len(unknowns) // 2, None)
    slope, steep = (np.polyfit(np.log(unknowns[half]), np.log(x[half]), 1)[0] for x in (nanoseconds, operations))
    rows = [(n, int(N), int(c), float(t)) for n, N, c, t in zip(kinds, unknowns, operations, nanoseconds)]
    text = (
        f"A record of {SAMPLES} samples, the general loop. Over the larger half, time grows like N to the {slope:.2f}, "
        f"operations like N to the {steep:.2f}: at these sizes much of a sample's time is the same for all."
    )
    return Table(f"Order: {what}", (letter, "N", "operations", "ns a sample"), rows, text)


def _operations(est, y, u) -> float:
    us = u.reshape(-1, 1) if est.model.inputs else np.empty((len(y), 0))
    state = est.scan(y[:40], us[:40] if est.model.inputs else None).state
    return work(est, y[40:, None], us[40:], state, {}).operations


def _lengths() -> Iterator[Table | Verdict]:
    """Yield the cost of a sample in records of different length; it must not grow."""
    kinds = {"Joint(3)": dw.Joint(3), "ARX(2, 2)": dw.ARX(2, 2)}
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=LENGTHS[-1], noise_std=0.1, seed=1)
    rows = []
    for length in LENGTHS:
        runs = [
            lambda est=est, many=max(1, 10_000 // length): [
                est.scan(y[:length], u[:length] if est.model.inputs else None, keep="innovations") for _ in range(many)
            ]
            for est in kinds.values()
        ]
        rounds = 7 if length < 1_000_000 else 3
        seconds = np.median(alternate(*runs, rounds=rounds), axis=0) / max(length, 10_000)
        rows.append((length, *(float(1e9 * s) for s in seconds)))
    yield Table("Length of the record: ns a sample", ("samples", *kinds), rows)
    worst = max(rows[-1][c] / rows[1][c] for c in (1, 2))
    yield at_most("a sample in a record of 1e6 over one in 1e4", worst, 1.25, "x", SOURCE)


def _series() -> Table:
    """Return the cost of a tick of fleets of different size, whose states leave one cache after the other."""
    kinds = {"Joint(3)": dw.Joint(3), "ARX(2, 2)": dw.ARX(2, 2)}
    rows = []
    for series in SERIES:
        row: list = [series]
        for est in kinds.values():
            feed = Feed(est, series, max(3, min(200, 500_000 // series)))
            seconds = seconds_of(feed.fleet(1), feed.batches(max(series, 1_000)))
            row += [float(1e9 * np.median(seconds)), series * est.dtype.itemsize / 1e6]
        rows.append(tuple(row))
    columns = tuple(c for name in kinds for c in (f"{name}, ns", "MB of states"))
    text = (
        "In order of time, a sample of each series in a batch (ten where there are 100): every state comes from afar."
    )
    return Table("Number of series", ("series", *columns), rows, text)


def _batches(series: int = 100_000) -> Table:
    """Return the cost of a sample in batches of different size."""
    est = dw.Joint(3)
    feed = Feed(est, series, 8)
    rows = []
    for size in BATCHES:
        nanoseconds = [
            1e9 * float(np.median(seconds_of(feed.fleet(1), feed.batches(size, by)))) for by in (False, True)
        ]
        rows.append((size, *nanoseconds))
    text = f"{series} series of Joint(3), `Fleet.advance`."
    return Table("Size of the batch: ns a sample", ("rows", "in order of time", "in order of series"), rows, text)


def _threads(rounds: int = 10) -> Table:
    """Return the wall time of a batch shared by threads, at its best."""
    kinds = {
        "Joint(3)": (dw.Joint(3), 100_000),
        "ARX(2, 2), AutoMemory": (dw.ARX(2, 2, memory=dw.AutoMemory()), 20_000),
    }
    counts = sorted({1, 2, os.cpu_count() or 1})
    best = np.full((len(counts), len(kinds)), np.inf)
    for column, (est, series) in enumerate(kinds.values()):
        feed = Feed(est, series, rounds)
        fleets = [feed.fleet(count) for count in counts]
        for batch in feed.batches(series):
            for row, fleet in enumerate(fleets):
                start = time.perf_counter()
                fleet.advance(*batch)
                best[row, column] = min(best[row, column], (time.perf_counter() - start) / series)
    rows = [
        (count, *(float(x) for pair in zip(1e-6 / best[i], best[0] / best[i]) for x in pair))
        for i, count in enumerate(counts)
    ]
    columns = tuple(c for name in kinds for c in (f"{name}, million/s", "times one"))
    text = (
        f"Wall time, best of {rounds} rounds; load average {os.getloadavg()[0]:.1f}: read it on an idle machine only."
    )
    return Table("Threads", ("threads", *columns), rows, text)
