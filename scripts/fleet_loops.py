"""What the loops of a fleet cost: sizes as data, sizes compiled in, eight series side by side (docs/decisions).

    python scripts/fleet_loops.py

CPU time, medians of nine rounds, the loops alternating in one process; 2000 series of 200 samples, one after the other.
"""

from __future__ import annotations

import time

import numpy as np

import driftwise as dw

SERIES, SAMPLES, ROUNDS = 2000, 200, 9
KINDS = (dw.Joint(3), dw.Joint(1, 1), dw.ARX(2, 2))


def medians(*calls) -> np.ndarray:
    """Return the median CPU time of each call, in nanoseconds a sample."""
    found = []
    for _ in range(ROUNDS):
        times = [time.process_time()]
        for call in calls:
            call()
            times.append(time.process_time())
        found.append(np.diff(times))
    return np.median(found, axis=0) / (SERIES * SAMPLES) * 1e9


def loops() -> None:
    """Print the three loops of each kind, and what a gap in one sample of a hundred does to the third."""
    print("| ns a sample | sizes as data | compiled in | side by side | 1 % missing: one by one | side by side |")
    print("|---|---|---|---|---|---|")
    draw = np.random.default_rng(0)
    for est in KINDS:
        y = draw.standard_normal((SERIES, SAMPLES, 1))
        u = draw.standard_normal((SERIES, SAMPLES, est.model.inputs))
        gappy = np.where(draw.random(y.shape) < 0.01, np.nan, y).reshape(-1, 1)
        at, flat = np.repeat(np.arange(SERIES), SAMPLES), (y.reshape(-1, 1), u.reshape(len(y) * SAMPLES, -1))
        rows, outs = est.start(SERIES).view(float).reshape(SERIES, -1), np.empty((SERIES, SAMPLES, 4))
        single, wide = (dw.Fleet(est, range(SERIES), threads=1, lanes=lanes) for lanes in (False, True))
        calls = [lambda: est.drive(rows, y, u, outs, est.spec, est.scratch())]
        for data in (flat[0], gappy):
            calls += [lambda fleet=fleet, data=data: fleet.advance(at, data, flat[1]) for fleet in (single, wide)]
        medians(*calls)
        print(f"| `{est!r}` | " + " | ".join(f"{ns:.0f}" for ns in medians(*calls)) + " |", flush=True)


def orders() -> None:
    """Print what a table's order costs, and what of it one thread has to do alone before two can share the rest."""
    print("\n| `Joint(order=3)`, 100 000 series, batches of 2^18 rows: ns a sample | one thread | of two, alone |")
    print("|---|---|---|")
    draw, series, size = np.random.default_rng(0), 100_000, 1 << 18
    y, u = draw.standard_normal((size, 1)), np.empty((size, 0))
    one, two = (dw.Fleet(dw.Joint(3), range(series), threads=threads, lanes=False) for threads in (1, 2))
    tables = {
        "by series": np.arange(size) // 100,
        "by time": np.arange(size) % series,
        "mixed": draw.integers(0, series, size),
    }
    for name, at in tables.items():
        found = []
        for _ in range(ROUNDS):
            start = time.process_time()
            one.advance(at, y, u)
            whole = time.process_time() - start
            start = time.thread_time()
            two.advance(at, y, u)
            found.append((whole, 2.0 * (time.thread_time() - start) - whole))  # this thread takes its half, too
        ns = np.median(found, axis=0) / size * 1e9
        print(f"| {name} | {ns[0]:.0f} | {ns[1]:.1f} |", flush=True)


if __name__ == "__main__":
    loops()
    orders()
