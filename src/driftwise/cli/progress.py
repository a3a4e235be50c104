"""A bar on standard error for what takes longer than a moment."""

from __future__ import annotations

import sys
from contextlib import contextmanager


@contextmanager
def bar(what: str, quiet: bool = False):
    """Show a bar; yield a function of the share that is done (None: not known), and of a word about it."""
    if quiet or not sys.stderr.isatty():
        yield lambda share, word="": None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    from driftwise.report.printed import console

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console(stderr=True), transient=True) as shown:
        task = shown.add_task(what, total=1.0)
        yield lambda share, word="": shown.update(
            task, completed=share or 0.0, total=None if share is None else 1.0, description=f"{what} {word}".strip()
        )
