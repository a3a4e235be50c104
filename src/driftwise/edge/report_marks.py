"""Events in the figures of the report: marks along the bottom, and lines across where something changed."""

from __future__ import annotations

from driftwise.edge.figure import MARKS, PALETTE

__all__ = ["dots", "lines"]


def dots(fig, events, level: float) -> list:
    """Mark events along the bottom of a figure, each kind in its own way; return what was drawn."""
    from bokeh.models import ColumnDataSource

    named = {kind for _, kinds, *_ in MARKS for kind in kinds}
    others = tuple({event.kind for event in events} - named)
    drawn = []
    for name, kinds, colour, marker in (("other event", others, PALETTE["quiet"], "circle"), *MARKS):
        some = [event for event in events if event.kind in kinds]
        if some:
            time, text = [event.time for event in some], [event.text for event in some]
            source = ColumnDataSource({"t": time, "y": [level] * len(some), "text": text})
            look = {"marker": marker, "size": 5 if marker == "circle" else 9, "color": colour, "line_width": 2}
            drawn.append(fig.scatter("t", "y", source=source, legend_label=name, **look))
    return drawn


def lines(fig, changes) -> None:
    """Draw a vertical line at each (time, colour)."""
    from bokeh.models import Span  # type: ignore[attr-defined]

    for when, colour in changes:
        line = {"line_color": colour, "line_dash": "dotdash", "line_alpha": 0.7}
        fig.add_layout(Span(location=when, dimension="height", **line))
