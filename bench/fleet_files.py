"""A run of a fleet over Parquet files, from rows to results on disk: rate, and memory that does not grow."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import driftwise as dw

from .memory import resident
from .verdicts import Verdict, at_most, for_information

SOURCE = "bench/fleet_files.py"
FILE = 2_000_000  # rows of a file


def verdicts(big: bool = False) -> Iterator[Verdict]:
    """Yield memory and rate of 1e7 rows of 10 000 series, or of 1e8 rows of 100 000."""
    series, ticks = (100_000, 1000) if big else (10_000, 1000)
    with tempfile.TemporaryDirectory() as folder:
        _write(Path(folder) / "data", series, ticks)
        command = [sys.executable, "-m", "bench.fleet_files", folder]
        answer = subprocess.run(
            command, check=True, cwd=Path(__file__).parent.parent, stdout=subprocess.PIPE, text=True
        )
    told = json.loads(answer.stdout)
    what = f"fleet over Parquet, {series * ticks:.0e} rows of {series} series".replace("e+0", "e")
    note = f"at most {told['half']:.0f} MB in the first half, {told['rest']:.0f} MB after it"
    yield at_most(f"{what}: memory, second half over first", told["rest"] / told["half"], 1.05, "x", SOURCE, note)
    rate = series * ticks / told["cpu"] / 1e6
    note = (
        f"reading, units, {told['estimator']}, counts, estimates of every 100th sample, checkpoints; "
        f"wall {told['wall']:.1f} s; 1e9 rows at this rate take {1e9 / rate / 1e6 / 60:.0f} min of one core"
    )
    yield for_information(f"{what}: rate", rate, "million rows/s of CPU time", SOURCE, note)


def _write(folder: Path, series: int, ticks: int) -> None:
    """Write what so many series say at so many instants, in order of time."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    folder.mkdir()
    draw, y = np.random.default_rng(0), np.zeros(series)
    names, step = np.arange(series, dtype=np.int32), max(1, FILE // series)
    for part, first in enumerate(range(0, ticks, step)):
        found = []
        for _ in range(first, min(first + step, ticks)):
            y = 0.9 * y + draw.standard_normal(series)
            found.append(y)
        instants = np.repeat(np.arange(first, first + len(found), dtype=float), series)
        columns = {"time": instants, "asset": np.tile(names, len(found)), "y": np.concatenate(found)}
        pq.write_table(pa.table(columns), folder / f"part-{part:05d}.parquet")


def _run(folder: Path) -> None:
    """The measured process."""
    from driftwise.fleet.fleet_run import FleetJob, run_fleet

    est, memory = dw.Joint(3), [0.0, 0.0]

    def progress(now) -> None:
        is_late = (now.share or 0.0) > 0.5
        memory[is_late] = max(memory[is_late], resident() / 1e6)

    def order(data, out):
        return FleetJob(data, by="asset", output="y", time="time", estimator=est, out=folder / out, progress=progress)

    few = {"asset": np.repeat([1, 2], 200), "time": np.arange(400.0), "y": np.sin(np.arange(400.0))}
    run_fleet(order(few, "warm"))  # compiled before the clock starts
    memory[:] = [0.0, 0.0]
    start, began = time.process_time(), time.perf_counter()
    run_fleet(order(folder / "data", "out"))
    told = {"cpu": time.process_time() - start, "wall": time.perf_counter() - began, "estimator": repr(est)}
    print(json.dumps({**told, "half": memory[0], "rest": memory[1]}))


if __name__ == "__main__":
    _run(Path(sys.argv[1]))
