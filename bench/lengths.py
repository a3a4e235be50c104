"""Length: a Parquet file of any size in constant memory, and a cost that does not grow with the past."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .memory import resident
from .plant import joint, record
from .verdicts import Verdict, at_least, at_most

SOURCE = "bench/lengths.py"
NOISE = "OutputError"
CHUNK = 1 << 20


def verdicts(big: bool = False) -> Iterator[Verdict]:
    """Yield the budgets of a file of 5e6 rows (or 1e8), and of history."""
    rows = 100_000_000 if big else 5_000_000
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.parquet"
        _write(path, rows)
        command = [sys.executable, "-m", "bench.lengths", str(path)]
        root = Path(__file__).parent.parent
        answer = subprocess.run(command, check=True, cwd=root, stdout=subprocess.PIPE, text=True)
    told = json.loads(answer.stdout)
    size = f"{rows:.0e}".replace("e+0", "e")
    grown = told["rest"] / told["quarter"]
    note = f"at most {told['quarter']:.0f} MB in the first quarter, {told['rest']:.0f} MB after it"
    yield at_most(f"Parquet, {size} rows: memory, rest over first quarter", grown, 1.05, "x", SOURCE, note)
    note = f"{told['rate']:.2f} million samples/s, in memory {told['in_memory']:.2f}; reading and scan, CPU time"
    yield at_least(
        f"Parquet, {size} rows: speed over in-memory", told["rate"] / told["in_memory"], 0.6, "x", SOURCE, note
    )
    yield _cost_of_history()
    yield _allocations()


def _write(path: Path, rows: int) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    y, u = record(min(rows, CHUNK))
    writer = None
    for start in range(0, rows, CHUNK):
        part = slice(0, min(CHUNK, rows - start))
        table = pa.table({"u": u[part], "y": y[part]})
        writer = writer or pq.ParquetWriter(path, table.schema)
        writer.write_table(table)
    if writer:
        writer.close()


def _run(path: str) -> None:
    """The measured process: through the file in chunks, then a stretch in memory."""
    from driftwise.tables.record import open_record

    est = joint(NOISE)
    state = est.scan(*record(100), keep="innovations").state  # compiled before the clock starts
    table = open_record(path, "y", ["u"])
    seen, state, rows, memory = 0, est.start(), table.source.rows or 0, [0.0, 0.0]
    start = time.process_time()
    for chunk in table:
        state = est.scan(chunk.columns["y"], chunk.columns["u"], state=state, keep="innovations").state
        seen += chunk.rows
        late = int(seen > rows / 4)
        memory[late] = max(memory[late], resident() / 1e6)
    seconds = time.process_time() - start
    y, u = record(min(seen, CHUNK))
    rates = []
    for _ in range(3):
        start = time.process_time()
        est.scan(y, u, state=state, keep="innovations")
        rates.append(len(y) / (time.process_time() - start) / 1e6)
    told = {"quarter": memory[0], "rest": memory[1], "rate": seen / seconds / 1e6, "in_memory": float(np.median(rates))}
    print(json.dumps(told))


def _cost_of_history(samples: int = 500_000) -> Verdict:
    est = joint(NOISE)
    y, u = record(samples)
    scratch = est.scratch()
    rounds = []
    for _ in range(5):
        rows, seconds = est.start(1).view("f8").reshape(1, -1), []
        for y_part, u_part in zip(np.split(y, 10), np.split(u, 10)):
            out = np.empty((1, len(y_part), 4))
            start = time.process_time()
            est.drive(rows, y_part.reshape(1, -1, 1), u_part.reshape(1, -1, 1), out, est.spec, scratch)
            seconds.append(time.process_time() - start)
        rounds.append(seconds[-1] / seconds[0])
    note = f"record of {samples}, {NOISE}"
    return at_most("history: cost of a sample, last tenth over first", float(np.median(rounds)), 1.1, "x", SOURCE, note)


def _allocations(samples: int = 3_000) -> Verdict:
    est = joint(NOISE)
    y, u = record(2 * samples)
    state = est.start()

    def updates(first: int) -> int:
        nonlocal state
        for t in range(first, first + samples):
            state, _ = est.update(state, y[t], u[t])
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    before = updates(0)
    after = updates(samples)
    tracemalloc.stop()
    note = f"{samples} updates after {samples} updates"
    return at_most(
        "history: memory that updates leave behind", float(max(after - before, 0)), 1024, "bytes", SOURCE, note
    )


if __name__ == "__main__":
    _run(sys.argv[1])
