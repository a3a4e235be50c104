"""Events in the figures of the report: marks on the output, and lines across where something changed."""

from __future__ import annotations

from typing import Any, NamedTuple

from driftwise.engine.status import MEANING, Status
from driftwise.report.figure import LINES_SHOWN, MARKS

ACROSS = 1200  # marks of a kind that can be told apart across a page


class Mark(NamedTuple):
    """An event to draw: when, which kind of `figure.MARKS`, and what to say of it."""

    time: float
    name: str
    text: str


def marks(events, time=(), status=()) -> list[Mark]:
    """Return what is drawn of some events, and of the status of samples: a list of events may have been cut short."""
    import numpy as np

    found: list[Mark] = []
    for name, kinds, *_ in MARKS:
        some = {event.time: event.text for event in events if event.kind in kinds}
        for kind in kinds if name != "jump" else ():
            for when in np.asarray(time)[(np.asarray(status, int) & int(Status[kind])) != 0]:
                some.setdefault(float(when), MEANING[Status[kind]])
        found += [Mark(when, name, some[when]) for when in _spread(sorted(some))]
    return found


def _spread(times: list[float]) -> list[float]:
    """Return the first of the times at each place that can be told apart."""
    if len(times) <= ACROSS:
        return times
    step = (times[-1] - times[0]) / ACROSS or 1.0
    return list({round((when - times[0]) / step): when for when in reversed(times)}.values())[::-1]


def mark_dots(line, fig, found: list[Mark], level: float) -> list:
    """Mark jumps and changes of the noise along a level of a panel over a `Timeline`; return (name, what was drawn)."""
    from bokeh.models import ColumnDataSource, HoverTool

    drawn = []
    for name, _, colour, marker, dash in MARKS:
        some = [mark for mark in found if mark.name == name]
        if some and dash:
            time, text = [line.at(mark.time) for mark in some], [mark.text for mark in some]
            when = line.words(*(mark.time for mark in some))
            source = ColumnDataSource({"t": time, "y": [level] * len(some), "text": text, "when": when})
            look = {"marker": marker, "size": 12, "color": colour, "line_color": "#ffffff"}
            drawn.append((name, [fig.scatter("t", "y", source=source, **look)]))
    if drawn:
        fig.add_tools(
            HoverTool(renderers=[dot for _, some in drawn for dot in some], tooltips="@when: @text", visible=False)
        )
    return drawn


def mark_lines(line, fig, found: list[Mark]) -> None:
    """Draw a vertical line at each jump and change of the noise, unless they are too many to tell apart."""
    from bokeh.models.annotations import Span

    looks = {name: (colour, dash) for name, _, colour, _, dash in MARKS if dash}
    some = [mark for mark in found if mark.name in looks]
    for mark in some if len(some) <= LINES_SHOWN else ():
        colour, dash = looks[mark.name]
        look: dict[str, Any] = {"line_color": colour, "line_dash": dash, "line_alpha": 0.8, "line_width": 1.5}
        fig.add_layout(Span(location=line.at(mark.time), dimension="height", **look))
