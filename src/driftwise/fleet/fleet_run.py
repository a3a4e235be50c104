"""A run of a fleet over a long table into a folder; where it was stopped, it goes on."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

from driftwise.engine import validation
from driftwise.engine.alone import alone
from driftwise.engine.errors import InputError
from driftwise.fleet import store
from driftwise.fleet.final import final
from driftwise.fleet.fleet import Fleet, check_learns
from driftwise.fleet.fleet_out import FleetOut
from driftwise.fleet.fleet_parts import sweep
from driftwise.fleet.job import FleetJob, FleetResult, Progress, facts_of, refuse_another
from driftwise.fleet.run import FleetRun
from driftwise.tables.dataset import Dataset, open_dataset

INTAKE = "dt", "first", "center", "longest"


def run_fleet(job: FleetJob, go: Callable[[FleetRun, Dataset], None] | None = None) -> FleetResult:
    """Run a fleet over a long table; return states and counts, the rest is in the folder.

    Killed at any moment and gone on with (``resume``), it writes what it would have written without.

    Parameters
    ----------
    job : what to run
    go : takes all of the table through the run in place of this process, without checkpoints; for clusters

    Raises
    ------
    InputError
        Where names, numbers or the folder do not fit, and on ``resume``, where the order is another than that of the
        run that was stopped.

    Notes
    -----
    Bad at: results while it runs, other than the parts that are there; and tables that grow: all of it is one run.

    Examples
    --------
    >>> import tempfile, numpy as np, driftwise as dw
    >>> y, _ = dw.simulate([-0.8], [0.0], samples=500, noise_std=1.0, seed=1)
    >>> table = {"pump": np.tile([7, 8], 500), "flow": np.repeat(y, 2) + 20.0}
    >>> job = dw.fleet.FleetJob(table, by="pump", output="flow", estimator=dw.AR(1), out=tempfile.mkdtemp())
    >>> found = dw.fleet.run_fleet(job)
    >>> found.rows, found.fleet.mean(7).round(1), sorted(path.name for path in found.out.iterdir())
    (1000, array([-0.8]), ['SHA256SUMS', 'estimates', 'events.parquet', 'final.parquet', 'fleet.parquet'])
    """
    batch, started = validation.count("batch", job.batch, least=1), time.monotonic()
    table = open_dataset(job.data, job.by, job.output, job.inputs, job.time, job.missing or ())
    words, folder = job.words or repr(job.estimator), Path(job.out)
    facts = {"order": facts_of(job), "words": words, "is_dated": bool(table.are_stamps), "is_read": False}
    _fit(job)
    _apart(job.data, folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made: {error.strerror or error}") from None
    with alone(folder, f"another process is running in {folder}: wait for it, or give another folder"):
        sweep(folder)
        kept = _kept(job)
        threads = job.threads
        fleet = Fleet(job.estimator, threads=threads) if kept is None else Fleet._of(kept, threads=threads)
        check_learns(job.estimator)
        run = _run(folder, fleet, facts)
        out = run.sinks
        if kept is None:
            run.keep(out.saved, facts)  # the first file: what comes after it is ours
        else:
            run.restore(kept)
        began = run.rows
        try:
            is_left = kept is None or not kept.facts["is_read"]
            if is_left:
                out.cut(run.rows)
            out.verify()
            if is_left:
                if go is None:
                    run.go(table, batch, _after(job, run, table, facts, started))
                else:
                    go(run, table)
                out.close(run.rows)
                run.keep(out.saved, facts | {"is_read": True})
            if not out.is_finished:
                out.finish(final(run.fleet, run.tally, run.intake.levels[0]))
        except OSError as error:
            raise InputError(
                f"the run in {folder} was stopped by the system at row {run.rows} ({error}). Is the disk full? Go on "
                "with it (resume=True) when there is room"
            ) from None
    return _result(run, began, time.monotonic() - started, facts | {"is_read": True})


def former_run(out, estimator=None) -> FleetResult:
    """Return what the run in a folder has come to so far; ``estimator`` only where a policy is your own."""
    saved = FleetOut(out, None).saved
    if not saved.exists():
        raise InputError(f"there is no run in {out}: no {saved.name}. Is it the folder of the data?")
    kept = store.read(saved, estimator)
    run = _run(out, Fleet._of(kept), kept.facts)
    run.restore(kept)
    return _result(run, run.rows, 0.0, kept.facts)


def _result(run: FleetRun, began: int, seconds: float, facts) -> FleetResult:
    out = run.sinks
    return FleetResult(
        run.fleet, run.tally, run.rows, run.intake.keyless, began, seconds, out.folder, run.events.reported,
        out.is_finished, facts,
    )  # fmt: skip


def _run(out, fleet: Fleet, facts) -> FleetRun:
    """Return a run at its beginning."""
    options = {name: facts["order"][name] for name in ("every", *INTAKE)}
    return FleetRun(fleet, FleetOut(out, fleet, facts.get("is_dated", False)), **options)


def _kept(job: FleetJob):
    """Return what a former run left to go on with, None where there is nothing; refuse what does not fit."""
    out = FleetOut(job.out, None)
    there = out.there()
    if not there:
        return None
    if job.replace and out.saved.exists():  # the first that a run writes, and the last that is deleted
        out.clear()
        return None
    if not job.resume and not job.replace:
        raise InputError(
            f"{job.out} holds a run already ({there[0].name}): go on with it (resume=True), delete its results and "
            "begin anew (replace=True), or give another folder"
        )
    if not out.saved.exists():
        what = "of a run to delete" if job.replace else "to resume from"
        raise InputError(f"there is no {out.saved} {what}, but {there[0]}: whose is it? Give another folder")
    kept = store.read(out.saved, job.estimator)
    refuse_another(job, kept.facts["order"])
    return kept


def _after(job: FleetJob, run: FleetRun, table, facts, started: float) -> Callable[[], None]:
    """Return what is done after each batch: long parts are written, a checkpoint when it is due, news."""
    last, since = time.monotonic(), 0

    def after() -> None:
        nonlocal last, since
        since += 1
        run.sinks.close(run.rows, long=True)
        is_due = time.monotonic() - last >= job.seconds if job.batches is None else since >= job.batches
        if is_due and len(run.fleet):
            run.sinks.close(run.rows)
            run.keep(run.sinks.saved, facts)
            last, since = time.monotonic(), 0
        if job.progress is not None:
            job.progress(Progress(run.rows, table.fraction, len(run.fleet), time.monotonic() - started))

    return after


def _fit(job: FleetJob) -> None:
    """Refuse columns that the estimator has no place for, and a run that is to go on and to begin anew."""
    model = job.estimator.model
    for what, names, takes in (
        ("outputs", job.output, job.estimator.outputs or 1),
        ("inputs", job.inputs, model.inputs),
    ):
        count = 1 if isinstance(names, str) else len(names)
        if count != takes:
            raise InputError(f"{what} must be {takes} for {job.estimator!r}, got {count}: {names!r}")
    if job.resume and job.replace:
        raise InputError("resume=True goes on with a run, replace=True deletes it: give one of them")


def _apart(data, folder: Path) -> None:
    """Refuse results among the data: the next run would read them."""
    if (
        isinstance(data, str | os.PathLike)
        and Path(data).is_dir()
        and folder.resolve().is_relative_to(Path(data).resolve())
    ):
        raise InputError(f"the results would lie among the data, {folder} in {data}: give a folder beside it")
