"""Options that several commands share, declared once."""

from __future__ import annotations

from typing import Annotated

import typer

TableFile = Annotated[str, typer.Argument(help="CSV or Parquet table, or - for CSV on standard input.")]
Inputs = Annotated[
    list[str] | None, typer.Option("--input", "-i", metavar="COLUMN", help="Column of an input; repeat for several.")
]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="TIME",
        help="Leave out rows before this time: a number (of time stamps: seconds since the first), or a date such as "
        "2024-03-30 or 2024-03-30T12:00.",
    ),
]
To = Annotated[
    str | None,
    typer.Option(
        "--to", metavar="TIME", help="Leave out rows after this time; a date without a time is the whole day."
    ),
]
Json = Annotated[str | None, typer.Option(metavar="FILE", help="Write the results as JSON; - for standard output.")]
Chunk = Annotated[int, typer.Option(help="Rows held in memory at a time.", min=1, hidden=True)]
TakeBest = Annotated[
    bool,
    typer.Option(
        "--take-best",
        metavar="",
        help="Where the columns can be read in two ways, take the likelier one instead of asking (exit code 3).",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", metavar="", help="Print nothing but errors.")]
Page = Annotated[str | None, typer.Option(metavar="FILE", help="Write a self-contained HTML page.")]


def time_option(what: str) -> typer.models.OptionInfo:
    """Return the option --time."""
    return typer.Option("--time", "-t", metavar="COLUMN", help=f"Column of the time{what}")
