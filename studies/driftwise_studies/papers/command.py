"""`driftwise reproduce`: run a paper's experiments, print the verdicts, write them as JSON and as a page."""

from __future__ import annotations

import json as text
import sys
from pathlib import Path

from driftwise.cli.targets import refuse_file, refuse_folder
from driftwise.engine.errors import InputError
from driftwise.report.terminal import console

__all__ = ["execute", "print_table", "show", "write_json"]

MARKS = {True: ("confirmed", "green"), False: ("NOT CONFIRMED", "bold red"), None: ("skipped", "yellow")}


def execute(name: str, seeds: int | None, json: str | None, figures: str | None) -> bool:
    """Run one reproduction and return whether no finding fails."""
    from driftwise_studies.papers import reproduce

    if json not in (None, "-"):
        refuse_file("--json", str(json))
    if figures is not None:
        refuse_folder("--figures", figures)
    err = console(stderr=True)

    def say(title):
        if err.is_terminal:
            err.print(f"{title} …", style="dim")

    found = reproduce(name, seeds, say)
    if json is not None:
        write_json(json, found.record())
    if json != "-":
        show(found)
    if figures is not None:
        from driftwise_studies.papers.page import write

        page = write(found, figures)
        print(f"page: {page}", file=sys.stderr if json == "-" else sys.stdout)
    return found.passes


def show(found, out=None) -> None:
    """Print what of the paper does not hold, every section's verdicts, and what is not reproduced."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    out = out or console()
    out.print()
    out.print(Text(found.title, style="bold"))
    headline = Text(
        f"{found.headline}{'; ' if found.against else ''}{found.against} ({found.seeds} records)",
        style="bold" if found.passes else "bold red",
    )
    out.print(headline)
    if found.refuted:
        out.print()
        out.print(Text("What the paper says that does not hold", style="bold"))
        for said, measured in found.refuted:
            lines = Table.grid(padding=(0, 1))
            lines.add_row(Text("  the paper", style="yellow"), Text(f"{said.where}: {said.paper}"))
            lines.add_row(Text("  what holds", style="dim"), Text(said.truth))
            lines.add_row(Text("  measured", style="dim"), Text(measured))
            out.print()
            out.print(lines)
    for section in found.sections:
        out.print()
        out.print(Text(section.title, style="bold"))
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, expand=False)
        for column, ratio in (("", None), ("finding", 3), ("found", 3), ("expected", 3)):
            table.add_column(column, header_style="dim", ratio=ratio, no_wrap=not column, overflow="fold")
        for verdict in section.verdicts:
            mark, style = MARKS[verdict.confirmed]
            said = verdict.refutes
            tag = Text(f" (against the paper, {said.where})" if said else "", style="yellow")
            table.add_row(
                Text(mark, style=style), Text(verdict.name) + tag, Text(verdict.value), Text(verdict.expected)
            )
        out.print(table)
        for result in section.tables:
            if result.is_result:
                print_table(out, result)
        for line in section.missing:
            out.print(Text("not reproduced: ", style="yellow") + Text(line))
    out.print()
    out.print(headline)


def print_table(out, numbers) -> None:
    """Print a table that is the result itself."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, title=numbers.caption, title_justify="left")
    for k, column in enumerate(numbers.head):
        table.add_column(column, header_style="dim", justify="right" if k else "left", no_wrap=not k)
    for row in numbers.rows:
        table.add_row(*row)
    out.print()
    out.print(table)


def write_json(file, record):
    """Write a record of verdicts as JSON to a file, or to standard output where it is -."""
    try:
        line = text.dumps(record, ensure_ascii=False, indent=1)
        if file == "-":
            print(line)
        else:
            Path(file).write_text(line + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be written ({error.strerror or error}). Does its folder exist?") from None
