"""A fleet over more rows than fit into memory: rows per second, and the memory in each quarter of the way.

python scripts/fleet_rows.py --rows 100_000_000                # a Parquet file, written here first and deleted after
python scripts/fleet_rows.py --series 100_000 --samples 1000   # batches made up on the way: memory against the states
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.fleet.fleet import Fleet
from driftwise.fleet.fleet_run import run_fleet
from driftwise.fleet.job import FleetJob
from driftwise.fleet.run import FleetRun

ESTIMATORS = {"ar": lambda: dw.AR(1), "joint": lambda: dw.Joint(3), "arx": lambda: dw.ARX(2, 2, memory=dw.AutoMemory())}
BATCH = 1 << 18


def resident() -> float:
    """Return the memory that is in use, in MB."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def write(path, rows: int, series: int) -> None:
    """Write a long table, a row for each series in turn."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rng, size = np.random.default_rng(0), 1 << 20
    schema = pa.schema([("key", pa.int32()), ("y", pa.float32()), ("u", pa.float32())])
    with pq.ParquetWriter(path, schema, use_dictionary=["key"]) as writer:
        for first in range(0, rows, size):
            n = min(size, rows - first)
            y, u = rng.standard_normal((2, n), np.float32)
            key = (np.arange(first, first + n) % series).astype(np.int32)
            writer.write_table(pa.table({"key": key, "y": y, "u": u}, schema))


def warm(fleet) -> None:
    """Compile before the clock is started."""
    est = fleet.estimators[0]
    for columns in est.n_columns, est.n_columns + 2 * est.model.N:
        fleet.crew.loop(columns)


class Course:
    """Where a run was when: rows, seconds, CPU seconds, megabytes."""

    def __init__(self):
        self.points = [(0, time.monotonic(), time.process_time(), resident())]

    def note(self, rows: int) -> None:
        self.points.append((rows, time.monotonic(), time.process_time(), resident()))

    def tell(self, rows: int) -> None:
        """Print the speed and the most memory of each quarter."""
        points = np.array(self.points)
        for quarter in range(4):
            inside = (points[:, 0] >= rows * quarter / 4) & (points[:, 0] <= rows * (quarter + 1) / 4)
            part = points[inside]
            if len(part) < 2:  # too few batches to tell
                continue
            done, wall, cpu = part[-1, :3] - part[0, :3]
            print(f"quarter {quarter + 1}: {done / wall / 1e6:.2f} M rows/s, {done / cpu / 1e6:.2f} M rows/s of CPU, "
                  f"at most {part[:, 3].max():.0f} MB")  # fmt: skip
        wall, cpu = points[-1, 1:3] - points[0, 1:3]
        print(f"all: {rows / wall / 1e6:.2f} M rows/s ({wall:.0f} s), {rows / cpu / 1e6:.2f} M rows/s of CPU; "
              f"10^9 rows: {1e9 / rows * wall / 60:.0f} minutes")  # fmt: skip


class Nowhere:
    """Takes what is to be written, and does not."""

    def take(self, found) -> None: ...

    def happened(self, at, seen) -> None: ...


class MadeUp:
    """Batches of so many rows, each made when it is asked for: a sample of each series in turn."""

    def __init__(self, series: int, samples: int, inputs: int):
        self.series, self.rows, self.inputs = series, series * samples, inputs

    def batches(self, size: int, skip: int = 0):
        from driftwise.tables.dataset import Batch

        names, rng = list(range(self.series)), np.random.default_rng(0)
        for first in range(skip, self.rows, size):
            n = min(size, self.rows - first)
            codes = np.arange(first, first + n) % self.series
            ys, us = rng.standard_normal((n, 1)), rng.standard_normal((n, self.inputs))
            yield Batch(first, names, codes, None, ys, us, np.zeros(n, bool))


def over_a_file(chosen) -> None:
    """Run over a Parquet file."""
    est = ESTIMATORS[chosen.estimator]()
    with tempfile.TemporaryDirectory(dir=chosen.folder) as folder:
        data = Path(folder) / "rows.parquet"
        write(data, chosen.rows, chosen.series)
        print(
            f"{est!r}: {chosen.rows:.3g} rows of {chosen.series} series, {data.stat().st_size / 1e9:.2f} GB of Parquet"
        )
        inputs = ["u"][: est.model.inputs]
        columns = dict(by="key", output="y", inputs=inputs, every=chosen.every)
        columns |= dict(threads=chosen.threads, seconds=chosen.seconds)
        warm(Fleet(est))
        course = Course()
        found = run_fleet(FleetJob(data, estimator=est, out=Path(folder) / "out", **columns,
                                     progress=lambda at: course.note(at.rows)))  # fmt: skip
        course.note(found.rows)
        course.tell(found.rows)


def over_nothing(chosen) -> None:
    """Run over batches made up on the way; compare the memory to that of the states."""
    est = ESTIMATORS[chosen.estimator]()
    fleet = Fleet(est, threads=chosen.threads)
    warm(fleet)
    run = FleetRun(fleet, Nowhere(), every=chosen.every, first=chosen.first)
    before, course = resident(), Course()
    run.go(MadeUp(chosen.series, chosen.samples, est.model.inputs), BATCH, lambda: course.note(run.rows))
    states, peak = fleet._rows.nbytes / 1e6, max(point[3] for point in course.points) - before
    print(f"{est!r}: {chosen.series} series of {chosen.samples} samples")
    course.tell(run.rows)
    print(f"peak {peak:.0f} MB above the start; states {states:.0f} MB: {peak - 2 * states:.0f} MB beyond twice them; "
          f"a batch is {BATCH * 8 * (2 + est.model.inputs) / 1e6:.0f} MB of numbers")  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--estimator", choices=ESTIMATORS, default="ar")
    options.add_argument("--rows", type=int, default=10_000_000)
    options.add_argument("--series", type=int, default=1000)
    options.add_argument("--samples", type=int, help="make up so many of each series instead of reading rows")
    options.add_argument("--every", type=int, default=100)
    options.add_argument("--first", type=int, default=32, help="rows held back, of what is made up")
    options.add_argument("--threads", type=int)
    options.add_argument("--seconds", type=float, default=60.0, help="from one checkpoint to the next")
    options.add_argument("--folder", help="where the file is written")
    chosen = options.parse_args()
    over_a_file(chosen) if chosen.samples is None else over_nothing(chosen)


if __name__ == "__main__":
    sys.exit(main())
