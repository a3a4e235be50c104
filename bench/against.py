"""Today's package beside that of a former commit of this repository: the same calls in turn, CPU time.

    python -m bench.against 93280d87 [WORD ..]     # only calls that have one of the words in their name
    python -m bench.against 93280d87..a8b282a0     # the package of the second commit instead of today's

Each package runs in a process of its own; what follows is from medians of pairs. Exit code: how many calls take longer
by more than a tenth for the same work: of a call that does more than it did, a row says which one is of the same.
93280d87 is the last commit before the package got its floors (docs/decisions/house.md).
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tarfile
import tempfile
import time
from io import BytesIO
from pathlib import Path

import numpy as np

HERE = Path(__file__).parents[1]
ROUNDS, SHORT, SLOWER = 11, 0.05, 1.1  # SHORT: seconds that a round of many calls takes at least


def serve() -> None:
    """Answer each line, the name of a call, with the CPU seconds of one, those of its processes included."""
    from .common_calls import calls

    make, name, call, times = calls(), "", None, 1
    _like_large_fleets()
    for line in sys.stdin:
        try:
            if name != line.strip():
                name, call = line.strip(), make[line.strip()]()
                call()
                _settle()
                call()
                times = 1 + int(SHORT / max(_taken(call), 1e-6))
            assert call
            print(json.dumps(_taken(call, times)), flush=True)
        except Exception as error:
            print(json.dumps(f"{type(error).__name__}: {error}"[:150]), flush=True)


def _taken(call, times: int = 1) -> float:
    """Return the CPU seconds of a call, mean of several."""
    begun = _used()
    for _ in range(times):
        call()
    return (_used() - begun) / times


def _used() -> float:
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + ended.ru_utime + ended.ru_stime


def _like_large_fleets() -> None:
    from driftwise.fleet import crew

    crew.FEW = 0  # type: ignore[attr-defined]  # fleets are measured with the loop that large ones have


def _settle() -> None:
    """Wait for what an optimising compiler makes in the background, where the package has one."""
    try:
        from driftwise.engine import objects
    except ImportError:
        return
    objects.wait()


class Package:
    """A process that makes the calls with the package in a folder."""

    def __init__(self, source: Path, room: Path):
        here = {"PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "", "OPENBLAS_NUM_THREADS": "1"}
        here |= {"NUMBA_CACHE_DIR": str(room / "numba"), "PYTHONPYCACHEPREFIX": str(room / "pyc")}
        here |= dict.fromkeys(("MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_"), "1000000000")  # pages are kept
        self.process = subprocess.Popen(
            [sys.executable, "-c", "from bench.against import serve; serve()"], cwd=HERE, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ | here,
        )  # fmt: skip

    def __call__(self, name: str) -> float | str:
        """Return the CPU seconds of a call, or what went wrong."""
        assert self.process.stdin is not None and self.process.stdout is not None
        print(name, file=self.process.stdin, flush=True)
        return json.loads(self.process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def unpacked(commit: str, folder: Path) -> Path:
    """Write the package of a commit below a folder; return where."""
    packed = subprocess.run(["git", "-C", str(HERE), "archive", f"{commit}:src"], capture_output=True, check=True)
    tarfile.open(fileobj=BytesIO(packed.stdout)).extractall(folder / commit, filter="data")
    return folder / commit


def main(commits: str, *words: str) -> int:
    """Print both times of each call and their ratio; return how many are slower by a tenth."""
    from .common_calls import MORE, calls

    slower = 0
    commit, _, other = commits.partition("..")
    with tempfile.TemporaryDirectory(prefix="driftwise-bench-") as name:
        folder = Path(name)
        ours = unpacked(other, folder) if other else HERE / "src"
        pair = Package(ours, folder), Package(unpacked(commit, folder), folder)
        for name in calls():
            if words and not any(word in name for word in words):
                continue
            first = [package(name) for package in pair]
            if any(isinstance(told, str) for told in first):
                print(f"{name:48} not compared: {first}", flush=True)
                continue
            rounds = ROUNDS if sum(map(float, first)) < 2 else 5
            seconds = np.array([[package(name) for package in pair] for _ in range(rounds)])
            ratio, (now, then) = np.median(seconds[:, 0] / seconds[:, 1]), 1e3 * np.median(seconds, axis=0)
            mark = "" if ratio <= SLOWER else f"  does more; the same: {MORE[name]}" if name in MORE else "  slower"
            slower += mark == "  slower"
            print(f"{name:48} {now:10.3f} ms, was {then:10.3f} ms: {ratio:6.3f}{mark}", flush=True)
    print(f"\n{slower} slower than {commit} by more than a tenth, for the same work")
    return slower


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
