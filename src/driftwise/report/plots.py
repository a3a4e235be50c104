"""The Bokeh panels of the report over time; each takes a `Timeline` and columns (T,) over it.

Long columns are thinned: of every bucket of samples the lowest and the highest are drawn.
"""

from __future__ import annotations

from typing import Any

from driftwise.report.axes import across, legend, shade, single
from driftwise.report.figure import LINES, PALETTE, steady_range
from driftwise.report.marks import mark_dots, mark_lines
from driftwise.report.page import named
from driftwise.report.thin import alone, envelope, together

POINTS = 20_000  # samples drawn of an output
INPUT_POINTS = 10_000  # of all inputs together
LONG = 4000  # innovations that can be told apart as dots
FEW = 2000  # of the panel of a parameter
ALL_POINTS = 16_000  # and of all of them together


def output(line, y, prediction, half, label: str = "output", *, outlier=None, marks=(), is_named=True) -> Any:
    """Measured against predicted with its 95 % band of half-width ``half``; alarms and outliers marked."""
    import numpy as np

    y, predicted, half = (np.asarray(column, float) for column in (y, prediction, half))
    outlier = np.zeros(len(y), bool) if outlier is None else np.asarray(outlier)
    low, high = limits(y[np.isfinite(y) & ~outlier])
    i = together(POINTS, y, predicted)
    below, above = edges(predicted, half)
    source = line.source(i, y=y, p=predicted, low=below, high=above)
    fig = line.figure(330, label, is_named=is_named, y_range=(low, high), name="output")
    band = fig.varea("t", "low", "high", source=source, color=PALETTE["predicted"], alpha=0.18)
    blue = fig.line("t", "p", source=source, color=PALETTE["predicted"], width=2.4)
    ink = fig.line("t", "y", source=source, color=PALETTE["measured"], width=1.0)
    dots = i if len(i) <= 500 else i[alone(y)[i]]
    lone = fig.scatter("t", "y", source=line.source(dots, y=y), size=4 if len(dots) < 1000 else 3, color=PALETTE["ink"])
    drawn = [("measured", [ink, lone]), ("predicted one step ahead", [blue]), ("95 % band", [band])]
    far = np.flatnonzero(outlier)
    if len(far):
        far = far[envelope(y[far], FEW)]
        shown = np.clip(y, low + 0.02 * (high - low), high - 0.02 * (high - low))
        look = {"marker": "x", "size": 10, "color": PALETTE["alert"], "line_width": 2}
        drawn.append(("outlier", [fig.scatter("t", "y", source=line.source(far, y=shown), **look)]))
    mark_lines(line, fig, marks)
    drawn += mark_dots(line, fig, marks, high - 0.03 * (high - low))
    line.hover(fig, [ink], ("measured", "y"), ("predicted", "p"), ("from", "low"), ("to", "high"))
    band.level = "underlay"
    legend(fig, drawn)
    return fig


def inputs(line, columns, labels) -> list:
    """Return one low panel for each input."""
    import numpy as np

    found = []
    for k, (values, label) in enumerate(zip(columns, labels), 1):
        values = np.asarray(values, float)
        i, is_last = envelope(values, INPUT_POINTS // len(columns)), k == len(columns)
        source = line.source(i, v=values)
        fig = line.figure(130 if is_last else 105, label, is_named=is_last, y_range=limits(values[np.isfinite(values)]))
        drawn = fig.line("t", "v", source=source, color=PALETTE["measured"], width=1.2)
        dots = i[alone(values)[i]]
        fig.scatter("t", "v", source=line.source(dots, v=values), size=3, color=PALETTE["measured"])
        fig.yaxis.ticker.desired_num_ticks = 3
        line.hover(fig, [drawn], (label, "v"))
        found.append(fig)
    return named("input", found)


def edges(middle, half):
    """Return the lower and the upper edge of a band, closed where there is none: an area does not stop at NaN."""
    import numpy as np

    seen = np.isfinite(middle) & np.isfinite(half)
    last = np.maximum.accumulate(np.where(seen, np.arange(len(seen)), np.argmax(seen)))
    middle, half = np.asarray(middle)[last], np.where(seen, half, 0.0)
    return middle - half, middle + half


def limits(seen, pad: float = 0.1) -> tuple[float, float]:
    """Return the range of an axis that shows some values."""
    low, high = (float(seen.min()), float(seen.max())) if len(seen) else (-1.0, 1.0)
    pad = pad * (high - low) or 0.1 * abs(high) or 1.0
    return low - pad, high + pad


def panels(line, names, values, stds, *, smoothed=None, colors=LINES, marks=()) -> list:
    """Return a panel for each column (T, m) with its band of two deviations.

    Filtered as a shaded band; ``smoothed`` (values, stds) dashed between dotted lines.
    """
    points = max(min(FEW, ALL_POINTS // max(len(names), 1)), 300)
    many, found = len(names) > 4, []
    chosen = [envelope(value, points) for value in values.T]
    bands = [edges(value, 2 * std) for value, std in zip(values.T, stds.T)]
    steady = [steady_range(value, std) for value, std in zip(values.T, stds.T)]
    for j, (name, value, i, (low, high)) in enumerate(zip(names, values.T, chosen, bands)):
        columns, spans = {"v": value, "low": low, "high": high}, [steady[j]]
        if smoothed is not None:
            v, s = smoothed[0][:, j], smoothed[1][:, j]
            columns |= {"s": v, "slow": v - 2 * s, "shigh": v + 2 * s}
            spans.append(steady_range(v, s))
        spans = [span for span in spans if span] or [(-1.0, 1.0)]
        span, color = (min(low for low, _ in spans), max(high for _, high in spans)), colors[j % len(colors)]
        is_last = j >= len(names) - (2 if many else 1)
        source = line.source(i, **columns)
        fig = line.figure(190 if is_last else 165, name, is_named=is_last, y_range=span)
        fig.varea("t", "low", "high", source=source, color=color, alpha=0.25)
        drawn = fig.line("t", "v", source=source, color=color, width=1.8)
        tips = [(name, "v"), ("from", "low"), ("to", "high")]
        if smoothed is not None:
            for edge in ("slow", "shigh"):
                fig.line("t", edge, source=source, color=PALETTE["ink"], width=1.1, line_dash="dotted")
            fig.line("t", "s", source=source, color=PALETTE["ink"], width=1.8, line_dash="dashed")
            tips.append(("smoothed", "s"))
        line.hover(fig, [drawn], *tips)
        fig.yaxis.axis_label_text_font_style = "bold"
        fig.yaxis.ticker.desired_num_ticks = 4
        found.append(fig)
    for fig in found:
        mark_lines(line, fig, marks)
    return found


def innovations(line, z, *, outlier=None, marks=()) -> Any:
    """Innovations over their predicted standard deviation; what leaves the figure is drawn at its edge."""
    import numpy as np

    z = np.asarray(z, float)
    outlier = np.zeros(len(z), bool) if outlier is None else np.asarray(outlier)
    size = np.abs(z[np.isfinite(z) & ~outlier])
    reach = min(1.12 * size.max(), max(1.8 * float(np.quantile(size, 0.99)), 4.5)) if size.size else 4.5
    fig, drawn = line.figure(240, "innovation / sigma", y_range=(-reach, reach), name="innovations"), []
    shade(fig, -2, 2)
    across(fig, 0)
    is_long, shown = np.isfinite(z).sum() > LONG, np.clip(z, -0.965 * reach, 0.965 * reach)
    limit = 4 if is_long else 3
    far = np.abs(z) > limit
    if is_long:  # dots would be extremes only, and look like louder innovations
        drawn.append(("from lowest to highest", [_span(line, fig, shown)]))
    kinds = (
        (f"within {limit} sigma", ~outlier & ~far & np.isfinite(z), "circle", 4, PALETTE["measured"], 0.6),
        (f"beyond {limit} sigma", ~outlier & far, "triangle", 7, PALETTE["alert"], 0.9),
        ("outlier", outlier & np.isfinite(z), "x", 9, PALETTE["alert"], 0.9),
    )
    for name, chosen, marker, width, color, alpha in kinds[int(is_long) :]:
        i = np.flatnonzero(chosen)
        if len(i):
            i = i[envelope(z[i], FEW)] if is_long else i
            look = {"marker": marker, "size": width, "color": color, "alpha": alpha}
            drawn.append((name, [fig.scatter("t", "y", source=line.source(i, y=shown, z=z), **look)]))
    mark_lines(line, fig, marks)
    dots = [dot for _, some in drawn[int(is_long) :] for dot in some]
    line.hover(fig, dots, ("innovation / sigma", "z"))
    legend(fig, drawn)
    return fig


def _span(line, fig, values):
    """Draw the area between the lowest and the highest value of every bucket of samples."""
    import numpy as np

    start = np.arange(0, len(values), -(-len(values) // 1000))
    low, high = (np.nan_to_num(f.reduceat(values, start)) for f in (np.fmin, np.fmax))
    look = {"step_mode": "after", "color": PALETTE["measured"], "alpha": 0.45}
    return fig.varea_step(line.t[start], single(low), single(high), **look)


def weight(line, values, marks=()) -> Any:
    """The memory of an estimator in samples."""
    return _from_zero(line, "memory (samples)", values, LINES[1], marks)


def statistic(line, values, marks=()) -> Any:
    """A detector's statistic against its threshold."""
    fig = _from_zero(line, "statistic / threshold", values, LINES[0], marks)
    fig.name = "statistic"
    across(fig, 1, line_color=PALETTE["ink"], line_dash="dashed")
    return fig


def _from_zero(line, label, values, color, marks):
    """One column from zero upwards, with the marks of what happened."""
    import numpy as np

    values = np.asarray(values, float)
    top = 1.08 * max(float(np.nanmax(values, initial=1.0)), 1.0)
    fig = line.figure(190, label, y_range=(0.0, top))
    drawn = fig.line("t", "v", source=line.source(envelope(values, FEW), v=values), width=1.6, color=color)
    mark_lines(line, fig, marks)
    line.hover(fig, [drawn], (label, "v"))
    return fig


HATCHES = (" ", "/", "\\", ".", "-", "|", "x", "+")
SHOWN = 7  # members with an area of their own


def weights(line, shares, names, marks=()) -> Any:
    """Shares (T, M) of the members of an average, as stacked areas: the largest by name, the rest together.

    Long records are drawn with the mean of every bucket of samples, which keeps the sum at one.
    """
    import numpy as np
    from bokeh.models import ColumnDataSource

    shares = np.asarray(shares, float)
    order = np.argsort(-np.nanmean(shares, axis=0), kind="stable")
    first, rest = order[:SHOWN], order[SHOWN:]
    columns, called = [shares[:, j] for j in first], [str(names[j]) for j in first]
    if len(rest):
        columns, called = [*columns, shares[:, rest].sum(axis=1)], [*called, f"{len(rest)} others"]
    start = np.arange(0, len(shares), -(-len(shares) // FEW))
    size = np.diff(np.append(start, len(shares)))[:, None]
    top = np.cumsum(np.add.reduceat(np.column_stack(columns), start, axis=0) / size, axis=1)
    fig = line.figure(240, "weight", y_range=(0.0, 1.0), name="weights")
    data = {"t": line.t[start], "k": line.rows[start].astype(np.int32), "top-1": single(0 * top[:, 0])}
    data |= {f"top{j}": single(top[:, j]) for j in range(len(called))}
    source, drawn = ColumnDataSource(data), []
    for j, name in enumerate(called):
        look = {"color": LINES[j % len(LINES)], "alpha": 0.75, "hatch_pattern": HATCHES[j % len(HATCHES)]}
        area = fig.varea(
            "t", f"top{j - 1}", f"top{j}", source=source, hatch_color="#ffffff", hatch_alpha=0.6, hatch_scale=10, **look
        )
        drawn.append((name, [area]))
    mark_lines(line, fig, marks)
    legend(fig, drawn)
    return fig
