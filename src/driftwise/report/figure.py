"""What `plot()` of a result draws with Matplotlib: outputs, parameters with bands, standardised innovations."""

from __future__ import annotations

from driftwise.engine.status import OUTLIER, REJECTED
from driftwise.report.thin import alone, envelope, together

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
    labels = {"output": "output", "time": "time (s)", **(getattr(trace, "labels", None) or {}), **(labels or {})}
    groups = _groups(trace.names) if getattr(trace, "keep", "std") != "innovations" else []
    heights = [1.5] + [1.0] * (len(groups) + 1)
    axes = _rows(figure, heights, 2.1)
    _output(axes[0], trace, labels["output"])
    for ax, (title, columns) in zip(axes[1:], groups, strict=False):
        _parameters(ax, trace, columns, title)
    _innovations(axes[-1], trace)
    _changes(axes, trace.events())
    return _done(axes, labels["time"])


def plot_mimo(trace, *, labels=None, figure=None):
    """Draw a trace of several outputs and return its Axes (p, 3): output, innovations, parameters of its equation.

    A trace that kept no parameters has (p, 2).

    Parameters
    ----------
    trace : a Trace of several outputs
    labels : dict with "outputs" (one name with unit for each) and "time"
    figure : a matplotlib Figure to draw into; a new one if omitted
    """
    import matplotlib.pyplot as plt
    import numpy as np

    form, has_parameters = trace.estimator.model, trace.keep != "innovations"
    p, columns = form.outputs, 1 + has_parameters
    labels = {"outputs": [f"output {i + 1}" for i in range(p)], "time": "time (s)", **(labels or {})}
    if figure is None:
        figure = plt.figure(figsize=(7.5 * columns, 3.2 * p + 0.6), layout="constrained")
    grid = figure.add_gridspec(2 * p, columns, height_ratios=[1.7, 1] * p, width_ratios=[1.25, 1][:columns])
    axes, first = np.empty((p, columns + 1), object), None
    for i, (one, name) in enumerate(zip(trace.outputs, labels["outputs"])):
        axes[i, 0] = first = figure.add_subplot(grid[2 * i, 0], sharex=first)
        axes[i, 1] = figure.add_subplot(grid[2 * i + 1, 0], sharex=first)
        _output(axes[i, 0], one, name, has_legend=not i)
        _innovations(axes[i, 1], one, "innovation\n/ sigma")
        axes[i, 0].tick_params(labelbottom=False)
        axes[i, 1].tick_params(labelbottom=i == p - 1)
        if has_parameters:
            axes[i, 2] = ax = figure.add_subplot(grid[2 * i : 2 * i + 2, 1], sharex=first)
            own = list(range(form.theta_at[i], form.theta_at[i + 1]))
            _parameters(ax, trace, own, fontsize=8, handlelength=1.6, ncols=1 + (len(own) > 12))
            ax.set_title(f"equation of {name}", fontsize=9, loc="left")
            ax.tick_params(labelbottom=i == p - 1)
        _changes(axes[i], one.events())
    for ax in axes[-1, 1:]:
        ax.set_xlabel(labels["time"])
    for ax in axes.ravel():
        _tidy(ax)
    figure.align_ylabels(axes[:, :2])
    return axes


def plot_observer(trace, *, labels=None, figure=None):
    """Draw the trace of an observer; return its Axes: each output, its innovations, then each estimate with 2 sigma.

    Parameters
    ----------
    trace : an ObserverTrace
    labels : dict of names (of outputs, states, .. and "time") with what to write at their axes
    figure : a matplotlib Figure to draw into; a new one if omitted
    """
    import numpy as np

    form, labels = trace.estimator.model, {"time": "time (s)", **(labels or {})}
    names = form.state_names + form.names if trace.keep != "innovations" else []
    axes = _rows(figure, [1.7, 1.0] * form.outputs + [1.2] * len(names), 1.5)
    for i, (name, one) in enumerate(zip(form.output_names, trace.outputs)):
        _output(axes[2 * i], one, labels.get(name, name), has_legend=not i)
        _innovations(axes[2 * i + 1], one, "innovation\n/ sigma")
    for i, name in enumerate(names):
        ax, value = axes[2 * form.outputs + i], trace.estimates[:, i]
        std = trace.std[:, i] if trace.keep == "std" else np.zeros(len(value))
        colour = LINES[0] if i < form.n else LINES[1] if i < form.m else LINES[2]
        at = envelope(value, POINTS)
        with np.errstate(invalid="ignore"):
            _band(ax, trace.time, value, 2 * std, at, colour, alpha=0.16)
        ax.plot(trace.time[at], value[at], color=colour, lw=1.3)
        _reach(ax, [steady_range(value, std)])
        ax.set_ylabel(labels.get(name, name))
    for event in trace.events():
        if event.kind == "READY":
            for ax in axes[2 * form.outputs :]:
                ax.axvline(event.time, color=PALETTE["good"], lw=0.9, ls=":", zorder=0)
    _changes(axes, trace.events())
    return _done(axes, labels["time"])


def plot_smoothed(found, *, labels=None, figure=None):
    """Draw smoothed parameters and return the Axes as an array, one for each parameter.

    Parameters
    ----------
    found : `SmoothedParameters`
    labels : dict with "time", the name with unit of the axis
    figure : a matplotlib Figure to draw into; a new one if omitted
    """
    axes = _rows(figure, None, 1.7, 0.8, len(found.names))
    for i, (ax, name) in enumerate(zip(axes, found.names, strict=True)):
        value, std, colour = found.parameters[:, i], found.parameters_std[:, i], LINES[i % len(LINES)]
        at = together(POINTS, value, found.filtered[:, i])
        time = found.time[at]
        ax.plot(time, found.filtered[at, i], color=PALETTE["quiet"], linewidth=0.7, label="filtered")
        _band(ax, found.time, value, 2 * std, at, colour, alpha=0.2)
        ax.plot(time, value[at], color=colour, linewidth=1.4, label="smoothed, 2-sigma band")
        for jump in found.jumps:
            is_named = jump.parameter == name
            ax.axvline(jump.time, color=PALETTE["alert"], linewidth=1.2 if is_named else 0.6, linestyle=":")
        ax.set_ylabel(name)
        _reach(ax, [steady_range(value, std)])
        _tidy(ax)
    axes[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, frameon=False, fontsize=9)
    axes[-1].set_xlabel((labels or {}).get("time", "time (s)"))
    return axes


# --- the parts of a figure -----------------------------------------------------------------------------------


def _rows(figure, heights, each: float, more: float = 1.0, rows: int = 0):
    """Return Axes one above the other, in a new figure where none is given."""
    import matplotlib.pyplot as plt

    rows = rows or len(heights)
    if figure is None:
        figure = plt.figure(figsize=(9.5, each * rows + more), layout="constrained")
    options = {} if heights is None else {"gridspec_kw": {"height_ratios": heights}}
    return figure.subplots(rows, 1, sharex=True, squeeze=False, **options)[:, 0]


def _done(axes, time: str):
    """Return the Axes, the time written below the last one, all of them tidy."""
    axes[-1].set_xlabel(time)
    for ax in axes:
        _tidy(ax)
    axes[0].figure.align_ylabels(axes)
    return axes


def _band(ax, time, middle, half, at, color, alpha, **more):
    ax.fill_between(time[at], (middle - half)[at], (middle + half)[at], color=color, alpha=alpha, lw=0, **more)


def _reach(ax, ranges):
    """Let an axis show ranges; those that are none are left out."""
    ranges = [r for r in ranges if r]
    if ranges:
        ax.set_ylim(min(r[0] for r in ranges), max(r[1] for r in ranges))


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


def _output(ax, trace, label: str, *, has_legend: bool = True):
    import numpy as np

    time, y, center = (np.asarray(column) for column in (trace.time, trace.y, trace.prediction))
    i, ink, few = together(POINTS, y, center), PALETTE["measured"], len(time) <= 300
    _band(ax, time, center, np.asarray(trace.band()), i, PALETTE["predicted"], alpha=0.16, label="95 % band")
    ax.plot(time[i], center[i], color=PALETTE["predicted"], lw=1.8, label="predicted one step ahead")
    ax.plot(time[i], y[i], ".-" if few else "-", color=ink, lw=0.9, ms=4, label="measured")
    if not few:
        lone = i[alone(y)[i]]
        ax.plot(time[lone], y[lone], ".", color=ink, ms=3)
    seen = y[np.isfinite(y)]
    if seen.size and seen.min() < seen.max():
        pad = 0.12 * (seen.max() - seen.min())
        ax.set_ylim(seen.min() - pad, seen.max() + pad)
    if has_legend:  # the first one serves all
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, frameon=False, fontsize=9, borderaxespad=0.2)
    ax.set_ylabel(label)


def _parameters(ax, trace, columns, label: str = "", **legend):
    import numpy as np

    time, ranges = np.asarray(trace.time), []
    for count, j in enumerate(columns):
        value = np.asarray(trace.parameters)[:, j]
        has_band = getattr(trace, "keep", "std") != "means"
        std = np.asarray(trace.parameters_std)[:, j] if has_band else np.zeros_like(value)
        i = envelope(value, POINTS)
        color = LINES[count % len(LINES)]
        _band(ax, time, value, 2 * std, i, color, alpha=0.15)
        dash = DASHES[(count + count // len(LINES)) % len(DASHES)]  # where a colour comes back, in other dashes
        ax.plot(time[i], value[i], color=color, lw=1.3, linestyle=dash, label=trace.names[j])
        ranges.append(steady_range(value, std))
    _reach(ax, ranges)
    look = {"frameon": False, "fontsize": 9, "handlelength": 1.2} | legend
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **look)
    ax.set_ylabel(label)


def _innovations(ax, trace, label: str = "innovation / sigma"):
    import numpy as np

    time, z = np.asarray(trace.time), np.asarray(trace.innovation) / np.sqrt(np.asarray(trace.variance))
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
    ax.set_ylabel(label)


def _changes(axes, events):
    """Draw a line across the Axes at the first jumps and rises of the noise."""
    looks = {kind: (colour, dash) for _, kinds, colour, _, dash in MARKS if dash for kind in kinds}
    some = [event for event in events if event.kind in looks][:LINES_SHOWN]
    for event in some:
        colour, dash = looks[event.kind]
        for ax in axes:
            ax.axvline(event.time, color=colour, linewidth=0.9, linestyle=dash, alpha=0.8, zorder=0)


def _tidy(ax):
    ax.grid(True, color=PALETTE["grid"], lw=0.7)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(PALETTE["quiet"])
    ax.tick_params(colors=PALETTE["ink"], labelsize=9)
    ax.margins(x=0.01)
