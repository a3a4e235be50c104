"""The fleets of the former engine, eight lanes of numba's, out of this repository's history, in their own process."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import tempfile
from io import BytesIO
from pathlib import Path

import numpy as np

COMMIT = "0d4e3266cd3db3c4f95393f672441d5d2630cf86"  # the last one whose fleets numba compiled
RUN = """
import sys, time
import numpy as np
import driftwise as dw

data = np.load(sys.argv[1])
est, at, ys, us = eval(sys.argv[2]), data["at"], data["ys"], data["us"]
fleet = dw.Fleet(est, range(int(at[-1]) + 1), threads=1, lanes=True)
fresh = fleet.states.copy()
np.save(sys.argv[3], fleet.advance(at, ys, us))
print("ready", flush=True)
for line in sys.stdin:
    fleet.states[:] = fresh
    start = time.process_time()
    fleet.advance(at, ys, us)
    print(time.process_time() - start, flush=True)
"""


class Former:
    """A fleet of the former engine that takes the same samples whenever it is called; OSError where there is none."""

    def __init__(self, estimator: str, at, ys, us):
        self.folder = tempfile.TemporaryDirectory(prefix="driftwise-bench-")
        place = Path(self.folder.name)
        git = ["git", "-C", str(Path(__file__).parents[1]), "archive", f"{COMMIT}:src"]
        found = subprocess.run(git, capture_output=True, check=False)
        if found.returncode:
            raise OSError(f"no commit {COMMIT[:7]} here, which holds the former engine")
        tarfile.open(fileobj=BytesIO(found.stdout)).extractall(place, filter="data")
        np.savez(place / "data.npz", at=at, ys=ys, us=us)
        words = [str(place / "data.npz"), estimator, str(place / "answer.npy")]
        self.process = subprocess.Popen(
            [sys.executable, "-c", RUN, *words], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env={"PYTHONPATH": str(place), "NUMBA_CACHE_DIR": str(place / "numba"), "PATH": "/usr/bin:/bin"},
        )  # fmt: skip
        if self._line() != "ready":
            raise OSError("the former engine does not run here: is numba installed?")
        self.answer = np.load(place / "answer.npy")

    def __call__(self) -> float:
        """Take all samples from fresh states; return the CPU seconds of that."""
        assert self.process.stdin is not None
        self.process.stdin.write("go\n")
        self.process.stdin.flush()
        return float(self._line())

    def close(self) -> None:
        """End the process."""
        self.process.communicate()
        self.folder.cleanup()

    def _line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()
