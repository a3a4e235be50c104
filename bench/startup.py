"""From the shell: import, help, first estimate."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .verdicts import Verdict, at_most, not_measured

SOURCE = "bench/startup.py"
FIRST = """
import numpy as np, driftwise as dw
y = np.sin(np.arange(100.0))
est = dw.Joint(2)
state, step = est.update(est.start(), y[0])
trace = est.scan(y)
"""
OTHERS = {
    "first smooth": "est.smooth(y)",
    "first estimate of two outputs": "dw.JointMIMO((1, 1)).scan(np.column_stack([y, y + np.cos(np.arange(100.0))]))",
    "first fleet": "dw.Fleet(dw.Joint(2)).scan(np.arange(100) % 10, y)",
    "first estimate in continuous time": "dw.ContinuousJoint(2).scan(y)",
}  # each after FIRST in the same cache
START = "import numpy as np, driftwise as dw; y, est = np.sin(np.arange(100.0)), dw.Joint(2); "


def verdicts() -> Iterator[Verdict]:
    """Yield the budgets of a process's life; wall time with the interpreter's own start in it."""
    python = [sys.executable]
    yield at_most("import driftwise", _wall([*python, "-c", "import driftwise"]), 0.15, "s", SOURCE)
    command = Path(sys.executable).with_name("driftwise")
    if command.exists():
        yield at_most("driftwise --help", _wall([str(command), "--help"]), 0.3, "s", SOURCE)
    else:
        yield not_measured("driftwise --help", "<= 0.3 s", SOURCE, "the command is not installed")
    with tempfile.TemporaryDirectory() as cache:
        first = [*python, "-c", FIRST]
        cold = _wall(first, 1, cache, warm=False)
        yield at_most("first estimate ever, empty cache", cold, 3, "s", SOURCE)
        yield at_most("first estimate, warm cache", _wall(first, 5, cache), 0.6, "s", SOURCE)
        for name, code in OTHERS.items():
            command = [*python, "-c", START + code]
            cold = _wall(command, 1, cache, warm=False)
            yield at_most(f"{name} ever", cold, 3, "s", SOURCE, "only Joint's own loop was compiled before")
            yield at_most(f"{name}, warm cache", _wall(command, 5, cache), 0.6, "s", SOURCE)


def _wall(command: list[str], times: int = 5, cache: str | None = None, warm: bool = True) -> float:
    """Return the median wall time of a command, run once before unless it is to be found cold."""
    environment = {**os.environ, **({"DRIFTWISE_CACHE": cache} if cache else {})}

    def run() -> float:
        start = time.perf_counter()
        subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
        return time.perf_counter() - start

    if warm:
        run()
    return float(np.median([run() for _ in range(times)]))
