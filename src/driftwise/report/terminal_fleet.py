"""What `driftwise fleet run` prints: how much there was, who needs a look and why, where the files are."""

from __future__ import annotations

from driftwise.report import fleet_words
from driftwise.report.terminal import table

__all__ = ["MOST", "show", "table_of"]

MOST = 3  # of each kind


def show(told, out) -> None:
    """Print a fleet."""
    from rich.text import Text

    from driftwise.fleet.wording import percent

    out.print()
    out.print(Text(told.title, style="bold"))
    out.print(Text(" \u00b7 ".join(told.facts), style="dim"))
    out.print(Text(" \u00b7 ".join(told.cost), style="dim"))
    out.print()
    if len(told.outliers.rows):
        out.print(table_of(told))
        out.print()
    out.print(Text(fleet_words.lead(told)))
    for what, count, share, series in fleet_words.quality(told):
        of = f"{what}: {fleet_words.shown(count)} ({percent(share)}) in {fleet_words.shown(series)} series"
        out.print(Text(of, style="dim"))
    for note in told.notes:
        out.print(Text("note: ", style="yellow") + Text(note))
    for line in told.files:
        out.print(line, soft_wrap=True)
    out.print()


def table_of(told):
    """Return the worst of each kind, in words."""
    from driftwise.fleet.outliers import KINDS

    shown = table(("what", "left"), ("series", "right"), ("worst", "left"), ("why", "left"))
    shown.columns[3].no_wrap = False
    for kind, (rows, _) in told.outliers.found.items():
        for k, row in enumerate(rows[:MOST].tolist()):
            first = (KINDS[kind], fleet_words.shown(len(rows))) if k == 0 else ("", "")
            shown.add_row(*first, str(told.outliers.keys[row]), told.outliers.words(kind, row))
    return shown
