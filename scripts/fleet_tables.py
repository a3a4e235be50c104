"""Print the table of docs/fleet-tables.md: what a row of a long table costs on its way through a fleet.

python scripts/fleet_tables.py [ROWS]
"""

import statistics
import sys
import tempfile
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import driftwise as dw
from driftwise.fleet.intake import Intake
from driftwise.tables.dataset import open_dataset

ROWS = int(float(sys.argv[1])) if len(sys.argv) > 1 else 8_000_000
GROUP = 1 << 20
LATE = 0.01  # share of rows that come late in the untidy table
TABLES = {
    "1000 whole numbers in turn": dict(series=1000),
    "1000 whole numbers in turn, with a clock": dict(series=1000, clock=True),
    "1000 words in turn, with a clock, 1 % late": dict(series=1000, clock=True, words=True, late=True),
    "1000 whole numbers one after the other": dict(series=1000, is_sorted=True),
    "100 000 whole numbers in turn": dict(series=100_000),
}


def write(path, series, clock=False, words=False, late=False, is_sorted=False):
    """Write a table of noise, group by group."""
    rng, writer = np.random.default_rng(0), None
    for first in range(0, ROWS, GROUP):
        row = np.arange(first, min(first + GROUP, ROWS))
        key = (row * series // ROWS if is_sorted else row % series).astype(np.int32)
        columns = {"pump": pa.array([f"pump {k}" for k in key]) if words else key, "y": rng.standard_normal(len(row))}
        if clock:
            behind = np.where(rng.random(len(row)) < LATE, 3 * series, 0) if late else 0
            columns["t"] = (row - behind).astype("M8[ms]")
        table = pa.table(columns)
        writer = writer or pq.ParquetWriter(path, table.schema)
        writer.write_table(table)
    writer.close()


def run(table):
    """Return the CPU time of each station in ns per row, once the units of the series are known."""
    fleet = dw.Fleet(dw.AR(1), threads=1)
    fleet.crew.loop(4)  # compiled
    intake, clock, laps = Intake(fleet), time.process_time, []
    now = clock()
    for batch in table.batches():
        spent = dict.fromkeys(["read", "intake", "fleet", "tally"], 0.0)

        def lap(name):
            nonlocal now
            before, now = now, clock()
            spent[name] += now - before

        lap("read")
        for taken in intake.take(batch):
            lap("intake")
            outs = fleet.advance(taken.at, taken.ys, taken.us)
            lap("fleet")
            intake.tally.add(taken, outs)
            lap("tally")
        laps.append({name: seconds / len(batch.codes) * 1e9 for name, seconds in spent.items()})
    later = laps[len(laps) // 4 : -1]
    return {name: statistics.median(lap[name] for lap in later) for name in laps[0]}


with tempfile.TemporaryDirectory() as folder:
    for title, options in TABLES.items():
        path = f"{folder}/table.parquet"
        write(path, **options)
        table = open_dataset(path, by="pump", output="y", time="t" if options.get("clock") else None)
        speeds = []
        for _ in range(3):
            began = time.process_time()
            rows = sum(len(batch.codes) for batch in table.batches())
            speeds.append(rows / (time.process_time() - began) / 1e6)
        cost = run(table)
        cells = [f"{statistics.median(speeds):.0f}", *(f"{cost[name]:.0f}" for name in cost)]
        print(f"| {title} | {' | '.join(cells)} |", flush=True)
