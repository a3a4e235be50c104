"""Measure everything that was promised about speed and memory."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from . import verdicts as v

PARTS = (
    "records", "failures", "calls", "smoothing", "outputs", "continuous", "choices", "recursive", "memories",
    "detectors", "observers", "tracks", "evidence", "startup", "lengths",
)  # fmt: skip


def main(
    big: Annotated[
        bool, typer.Option("--big", help="1e8 rows of Parquet instead of 5e6 (takes minutes, 2 GB).")
    ] = False,
    json: Annotated[Path, typer.Option(help="Where the verdicts go.")] = Path("bench.json"),
    only: Annotated[str, typer.Option(help=f"One part: {', '.join(PARTS)}.")] = "",
    page: Annotated[Path | None, typer.Option(help="Write the table as a Markdown page too.")] = None,
) -> None:
    """Print a table of what was measured beside what was promised, and write it as JSON."""
    from rich.console import Console
    from rich.live import Live

    if only not in ("", *PARTS):
        raise typer.BadParameter(f"no part is called {only!r}; there are {', '.join(PARTS)}")
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
    for name in PARTS:
        if only in ("", name):
            part = import_module(f".{name}", __package__)
            yield from part.verdicts(rows) if name == "lengths" else part.verdicts()


if __name__ == "__main__":
    typer.run(main)
