"""`driftwise score`: measure, print the tables and the targets, write JSON and the page."""

from __future__ import annotations

import sys
from pathlib import Path

from driftwise.engine.errors import InputError
from driftwise.report.terminal import console
from driftwise_studies.papers.command import print_table, write_json

from ..papers.verdict import Verdict

MARKS = {True: ("met", "green"), False: ("MISSED", "bold red"), None: ("skipped", "yellow")}


def execute(data: str | None, json: str | None, page: str | None, only: str, processes: int | None) -> bool:
    """Score what there is below ``data`` and return whether every target is met."""
    from . import page as paper
    from .acceptance import verdicts
    from .records import folder
    from .run import run
    from .tables import tables
    from .worlds import judged

    if page and only:
        raise InputError("the page has everything on it: --page and --only cannot be used together")
    files = ("src/driftwise",), ("docs/constants.txt",)
    frozen = [judged.seed(of)[0] for of in files] if page else []  # a page is of what is committed
    found = run(folder(data), only, processes, lambda line: print(line, file=sys.stderr, flush=True))
    told, made = verdicts(found), tables(found)
    if json != "-":
        show(made, told, found.seconds)
    if json is not None:
        write_json(json, record(made, told, found.seconds))
    if page is not None:
        paper.write(Path(page), told, made, *frozen)
    return not any(v.fails for v in told)


def record(tables, told: list[Verdict], seconds: float) -> dict:
    """Return what ``--json`` writes."""
    return {
        "name": "score",
        "seconds": round(seconds, 1),
        "verdicts": [v.row() for v in told],
        "tables": [{"caption": t.caption, "head": t.head, "rows": t.rows} for t in tables],
    }


def show(tables, told: list[Verdict], seconds: float, out=None) -> None:
    """Print every table, the targets, and how many are met."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from .page import headline

    out = out or console()
    if not out.is_terminal:
        out.width = 240  # tables as wide as they are: nobody watches
    for one in tables:
        print_table(out, one)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, title="Targets", title_justify="left")
    for name in ("", "row", "what", "found", "target"):
        table.add_column(name, header_style="dim", no_wrap=not name, overflow="fold")
    for v in told:
        mark, style = MARKS[v.confirmed]
        table.add_row(Text(mark, style=style), v.source.rsplit("row ")[-1], v.name, v.value, v.expected)
    out.print()
    out.print(table)
    out.print(Text(f"{headline(told)} {seconds:.0f} s", style="bold"))
