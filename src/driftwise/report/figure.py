"""What `trace.plot()` draws: measured against predicted, parameters with bands, standardised innovations."""

from __future__ import annotations

from driftwise.engine.status import OUTLIER, REJECTED
from driftwise.report.thin import alone, envelope, together

__all__ = ["MARKS", "PALETTE", "changes", "plot", "steady_range"]

POINTS = 5000
LINES_SHOWN = 60  # vertical lines at jumps and rises of the noise
# colours that everyone can tell apart (Okabe and Ito, 2008); dashes and markers say the same again
PALETTE = {
    "ink": "#1f2933",
    "quiet": "#7b8794",
    "grid": "#e6eaef",
    "measured": "#1f2933",
    "predicted": "#0072B2",
    "alert": "#D55E00",
    "warn": "#E69F00",
    "good": "#009E73",
}
LINES = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#1f2933", "#8c8200"]
DASHES = ["solid", "dashed", "dashdot", "dotted"]
# events that are drawn apart: what they are called, which they are, colour, marker (Bokeh's), dashes of a line across
MARKS = (
    ("jump", ("JUMP",), PALETTE["alert"], "inverted_triangle", "dashed"),
    ("louder noise", ("NOISE",), PALETTE["warn"], "diamond", "dotted"),
    ("outlier", ("REJECTED", "OUTLIER"), PALETTE["alert"], "x", ""),
)


def plot(trace, *, labels=None, figure=None):
    """Draw a trace and return its Axes as an array: output, parameters (denominator, numerator), innovations.

    Parameters
    ----------
    trace : a Trace
    labels : dict with "output", "input" and "time", names with units for the axes
    figure : a matplotlib Figure to draw into; a new one if omitted
    """
    import matplotlib.pyplot as plt
    import numpy as np

    labels = {
        "output": "output",
        "time": "time (s)",
        **(getattr(trace, "labels", None) or {}),
        **(labels or {}),
    }
    groups = _groups(trace.names) if getattr(trace, "keep", "std") != "innovations" else []
    rows = len(groups) + 2
    if figure is None:
        figure = plt.figure(figsize=(9.5, 2.1 * rows + 1.0), layout="constrained")
    axes = figure.subplots(
        rows, 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": [1.5] + [1] * (rows - 1)}
    )[:, 0]
    time = np.asarray(trace.time)
    _output(axes[0], trace, time)
    axes[0].set_ylabel(labels["output"])
    for ax, (title, columns) in zip(axes[1:], groups, strict=False):
        _parameters(ax, trace, time, columns)
        ax.set_ylabel(title)
    _innovations(axes[-1], trace, time)
    _changes(axes, trace.events())
    axes[-1].set_xlabel(labels["time"])
    for ax in axes:
        _tidy(ax)
    figure.align_ylabels(axes)
    return axes


def changes(events, most: int) -> list[tuple[float, str, str]]:
    """Return (time, colour, dashes) of the first jumps and rises of the noise, for vertical lines."""
    looks = {kind: (colour, dash) for _, kinds, colour, _, dash in MARKS if dash for kind in kinds}
    return [(event.time, *looks[event.kind]) for event in events if event.kind in looks][:most]


def steady_range(value, std, skip: float = 0.05):
    """Return an axis range that shows a band once the first guesses are over, or None without any."""
    import numpy as np

    value, std = np.asarray(value, float), np.asarray(std, float)
    start = min(int(np.ceil(skip * len(value))), max(len(value) - 1, 0))
    low, high = (value - 2 * std)[start:], (value + 2 * std)[start:]
    good = np.isfinite(low) & np.isfinite(high)
    if not good.any():
        return None
    low, high = np.quantile(low[good], 0.02), np.quantile(high[good], 0.98)
    middle = value[start:][good]
    low, high = min(low, np.quantile(middle, 0.005)), max(high, np.quantile(middle, 0.995))
    pad = 0.08 * (high - low) or 0.1 * abs(high) or 1.0
    return float(low - pad), float(high + pad)


def _groups(names):
    groups = []
    for letter, title in (("a", "denominator"), ("b", "numerator")):
        columns = [j for j, name in enumerate(names) if name.startswith(letter)]
        if columns:
            groups.append((title, columns))
    rest = [j for j, name in enumerate(names) if name[0] not in "ab"]
    return [*groups, ("other parameters", rest)] if rest else groups


def _output(ax, trace, time):
    import numpy as np

    i = together(POINTS, trace.y, trace.prediction)
    center, half = np.asarray(trace.prediction)[i], np.asarray(trace.band())[i]
    ax.fill_between(
        time[i], center - half, center + half, color=PALETTE["predicted"], alpha=0.16, lw=0, label="95 % band"
    )
    few = len(time) <= 300
    ax.plot(time[i], center, color=PALETTE["predicted"], lw=1.8, label="predicted one step ahead")
    ink = PALETTE["measured"]
    ax.plot(time[i], np.asarray(trace.y)[i], ".-" if few else "-", color=ink, lw=0.9, ms=4, label="measured")
    if not few:
        lone = i[alone(trace.y)[i]]
        ax.plot(time[lone], np.asarray(trace.y)[lone], ".", color=ink, ms=3)
    seen = np.asarray(trace.y)[np.isfinite(trace.y)]
    if seen.size and seen.min() < seen.max():
        pad = 0.12 * (seen.max() - seen.min())
        ax.set_ylim(seen.min() - pad, seen.max() + pad)
    ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, frameon=False, fontsize=9, borderaxespad=0.2)


def _parameters(ax, trace, time, columns):
    import numpy as np

    ranges = []
    for count, j in enumerate(columns):
        value = np.asarray(trace.parameters)[:, j]
        has_band = getattr(trace, "keep", "std") != "means"
        std = np.asarray(trace.parameters_std)[:, j] if has_band else np.zeros_like(value)
        i = envelope(value, POINTS)
        color = LINES[count % len(LINES)]
        ax.fill_between(time[i], (value - 2 * std)[i], (value + 2 * std)[i], color=color, alpha=0.15, lw=0)
        dash = DASHES[(count + count // len(LINES)) % len(DASHES)]  # where a colour comes back, in other dashes
        ax.plot(time[i], value[i], color=color, lw=1.3, linestyle=dash, label=trace.names[j])
        ranges.append(steady_range(value, std))
    ranges = [r for r in ranges if r]
    if ranges:
        ax.set_ylim(min(r[0] for r in ranges), max(r[1] for r in ranges))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9, handlelength=1.2)


def _innovations(ax, trace, time):
    import numpy as np

    z = np.asarray(trace.innovation) / np.sqrt(np.asarray(trace.variance))
    i = envelope(z, POINTS)
    ax.axhspan(-2, 2, color=PALETTE["predicted"], alpha=0.08, lw=0)
    ax.axhline(0, color=PALETTE["quiet"], lw=0.6)
    ax.plot(time[i], z[i], ".", ms=2.5, color=PALETTE["measured"])
    is_outlier = (np.asarray(trace.status) & (REJECTED | OUTLIER)) != 0
    far = np.flatnonzero((np.abs(z) > 3) & ~is_outlier)[:POINTS]
    ax.plot(time[far], z[far], ".", ms=4, color=PALETTE["alert"])
    reach = min(1.1 * np.nanmax(np.abs(z[~is_outlier]), initial=3.0), 12)
    ax.plot(time[is_outlier], np.clip(z[is_outlier], -0.95 * reach, 0.95 * reach), "x", ms=5, color=PALETTE["warn"])
    ax.set_ylim(-reach, reach)
    ax.set_ylabel("innovation / sigma")


def _changes(axes, events):
    for when, colour, dash in changes(events, LINES_SHOWN):
        for ax in axes:
            ax.axvline(when, color=colour, linewidth=0.9, linestyle=dash, alpha=0.8, zorder=0)


def _tidy(ax):
    ax.grid(True, color=PALETTE["grid"], lw=0.7)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(PALETTE["quiet"])
    ax.tick_params(colors=PALETTE["ink"], labelsize=9)
    ax.margins(x=0.01)
