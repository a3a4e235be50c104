"""`driftwise fleet`: a long table of many series in; states, estimates, events, a summary and a page out."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from driftwise.cli import specs
from driftwise.cli.job import Job
from driftwise.cli.options import Inputs, Quiet, time_option
from driftwise.cli.targets import refuse_files, refuse_folder
from driftwise.engine.atomic import replaced
from driftwise.engine.errors import CommandError, InputError, Stopped
from driftwise.tables.spreadsheet import harmless

PAGE, NAMES = "summary.html", "outliers.csv"  # written into the folder beside what the run writes
HEAD = "key", "kind", "rank", "score", "words"  # of the names


@dataclass
class FleetRunJob(Job):
    """Estimate every series of a long table, in memory that does not grow with it.

    Rows of a series may be mixed with those of others in any way; those of one series stand in order of time. Writes
    into DIR: summary.html and outliers.csv (who jumped, drifts, differs, is not identifiable, is not to be believed),
    final.parquet (one row for each series), estimates, events.parquet, and the states to go on with.

    Example: driftwise fleet run pumps --by asset --output flow --input speed --time time --out results
    """

    data: Annotated[str, typer.Argument(help="Parquet or CSV file, or a folder of them (partitioned or not).")]
    by: Annotated[str, typer.Option("--by", "-b", metavar="COLUMN", help="Column that says whose row it is.")]
    output: Annotated[
        list[str], typer.Option("--output", "-o", metavar="COLUMN", help="Column of the measured output.")
    ]
    out: Annotated[str, typer.Option("--out", metavar="DIR", help="Folder for the results; made if need be.")]
    input: Inputs = None
    time: Annotated[
        str | None,
        time_option(
            ". Rows that come late or twice are then counted and left out; without it, rows of a series are trusted to "
            "be in order."
        ),
    ] = None
    model: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:ORDERS",
            help="As for run: arx:NA,NB[,NK] (arx:2,2 if omitted; ar:2 without an input), armax, oe, bj; or joint:N. "
            "Each series has an offset besides.",
        ),
    ] = None
    memory: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:NUMBER",
            help="As for run: auto if omitted (how fast each parameter drifts, noise, outliers and jumps are found "
            "out), constant (several times faster), exponential:LAM, restart, ...",
        ),
    ] = None
    jumps: Annotated[
        str | None,
        typer.Option(metavar="DETECTOR:RATE[,SIZE]", help="As for run: start afresh at jumps, e.g. parameters:10000."),
    ] = None
    dt: Annotated[
        float | None,
        typer.Option(
            metavar="STEP",
            help="Step of the clock: ticks without a row become missing samples. Without it, rows are taken as equally "
            "spaced.",
        ),
    ] = None
    missing: Annotated[
        list[float] | None,
        typer.Option(metavar="CODE", help="A value that stands for a missing one, e.g. -9999; repeat for several."),
    ] = None
    first: Annotated[
        int,
        typer.Option(
            metavar="ROWS",
            min=1,
            help="Complete rows of each series that tell its level and units; more for slow plants.",
        ),
    ] = 32
    every: Annotated[
        int, typer.Option(metavar="N", min=0, help="Write an estimate for every N samples of a series; 0: none.")
    ] = 100
    batch: Annotated[int, typer.Option(metavar="ROWS", min=1, help="Rows in memory at a time.")] = 1 << 18
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores if omitted.")] = None
    checkpoint: Annotated[
        str,
        typer.Option(metavar="SECONDS|BATCHESb", help="Between two checkpoints: 60 (seconds), 20b (batches)."),
    ] = "60"
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", metavar="", help="Go on from the last checkpoint in DIR, bit for bit as if never stopped."
        ),
    ] = False
    replace: Annotated[
        bool, typer.Option("--replace", metavar="", help="Delete what a former run wrote into DIR, and nothing else.")
    ] = False
    spark: Annotated[
        str | None, typer.Option(metavar="URL", help="Run on Apache Spark, e.g. local[4] or spark://host:7077.")
    ] = None
    json: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the summary as JSON; - for standard output.")
    ] = None
    quiet: Quiet = False

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(self.input or ())

    @property
    def model_word(self) -> str:
        """The word for the model."""
        return self.model or ("arx:2,2" if self.inputs else "ar:2")

    @property
    def memory_word(self) -> str:
        """The word for the memory."""
        return self.memory or ("constant" if self.jumps or self.is_joint else "auto")

    @property
    def is_joint(self) -> bool:
        """Whether the model is the joint filter's."""
        return self.model_word.partition(":")[0] == "joint"

    @property
    def words(self) -> str:
        """Model and memory in words."""
        return f"{self.model_word}, memory {self.memory_word}" + (f", jumps {self.jumps}" if self.jumps else "")

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
        if len(self.output) > 1:
            raise CommandError(
                f"--output names {len(self.output)} columns, {', '.join(self.output)}, and a series has one: run the "
                "fleet once for each, into folders of their own."
            )
        self.pace  # noqa: B018  (it raises)
        if self.model_word.partition(":")[0] not in (*specs.MODELS, "joint"):
            known = ", ".join(specs.MODELS)
            raise CommandError(
                f"--model must be {known}, as in arx:2,2,1, or joint, as in joint:2; got {self.model!r}."
            )
        if "://" not in self.data and not os.path.exists(self.data):
            raise CommandError(f"no such file or folder: {self.data}")
        if self.resume and self.replace:
            raise CommandError("--resume goes on with a run, --replace deletes it: give one of them.")
        refuse_folder("--out", self.out)
        refuse_files([("--json", self.json)], [self.data])
        if self.dt is not None and self.time is None:
            raise CommandError(
                "--dt says how far samples lie apart on the clock, but there is no --time; which column?"
            )
        try:
            self.estimator()
        except InputError as error:
            raise specs.refusal(error, model=self.model, memory=self.memory, jumps=self.jumps) from None
        self._check_places()

    def _check_places(self) -> None:
        """Refuse a folder among the data, or with what is none of ours, and a cluster that is none."""
        if os.path.isdir(self.data) and Path(self.out).resolve().is_relative_to(Path(self.data).resolve()):
            raise CommandError(
                f"--out {self.out} lies in the folder of the data: results would be taken for data; give another one."
            )
        try:
            option = "--out"
            _refuse_strangers(Path(self.out))
            if self.spark:
                from driftwise.fleet.spark.masters import refuse

                option = "--spark"
                refuse(self.spark)
        except InputError as error:
            raise CommandError(f"{option}: {error}") from None

    def estimator(self) -> Any:
        """Return the settings of every series, before they are scaled to its data.

        An offset is estimated besides: the level that is subtracted is that of the first samples only.
        """
        dt = self.dt or 1.0
        if self.is_joint:
            if self.jumps:
                raise InputError(
                    "--jumps is for --model arx and its kin; with joint say --memory restart or restart:STEP."
                )
            text = self.model_word + (f"@{self.memory}" if self.memory else "")
            return specs.estimators([text], self.inputs, dt)[text]
        memory = specs.policy(self.memory_word, self.jumps)
        more = {} if self.model_word == "regression" else {"offset": True}
        return specs.recursive(self.model_word, self.inputs, memory=memory, dt=dt, **more)

    def estimate(self) -> None:
        """Run the fleet, a bar shown while it lasts."""
        from driftwise.cli.progress import bar
        from driftwise.fleet.job import FleetJob

        title = os.path.basename(os.path.abspath(self.data))
        with bar(f"fleet of {title}", self.quiet) as advance:
            asked = FleetJob(
                self.data, self.by, self.output[0], self.estimator(), self.out, inputs=self.inputs, time=self.time,
                dt=self.dt, first=self.first, every=self.every, batch=self.batch, threads=self.threads,
                resume=self.resume, replace=self.replace, progress=lambda p: advance(p.share, f"{p.series} series"),
                words=self.words, missing=tuple(self.missing or ()) or None, **self.pace,
            )  # fmt: skip
            try:
                self.result = self._run(asked)
            except (KeyboardInterrupt, Stopped) as asked_to:
                left = f"what was done until the last checkpoint is in {self.out}: go on with it (--resume)"
                raise Stopped(getattr(asked_to, "code", 130), left) from None

    def _run(self, asked):
        if self.spark:
            from driftwise.fleet.spark import run_on_spark

            return run_on_spark(asked, self.spark)
        from driftwise.fleet.fleet_run import run_fleet

        return run_fleet(asked)

    def summarise(self) -> None:
        """Write page and names beside the results."""
        result = self.result
        report = _report(result, os.path.basename(os.path.abspath(self.data)))
        took = result.seconds if result.began < result.rows else None
        report = replace(report, took=took, peak=_peak(), notes=(*report.notes, *_notes(result)))
        self.summary = _written(report, result.out)

    def tell(self) -> None:
        """Write the results as JSON, and print the summary."""
        if self.json:
            from driftwise.cli.results import write

            write(self.content(), self.json)
        if not self.quiet:
            _show(self.summary, self.json == "-")

    def content(self) -> dict[str, Any]:
        """Return the results as JSON has them; the files hold the rest."""
        from driftwise.report import fleet_report
        from driftwise.version import __version__

        report, found = self.summary, self.summary.outliers
        return {
            "driftwise": __version__, "data": self.data, "estimator": self.words, "series": len(report.fleet),
            "rows": report.rows, "samples": report.samples, "seconds": report.took, "time": report.span,
            "need_a_look": len(found.rows), "kinds": {kind: len(rows) for kind, (rows, _) in found.found.items()},
            "worst": [dict(zip(("key", "kind", "score", "words"), row)) for row in found.table()],
            "together": [{"start": b.start, "end": b.end, "keys": [found.keys[r] for r in b.rows]}
                         for b in found.together],
            "rest": dict(zip(found.census.names, found.rest.median)) | {"noise": found.rest.noise},
            "quality": [dict(zip(("what", "rows", "share", "series"), row)) for row in fleet_report.quality(report)],
            "words": fleet_report.lead(report), "notes": report.notes, "files": report.files,
        }  # fmt: skip


@dataclass
class FleetShowJob:
    """Print the summary of a finished run again.

    Example: driftwise fleet show results
    """

    folder: Annotated[str, typer.Argument(metavar="DIR", help="Folder of a finished run.")]

    def run(self) -> None:
        """Print the summary as far as the run has come, and write its page."""
        from driftwise.fleet.fleet_run import former_run

        result = former_run(self.folder)
        _refuse_strangers(result.out)
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
    """Return what a run has found, as its page and its summary take it."""
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
        found.append(
            "1 row has no key: it belongs to no series and was left out."
            if result.keyless == 1
            else f"{result.keyless} rows have no key: they belong to no series and were left out."
        )
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


def _refuse_strangers(folder: Path) -> None:
    """Refuse a folder in which a page or names stand that no run has written."""
    for name, mark in ((PAGE, b'name="generator" content="driftwise"'), (NAMES, ",".join(HEAD).encode())):
        path = folder / name
        if path.is_file():
            with open(path, "rb") as file:
                if mark not in file.read(1 << 12):
                    raise InputError(f"{path} was not written by a run of a fleet: move it, or give another folder")


def _written(report, folder: Path) -> Any:
    """Write page and names, and say which files are there."""
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
    from driftwise.report.printed import console
    from driftwise.report.terminal import show_fleet

    show_fleet(report, console(stderr=stderr))


def _write_names(report, path: Path) -> Path:
    """Write key, kind, rank, score and reason of everyone who needs a look; return the path."""
    import csv

    with replaced(path) as beside, open(beside, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(HEAD)
        found = report.outliers
        for kind, (rows, scores) in found.found.items():
            for rank, (row, score) in enumerate(zip(rows.tolist(), scores.tolist()), 1):
                writer.writerow(
                    [harmless(found.keys[row]), kind, rank, f"{score:.6g}", harmless(found.words(kind, row))]
                )
    return path
