"""Output, inputs and clock of drawn tables, as the program finds them.

``python -m driftwise_studies.score.claims.columns --seed 1``.
Plants of order one and two behind one to three inputs (switches, noise of some memory, steps) are drawn, written by
`tables.write_table` and recognised; what comes out is counted against the truth.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from driftwise.analysis.directions import settled
from driftwise.engine.errors import InputError
from driftwise.tables.table import open_table

from .tables import Written, write_table


def drawn(rng: np.random.Generator):
    """Return (y (T,), u (T, k)) of a plant that is drawn; some of them measure noise as well."""
    T, k = int(rng.integers(300, 1500)), int(rng.integers(1, 4))
    u = np.column_stack([_input(T, rng) for _ in range(k)])
    poles = rng.uniform(0.3, 0.95, int(rng.integers(1, 3)))
    x = np.zeros(T)
    delay = int(rng.integers(1, 4))
    for j in range(k):
        x[delay:] += rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 2.0) * u[:-delay, j]
    for pole in poles:
        for t in range(1, T):
            x[t] = pole * x[t - 1] + (1 - pole) * x[t]
    return x + 0.1 * rng.uniform() * x.std() * rng.normal(size=T), u


def _input(T: int, rng) -> np.ndarray:
    what = rng.integers(4)
    if what == 0:
        return np.repeat(rng.integers(0, 2, T), rng.integers(3, 20))[:T].astype(float)
    if what == 1:
        return np.repeat(rng.normal(size=T), rng.integers(5, 30))[:T]
    memory, noise = rng.uniform(0.0, 0.95), rng.normal(size=T)
    for t in range(1, T):
        noise[t] += memory * noise[t - 1]
    return noise


def judged(truth: Written) -> dict[str, bool]:
    """Return what was right of the recognition of one file; ``asked`` or ``refused`` where nothing was taken."""
    try:
        found = settled(open_table(truth.path))
    except InputError:
        return {"refused": True}
    clock = found.time in truth.clocks if truth.clocks else found.time is None
    if truth.clocks and (found.timed or truth.way != "plain t"):
        clock &= abs(found.dt - truth.dt) < 0.05 * truth.dt
    rows = {"clock": bool(clock)}
    if found.is_ambiguous:
        return rows | {"asked": True}
    return rows | {"output": found.output in truth.outputs, "inputs": set(found.inputs) == set(truth.inputs)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--files", type=int, default=200)
    parser.add_argument("--wrong", action="store_true", help="say which files were wrong, and how they are written")
    options = parser.parse_args()
    counts: dict[bool, Counter] = {True: Counter(), False: Counter()}
    with tempfile.TemporaryDirectory() as folder:
        for i in range(options.files):
            rng = np.random.default_rng((options.seed, i))
            y, u = drawn(rng)
            truth = write_table(Path(folder) / f"{i}.csv", y, u, rng)
            found = judged(truth)
            count = counts[truth.knows_output]
            count["files"] += 1
            count.update(name for name, is_right in found.items() if is_right)
            count["all"] += all(found.get(part, False) for part in ("output", "inputs", "clock"))
            if options.wrong and not all(found.get(p) for p in ("output", "inputs", "clock")):
                print(
                    i, truth.kind, "|", truth.way, "|", truth.outputs, truth.inputs, truth.clocks, truth.beside, found
                )
    for knows, count in counts.items():
        parts = ("output", "inputs", "clock", "all", "asked", "refused")
        shown = ", ".join(f"{part} {count[part]}" for part in parts)
        print(f"{'knowable' if knows else 'names say nothing'}: {count['files']} files; {shown}")


if __name__ == "__main__":
    main()
