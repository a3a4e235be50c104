"""Measure everything that was promised about speed and memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from . import verdicts as v


def main(
    big: Annotated[
        bool, typer.Option("--big", help="1e8 rows of Parquet instead of 5e6 (takes minutes, 2 GB).")
    ] = False,
    json: Annotated[Path, typer.Option(help="Where the verdicts go.")] = Path("bench.json"),
    only: Annotated[str, typer.Option(help="records, failures, calls, startup or lengths.")] = "",
    page: Annotated[Path | None, typer.Option(help="Write the table as a Markdown page too.")] = None,
) -> None:
    """Print a table of what was measured beside what was promised, and write it as JSON."""
    from rich.console import Console
    from rich.live import Live

    console = Console(width=None if Console().is_terminal else 160)
    found, table = [], v.table()
    with Live(table, console=console, auto_refresh=False) as live:
        for verdict in _all(100_000_000 if big else 5_000_000, only):
            found.append(verdict)
            v.add(table, verdict)
            live.update(table, refresh=console.is_terminal)
        live.update(table, refresh=True)
    v.write(json, found)
    if page:
        page.write_text(v.page(found))
    missed = [verdict.name for verdict in found if not verdict.kept]
    console.print(f"\n{len(found) - len(missed)} met, {len(missed)} missed; in {json}", highlight=False)


def _all(rows: int, only: str) -> Iterator[v.Verdict]:
    from . import calls, failures, lengths, records, startup

    parts = {
        "records": records.verdicts,
        "failures": failures.verdicts,
        "calls": calls.verdicts,
        "startup": startup.verdicts,
        "lengths": lambda: lengths.verdicts(rows),
    }
    for name, part in parts.items():
        if only in ("", name):
            yield from part()


if __name__ == "__main__":
    typer.run(main)
