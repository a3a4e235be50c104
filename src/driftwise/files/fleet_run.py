"""One order, one run: a long table through a fleet into a folder, to be gone on with wherever it was stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

__all__ = ["FleetOrder", "FleetResult", "Progress", "run_fleet"]


@dataclass(frozen=True)
class FleetOrder:
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
    seconds : between two checkpoints
    batches : int, optional
        Between two checkpoints, instead of seconds: files are then cut at the same rows in every run.
    resume : go on where a run of this order was stopped
    replace : delete what a former run left in the folder, and nothing else
    progress : called after each batch
    """

    data: Any
    by: str
    output: Any
    estimator: Any
    out: Any
    inputs: tuple[str, ...] = ()
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
    estimates, final, events, saved : paths: folder of ``part-*.parquet``, and three files
    told : number of events
    """

    fleet: Any
    tally: Any
    rows: int
    keyless: int
    began: int
    seconds: float
    estimates: Any
    final: Any
    events: Any
    saved: Any
    told: int


def run_fleet(order: FleetOrder) -> FleetResult:
    """Run a fleet over a long table; return states and counts, the rest is in the folder.

    Raises
    ------
    InputError
        Where names, numbers or the folder do not fit, and on ``resume``, where the order is another than that of the
        run that was stopped.
    """
    raise NotImplementedError
