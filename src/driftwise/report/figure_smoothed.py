"""What `SmoothedParameters.plot()` draws: each parameter with its band, the filtered one thin, the jumps."""

from __future__ import annotations

from .figure import LINES, PALETTE, POINTS, _tidy, steady_range
from .thin import together

__all__ = ["plot"]


def plot(found, *, labels=None, figure=None):
    """Draw smoothed parameters and return the Axes as an array, one for each parameter.

    Parameters
    ----------
    found : `SmoothedParameters`
    labels : dict with "time", the name with unit of the axis
    figure : a matplotlib Figure to draw into; a new one if omitted
    """
    import matplotlib.pyplot as plt

    rows = len(found.names)
    if figure is None:
        figure = plt.figure(figsize=(9.5, 1.7 * rows + 0.8), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for i, (ax, name) in enumerate(zip(axes, found.names, strict=True)):
        value, std, colour = found.parameters[:, i], found.parameters_std[:, i], LINES[i % len(LINES)]
        at = together(POINTS, value, found.filtered[:, i])
        time, low, high = found.time[at], (value - 2 * std)[at], (value + 2 * std)[at]
        ax.plot(time, found.filtered[at, i], color=PALETTE["quiet"], linewidth=0.7, label="filtered")
        ax.fill_between(time, low, high, color=colour, alpha=0.2, linewidth=0)
        ax.plot(time, value[at], color=colour, linewidth=1.4, label="smoothed, 2-sigma band")
        for jump in found.jumps:
            is_named = jump.parameter == name
            ax.axvline(jump.time, color=PALETTE["alert"], linewidth=1.2 if is_named else 0.6, linestyle=":")
        ax.set_ylabel(name)
        limits = steady_range(value, std)
        if limits is not None:
            ax.set_ylim(*limits)
        _tidy(ax)
    axes[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, frameon=False, fontsize=9)
    axes[-1].set_xlabel((labels or {}).get("time", "time (s)"))
    return axes
