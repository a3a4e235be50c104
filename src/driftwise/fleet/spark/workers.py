"""What executors do for a run: read the files of a table, and take the series of a partition through it."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ...tables.dataset import Batch, Dataset
from ..fleet import Fleet
from ..run import FleetRun
from .batch import gathered
from .shipped import unship

SCALES = "y_scale", "u_scale"  # in which the series of a run differ


class Task(NamedTuple):
    """Rows of a part of the table that one task reads."""

    part: int
    skip: int  # rows of the part before them
    rows: int
    first: int  # the number of the first of them in the table


class Piece(NamedTuple):
    """What a worker has come to since the last one; ``end`` behind its last sample."""

    keys: list  # new series
    rows: int  # of the table, taken
    estimates: list
    events: list
    end: dict[str, Any] | None


class Gathered:
    """The sinks of a worker: what is to be written waits here."""

    def __init__(self):
        self.estimates: list[Any] = []
        self.events: list[Any] = []

    def take(self, found) -> None:
        """Take estimates."""
        if len(found.at):
            self.estimates.append(found)

    def happened(self, at, seen) -> None:
        """Take events."""
        if len(at):
            self.events.append((at, seen))


# --- reading -----------------------------------------------------------------------------------------------


def counting(table: Dataset, parts: list[int]):
    """Return what counts the rows of some parts of a table, given their numbers."""

    def work(batches):
        import pyarrow as pa

        for batch in batches:
            chosen = [parts[i] for i in batch["id"].to_pylist()]
            found = [sum(len(rows.codes) for rows in table.only(part).batches()) for part in chosen]
            yield pa.RecordBatch.from_arrays([pa.array(chosen), pa.array(found)], ["part", "rows"])

    return work


def reading(table: Dataset, tasks: list[Task]):
    """Return what reads the rows of tasks, given their numbers."""

    def work(batches):
        for batch in batches:
            for task in (tasks[i] for i in batch["id"].to_pylist()):
                left = task.rows
                for found in table.only(task.part).batches(skip=task.skip):
                    n = min(left, len(found.codes))
                    yield _arrow(found, n, task.first + task.rows - left)
                    left -= n
                    if not left:
                        break

    return work


def _arrow(batch: Batch, n: int, first: int):
    """Return the first rows of a batch, keys as numbers or words."""
    import pyarrow as pa

    where = pa.array(batch.codes[:n], mask=batch.codes[:n] < 0)
    numbers = pa.array([key if isinstance(key, int) else None for key in batch.names], pa.int64())
    words = pa.array([None if isinstance(key, int) else key for key in batch.names], pa.string())
    time = np.zeros(n) if batch.time is None else batch.time[:n]
    columns = {
        "number": numbers.take(where),
        "word": words.take(where),
        "row": pa.array(first + np.arange(n)),
        "time": pa.array(time),
        "bad": pa.array(batch.bad[:n]),
    }
    values = [pa.array(np.ascontiguousarray(column[:n])) for column in (*batch.ys.T, *batch.us.T)]
    return pa.RecordBatch.from_pydict(columns | {f"value{i}": column for i, column in enumerate(values)})


# --- taking ------------------------------------------------------------------------------------------------


def advancing(shipped, options, has_clock: bool, outputs: int):
    """Return what takes the series of a partition, in order of series and row, through a run of their own."""

    def work(batches):
        sinks = Gathered()
        run = FleetRun(Fleet(unship(shipped), threads=1), sinks, **options)
        run.fleet.crew.loop(run._head)
        known = 0
        for batch in _again(batches, has_clock, outputs):
            run.take(batch)
            yield _packed(run, known, len(batch.codes))
            known = len(run.fleet)
        run.end()
        yield _packed(run, known, 0, _end(run))

    return work


def _packed(run: FleetRun, known: int, rows: int, end=None):
    """Return a `Piece` as Arrow has it; the first ``told`` series have been told before."""
    import pyarrow as pa

    sinks: Any = run.sinks
    piece = Piece(run.fleet.keys[known:], rows, sinks.estimates, sinks.events, end)
    sinks.estimates, sinks.events = [], []
    blob = pickle.dumps(piece, pickle.HIGHEST_PROTOCOL)
    return pa.RecordBatch.from_arrays([pa.array([blob], pa.binary())], ["piece"])


def _again(batches, has_clock: bool, outputs: int) -> Iterator[Batch]:
    """Yield the rows of a partition as batches of a table, each row with its number in the whole one."""
    names: list[Any] = []
    codes: dict[Any, int] = {}
    first = 0
    for table in gathered(batches):
        columns = {name: table[name].combine_chunks() for name in table.column_names}
        code = np.full(len(table), -1)
        for column in (columns["number"].dictionary_encode(), columns["word"].dictionary_encode()):
            is_known = column.is_valid().to_numpy(zero_copy_only=False)
            met = column.dictionary.to_pylist()
            for name in met:
                if codes.setdefault(name, len(names)) == len(names):
                    names.append(name)
            index = column.indices.filter(column.is_valid()).to_numpy()
            code[is_known] = np.array([codes[name] for name in met], np.int64)[index]
        rows, time, bad, *values = (columns[name].to_numpy(zero_copy_only=False) for name in table.column_names[2:])
        ys, us = np.column_stack(values[:outputs]), np.empty((len(table), len(values) - outputs))
        for j, value in enumerate(values[outputs:]):
            us[:, j] = value
        yield Batch(first, names, code, time if has_clock else None, ys, us, bad, rows)
        first += len(table)


def _end(run: FleetRun) -> dict[str, Any]:
    """Return all that is known of the series of a partition at its end."""
    size, first, events = len(run.fleet), run.fleet.estimators[0], run.events.table
    return {
        "states": run.fleet._rows[:size].copy(),
        "group": run.fleet._group[:size].copy(),
        "scales": [None if est is first else {k: est.options[k] for k in SCALES} for est in run.fleet.estimators],
        "tally": run.tally.table.copy(),
        "events": np.concatenate([events, np.zeros((size - len(events), events.shape[1]))]),
        "intake": run.intake.snapshot(),
    }
