"""The commands that the studies bring to `driftwise`: `reproduce` and `score`. Nothing heavy loads before one runs."""

from __future__ import annotations

from typing import Annotated

import typer


def reproduce(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="salut1979, radar, perriot1981, abid2008, tian2009 or policies.")
    ],
    seeds: Annotated[
        int | None,
        typer.Option(
            help="Simulated records; if omitted as many as each was checked with: 300 for salut1979, 500 for "
            "perriot1981, 400 for abid2008, 200 for tian2009 and policies; radar simulates nothing. Tolerances widen "
            "with fewer."
        ),
    ] = None,
    json: Annotated[str | None, typer.Option(help="Write the verdicts as JSON; - for standard output.")] = None,
    figures: Annotated[str | None, typer.Option(help="Write the figures and one HTML page into this folder.")] = None,
) -> None:
    """Run a paper's experiments again and say which findings are confirmed; exit code 0 when none fails.

    Example: driftwise reproduce salut1979 --figures out
    """
    from .papers.command import execute

    if not execute(name, seeds, json, figures):
        raise typer.Exit(1)


def score(
    data: Annotated[
        str | None,
        typer.Option(
            metavar="DIR", help="Folder of the recordings (sysid and tracking below it); else DRIFTWISE_DATA."
        ),
    ] = None,
    json: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write tables and verdicts as JSON; - for standard output.")
    ] = None,
    page: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the tables between the markers of this Markdown page.")
    ] = None,
    only: Annotated[str, typer.Option(metavar="NAME", help="Only what has NAME in its name.")] = "",
    processes: Annotated[int | None, typer.Option(min=1, help="How many at a time; all cores if omitted.")] = None,
    strict: Annotated[bool, typer.Option("--strict", metavar="", help="Exit code 1 when a target is missed.")] = False,
) -> None:
    """Measure driftwise on recordings, nothing tuned, beside opponents tuned in hindsight; say what is lost and won.

    Example: driftwise score --data recordings --json score.json
    """
    from .score.command import execute

    if not execute(data, json, page, only, processes) and strict:
        raise typer.Exit(1)
