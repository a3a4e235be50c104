"""Kill a run of a fleet again and again (SIGKILL, at random moments), go on, and compare with one left alone.

    python scripts/fleet_kill.py --kills 50

Every trial has a folder of its own in which a run is killed up to ``--most`` times, then finished; then all files of
the folder are compared, byte for byte. Checkpoints are at every batch, so that most kills meet a file being written.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from hashlib import sha256
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.fleet.fleet_run import run_fleet
from driftwise.fleet.job import FleetJob


def make(path, rows: int, series: int, seed: int) -> None:
    """Write a long table: series of unequal length, gaps, jumps, late rows, text keys."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rng = np.random.default_rng(seed)
    key = (series * rng.random(rows) ** 2).astype(int)
    time = np.arange(rows, dtype=float)
    late = rng.random(rows) < 0.01
    time[late] -= 5 * series
    u = rng.standard_normal(rows)
    y = 20.0 + 0.1 * key + u + 0.1 * rng.standard_normal(rows) + np.where(time > rows / 2, 3 * u, 0.0)
    y[rng.random(rows) < 0.02] = np.nan
    columns = {"asset": [f"pump {k}" for k in key], "time": time, "flow": y, "speed": u}
    pq.write_table(pa.table(columns), path)


def order(data, out, rows: int, **more) -> FleetJob:
    """Return what is run."""
    est = dw.ARX(1, 1)
    names = dict(by="asset", output="flow", inputs=("speed",), time="time")
    return FleetJob(data, estimator=est, out=out, **names, every=7, batch=rows // 40, batches=1, threads=1, **more)


def contents(out) -> dict[str, str]:
    """Return the SHA-256 of every file in a folder, hidden ones too."""
    files = [path for path in Path(out).rglob("*") if path.is_file()]
    return {str(path.relative_to(out)): sha256(path.read_bytes()).hexdigest() for path in files}


def begin(order) -> int:
    """Start a run in a process of its own, go on where there is something; return its number."""
    number = os.fork()
    if number:
        return number
    try:
        run_fleet(order)
        os._exit(0)
    except BaseException as error:
        print(f"a run failed: {type(error).__name__}: {error}", file=sys.stderr)
        os._exit(1)


def left(out) -> str:
    """Return in a word where a killed run was."""
    out = Path(out)
    if any(path.name.endswith(".writing") for path in out.rglob(".*")):
        return "a file half written"
    if not (out / "fleet.parquet").exists():
        return "before the first file"
    return "between files"


def main() -> int:
    """Run the trials; return 0 where all came to the same."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kills", type=int, default=50)
    options.add_argument("--most", type=int, default=1, help="kills in a trial")
    options.add_argument("--rows", type=int, default=200_000)
    options.add_argument("--series", type=int, default=200)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    rng, met, kills, trials, same = random.Random(chosen.seed), dict[str, int](), 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data.parquet"
        make(data, chosen.rows, chosen.series, chosen.seed)
        run_fleet(order(data, Path(folder) / "first", chosen.rows))  # compiles, for all that are forked
        alone = Path(folder) / "alone"
        began = time.monotonic()
        os.waitpid(begin(order(data, alone, chosen.rows)), 0)
        length, expected = time.monotonic() - began, contents(alone)
        while kills < chosen.kills:
            out, before = Path(folder) / f"trial {trials}", kills
            for _ in range(rng.randint(1, chosen.most)):
                number = begin(order(data, out, chosen.rows, resume=True))
                time.sleep(rng.uniform(0, length))
                os.kill(number, signal.SIGKILL)
                if os.WIFSIGNALED(os.waitpid(number, 0)[1]):  # else it had finished before
                    met[left(out)] = met.get(left(out), 0) + 1
                    kills += 1
            if kills > before:
                os.waitpid(begin(order(data, out, chosen.rows, resume=True)), 0)
                trials, same = trials + 1, same + (contents(out) == expected)
            shutil.rmtree(out, ignore_errors=True)
    print(f"{chosen.rows} rows, {chosen.series} series, {length:.2f} s alone, {len(expected)} files")
    print(f"{kills} kills: " + ", ".join(f"{count} {where}" for where, count in sorted(met.items())))
    print(f"{same} of {trials} runs left the very same files")
    return 0 if same == trials else 1


if __name__ == "__main__":
    sys.exit(main())
