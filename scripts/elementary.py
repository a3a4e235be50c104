"""What the elementary functions of the engine cost and how exact they are: prints a table.

    python scripts/elementary.py [DRAWS]

Error: the largest among so many arguments drawn as the tests draw them (20 000), in units of the last place. Cost:
nanoseconds of a call in a loop over arguments that a kernel has: translated to C, compiled by numba, and of the
function of the C library that numba takes.
"""

import math
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np

from driftwise.engine import elementary, jit

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "engine"))
from test_elementary import in_c, loop, worst

ORDINARY = {
    "log": (1e-3, 1e3), "log1p": (0.0, 10.0), "exp": (-10.0, 1.0), "expm1": (-3.0, 0.0), "erfc": (-4.0, 4.0),
    "lgamma": (1.0, 25.0), "sin": (-3.0, 3.0), "cos": (-3.0, 3.0), "hypot": (0.0, 10.0), "pow": (0.0, 1.0),
}  # fmt: skip
CALLS, REPEATS = 10_000, 50


def nanoseconds(run, table):
    """Return the least time of a call among many loops."""
    out, times = np.zeros(len(table)), []
    run(table, out)
    for _ in range(REPEATS):
        start = time.perf_counter()
        run(table, out)
        times.append(time.perf_counter() - start)
    return 1e9 * min(times) / len(table)


def main() -> None:
    """Print a line for each function."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    jit._bind()
    print(f"{'':8}{'error, ulp':>12}{'C, ns':>8}{'numba, ns':>12}{'C library, ns':>16}")
    for name, (low, high) in ORDINARY.items():
        table = np.random.default_rng(0).uniform(low, high, (CALLS, 2))
        with tempfile.TemporaryDirectory() as folder:
            ways = [
                in_c(name, Path(folder)),
                *(numba.njit(loop(name, m), **jit.OPTIONS) for m in (elementary, math)),
            ]
            c, ours, theirs = (nanoseconds(way, table) for way in ways)
        print(f"{name:8}{worst(name, draws, 3)[0]:12.2f}{c:8.1f}{ours:12.1f}{theirs:16.1f}", flush=True)


if __name__ == "__main__":
    main()
