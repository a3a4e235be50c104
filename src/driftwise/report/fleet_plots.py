"""The Bokeh figures of a fleet: how a number is spread over it, one against another, when its series jumped."""

from __future__ import annotations

from typing import Any

from driftwise.report.axes import FONT, Timeline, dress, legend, shade, single, zoomable
from driftwise.report.figure import PALETTE
from driftwise.results.sentences import SERIES_JUMPED

BINS = 80
NAMES = 5  # written beside their marks
MARKED = 400  # of those that need a look, in a histogram
DOTS, ODD = 3000, 1500  # of a scatter: of the rest, and of those that need a look
APART = 0.28  # of the width of a figure: names closer than this are left to the pointer
REACH = 20.0  # widths between quartiles that a histogram shows either side; what is beyond stands at its edge


def window(values) -> tuple[float, float]:
    """Return the range that shows the bulk of some values; all of them, where none is far off."""
    import numpy as np

    seen = values[np.isfinite(values)]
    if not len(seen):
        return -1.0, 1.0
    low, middle, high = np.quantile(seen, [0.25, 0.5, 0.75])
    reach = REACH * max(float(high - low), 1e-12 * max(abs(float(middle)), 1e-300))
    ends = max(float(seen.min()), float(middle) - reach), min(float(seen.max()), float(middle) + reach)
    pad = 0.03 * (ends[1] - ends[0]) or 0.05 * abs(ends[0]) or 1.0
    return ends[0] - pad, ends[1] + pad


def spread(values, label: str, keys, odd, *, worth=None, ideal: tuple[float, float] | None = None) -> Any:
    """Histogram of one number (S,) over a fleet; rows ``odd`` are marked, the first of them by name.

    ``worth`` (S,) ranks them; ``ideal`` is a range to shade.
    """
    import numpy as np
    from bokeh.models import ColumnDataSource, HoverTool

    values = np.asarray(values, float)
    low, high = window(values)
    inside = values[np.isfinite(values)].clip(low, high)
    counts, edges = np.histogram(inside, BINS, (low, high))
    top = float(counts.max(initial=1))
    fig = dress(zoomable(height=230, x_range=(low, high), y_range=(0, 1.32 * top)), label, "series")
    if ideal:
        shade(fig, *ideal, "left right", fill_color=PALETTE["good"], fill_alpha=0.1)
    fig.quad(left=edges[:-1], right=edges[1:], top=counts, bottom=0, color=PALETTE["predicted"], alpha=0.55,
             line_color="#ffffff")  # fmt: skip
    odd = np.asarray(odd, int)
    odd = odd[np.isfinite(values[odd])]
    if len(odd):
        odd = odd[np.argsort(-abs(worth[odd]) if worth is not None else np.zeros(len(odd)), kind="stable")][:MARKED]
        at = values[odd].clip(low, high)
        place = np.interp(at, 0.5 * (edges[1:] + edges[:-1]), counts) + 0.05 * top
        data = {"x": single(at), "y": single(place), "v": single(values[odd]), "name": [str(keys[r]) for r in odd]}
        look: Any = {"marker": "inverted_triangle", "size": 9, "color": PALETTE["alert"], "alpha": 0.85}
        drawn = fig.scatter("x", "y", source=ColumnDataSource(data), **look)
        fig.add_tools(HoverTool(renderers=[drawn], tooltips="@name: @v{%.5g}", formatters={"@v": "printf"}))
        _name(fig, at, place + 0.06 * top, data["name"], (low, high))
    fig.yaxis.ticker.desired_num_ticks = 4
    fig.yaxis.formatter.use_scientific = False
    return fig


def _name(fig, x, y, names, ends) -> None:
    """Write the names of the first few marks that stand apart, within the frame."""
    from bokeh.models.annotations.labels import LabelSet
    from bokeh.models.sources import ColumnDataSource

    chosen: list[int] = []
    for k in range(len(x)):
        if len(chosen) < NAMES and all(abs(x[k] - x[j]) > APART * (ends[1] - ends[0]) for j in chosen):
            chosen.append(k)
    for align, side in (("left", lambda place: place < 0.12), ("right", lambda place: place > 0.88),
                        ("center", lambda place: 0.12 <= place <= 0.88)):  # fmt: skip
        some = [k for k in chosen if side((x[k] - ends[0]) / (ends[1] - ends[0]))]
        if some:
            source = ColumnDataSource({"x": x[some], "y": y[some], "name": [_short(names[k]) for k in some]})
            look: Any = {"text_font": FONT, "text_font_size": "12px", "text_align": align}
            fig.add_layout(LabelSet(x="x", y="y", text="name", source=source, text_color=PALETTE["ink"], **look))


def _short(name: str, most: int = 16) -> str:
    return name if len(name) <= most else name[: most - 1] + "\u2026"


def against(x, y, labels, keys, odd) -> Any:
    """One number against another, a dot for each series; those that need a look stand out."""
    import numpy as np
    from bokeh.models import ColumnDataSource, HoverTool

    x, y = np.asarray(x, float), np.asarray(y, float)
    (left, right), (low, high) = window(x), window(y)
    fig = dress(zoomable(height=380, x_range=(left, right), y_range=(low, high), name="against"), *labels)
    is_odd = np.zeros(len(x), bool)
    is_odd[np.asarray(odd, int)] = True
    seen, groups = np.isfinite(x) & np.isfinite(y), []
    usual: Any = {"marker": "circle", "size": 4, "color": PALETTE["measured"], "alpha": 0.35}
    unlike: Any = {"marker": "triangle", "size": 8, "color": PALETTE["alert"], "alpha": 0.8}
    kinds = ("as the rest", seen & ~is_odd, DOTS, usual), ("not like the rest", seen & is_odd, ODD, unlike)
    for name, chosen, most, look in kinds:
        i = np.flatnonzero(chosen)
        i = i[:: max(-(-len(i) // most), 1)]
        if len(i):
            data = {
                "x": single(x[i].clip(left, right)), "y": single(y[i].clip(low, high)), "v": single(x[i]),
                "w": single(y[i]), "name": [str(keys[r]) for r in i],
            }  # fmt: skip
            drawn = fig.scatter("x", "y", source=ColumnDataSource(data), **look)
            tips = [("", "@name"), (labels[0], "@v{%.5g}"), (labels[1], "@w{%.5g}")]
            fig.add_tools(HoverTool(renderers=[drawn], tooltips=tips, formatters={"@v": "printf", "@w": "printf"}))
            groups.append((name, [drawn]))
    legend(fig, groups)
    return fig


def jumps(time, span, bursts, origin: str | None, label: str) -> Any:
    """How many series jumped last in each stretch of the record; what many did together stands out."""
    import numpy as np
    from bokeh.models import ColumnDataSource, HoverTool

    line = Timeline(np.array(span), label, origin)
    counts, edges = np.histogram(time, 120, span)
    together = np.zeros(len(counts), bool)
    for burst in bursts:
        together |= (edges[1:] >= burst.start) & (edges[:-1] <= burst.end) & (counts > 0)
    top = 1.15 * max(counts.max(initial=0), 1)
    fig, at, groups = line.figure(220, SERIES_JUMPED, y_range=(0, top), name="jumps"), line.at(edges), []
    for name, chosen, color in (("one by one", ~together, "predicted"), ("together", together, "alert")):
        some = np.flatnonzero(chosen & (counts > 0))
        if len(some):
            data = {"left": at[some], "right": at[some + 1], "top": counts[some], "middle": at[some]}
            bars = fig.quad("left", "right", "top", 0, source=ColumnDataSource(data), color=PALETTE[color], alpha=0.8)
            dated = origin is not None
            tips = [("series", "@top"), (line.label, "@middle{%F %T}" if dated else "@middle{%.6g}")]
            kind: Any = {"@middle": "datetime" if dated else "printf"}
            fig.add_tools(HoverTool(renderers=[bars], tooltips=tips, formatters=kind))
            groups.append((name, [bars]))
    legend(fig, groups)
    return fig
