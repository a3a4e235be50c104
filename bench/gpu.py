"""Fleets on a GPU beside all threads of the processor: ``python -m bench.gpu``, where there is one (docs/gpu.md)."""

from __future__ import annotations

import os
import time

import numpy as np

import driftwise as dw

from .fleets import Feed

KINDS = {
    "Joint(3)": dw.Joint(3),
    "ARX(2, 2)": dw.ARX(2, 2),
    "ARX(2, 2), AutoMemory": dw.ARX(2, 2, memory=dw.AutoMemory()),
}
SIZES, TICKS, ROUNDS = (1000, 10_000, 100_000), 10, 5
HEAD = "| fleet | series | table in order of | GPU | of that, the loop | processor | processor / GPU |\n|" + "---|" * 7


class Watched:
    """A loop on a GPU whose last call's seconds are kept."""

    def __init__(self, loop):
        self.loop, self.seconds = loop, 0.0

    def __getitem__(self, shape):
        from numba import cuda

        def go(*arguments):
            cuda.synchronize()
            start = time.perf_counter()
            self.loop[shape](*arguments)
            cuda.synchronize()
            self.seconds = time.perf_counter() - start

        return go


def median_seconds(fleet, batch) -> float:
    """Return the median wall time of a batch, after one that is not counted."""
    fleet.advance(*batch)
    seconds = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        fleet.advance(*batch)
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds))


def main() -> None:
    from numba import cuda

    name = cuda.get_current_device().name
    print(f"{name.decode() if isinstance(name, bytes) else name}, {os.cpu_count()} threads of its processor")
    print("Nanoseconds a sample, whole call: grouped, sent, computed, fetched.\n\n" + HEAD)
    notes = []
    for what, est in KINDS.items():
        start = time.perf_counter()
        watch = Watched(dw.Fleet(est, device="cuda").crew.loop(4))
        ready = time.perf_counter() - start
        for series in SIZES:
            feed = Feed(est, series, TICKS)
            here, there = feed.fleet(os.cpu_count() or 1), dw.Fleet(est, range(series), device="cuda")
            there.states[:], there.crew.loop = here.states, lambda columns, watch=watch: watch
            for order in ("time", "series"):
                (batch,) = feed.batches(series * TICKS, is_sorted=order == "series")
                n = 1e9 / len(batch[0])
                gpu, processor = median_seconds(there, batch) * n, median_seconds(here, batch) * n
                loop = f"{watch.seconds * n:.2f}"
                print(
                    f"| `{what}` | {series} | {order} | {gpu:.1f} | {loop} | {processor:.1f} | {processor / gpu:.2f} |"
                )
        start = time.perf_counter()
        there.crew.fetch(there._rows)
        fetched = time.perf_counter() - start
        notes.append(
            f"{what}: {ready:.1f} s until the loop was there; {series} states fetched in {1e3 * fetched:.0f} ms"
        )
    print("", *notes, sep="\n")


if __name__ == "__main__":
    main()
