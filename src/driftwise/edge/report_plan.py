"""The plan view of tracks: East and North in kilometres at equal scales, without a map beneath."""

from __future__ import annotations

from typing import Any

from driftwise.edge.figure import LINES, PALETTE
from driftwise.edge.report_axes import FONT, dress, single
from driftwise.edge.thin import together
from driftwise.edge.track_words import stretches, when

__all__ = ["colour", "plan"]

LINE_POINTS = 40_000  # of all tracks together
DOTS = 20_000  # plots drawn
ELLIPSES = 400
NAMED = 20  # tracks with a name beside them
VISIBLE = 0.004  # of the width of the plan: what a 95 % ellipse must measure to be seen
RADIUS95 = 2.4477  # deviations of a 95 % ellipse in two dimensions


def colour(k: int, shown: int) -> str:
    """Return the colour of the k-th busiest track."""
    return LINES[k % len(LINES)] if k < shown else PALETTE["quiet"]


def plan(rows, shown: int, sites=()) -> Any:
    """Return the figure of all tracks, the busiest first; those beyond the first ``shown`` in a quiet colour.

    Parameters
    ----------
    rows : list of `track_words.Row`
    shown : number of tracks that have a colour
    sites : (name, East, North) of radars, m; range rings are drawn about them
    """
    from bokeh.models import ColumnDataSource

    fig, extent = _blank(), _extent(rows, sites)
    _rings(fig, sites, rows, extent)
    dots = _plots(fig, rows)
    lines: dict[str, list] = {"x": [], "y": [], "colour": [], "width": [], "track": [], "said": []}
    wide: dict[str, list] = {"x": [], "y": [], "colour": []}
    for k, r in enumerate(rows):
        for name, value in zip(
            lines, (*_path(r, len(rows)), colour(k, shown), 1.8 if k < shown else 0.9, r.called, _said(r))
        ):
            lines[name].append(value)
        km = r.track.trace.position / 1000
        for a, b in stretches(r.track.trace):
            i = slice(max(a - 1, 0), b)
            for name, value in zip(wide, (single(km[i, 0]), single(km[i, 1]), colour(k, shown))):
                wide[name].append(value)
    told = [("plot", [dots])]
    some = _ellipses(rows, shown, extent)
    if some["x"]:
        look: Any = {"line_color": "colour", "fill_color": "colour", "fill_alpha": 0.08, "line_alpha": 0.45}
        told.append(
            ("95 % of the position", [fig.ellipse("x", "y", "width", "height", source=ColumnDataSource(some), **look)])
        )
    if wide["x"]:
        drawn = fig.multi_line("x", "y", source=ColumnDataSource(wide), color="colour", width=8, alpha=0.3)
        told.append(("manoeuvre", [drawn]))
    source = ColumnDataSource(lines, name="tracks")
    source.selected.indices = [0] if len(rows) > 1 else []
    tracks = fig.multi_line("x", "y", source=source, color="colour", width="width", nonselection_alpha=0.8)
    tracks.selection_glyph = tracks.glyph.clone(line_width=3.2)
    _heads(fig, rows, shown)
    _tools(fig, tracks)
    fig.x_range.renderers = fig.y_range.renderers = [tracks, dots]
    from driftwise.edge.report_axes import legend

    legend(fig, told)
    return fig


def _blank():
    from bokeh.models import DataRange1d
    from bokeh.plotting import figure

    ranges: Any = {"x_range": DataRange1d(range_padding=0.06), "y_range": DataRange1d(range_padding=0.06)}
    fig: Any = figure(height=640, tools="", match_aspect=True, **ranges)
    return dress(fig, "East (km)", "North (km)")


def _tools(fig, tracks) -> None:
    from bokeh.models import BoxZoomTool, CustomJS, HoverTool, PanTool, ResetTool, SaveTool, TapTool, WheelZoomTool

    zoom, wheel = BoxZoomTool(match_aspect=True), WheelZoomTool(modifiers={"ctrl": True})
    hover = HoverTool(renderers=[tracks], tooltips="@track: @said", line_policy="interp")
    tap = TapTool(renderers=[tracks])
    fig.add_tools(zoom, PanTool(), wheel, ResetTool(), SaveTool(), hover, tap)
    fig.toolbar.active_drag, fig.toolbar.active_scroll, fig.toolbar.active_tap = zoom, wheel, tap
    fig.js_on_event("doubletap", CustomJS(args={"figure": fig}, code="figure.reset.emit()"))


def _extent(rows, sites) -> float:
    """Return the larger side of what is drawn, km."""
    import numpy as np

    ends = np.array([f(r.track.trace.position, axis=0) for r in rows for f in (np.nanmin, np.nanmax)])
    return float(max(np.nanmax(ends, axis=0) - np.nanmin(ends, axis=0))) / 1000 or 1.0


def _path(r, count: int):
    """Return East and North of a track in km, thinned where its extremes allow."""
    position = r.track.trace.position
    i = together(max(LINE_POINTS // count, 40), position[:, 0], position[:, 1])
    return single(position[i, 0] / 1000), single(position[i, 1] / 1000)


def _said(r) -> str:
    return f"{r.plots} plots, {when(r.start)} to {when(r.end, False)}"


def _plots(fig, rows):
    """Draw the plots as small dots, every n-th of them where they are very many."""
    import numpy as np

    seen = np.concatenate([r.track.trace.plot for r in rows])
    seen = seen[np.isfinite(seen).all(axis=1)]
    seen = seen[:: -(-len(seen) // DOTS) or 1] / 1000
    return fig.scatter(single(seen[:, 0]), single(seen[:, 1]), size=2.5, color="#9aa5b1", alpha=0.6)


def _ellipses(rows, shown: int, extent: float) -> dict:
    """Return 95 % ellipses along the tracks where they are large enough to be seen."""
    import numpy as np

    found: dict[str, list] = {"x": [], "y": [], "width": [], "height": [], "colour": []}
    most = max(ELLIPSES // max(len(rows[:shown]), 1), 4)
    for k, r in enumerate(rows[:shown]):
        trace = r.track.trace
        size = 2 * RADIUS95 * trace.position_sd / 1000
        large = np.flatnonzero((size.max(axis=1) > VISIBLE * extent) & (size.max(axis=1) < 0.5 * extent))
        for i in large[:: -(-len(large) // most) or 1]:
            x, y = trace.position[i] / 1000
            for name, value in zip(found, (x, y, size[i, 0], size[i, 1], colour(k, shown))):
                found[name].append(value if isinstance(value, str) else float(value))
    return found


def _heads(fig, rows, shown: int) -> None:
    """Draw where each track was last, which way it went (there and half way), and its name."""
    import numpy as np
    from bokeh.core.properties import value
    from bokeh.models import ColumnDataSource

    heads: dict[str, list] = {"x": [], "y": [], "angle": [], "colour": []}
    names: dict[str, list] = {"x": [], "y": [], "colour": [], "text": []}
    for k, r in enumerate(rows):
        trace = r.track.trace
        known = np.flatnonzero(np.isfinite(trace.course) & np.isfinite(trace.position).all(axis=1))
        for i in (known[-1:], known[len(known) // 2 : len(known) // 2 + 1])[: 2 if k < shown else 1]:
            for j in i:
                x, y = (float(metres) / 1000 for metres in trace.position[j])
                for name, cell in zip(heads, (x, y, -float(np.radians(trace.course[j])), colour(k, shown))):
                    heads[name].append(cell)
        if len(known) and k < NAMED:
            x, y = (float(metres) / 1000 for metres in trace.position[known[-1]])
            for name, cell in zip(names, (x, y, colour(k, shown), r.called)):
                names[name].append(cell)
    look: Any = {"marker": "triangle", "size": 11, "color": "colour", "line_color": "#ffffff"}
    fig.scatter("x", "y", angle="angle", source=ColumnDataSource(heads), **look)
    look = {"text_font": value(FONT), "text_font_size": "12px", "text_color": "colour", "x_offset": 8, "y_offset": -4}
    halo: Any = {"background_fill_color": "#ffffff", "background_fill_alpha": 0.75}
    fig.text("x", "y", "text", source=ColumnDataSource(names), **look, **halo)


def _rings(fig, sites, rows, extent: float) -> None:
    """Draw range rings about the sites, at round distances as far as the tracks go, labelled towards these."""
    import numpy as np
    from bokeh.core.properties import value

    positions = np.concatenate([r.track.trace.position for r in rows]) / 1000
    middle = (np.nanmin(positions, axis=0) + np.nanmax(positions, axis=0)) / 2
    step = 10.0 ** np.floor(np.log10(max(extent, 1e-3)))
    step *= 1 if extent / step > 4 else 0.5 if extent / step > 2 else 0.2
    turn = np.linspace(0, 2 * np.pi, 181)
    quiet: Any = {"line_color": "#b3bcc6", "line_width": 1, "line_dash": "dotted"}
    said: Any = {"text_font": value(FONT), "text_font_size": "11px", "text_color": "#7b8794", "text_align": "center"}
    halo: Any = {"background_fill_color": "#ffffff", "background_fill_alpha": 0.75, "text_baseline": "middle"}
    for name, east, north in sites:
        site = np.array([east, north]) / 1000
        reach, to = float(np.nanmax(np.linalg.norm(positions - site, axis=1))), middle - site
        towards = to / np.linalg.norm(to) if np.linalg.norm(to) > 0.1 * extent else np.array([0.0, 1.0])
        rings = step * np.arange(1, min(int(reach / step) + 2, 40))
        circles = np.stack([np.sin(turn), np.cos(turn)]) * rings[:, None, None] + site[:, None]
        fig.multi_line([single(c[0]) for c in circles], [single(c[1]) for c in circles], **quiet)
        at = site + rings[:, None] * towards
        fig.text(at[:, 0], at[:, 1], [f"{r:g} km" for r in rings], **said, **halo)
        fig.scatter([site[0]], [site[1]], marker="cross", size=12, color=PALETTE["ink"], line_width=2)
        fig.text([site[0]], [site[1]], [name], **{**said, "text_color": PALETTE["ink"]}, y_offset=20)
