"""`driftwise fleet run`: a long table of many series in; states, estimates, events, a summary and a page out."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from driftwise.cli import specs
from driftwise.cli.targets import refuse_file, refuse_folder
from driftwise.engine.errors import CommandError, InputError

__all__ = ["Order", "estimator_of", "execute", "one", "show_again"]

PAGE, NAMES = "summary.html", "outliers.csv"  # written into the folder beside what the run writes


@dataclass(frozen=True)
class Order:
    """What was asked for.

    Attributes
    ----------
    data : file, or folder of files
    by, output, inputs, time : names of columns
    model, memory, jumps : as for `driftwise run`; the model is arx:2,2 (ar:2 without an input) if omitted
    checkpoint : seconds ("60"), or batches ("20b"), between two checkpoints
    """

    data: str
    by: str
    output: str
    out: str
    inputs: tuple[str, ...] = ()
    time: str | None = None
    model: str | None = None
    memory: str | None = None
    jumps: str | None = None
    dt: float | None = None
    first: int = 32
    every: int = 100
    batch: int = 1 << 18
    threads: int | None = None
    checkpoint: str = "60"
    resume: bool = False
    replace: bool = False
    spark: str | None = None
    json: str | None = None
    quiet: bool = False
    missing: tuple[float, ...] = ()

    @property
    def chosen(self) -> str:
        """The model."""
        return self.model or ("arx:2,2" if self.inputs else "ar:2")

    @property
    def kept(self) -> str:
        """The word for the memory."""
        return self.memory or ("constant" if self.jumps or self.is_joint else "auto")

    @property
    def is_joint(self) -> bool:
        """Whether the model is the joint filter's."""
        return self.chosen.partition(":")[0] == "joint"

    @property
    def words(self) -> str:
        """Model and memory in words."""
        return f"{self.chosen}, memory {self.kept}" + (f", jumps {self.jumps}" if self.jumps else "")

    @property
    def pace(self) -> dict[str, Any]:
        """The time between two checkpoints, as `FleetJob` takes it."""
        text = self.checkpoint.strip().lower()
        number, is_count = (text[:-1], True) if text.endswith("b") else (text.removesuffix("s"), False)
        try:
            value = float(number)
        except ValueError:
            value = 0.0
        if not value > 0 or value == float("inf") or (is_count and value % 1):
            raise CommandError(f"--checkpoint takes seconds, as in 60, or batches, as in 20b; got {self.checkpoint!r}.")
        return {"batches": int(value)} if is_count else {"seconds": value}

    def check(self) -> None:
        """Refuse what cannot be, before anything is read."""
        self.pace  # noqa: B018  (it raises)
        if self.chosen.partition(":")[0] not in (*specs.MODELS, "joint"):
            known = ", ".join(specs.MODELS)
            raise CommandError(
                f"--model must be {known}, as in arx:2,2,1, or joint, as in joint:2; got {self.model!r}."
            )
        if "://" not in self.data and not os.path.exists(self.data):
            raise CommandError(f"no such file or folder: {self.data}")
        if self.resume and self.replace:
            raise CommandError("--resume goes on with a run, --replace deletes it: give one of them.")
        refuse_folder("--out", self.out)
        if os.path.isdir(self.out) and os.path.isdir(self.data) and os.path.samefile(self.out, self.data):
            raise CommandError("--out is the folder of the data: results would be taken for data; give another one.")
        if self.json and self.json != "-":
            refuse_file("--json", self.json)
        if self.dt is not None and not self.dt > 0:
            raise CommandError(f"--dt must be a positive step of the clock, got {self.dt:g}.")
        if self.dt is not None and self.time is None:
            raise CommandError(
                "--dt says how far samples lie apart on the clock, but there is no --time; which column?"
            )
        try:
            estimator_of(self)
        except InputError as error:
            raise specs.refusal(error, model=self.model, memory=self.memory, jumps=self.jumps) from None


def one(columns: list[str]) -> str:
    """Return the only output; a series has one here."""
    if len(columns) > 1:
        raise CommandError(
            f"--output names {len(columns)} columns, {', '.join(columns)}, and a series has one: run the fleet once "
            "for each, into folders of their own."
        )
    return columns[0]


def estimator_of(order: Order) -> Any:
    """Return the settings of every series, before they are scaled to its data.

    An offset is estimated besides: the level that is subtracted is that of the first samples only.
    """
    dt = order.dt or 1.0
    if order.is_joint:
        if order.jumps:
            raise InputError("--jumps is for --model arx and its kin; with joint say --memory restart or restart:STEP.")
        text = order.chosen + (f"@{order.memory}" if order.memory else "")
        return specs.estimators([text], order.inputs, dt)[text]
    memory = specs.policy(order.kept, order.jumps, False)
    more = {} if order.chosen == "regression" else {"offset": True}
    return specs.recursive(order.chosen, order.inputs, memory=memory, dt=dt, **more)


def execute(order: Order) -> None:
    """Run the fleet, write page and names beside its results, and print the summary."""
    order.check()
    try:
        result = _run(order)
    except KeyboardInterrupt:
        raise InputError(
            f"stopped; what was done until the last checkpoint is in {order.out}: go on with it (--resume)"
        ) from None
    title = os.path.basename(os.path.abspath(order.data))
    report = _report(result, title)
    took = result.seconds if result.began < result.rows else None
    report = replace(report, took=took, peak=_peak(), notes=(*report.notes, *_notes(result)))
    report = _written(report, result.out)
    if order.json:
        from driftwise.cli.results import write as write_json

        write_json(_content(order, report), order.json)
    if not order.quiet:
        _show(report, order.json == "-")


def _run(order: Order):
    """Return what the run came to, a bar shown while it lasts."""
    from driftwise.cli.progress import bar
    from driftwise.fleet.job import FleetJob

    with bar(f"fleet of {os.path.basename(os.path.abspath(order.data))}", order.quiet) as advance:
        asked = FleetJob(
            order.data, order.by, order.output, estimator_of(order), order.out, inputs=order.inputs, time=order.time,
            dt=order.dt, first=order.first, every=order.every, batch=order.batch, threads=order.threads,
            resume=order.resume, replace=order.replace, progress=lambda p: advance(p.share, f"{p.series} series"),
            words=order.words, missing=order.missing or None, **order.pace,
        )  # fmt: skip
        if order.spark:
            from driftwise.fleet.spark import run_on_spark

            return run_on_spark(asked, order.spark)
        from driftwise.fleet.fleet_run import run_fleet

        return run_fleet(asked)


def show_again(folder: str) -> None:
    """Print the summary of a run again, as far as it has come, and write its page."""
    from driftwise.fleet.fleet_run import former_run

    result = former_run(folder)
    report = _report(result, _title(result.facts["order"]["data"], result.out))
    unfinished = f"the run is not finished: this is what its last checkpoint knew, after {result.rows} rows."
    if not result.facts["is_read"]:
        report = replace(report, notes=(*report.notes, unfinished))
    _show(_written(report, result.out), False)


def _title(data, out: Path) -> str:
    """Return the name of the data that a run knows; of its folder, where they were no file."""
    is_file = bool(data) and isinstance(data[0], list) and isinstance(data[0][0], str)
    return Path(data[0][0]).parts[0] if is_file else out.resolve().name


def _report(result, title: str) -> Any:
    """Return what is to be reported of a run."""
    from driftwise.fleet.outliers import outliers
    from driftwise.report.fleet_report import FleetReport, gap_notes, key_notes, starts_anew

    asked, words = result.facts["order"], result.facts.get("words") or repr(result.fleet.estimators[0])
    output = asked["output"] if isinstance(asked["output"], str) else ", ".join(asked["output"])
    inputs = (asked["inputs"],) if isinstance(asked["inputs"], str) else tuple(asked["inputs"])
    report = FleetReport(
        title, asked["by"], output, inputs, result.fleet, result.tally, None, words, rows=result.rows, dt=asked["dt"],
        is_dated=result.facts.get("is_dated", False),
    )  # fmt: skip
    found = outliers(result.fleet, result.tally, inputs=inputs, when=report.when)
    found = replace(found, together=[]) if starts_anew(report) else found
    return replace(report, outliers=found, notes=(*key_notes(report), *gap_notes(report)))


def _notes(result) -> list[str]:
    """Return what to beware of."""
    found = []
    if result.keyless:
        found.append(f"{result.keyless} rows have no key: they belong to no series and were left out.")
    if 0 < result.began < result.rows:
        found.append(f"resumed: went on from row {result.began} of {result.rows}.")
    elif result.began:
        found.append("nothing was left to run: this is the summary of what was done.")
    return found


def _peak() -> float | None:
    """Return the most memory this process has had, in bytes, where the system says."""
    try:
        import resource
    except ImportError:
        return None
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(most) if sys.platform == "darwin" else 1024.0 * most


def _written(report, folder: Path) -> Any:
    """Write page and names, and tell all files that are there."""
    from driftwise.fleet.fleet_out import ESTIMATES, EVENTS, FINAL, FLEET
    from driftwise.report.fleet_page import write

    try:
        write(report, folder / PAGE)
        _write_names(report, folder / NAMES)
    except OSError as error:
        raise InputError(f"page and names cannot be written into {folder}: {error.strerror or error}") from None
    files = {
        PAGE: "page", NAMES: "who needs a look", FINAL: "a row for each series", ESTIMATES: "estimates",
        EVENTS: "events", FLEET: "to go on with",
    }  # fmt: skip
    there = tuple(f"{what} in {folder / name}" for name, what in files.items() if (folder / name).exists())
    return replace(report, files=there)


def _show(report, stderr: bool) -> None:
    from driftwise.report.terminal import console, show_fleet

    show_fleet(report, console(stderr=stderr))


def _write_names(report, path: Path) -> Path:
    """Write key, kind, rank, score and reason of everyone who needs a look; return the path."""
    import csv

    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["key", "kind", "rank", "score", "words"])
        found = report.outliers
        for kind, (rows, scores) in found.found.items():
            for rank, (row, score) in enumerate(zip(rows.tolist(), scores.tolist()), 1):
                writer.writerow([found.keys[row], kind, rank, f"{score:.6g}", found.words(kind, row)])
    return path


def _content(order: Order, report) -> dict:
    """Return the results as JSON has them; the files hold the rest."""
    from driftwise.report import fleet_report
    from driftwise.version import __version__

    found = report.outliers
    return {
        "driftwise": __version__, "data": order.data, "estimator": order.words, "series": len(report.fleet),
        "rows": report.rows, "samples": report.samples, "seconds": report.took, "time": report.span,
        "need_a_look": len(found.rows), "kinds": {kind: len(rows) for kind, (rows, _) in found.found.items()},
        "worst": [dict(zip(("key", "kind", "score", "words"), row)) for row in found.table()],
        "together": [{"start": b.start, "end": b.end, "keys": [found.keys[r] for r in b.rows]} for b in found.together],
        "rest": dict(zip(found.census.names, found.rest.median)) | {"noise": found.rest.noise},
        "quality": [dict(zip(("what", "rows", "share", "series"), row)) for row in fleet_report.quality(report)],
        "words": fleet_report.lead(report), "notes": report.notes, "files": report.files,
    }  # fmt: skip
