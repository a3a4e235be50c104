"""How a task says what it found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...papers.verdict import Verdict


def verdict(row: int, name: str, value: str, expected: str, confirmed) -> Verdict:
    """Return one finding of a numbered row; ``confirmed`` None where its recording is not there."""
    return Verdict(name, value, expected, None if confirmed is None else bool(confirmed), f"docs/score.md, row {row}")


def needs(file: str, *rows: tuple[int, str]):
    """Make a task skip, and say so, where its recording is not there; ``rows``: its numbers, what they are about."""

    def decorate(task: Callable[[Path], list[Verdict]]) -> Callable[[Path], list[Verdict]]:
        def run(where: Path) -> list[Verdict]:
            if not (where / file).exists():
                return [verdict(row, about, f"skipped: no {file}", "", None) for row, about in rows]
            return task(where)

        run.__name__, run.__doc__ = task.__name__, task.__doc__
        return run

    return decorate
