"""Run every job on as many processes as there are cores, and keep what came out."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

from driftwise.engine.errors import InputError

from ..papers.verdict import Verdict
from . import labels, records
from .second import SECOND
from .tracks import SETS

# Rows of the acceptance table that are tasks of their own: "module.function" of this package, which takes the folder of
# recordings and returns a list of `Verdict`.
TASKS: dict[str, str] = {
    "newcomer": "acceptance.newcomer",
    "gas sensor": "tasks.calibration.gas_sensor",
    "motor, motion": "tasks.motor.motor_motion",
    "motor, parameters": "tasks.motor.motor_parameters",
    "resistance": "tasks.cells.resistance",
    "ageing": "tasks.cells.ageing",
}
SLOW = (
    "leaf_hppc_25C",
    "leaf_hppc_40C",
    "wye_flow",
    "ahu_szcav",
    "gliders",
    "ahu_szvav",
    "calibration flights 5 s",
)  # begun first


class Job(NamedTuple):
    """One thing to measure: "module.function" of this package, and the name it is called with (none: a task)."""

    what: str
    name: str

    @property
    def title(self) -> str:
        """How it is called in a line of progress."""
        return f"{self.what.split('.')[-1]} {self.name}" if self.name else self.what.split(".")[-1]


class Failure(NamedTuple):
    """A job that ended with an error: nothing is known of its record."""

    job: Job
    words: str


@dataclass
class Measured:
    """Everything that was measured, by kind and name."""

    rows: dict[str, Any] = field(default_factory=dict)
    labelled: dict[str, Any] = field(default_factory=dict)
    pump: dict[str, Any] = field(default_factory=dict)
    day: dict[str, Any] = field(default_factory=dict)
    tracks: dict[str, Any] = field(default_factory=dict)
    tasks: dict[str, list[Verdict]] = field(default_factory=dict)
    failures: list[Failure] = field(default_factory=list)
    seconds: float = 0.0
    is_whole: bool = True  # False: only a part was asked for

    def keep(self, job: Job, found) -> None:
        """Put what a job found where it belongs."""
        kinds = {"board.row": self.rows, "board.labelled": self.labelled, "board.pump": self.pump}
        kinds |= {"board.day": self.day, "board.tracks": self.tracks}
        kinds.get(job.what, self.tasks)[job.name or job.what] = found


def jobs(where: Path, only: str = "") -> list[Job]:
    """Return what is to be measured: everything, or what has ``only`` in its name."""
    if not where.is_dir():
        raise InputError(
            f"there is no folder {where}. Where are the recordings? --data (or DRIFTWISE_DATA) names the folder that "
            "has sysid and tracking in it"
        )
    found = [Job("board.row", name) for name in records.ROWS]
    found += [Job("board.row", name) for name in SECOND] if (where / "second").is_dir() else []
    found += [Job("board.labelled", name) for name in dict.fromkeys(c.record for c in labels.CHANGES)]
    found += [Job("board.pump", name) for name in records.pump_files(where)]
    found += [Job("board.day", name) for name in (*labels.FAULTS, *labels.NO_FAULT)]
    if (where.parent / "tracking").is_dir():
        found += [Job("board.tracks", name) for name in SETS]
    found += [Job(path, "") for path in TASKS.values()]
    found = [job for job in found if only in job.title]
    if not found:
        raise InputError(f"nothing that is scored has {only!r} in its name; there is: {', '.join(records.ROWS)}, ..")
    return sorted(found, key=lambda job: job.name not in SLOW)


def measure(job: Job, where: Path):
    """Do one job."""
    module, name = job.what.rsplit(".", 1)
    function = getattr(importlib.import_module(f".{module}", __package__), name)
    return function(job.name, where) if job.name else function(where)


def run(where: Path, only: str = "", processes: int | None = None, say: Callable[[str], Any] = print) -> Measured:
    """Return everything measured on the recordings below ``where``; ``say`` is told of every job that is done."""
    todo, began, found = jobs(where, only), perf_counter(), Measured(is_whole=not only)
    processes = min(processes or cores(), len(todo))
    for count, (job, result) in enumerate(_done(todo, where, processes), 1):
        if isinstance(result, Failure):
            found.failures.append(result)
        else:
            found.keep(job, result)
        say(f"{count}/{len(todo)} {job.title} ({perf_counter() - began:.0f} s)")
    found.seconds = perf_counter() - began
    return found


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _done(todo: list[Job], where: Path, processes: int) -> Iterator[tuple[Job, Any]]:
    """Yield jobs and what they found, as they end."""
    if processes == 1:
        for job in todo:
            yield job, attempt(job, where)
        return
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # processes fill the cores
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        waiting = {pool.submit(attempt, job, where): job for job in todo}
        for future in as_completed(waiting):
            yield waiting[future], future.result()


def attempt(job: Job, where: Path):
    """Do one job; an error becomes a `Failure`: one broken record must not hide the others."""
    try:
        return measure(job, where)
    except Exception as error:
        return Failure(job, f"{type(error).__name__}: {error}")
