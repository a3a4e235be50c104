"""`driftwise reproduce`: run a paper's experiments, print the verdicts, write them as JSON and as a page."""

from __future__ import annotations

import json as text
import sys
from pathlib import Path

from driftwise.edge.terminal import console
from driftwise.errors import InputError

__all__ = ["execute", "show"]

MARKS = {True: ("holds", "green"), False: ("FAILS", "bold red"), None: ("skipped", "yellow")}


def execute(name: str, seeds: int, json: str | None, figures: str | None) -> bool:
    """Run one reproduction and return whether every check holds."""
    from driftwise.reproduce import reproduce

    err = console(stderr=True)

    def say(title):
        if err.is_terminal:
            err.print(f"{title} …", style="dim")

    found = reproduce(name, seeds, say)
    if json is not None:
        _write_json(json, found.record())
    if json != "-":
        show(found)
    if figures is not None:
        from driftwise.reproduce.page import write

        page = write(found, figures)
        print(f"page: {page}", file=sys.stderr if json == "-" else sys.stdout)
    return found.passes


def show(found, out=None) -> None:
    """Print every section's verdicts, and what is not reproduced."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    out = out or console()
    out.print()
    out.print(Text(found.title, style="bold"))
    for section in found.sections:
        out.print()
        out.print(Text(section.title, style="bold"))
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, expand=False)
        for column, ratio in (("", None), ("check", 3), ("found", 3), ("expected", 3)):
            table.add_column(column, header_style="dim", ratio=ratio, no_wrap=not column, overflow="fold")
        for verdict in section.verdicts:
            mark, style = MARKS[verdict.holds]
            table.add_row(Text(mark, style=style), Text(verdict.name), Text(verdict.value), Text(verdict.expected))
        out.print(table)
        for line in section.missing:
            out.print(Text("not reproduced: ", style="yellow") + Text(line))
    verdicts = found.verdicts
    failed, skipped = sum(v.fails for v in verdicts), sum(v.holds is None for v in verdicts)
    out.print()
    out.print(
        Text(
            f"{len(verdicts) - failed - skipped} of {len(verdicts)} checks hold, {failed} fail, {skipped} skipped "
            f"({found.seeds} records)",
            style="bold red" if failed else "bold",
        )
    )


def _write_json(file, record):
    try:
        line = text.dumps(record, ensure_ascii=False, indent=1)
        if file == "-":
            print(line)
        else:
            Path(file).write_text(line + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be written ({error.strerror or error}). Does its folder exist?") from None
