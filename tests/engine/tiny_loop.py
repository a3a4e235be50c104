"""A loop of three lines, and what a process that uses it tells: ``tiny_loop.py [wait]`` prints JSON."""

import json
import sys
import warnings

import numpy as np

from driftwise.engine import compile, objects


def total(rows, scale):
    s = 0.1
    for i in range(rows.shape[0]):
        s += rows[i] * scale / 3.0
    rows[0] = s
    return rows.shape[0]


def other(rows, scale):
    rows[0] = scale - rows[0]
    return rows.shape[0]


def outcome(loop) -> list[str]:
    rows = np.arange(10.0)
    return [str(loop(rows, 0.7)), rows[0].hex()]


def tell(wait: bool) -> dict:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        loops = [compile.function(loop, 1, float) for loop in (total, other)]
        first = [outcome(loop) for loop in loops]
        began = [[entry.origin, entry.path.name.split(".")[1]] for entry in objects.loaded.values()]
        if wait:
            objects._queue.join()
    return {
        "results": first,
        "again": [outcome(loop) for loop in loops],
        "began": began,
        "ended": [entry.path.name.split(".")[1] for entry in objects.loaded.values()],
        "warnings": [str(one.message) for one in caught],
    }


if __name__ == "__main__":
    print(json.dumps(tell("wait" in sys.argv)))
