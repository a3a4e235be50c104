"""What to run, on what, into which folder; how far it is, and what it came to."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.fleet.store import settings

SAME = "by", "output", "inputs", "time", "dt", "first", "center", "longest", "every", "batch", "missing"


@dataclass(frozen=True)
class FleetJob:
    """What to run, on what, into which folder.

    Parameters
    ----------
    data : whatever `open_dataset` takes
    by, output, inputs, time : names of its columns: key, output (or several), inputs, clock
    estimator : settings of each series, before they are scaled to its first samples
    out : folder for the results
    dt, first, center, longest : as for `Intake`
    every : one row of estimates for every so many samples of a series; 0: none, 1: all
    batch : rows of the table in memory at a time
    threads : as many as there are cores if omitted
    seconds : from one checkpoint to the next
    batches : int, optional
        From one checkpoint to the next, instead of seconds: parts are then cut at the same rows in every run.
    resume : go on where a run of this order was stopped
    replace : delete what a former run left in the folder, and nothing else
    progress : called after each batch
    missing : values that stand for a missing one, such as -9999
    words : what summaries call the estimator; how it prints, if omitted

    Examples
    --------
    >>> import tempfile, numpy as np, driftwise as dw
    >>> key = np.repeat(["a", "b"], 300)
    >>> y = np.concatenate([dw.simulate([-0.8], [0.0], samples=300, seed=s)[0] for s in (1, 2)])
    >>> job = dw.fleet.FleetJob({"key": key, "y": y}, "key", "y", dw.AR(1), tempfile.mkdtemp() + "/out")
    >>> dw.fleet.run_fleet(job).rows
    600
    """

    data: Any
    by: str
    output: Any
    estimator: Any
    out: Any
    inputs: Any = ()
    time: str | None = None
    dt: float | None = None
    first: int = 32
    center: bool = True
    longest: int = 10_000
    every: int = 100
    batch: int = 1 << 18
    threads: int | None = None
    seconds: float = 60.0
    batches: int | None = None
    resume: bool = False
    replace: bool = False
    progress: Callable[[Progress], None] | None = None
    missing: tuple[float, ...] | None = None
    words: str = ""


@dataclass(frozen=True)
class Progress:
    """How far a run is: rows read, their share of the table (None: not known), series met, seconds since it began."""

    rows: int
    share: float | None
    series: int
    seconds: float


@dataclass(frozen=True)
class FleetResult:
    """What a run came to.

    Attributes
    ----------
    fleet, tally : states and counts of all series
    rows : of the table
    keyless : of them, without a key
    began : row this call began with: 0, or where the run before was stopped; equal to ``rows`` where nothing was left
    seconds : this call took
    out : folder
    events : how many were reported
    is_finished : whether all of the table was read and all files are there
    facts : of the run: ``order``; ``words`` for the estimator; ``is_dated``: times are seconds since 1970 (in the files
        they are time stamps); ``is_read``: to the end
    """

    fleet: Any
    tally: Any
    rows: int
    keyless: int
    began: int
    seconds: float
    out: Path
    events: int
    is_finished: bool
    facts: dict[str, Any]


def facts_of(job: FleetJob) -> dict[str, Any]:
    """Return what must not differ when a run is gone on with, as JSON has it."""
    facts = {name: getattr(job, name) for name in SAME}
    facts |= {"estimator": settings(job.estimator), "data": _contents(job.data)}
    return json.loads(json.dumps(facts))


def refuse_another(job: FleetJob, former: dict[str, Any]) -> None:
    """Raise `InputError` where the run in the folder is of another order."""
    now = facts_of(job)
    differs = [name for name in now if now[name] != former.get(name)]
    if differs:
        what = "; ".join(
            f"{name} is another" if name in ("estimator", "data") else f"{name} was {former[name]!r}, is {now[name]!r}"
            for name in differs
        )
        raise InputError(
            f"the run in {job.out} was of another order: {what}. Resume with the former one, or begin anew with "
            "replace=True, or in another folder"
        )


def _contents(data) -> Any:
    """Return what tells data from others: names and sizes of files; rows and columns of what is in memory."""
    if isinstance(data, str | os.PathLike):
        path = Path(data)
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        return [[str(p.relative_to(path.parent)), p.stat().st_size] for p in files if p.exists()]
    if isinstance(data, list | tuple) and all(isinstance(item, str | os.PathLike) for item in data):
        return [_contents(item) for item in data]
    if hasattr(data, "files"):  # a pyarrow Dataset
        return [_contents(name) for name in data.files]
    if isinstance(data, Mapping):
        return [len(column) for column in data.values()]
    return list(getattr(data, "shape", ()))
