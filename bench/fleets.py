"""A fleet of 100 000 series fed in batches: rate, steadiness, two threads, memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import driftwise as dw

from .memory import forget_peak, peak
from .verdicts import Verdict, at_least, at_most, for_information

SOURCE = "bench/fleets.py"
SERIES, BATCH, PLANTS, PAST = 100_000, 1 << 18, 1000, 200
KINDS = {
    "Joint(3)": (lambda: dw.Joint(3), 5.0),
    "ARX(2, 2), AutoMemory": (lambda: dw.ARX(2, 2, memory=dw.AutoMemory()), 1.0),
}


def verdicts(big: bool = False) -> Iterator[Verdict]:
    """Yield the budgets of fleets, over 24 batches (6 with `AutoMemory`), or over 1000 samples of each series."""
    for name, (make, budget) in KINDS.items():
        batches = SERIES * 1000 // BATCH if big else 24 if budget > 1 else 6
        yield from _rates(name, make(), budget, batches)
        yield _threads(name, make(), SERIES if budget > 1 else SERIES // 5)
        yield _memory(name)


class Feed:
    """Samples of plants that differ by their noise: a thousand, and again for further series."""

    def __init__(self, est, series: int, ticks: int):
        self.est, self.series, self.ticks = est, series, ticks
        plants, draw = min(series, PLANTS), np.random.default_rng(0)
        shape = PAST + ticks, plants
        self.y, self.u = np.zeros(shape), draw.standard_normal(shape)
        for t in range(2, PAST + ticks):
            e = 0.1 * draw.standard_normal(plants)
            self.y[t] = 1.5 * self.y[t - 1] - 0.7 * self.y[t - 2] + self.u[t - 1] + e

    def fleet(self, threads: int):
        """Return a fleet whose series have seen 200 samples each."""
        plants = self.y.shape[1]
        few, fleet = (
            dw.Fleet(self.est, range(plants), threads=1),
            dw.Fleet(self.est, range(self.series), threads=threads),
        )
        at = np.tile(np.arange(plants), PAST)
        few.advance(at, self.y[:PAST].reshape(-1, 1), self._inputs(self.u[:PAST]))
        fleet.states[:] = np.resize(few.states, self.series)
        return fleet

    def batches(self, size: int = BATCH, is_sorted: bool = False):
        """Yield row numbers, outputs and inputs of the samples in batches: in order of time, or of series."""
        for first in range(0, self.series * self.ticks, size):
            i = np.arange(first, min(first + size, self.series * self.ticks))
            t, at = (i % self.ticks, i // self.ticks) if is_sorted else (i // self.series, i % self.series)
            cell = PAST + t, at % self.y.shape[1]
            yield at, self.y[cell].reshape(-1, 1), self._inputs(self.u[cell])

    def _inputs(self, u):
        return u.reshape(-1, 1) if self.est.model.inputs else np.empty((u.size, 0))


def seconds_of(fleet, batches) -> list[float]:
    """Return the CPU seconds of each batch over its samples."""
    found = []
    for at, ys, us in batches:
        start = time.process_time()
        fleet.advance(at, ys, us)
        found.append((time.process_time() - start) / len(at))
    return found


def _rates(name: str, est, budget: float, batches: int) -> Iterator[Verdict]:
    """Yield updates per second of one core: a table in order of time, then one in order of series."""
    feed = Feed(est, SERIES, batches * BATCH // SERIES)
    for order in ("time", "series"):
        fleet = feed.fleet(1)
        seconds = seconds_of(fleet, feed.batches(is_sorted=order == "series"))
        rate, quarter = 1e-6 / float(np.median(seconds)), len(seconds) // 4
        first, last = 1e-6 / np.median(seconds[:quarter]), 1e-6 / np.median(seconds[-quarter:])
        note = (
            f"{feed.ticks} samples a series, after {PAST} before the clock; batches of {BATCH}; "
            f"first quarter {first:.2f}, last {last:.2f}"
        )
        what = f"fleet of {SERIES} {name}, table in order of {order}"
        if order == "time":
            yield at_least(what, rate, budget, "million/s a core", SOURCE, note)
        else:
            yield for_information(what, rate, "million/s a core", SOURCE, note)


def _threads(name: str, est, series: int, rounds: int = 20) -> Verdict:
    """Return the wall time of one thread over that of two, at their best."""
    feed = Feed(est, series, rounds)
    fleets, batches = [feed.fleet(count) for count in (1, 2)], feed.batches(feed.series)
    best = [np.inf, np.inf]
    for batch in batches:
        for i, fleet in enumerate(fleets):
            start = time.perf_counter()
            fleet.advance(*batch)
            best[i] = min(best[i], time.perf_counter() - start)
        time.sleep(0.05)  # spread out, so that some rounds find both cores idle
    note = f"best wall time of {rounds}; needs two idle cores (load average {os.getloadavg()[0]:.1f})"
    return at_least(f"fleet of {name}, two threads over one", best[0] / best[1], 1.7, "x", SOURCE, note)


def _memory(name: str) -> Verdict:
    """Return the peak memory of a fleet in a process of its own, beyond what Python and the code take."""
    command = [sys.executable, "-m", "bench.fleets", name]
    answer = subprocess.run(command, check=True, cwd=Path(__file__).parent.parent, stdout=subprocess.PIPE, text=True)
    told = json.loads(answer.stdout)
    value = told["peak"] / (2 * told["states"] + told["batch"])
    note = (
        f"peak {told['peak']:.0f} MB beyond the code; states {told['states']:.0f} MB, "
        f"a batch of {BATCH} with its results {told['batch']:.0f} MB"
    )
    return at_most(f"fleet of {SERIES} {name}, memory over twice the states and a batch", value, 1, "x", SOURCE, note)


def _run(name: str) -> None:
    """The measured process: three batches through a fleet."""
    est = KINDS[name][0]()
    feed, compiled = Feed(est, SERIES, 3), Feed(est, 8, 1)
    seconds_of(compiled.fleet(2), compiled.batches())
    batch = next(feed.batches())
    before = forget_peak()
    fleet = dw.Fleet(est, range(SERIES), threads=2)
    for _ in range(3):
        outs = fleet.advance(*batch)
    size, states = sum(array.nbytes for array in (*batch, outs)), fleet.states.nbytes
    print(json.dumps({"peak": (peak() - before) / 1e6, "states": states / 1e6, "batch": size / 1e6}))


if __name__ == "__main__":
    _run(sys.argv[1])
