"""The question that a command asks where the columns of a table can be read in more than one way."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from typing import Any, NoReturn

import typer

ASKED = 3  # exit code

# options of a job that go into a command, beside those of a model
KEPT = ("time", "dt", "save", "report", "json")


def command(reading: Any, job: Any) -> str:
    """Return the command that takes one reading, ready to be run."""
    words = ["driftwise", *job.called, "-o", reading.output]
    for name in reading.inputs:
        words += ["-i", name]
    for option in (*job.changed, *(f"--{field}" for field in KEPT)):
        value = getattr(job, option.removeprefix("--"))
        if value is not None:
            words += [option] if value is True else [option, f"{value:g}" if isinstance(value, float) else str(value)]
    return shlex.join(words)


def recognised(job: Any, output: str | None, inputs: tuple[str, ...] | None) -> tuple[Any, Any]:
    """Return the `Table` of a job's file and its segments, those columns recognised that are None; it may ask."""
    from driftwise.analysis.directions import read_settled

    table, segments = read_settled(job.file, output, inputs, job.time, job.chunk, dt=job.dt)
    if table.is_ambiguous and not job.take_best:
        ask(table, job, segments)
    job.is_recognised = True
    return table, segments


def ask(table: Any, job: Any, segments: Any) -> NoReturn:
    """Print the readings of a table with their evidence and commands, write them as JSON where asked, and stop.

    What several columns have in common and changed at one date is told all the same: it asks for no output.
    """
    from driftwise.analysis.table_together import together_of, together_words
    from driftwise.cli.results import write
    from driftwise.report.terminal import console
    from driftwise.tables.table_words import asked_words
    from driftwise.version import __version__

    commands = [command(reading, job) for reading in table.alternatives]
    common = together_of(segments.table.head, table)
    if job.json:
        found = [one._asdict() | {"command": line} for one, line in zip(table.alternatives, commands)]
        told = {"together": [asdict(one) for one in common]} if common else {}
        write({"driftwise": __version__, "alternatives": found, **told}, job.json)
    out = console(stderr=job.json == "-")
    for line in (*asked_words(table, commands), *(together_words(one, table, segments.origin) for one in common)):
        out.print(line, markup=False, highlight=False, soft_wrap=True)
    raise typer.Exit(ASKED)
