"""The Bokeh figures of the report over time, and its bars; one function each."""

from __future__ import annotations

from driftwise.edge import report_marks
from driftwise.edge.figure import LINES, PALETTE, steady_range
from driftwise.edge.thin import envelope, together

__all__ = [
    "adaptation",
    "autocorrelations",
    "blank",
    "excitation",
    "has_weight",
    "innovations",
    "legend",
    "orders",
    "output",
    "panels",
    "parameters",
    "states",
    "statistic",
]

POINTS = 4000
FONT = "Inter, Segoe UI, system-ui, -apple-system, Helvetica Neue, Arial, sans-serif"


def blank(height: int, x_label: str = "", y_label: str = "", *, tools="pan,box_zoom,xwheel_zoom,reset,save", **more):
    from bokeh.plotting import figure

    fig = figure(height=height, sizing_mode="stretch_width", tools=tools, **more)
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
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "12px"
        axis.axis_label_text_color = axis.major_label_text_color = "#52606d"
        axis.axis_line_color = axis.major_tick_line_color = "#c4ccd6"
        axis.minor_tick_line_color = None
    return fig


def legend(fig):
    from bokeh.models import Legend  # type: ignore[attr-defined]

    row = Legend(items=list(fig.legend[0].items), orientation="horizontal", location="top_right")
    fig.legend[0].visible = False
    row.update(
        border_line_color=None, background_fill_alpha=0, label_text_font=FONT, label_text_font_size="12px",
        padding=0, margin=0, spacing=14, label_text_color="#3e4c59", glyph_width=18, click_policy="hide",
    )  # fmt: skip
    fig.add_layout(row, "above")


def _single(values):
    """Return values in single precision: half the size of the page, far finer than the screen."""
    import numpy as np

    return np.asarray(values, np.float32)


def output(trace, labels, events):
    """Measured against predicted with its 95 % band; lost and rejected samples marked."""
    import numpy as np
    from bokeh.models import ColumnDataSource, HoverTool

    time, y = np.asarray(trace.time, float), np.asarray(trace.y, float)
    predicted, half = np.asarray(trace.prediction, float), np.asarray(trace.band(0.95), float)
    i = together(POINTS, y, predicted)
    source = ColumnDataSource(
        {
            "t": time[i],
            "y": _single(y[i]),
            "p": _single(predicted[i]),
            "low": _single((predicted - half)[i]),
            "high": _single((predicted + half)[i]),
        }
    )
    seen = y[np.isfinite(y)]
    low, high = (seen.min(), seen.max()) if seen.size else (-1.0, 1.0)
    pad = 0.1 * (high - low) or 1.0
    start, end = float(time.min()), float(time.max())
    ranges = {
        "x_range": (start, end if end > start else start + 1),
        "y_range": (float(low - pad), float(high + pad)),
    }
    fig = blank(330, labels["time"], labels["output"], **ranges)
    band = fig.varea(
        "t", "low", "high", source=source, color=PALETTE["predicted"], alpha=0.16, legend_label="95 % band"
    )
    line = fig.line("t", "y", source=source, color=PALETTE["measured"], width=2.0, legend_label="measured")
    if len(i) <= 400:
        fig.scatter("t", "y", source=source, size=4, color=PALETTE["measured"], legend_label="measured")
    fig.line(
        "t",
        "p",
        source=source,
        color=PALETTE["predicted"],
        width=1.2,
        legend_label="predicted one step ahead",
    )
    if events:
        drawn = report_marks.dots(fig, events, float(low - 0.6 * pad))
        fig.add_tools(HoverTool(renderers=drawn, tooltips=[("", "@text"), (labels["time"], "@t{0.[0000]}")]))
    fig.add_tools(
        HoverTool(
            renderers=[line],
            tooltips=[
                (labels["time"], "@t{0.[000]}"),
                ("measured", "@y{0.[00000]}"),
                ("predicted", "@p{0.[00000]}"),
            ],
            mode="vline",
            visible=False,
        )
    )
    band.level = "underlay"
    legend(fig)
    return fig


def parameters(trace, x_range, smoothed=None, marks=()):
    """One small figure per parameter with its 2-sigma band, where the trace kept one."""
    import numpy as np

    has_band = getattr(trace, "keep", "std") != "means"
    values = np.asarray(trace.parameters, float)
    stds = np.asarray(trace.parameters_std, float) if has_band else np.zeros_like(values)
    more = None if smoothed is None else (smoothed.parameters, smoothed.parameters_std)
    colors = [LINES["abcdefgh".find(name[0]) % len(LINES)] for name in trace.names]
    return panels(trace.time, trace.names, values, stds, more, colors, x_range, marks)


def states(trace, x_range, smoothed, marks=()):
    """One small figure per state, filtered and smoothed."""
    n = trace.estimator.model.n
    names = [f"x{n - i}" for i in range(n)]
    more = smoothed.x, smoothed.x_std
    return panels(trace.time, names, trace.x, trace.x_std, more, [LINES[5]] * n, x_range, marks)


def adaptation(trace, x_range, marks=()):
    """Memory in samples, and the detector's statistic against its threshold where there is a detector."""
    import numpy as np

    if trace.estimator.columns <= 5:
        return []
    found: list = []
    if has_weight(trace.estimator.options.get("memory")):
        found.append(_from_zero(trace.time, "memory (samples)", trace.weight, LINES[1], x_range, marks))
    if np.nanmax(trace.statistic, initial=0.0) > 0:
        found.append(statistic(trace.time, trace.statistic, x_range, marks))
    return found


def statistic(time, values, x_range, marks=()):
    """A detector's statistic against its threshold."""
    from bokeh.models import Span  # type: ignore[attr-defined]

    fig = _from_zero(time, "statistic / threshold", values, LINES[4], x_range, marks)
    fig.add_layout(Span(location=1, dimension="width", line_color=PALETTE["ink"], line_dash="dashed"))
    return fig


def _from_zero(time, label, values, color, x_range, marks):
    """One column from zero upwards, with the marks of what happened."""
    import numpy as np

    top = 1.08 * max(float(np.nanmax(values, initial=1.0)), 1.0)
    fig = blank(185, "", label, x_range=x_range, y_range=(0.0, top))
    i = envelope(values, POINTS)
    fig.line(np.asarray(time)[i], _single(values[i]), width=1.6, color=color)
    report_marks.lines(fig, marks)
    return fig


def has_weight(memory) -> bool:
    """Whether a memory counts samples: not where it adds a variance that was told at every one."""
    from driftwise.memory.drift import Walk

    return not isinstance(memory, Walk)


def panels(time, names, values, stds, smoothed, colors, x_range, marks):
    """Columns with bands: filtered as a shaded band, smoothed (values, stds) dashed between dotted lines."""
    import numpy as np
    from bokeh.models import ColumnDataSource

    time = np.asarray(time, float)
    i = together(POINTS, *values.T) if len(values.T) <= 8 else envelope(values[:, 0], POINTS)
    data = {"t": time[i]}
    kinds = {"": (values, stds), **({"s": smoothed} if smoothed is not None else {})}
    for kind, (middle, std) in kinds.items():
        for j in range(len(names)):
            v, s = middle[i, j], std[i, j]
            data |= {f"v{kind}{j}": _single(v), f"l{kind}{j}": _single(v - 2 * s), f"h{kind}{j}": _single(v + 2 * s)}
    source = ColumnDataSource(data)
    figures = []
    for j, name in enumerate(names):
        spans = [steady_range(values[:, j], stds[:, j])]
        spans += [] if smoothed is None else [steady_range(smoothed[0][:, j], smoothed[1][:, j])]
        spans = [span for span in spans if span] or [(-1.0, 1.0)]
        span = min(low for low, _ in spans), max(high for _, high in spans)
        fig = blank(185, "", name, x_range=x_range, y_range=span)
        fig.varea("t", f"l{j}", f"h{j}", source=source, color=colors[j], alpha=0.2)
        fig.line("t", f"v{j}", source=source, color=colors[j], width=1.6)
        if smoothed is not None:
            for edge in ("ls", "hs"):
                fig.line("t", f"{edge}{j}", source=source, color=PALETTE["ink"], width=1.1, line_dash="dotted")
            fig.line("t", f"vs{j}", source=source, color=PALETTE["ink"], width=1.8, line_dash="dashed")
        report_marks.lines(fig, marks)
        fig.yaxis.axis_label_text_font_style = "bold"
        fig.yaxis.axis_label_text_font_size = "13px"
        fig.xaxis.ticker.desired_num_ticks = 4
        fig.yaxis.ticker.desired_num_ticks = 4
        figures.append(fig)
    return figures


def innovations(trace, labels, x_range):
    """Innovations over their predicted standard deviation; what leaves the figure is drawn at its edge."""
    import numpy as np
    from bokeh.models import Span  # type: ignore[attr-defined]

    from driftwise.kernel.status import OUTLIER, REJECTED

    z = np.asarray(trace.innovation, float) / np.sqrt(np.asarray(trace.variance, float))
    rejected = (np.asarray(trace.status) & (REJECTED | OUTLIER)) != 0
    size = np.abs(z[np.isfinite(z) & ~rejected])
    reach = min(1.12 * size.max(), max(1.8 * float(np.quantile(size, 0.99)), 4.5)) if size.size else 4.5
    i = envelope(z, POINTS)
    i = i[np.isfinite(z[i])]
    time, shown = np.asarray(trace.time, float), np.clip(z, -0.965 * reach, 0.965 * reach)
    fig = blank(260, labels["time"], "innovation / sigma", x_range=x_range, y_range=(-reach, reach))
    fig.add_layout(_band(-2, 2))
    fig.add_layout(Span(location=0, dimension="width", line_color=PALETTE["quiet"], line_width=1))
    kinds = (
        (
            "within 3 sigma",
            ~rejected[i] & (np.abs(z[i]) <= 3),
            "circle",
            4 if len(i) < 1500 else 2.5,
            PALETTE["measured"],
            0.65,
        ),
        ("beyond", ~rejected[i] & (np.abs(z[i]) > 3), "circle", 6, PALETTE["alert"], 0.85),
        ("outlier", rejected[i], "x", 7, PALETTE["warn"], 0.9),
    )
    for name, chosen, marker, width, color, alpha in kinds:
        if chosen.any():
            at = i[chosen]
            fig.scatter(
                time[at],
                _single(shown[at]),
                marker=marker,
                size=width,
                color=color,
                alpha=alpha,
                legend_label=name,
            )
    if fig.legend:
        legend(fig)
    return fig


def _band(low: float, high: float):
    """Shade a horizontal band."""
    from bokeh.models import BoxAnnotation  # type: ignore[attr-defined]

    return BoxAnnotation(
        bottom=low,
        top=high,
        fill_color=PALETTE["predicted"],
        fill_alpha=0.08,
        line_color=None,
        level="underlay",
    )


def autocorrelations(values, count: float):
    """Autocorrelation of the innovations from lag 1 with the 95 % bounds of white noise."""
    import numpy as np
    from bokeh.models import Span  # type: ignore[attr-defined]

    values = np.asarray(values, float)
    bound = 1.96 / np.sqrt(max(count, 1.0))
    reach = max(1.25 * np.nanmax(np.abs(values), initial=0.0), 2.2 * bound)
    fig = blank(
        250,
        "lag (samples)",
        "autocorrelation",
        tools="save",
        y_range=(-reach, reach),
        x_range=(0.3, len(values) + 0.7),
    )
    fig.add_layout(_band(-bound, bound))
    fig.add_layout(Span(location=0, dimension="width", line_color=PALETTE["quiet"], line_width=1))
    colors = [PALETTE["warn"] if abs(v) > bound else PALETTE["predicted"] for v in values]
    fig.vbar(np.arange(1, len(values) + 1), top=values, width=0.55, color=colors)
    return fig


def excitation(directions, threshold: float):
    """Bars of posterior over prior variance per direction, on a log scale; long bars were not learned."""
    from math import log10

    from bokeh.models import FactorRange, Span  # type: ignore[attr-defined]

    names: list[str] = []
    seen: dict[str, int] = {}
    for text, _ in directions:
        text = _short(text)
        seen[text] = seen.get(text, 0) + 1
        names.append(text if seen[text] == 1 else f"{text} ({seen[text]})")
    ratios = [min(max(float(r), 1e-30), 1.0) for _, r in directions]
    decades = max(1, round(-log10(min([*ratios, 0.1]))) + 1)
    step = -(-decades // 5)
    lowest = 10.0**-decades
    fig = blank(
        max(70 + 30 * len(names), 300 if len(names) > 2 else 0),
        "variance left: posterior / prior", "", tools="save",
        x_axis_type="log", x_range=(lowest, 10 ** (0.04 * decades)), y_range=FactorRange(factors=names[::-1]),
    )  # fmt: skip
    colors = [PALETTE["warn"] if r > threshold else PALETTE["good"] for r in ratios]
    fig.hbar(y=names, left=lowest, right=ratios, height=0.5, color=colors, alpha=0.85)
    fig.add_layout(Span(location=threshold, dimension="height", line_color=PALETTE["warn"], line_dash="dashed"))
    fig.xaxis.ticker = [10.0**-k for k in range(0, decades + 1, step)]
    fig.ygrid.grid_line_color = None
    return fig


def _short(text: str, most: int = 28) -> str:
    """Return the first terms of a long combination."""
    if len(text) <= most:
        return text
    cut = max(text.rfind(sign, 0, most) for sign in (" + ", " \u2212 "))
    return text[:cut] + " \u2026"


def orders(names: list[int], probability):
    """Bars of the posterior probability of each order."""
    import numpy as np
    from bokeh.models import FactorRange  # type: ignore[attr-defined]

    factors = [str(name) for name in names]
    p = np.asarray(probability, float)
    fig = blank(
        max(70 + 30 * len(names), 190), "posterior probability", "order", tools="save",
        x_range=(0, 1.02), y_range=FactorRange(factors=factors[::-1]),
    )  # fmt: skip
    colors = [PALETTE["predicted"] if v == p.max() else PALETTE["quiet"] for v in p]
    fig.hbar(y=factors, left=0, right=p, height=0.5, color=colors, alpha=0.85)
    fig.xaxis.ticker = [0, 0.25, 0.5, 0.75, 1]
    fig.ygrid.grid_line_color = None
    return fig
