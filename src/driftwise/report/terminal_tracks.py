"""What `driftwise track` prints: the tracks in a table, the whole in a sentence, what was skipped."""

from __future__ import annotations

from driftwise.report import track_words
from driftwise.report.terminal import table

__all__ = ["MOST", "show", "table_of"]

MOST = 20  # tracks listed


def show(tracks, rows, *, title: str, took: str, out) -> None:
    """Print the tracks, the busiest first."""
    from rich.text import Text

    plots = f"{sum(r.plots for r in rows)} plots on {len(rows)} track{'' if len(rows) == 1 else 's'}"
    out.print()
    out.print(Text(title, style="bold"))
    out.print(Text(" \u00b7 ".join(filter(None, [plots, took])), style="dim"))
    out.print()
    if rows:
        out.print(table_of(rows))
        if len(rows) > MOST:
            rest = rows[MOST:]
            out.print(Text(f"and {len(rest)} more tracks of {rest[-1].plots} to {rest[0].plots} plots", style="dim"))
        out.print()
    out.print(Text(track_words.lead(rows, tracks.counts)))
    if told := track_words.faults_told(tracks.faults):
        out.print(Text("skipped: ", style="yellow") + Text(told))
    for told in filter(None, (track_words.counted(tracks.counts), track_words.hint(rows, tracks.counts))):
        out.print(Text("note: ", style="yellow") + Text(f"{told}."))
    out.print()


def table_of(rows):
    """Return the table of the busiest tracks."""
    days = {track_words.when(t).partition(" ")[0] for r in rows for t in (r.start, r.end)}
    dated = bool(rows) and track_words.clock(rows[0].start) is not None and len(days) > 1
    narrow = {"manoeuvres": "man-\noeuvres", "in 95 %": "in\n95 %"}
    text = ("track", "name", "from", "to", "status")
    shown = table(*((narrow.get(name, name), "left" if name in text else "right") for name in track_words.HEAD))
    for r in rows[:MOST]:
        label, name, start, end, *numbers = track_words.cells(r, with_day=dated)
        shown.add_row(label, name, *(time[2:-3] if dated else time for time in (start, end)), *numbers)
    return shown
