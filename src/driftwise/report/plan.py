"""The plan view of tracks: East and North in kilometres at equal scales, without a map beneath."""

from __future__ import annotations

from typing import Any

from driftwise.report.axes import FONT, dress, legend, single, zoomable
from driftwise.report.figure import LINES, PALETTE
from driftwise.report.thin import together
from driftwise.report.track_report import when

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
    rows : list of `track_report.Row`
    shown : number of tracks that have a colour
    sites : (name, East, North) of radars, m; range rings are drawn about them
    """
    from bokeh.models import ColumnDataSource

    paths = [r.track.trace.position / 1000 for r in rows]  # km
    fig, extent = _blank(), _extent(paths)
    _rings(fig, sites, paths, extent)
    dots = _plots(fig, rows)
    lines: dict[str, list] = {"x": [], "y": [], "colour": [], "width": [], "track": [], "said": []}
    wide: dict[str, list] = {"x": [], "y": [], "colour": []}
    for k, (r, path) in enumerate(zip(rows, paths)):
        i = together(max(LINE_POINTS // len(rows), 40), path[:, 0], path[:, 1])
        line = single(path[i, 0]), single(path[i, 1]), colour(k, shown), 1.8 if k < shown else 0.9, r.called, _said(r)
        _add(lines, *line)
        for a, b in r.spans:
            _add(wide, *single(path[max(a - 1, 0) : b]).T, colour(k, shown))
    drawn = [("plot", [dots])]
    some = _ellipses(rows[:shown], shown, extent)
    if some["x"]:
        look: Any = {"line_color": "colour", "fill_color": "colour", "fill_alpha": 0.08, "line_alpha": 0.45}
        ellipses = fig.ellipse("x", "y", "width", "height", "angle", source=ColumnDataSource(some), **look)
        drawn.append(("95 % of the position", [ellipses]))
    if wide["x"]:
        bands = fig.multi_line("x", "y", source=ColumnDataSource(wide), color="colour", width=8, alpha=0.3)
        drawn.append(("manoeuvre", [bands]))
    source = ColumnDataSource(lines, name="tracks")
    source.selected.indices = [0] if len(rows) > 1 else []
    tracks = fig.multi_line("x", "y", source=source, color="colour", width="width", nonselection_alpha=0.8)
    tracks.selection_glyph = tracks.glyph.clone(line_width=3.2)
    _heads(fig, rows, paths, shown)
    _tools(fig, tracks)
    fig.x_range.renderers = fig.y_range.renderers = [tracks, dots]
    legend(fig, drawn)
    return fig


def _add(columns: dict[str, list], *values) -> None:
    """Append a row to columns."""
    for column, value in zip(columns.values(), values, strict=True):
        column.append(value)


def _blank():
    from bokeh.models import DataRange1d

    ranges: Any = {"x_range": DataRange1d(range_padding=0.06), "y_range": DataRange1d(range_padding=0.06)}
    fig = zoomable({"match_aspect": True}, height=640, match_aspect=True, name="plan", **ranges)
    return dress(fig, "East (km)", "North (km)")


def _tools(fig, tracks) -> None:
    from bokeh.models import HoverTool, TapTool

    tap = TapTool(renderers=[tracks])
    fig.add_tools(HoverTool(renderers=[tracks], tooltips="@track: @said", line_policy="interp"), tap)
    fig.toolbar.active_tap = tap


def _extent(paths) -> float:
    """Return the larger side of what the tracks take, km."""
    import numpy as np

    ends = np.array([f(path, axis=0) for path in paths for f in (np.nanmin, np.nanmax)])
    return float(max(ends.max(axis=0) - ends.min(axis=0))) or 1.0


def _said(r) -> str:
    return f"{r.plots} plots, {when(r.start)} to {when(r.end, False)}"


def _plots(fig, rows):
    """Draw the plots as small dots, every n-th of them where they are very many."""
    import numpy as np

    seen = np.concatenate([r.track.trace.y for r in rows])
    seen = seen[np.isfinite(seen).all(axis=1)]
    seen = seen[:: -(-len(seen) // DOTS) or 1] / 1000
    return fig.scatter(single(seen[:, 0]), single(seen[:, 1]), size=2.5, color="#9aa5b1", alpha=0.6)


def _ellipses(rows, shown: int, extent: float) -> dict:
    """Return 95 % ellipses along the tracks where they are large enough to be seen."""
    import numpy as np

    found: dict[str, list] = {"x": [], "y": [], "width": [], "height": [], "angle": [], "colour": []}
    most = max(ELLIPSES // max(len(rows), 1), 4)
    for k, r in enumerate(rows):
        trace = r.track.trace
        position, size = trace.position, 2 * RADIUS95 * trace.position_sd.max(axis=1) / 1000
        large = np.flatnonzero((size > VISIBLE * extent) & (size < 0.5 * extent))
        large = large[:: -(-len(large) // most) or 1]
        size, axes = np.linalg.eigh(trace.spread[large][:, ::3, ::3])  # East and North
        size = 2 * RADIUS95 * np.sqrt(np.maximum(size, 0.0)) / 1000
        for i, (height, width), axis in zip(large, size, axes):
            x, y = position[i] / 1000
            angle = np.arctan2(axis[1, 1], axis[0, 1])
            _add(found, *map(float, (x, y, width, height, angle)), colour(k, shown))
    return found


def _heads(fig, rows, paths, shown: int) -> None:
    """Draw where each track was last, which way it went (there and half way), and its name."""
    import numpy as np
    from bokeh.core.properties import value
    from bokeh.models import ColumnDataSource

    heads: dict[str, list] = {"x": [], "y": [], "angle": [], "colour": []}
    names: dict[str, list] = {"x": [], "y": [], "colour": [], "text": []}
    latest = {r.called: r.end for r in sorted(rows, key=lambda r: r.end)}
    for k, (r, path) in enumerate(zip(rows, paths)):
        course = r.track.trace.course
        known = np.flatnonzero(np.isfinite(course) & np.isfinite(path).all(axis=1))
        if not len(known):
            continue
        last, middle = known[-1], known[len(known) // 2]
        for i in (last, middle) if k < shown else (last,):
            _add(heads, *map(float, (*path[i], -np.radians(course[i]))), colour(k, shown))
        if k < NAMED and r.end == latest[r.called]:
            _add(names, *map(float, path[last]), colour(k, shown), r.called)
    look: Any = {"marker": "triangle", "size": 11, "color": "colour", "line_color": "#ffffff"}
    fig.scatter("x", "y", angle="angle", source=ColumnDataSource(heads), **look)
    look = {"text_font": value(FONT), "text_font_size": "12px", "text_color": "colour", "x_offset": 8, "y_offset": -4}
    halo: Any = {"background_fill_color": "#ffffff", "background_fill_alpha": 0.75}
    fig.text("x", "y", "text", source=ColumnDataSource(names), **look, **halo)


def _rings(fig, sites, paths, extent: float) -> None:
    """Draw range rings about the sites, at round distances as far as the tracks go, labelled towards these."""
    import numpy as np
    from bokeh.core.properties import value

    positions = np.concatenate(paths)
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
