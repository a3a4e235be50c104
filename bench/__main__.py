"""Measure everything that was promised about speed and memory."""

from __future__ import annotations

import time
import traceback
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from driftwise.fleet import crew

from . import verdicts as v
from .groups import PARTS
from .machine import machine
from .page import page, terminal

LONG = ("lengths", "fleets", "fleet_files")  # the parts that --big makes longer


def main(
    big: Annotated[
        bool, typer.Option("--big", help="1e8 rows of Parquet instead of 5e6, 1000 samples a series (minutes, 2 GB).")
    ] = False,
    json: Annotated[Path, typer.Option(help="Where verdicts and tables go.")] = Path("bench.json"),
    only: Annotated[str, typer.Option(help=f"One part, or several with commas: {', '.join(PARTS)}.")] = "",
    docs: Annotated[
        Path | None, typer.Option(help="Write benchmarks.md, and figures/roofline.svg, into this folder too.")
    ] = None,
) -> None:
    """Print what was measured beside what was promised, and write it as JSON."""
    from rich.console import Console

    crew.FEW = 0  # fleets are measured with the loop that large ones have
    wanted = [name.strip() for name in only.split(",")] if only else list(PARTS)
    for name in wanted:
        if name not in PARTS:
            raise typer.BadParameter(f"no part is called {name!r}; there are {', '.join(PARTS)}")
    console = Console(width=None if Console().is_terminal else 160, highlight=False, markup=False)
    told, found, seconds = machine(), [], {}
    for part in wanted:
        start = time.perf_counter()
        for one in _verdicts(part, big):
            found.append((part, one))
            console.print(terminal(one))
        seconds[part] = round(time.perf_counter() - start, 1)
    v.write(json, told, seconds, [one for _, one in found])
    if docs:
        (docs / "benchmarks.md").write_text(page(found, told))
        if "roofline" in wanted:
            import_module(".figure", __package__).draw(docs / "figures" / "roofline.svg", found)
    missed = sum(isinstance(one, v.Verdict) and not one.kept for _, one in found)
    console.print(f"\n{missed} missed, {sum(seconds.values()):.0f} s; in {json}")


def _verdicts(name: str, big: bool) -> Iterator[v.Verdict | v.Table]:
    """Yield what a part finds; where it breaks, that is told, and the others go on."""
    try:
        part = import_module(f".{name}", __package__)
        yield from part.verdicts(big) if name in LONG else part.verdicts()
    except Exception as error:
        traceback.print_exc()
        yield v.not_measured(f"{name}, to its end", "no error", f"bench/{name}.py", f"{type(error).__name__}: {error}")


if __name__ == "__main__":
    typer.run(main)
