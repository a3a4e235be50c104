"""The looks of a figure of the report, and the time axis that all its panels share."""

from __future__ import annotations

from typing import Any

from driftwise.report.figure import PALETTE
from driftwise.results.numbers import instant, number

FONT = "system-ui, -apple-system, Segoe UI, Roboto, Helvetica Neue, Arial, sans-serif"
LEFT = 84  # pixels left of the frame, so that frames stand one above the other
ENTRY, LETTER = 41.0, 7.0  # pixels of an entry of a legend beside its name, and of a letter of it
BREAK_LEGEND = """
const fitting = widths.findLastIndex((width) => width <= cb_obj.inner_width) + 1
legend.ncols = fitting == widths.length ? "auto" : Math.max(fitting, 1)
legend.spacing = fitting == widths.length ? 14 : 4
"""


class Timeline:
    """One time axis for all panels of a page: they zoom, pan and point together.

    Parameters
    ----------
    time : (T,) seconds, or what `label` says
    label : name of the axis with its unit
    origin : time stamp (ISO 8601) of second 0; the axis then shows dates
    rows : (T,) numbers of the samples where some were left out
    """

    def __init__(self, time, label: str = "time (s)", origin: str | None = None, rows=None):
        import numpy as np
        from bokeh.models.annotations.geometry import Span
        from bokeh.models.ranges import Range1d

        self.stamp = origin
        self.origin = None if origin is None else float(np.datetime64(origin, "ms").astype(float))
        self.label = label if origin is None else "date"
        self.t = self.at(np.asarray(time, float))
        self.rows = np.arange(len(self.t)) if rows is None else np.asarray(rows)
        start, end = float(np.nanmin(self.t)), float(np.nanmax(self.t))
        self.range: Any = Range1d(start=start, end=end if end > start else start + 1.0)
        # an overlay is drawn alone when it moves, anything below it with all else
        self.pointer = Span(dimension="height", line_color=PALETTE["quiet"], line_width=1, level="overlay")

    def __len__(self):
        return len(self.t)

    def at(self, time):
        """Return where times lie on the axis: milliseconds since 1970 where it shows dates."""
        return time if self.origin is None else self.origin + 1000.0 * time

    def words(self, *times: float) -> list[str]:
        """Return instants as they are written."""
        return [number(time) if self.stamp is None else instant(time, self.stamp) for time in times]

    def source(self, i, **columns) -> Any:
        """Return a Bokeh source of samples `i`: time t, number k, and these (T,) columns."""
        import numpy as np
        from bokeh.models import ColumnDataSource

        found = {name: single(np.asarray(column)[i]) for name, column in columns.items()}
        return ColumnDataSource({"t": self.t[i], "k": self.rows[i].astype(np.int32), **found})

    def figure(self, height: int, label: str, *, is_named: bool = True, **more) -> Any:
        """Return an empty panel over this axis; only where `is_named` the axis says what it shows."""
        from bokeh.models import CrosshairTool

        kind = "linear" if self.origin is None else "datetime"
        pointer = CrosshairTool(overlay=self.pointer, visible=False)
        more |= {"height": height, "x_range": self.range, "x_axis_type": kind}
        fig = zoomable({"dimensions": "auto"}, {"dimensions": "width"}, pointer, **more)
        fig.min_border_left = LEFT
        for axis in fig.axis:
            if hasattr(axis.formatter, "power_limit_high"):
                axis.formatter.power_limit_high = 7
        return dress(fig, self.label if is_named else "", label)

    def hover(self, fig, renderers, *tips: tuple[str, str]) -> None:
        """Let a panel tell the sample, the time and these (name, column) under the pointer."""
        from bokeh.models import HoverTool

        dated = self.origin is not None
        shown = [("sample", "@k"), (self.label, "@t{%F %T}" if dated else "@t{%.6g}")]
        shown += [(name, f"@{column}{{%.5g}}") for name, column in tips]
        kinds: dict[Any, Any] = {f"@{column}": "printf" for _, column in tips} | {
            "@t": "datetime" if dated else "printf"
        }
        fig.add_tools(HoverTool(renderers=renderers, tooltips=shown, formatters=kinds, mode="vline", visible=False))


def zoomable(box=None, wheel=None, *tools, **more) -> Any:
    """Return an empty figure that is zoomed by dragging and by Ctrl and wheel (the bare wheel scrolls the page)."""
    from bokeh.models import BoxZoomTool, CustomJS, PanTool, ResetTool, SaveTool, WheelZoomTool
    from bokeh.plotting import figure

    zoom, scroll = BoxZoomTool(**box or {}), WheelZoomTool(modifiers={"ctrl": True}, **wheel or {})
    fig: Any = figure(tools=[zoom, PanTool(), scroll, ResetTool(), SaveTool(), *tools], **more)
    fig.toolbar.active_drag, fig.toolbar.active_scroll = zoom, scroll
    fig.js_on_event("doubletap", CustomJS(args={"figure": fig}, code="figure.reset.emit()"))
    return fig


def across(fig, at: float, **look) -> None:
    """Draw a line across a figure at a level."""
    from bokeh.models.annotations.geometry import Span

    fig.add_layout(Span(location=at, **{"dimension": "width", "line_color": PALETTE["quiet"], "line_width": 1, **look}))


def shade(fig, low: float, high: float, way: str = "bottom top", **look) -> None:
    """Shade a figure between two levels."""
    from bokeh.models.annotations.geometry import BoxAnnotation

    usual: Any = {"fill_color": PALETTE["predicted"], "fill_alpha": 0.08, "line_color": None, "level": "underlay"}
    fig.add_layout(BoxAnnotation(**usual | dict(zip(way.split(), (low, high))) | look))


def dress(fig, x_label: str = "", y_label: str = ""):
    """Give a Bokeh figure the looks of the page, and return it."""
    fig.sizing_mode = "stretch_width"
    fig.toolbar.logo = None
    fig.toolbar.autohide = True
    fig.border_fill_color = fig.background_fill_color = "#ffffff"
    fig.outline_line_color = None
    fig.min_border_right = 12
    fig.grid.grid_line_color = PALETTE["grid"]
    for axis, label in ((fig.xaxis, x_label), (fig.yaxis, y_label)):
        axis.axis_label = label or None
        axis.axis_label_text_font = axis.major_label_text_font = FONT
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "13px"
        axis.axis_label_text_color = axis.major_label_text_color = "#3e4c59"
        axis.axis_line_color = axis.major_tick_line_color = "#9aa5b1"
        axis.minor_tick_line_color = None
    return fig


def legend(fig, drawn) -> None:
    """Put a legend in a row above a figure; ``drawn`` are pairs of a name and what was drawn for it.

    Where the frame is too narrow for the row, it is broken into several.
    """
    from bokeh.models import CustomJS, Legend, LegendItem  # type: ignore[attr-defined]  # by a star import

    row = Legend(
        items=[LegendItem(label=name, renderers=some) for name, some in drawn], orientation="horizontal",
        location="top_right", border_line_color=None, background_fill_alpha=0, label_text_font=FONT,
        label_text_font_size="13px", padding=0, margin=0, spacing=14, label_text_color="#1f2933", glyph_width=22,
        click_policy="hide",
    )  # fmt: skip
    fig.add_layout(row, "above")
    widths = legend_widths([str(name) for name, _ in drawn])
    fig.js_on_change("inner_width", CustomJS(args={"legend": row, "widths": widths}, code=BREAK_LEGEND))


def legend_widths(names: list[str]) -> list[float]:
    """Return about how many pixels a legend takes in one column, in two, .., with all in a row."""
    each = [ENTRY + LETTER * len(name) for name in names]
    return [sum(max(each[k::n]) for k in range(n)) for n in range(1, len(each) + 1)]


def single(values):
    """Return values in single precision: half the size of the page, far finer than the screen; if they fit."""
    import numpy as np

    found = np.asarray(values)
    if found.dtype.kind != "f" or np.nanmax(np.abs(found), initial=0.0) > np.finfo(np.float32).max:
        return values
    return found.astype(np.float32)
