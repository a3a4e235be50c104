"""`run_fleet` on a cluster: executors read the files and advance the series, this process writes the results."""

from __future__ import annotations

import os
import pickle
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ...engine.errors import InputError
from ...tables.dataset import Dataset
from ..fleet_run import INTAKE, run_fleet
from ..job import FleetJob, FleetResult, Progress
from ..run import FleetRun
from .columns import needed
from .masters import refuse
from .shipped import ship
from .workers import Piece, Task, advancing, counting, reading

STRETCH = 1 << 20  # rows of a file that one task reads


def run_on_spark(job: FleetJob, master: str | None = None) -> FleetResult:
    """Run a fleet over a long table on a cluster; the folder holds what `run_fleet` writes, bit for bit.

    Parameters
    ----------
    job : as for `run_fleet`; executors see the files of ``data`` under the same names as this process
    master : such as "spark://host:7077", "yarn", "local[4]"; that of the session there is if omitted

    Raises
    ------
    InputError
        What `run_fleet` refuses, what an executor refuses, a Spark that does not start.

    Notes
    -----
    Series, and so the rows of the tables, are in the order in which executors hand them over. There are no checkpoints:
    Spark repeats what it loses, and a run that was killed as a whole begins anew (``resume``).

    Bad at: small tables, one large CSV file (one task reads it), and ``every=1`` on large ones (all estimates pass
    through this process).
    """
    needed()
    with _session(master) as spark, _told():
        return run_fleet(job, lambda run, table: _go(spark, job, run, table))


@contextmanager
def _session(master) -> Iterator[Any]:
    """Open a session, or borrow the one there is; one of our own is stopped."""
    from pyspark.errors import PySparkException
    from pyspark.sql import SparkSession

    running = SparkSession.getActiveSession()
    if running is not None and master is None:
        yield running
        return
    if master is not None:
        refuse(master)
    os.environ.setdefault("PYSPARK_PYTHON", sys.executable)
    builder = SparkSession.builder.appName("driftwise").config("spark.ui.showConsoleProgress", "false")
    try:
        spark = builder.master(master or "local[*]").getOrCreate()
    except (PySparkException, OSError) as error:
        raise InputError(
            f"Spark did not start ({str(error)[:200]}). Is there Java 17, and is {master!r} right?"
        ) from None
    try:
        yield spark
    finally:
        if running is None:
            spark.stop()


@contextmanager
def _told() -> Iterator[None]:
    """Raise what an executor refused as it was said there."""
    from pyspark.errors import PySparkException

    try:
        yield
    except PySparkException as error:
        said = re.search(r"driftwise\.errors\.\w+: (.*)", str(error))
        if said is None:
            raise
        raise InputError(said[1]) from None


def _go(spark, job: FleetJob, run: FleetRun, table: Dataset) -> None:
    """Take a table through a run: the executors' pieces, one partition after the other, become those of ``run``."""
    from pyspark import StorageLevel

    if run.rows:
        raise InputError(f"{job.out} has a run that one machine began and took to row {run.rows}: resume it there")
    started, tasks = time.monotonic(), _tasks(spark, table)
    rows = tasks[-1].first + tasks[-1].rows
    found = _advanced(spark, job, table, tasks).persist(StorageLevel.DISK_ONLY)
    ends: list[dict[str, Any]] = []
    base = 0  # where the series of a partition begin in the fleet
    try:
        found.count()  # all partitions at once; then they are read one by one
        for (blob,) in found.toLocalIterator():
            piece = pickle.loads(blob)
            _put(run, piece, base)
            if piece.end is not None:
                _settle(run, piece.end, base)
                ends.append(piece.end)
                base = len(run.fleet)
            if job.progress is not None:
                job.progress(Progress(run.rows, run.rows / rows, len(run.fleet), time.monotonic() - started))
    finally:
        found.unpersist()
    run.tally.restore(np.concatenate([end["tally"] for end in ends]))
    run.events.table = np.concatenate([end["events"] for end in ends])
    kept = [end["intake"] for end in ends]
    whole = {name: np.concatenate([one[name] for one in kept]) for name in kept[0]}
    run.intake.restore(whole | {"keyless": whole["keyless"].sum(keepdims=True)})


def _tasks(spark, table: Dataset) -> list[Task]:
    """Cut a table into tasks; parts of unknown length are counted first, and read from their beginning."""
    counts, sizes = table.counts, [STRETCH if count is not None else 0 for count in table.counts]
    unknown = [i for i, count in enumerate(counts) if count is None]
    if unknown:
        ids = spark.range(0, len(unknown), 1, len(unknown))
        for part, rows in ids.mapInArrow(counting(table, unknown), "part long, rows long").collect():
            counts[part] = rows
    tasks, first = [], 0
    for part, (count, size) in enumerate(zip(counts, sizes)):
        rows = count or 0
        tasks += [
            Task(part, skip, min(size or rows, rows - skip), first + skip) for skip in range(0, rows, size or rows or 1)
        ]
        first += rows
    return tasks


def _advanced(spark, job: FleetJob, table: Dataset, tasks: list[Task]):
    """Return the pieces that executors come to: they read, pass the rows on by key, and take each key's in order."""
    p, k = len(table.outputs), len(table.inputs)
    values = [f"value{i} double" for i in range(p + k)]
    schema = ", ".join(["number long, word string, row long, time double, bad boolean", *values])
    samples = spark.range(0, len(tasks), 1, len(tasks)).mapInArrow(reading(table, tasks), schema)
    placed = samples.repartition("number", "word").sortWithinPartitions("number", "word", "row")
    options = {name: getattr(job, name) for name in ("every", *INTAKE)}
    return placed.mapInArrow(advancing(ship(job.estimator), options, table.time is not None, p), "piece binary")


def _put(run: FleetRun, piece: Piece, base: int) -> None:
    """Write what a piece has to tell; its series are rows ``base`` and beyond of the fleet."""
    run.fleet.add(piece.keys)
    for found in piece.estimates:
        run.sinks.take(found._replace(at=found.at + base))
    for at, seen in piece.events:
        run.sinks.happened(at + base, seen)
    run.rows += piece.rows
    if piece.rows:  # a part is called after the row at which it begins
        run.sinks.close(run.rows, long=True)


def _settle(run: FleetRun, end: dict[str, Any], base: int) -> None:
    """Give series their settings and states."""
    first = run.fleet.estimators[0]
    for number, scales in enumerate(end["scales"]):
        own = first if scales is None else type(first)(**{**first.options, **scales})
        run.fleet.begin(base + np.flatnonzero(end["group"] == number), own)
    run.fleet._rows[base : base + len(end["states"])] = end["states"]
