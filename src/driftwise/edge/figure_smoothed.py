"""What `SmoothedParameters.plot()` draws: each parameter with its band, the filtered one thin, the jumps."""

from __future__ import annotations

from .figure import LINES, PALETTE, _tidy, steady_range

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
        ax.plot(found.time, found.filtered[:, i], color=PALETTE["quiet"], linewidth=0.7, label="filtered")
        ax.fill_between(found.time, value - 2 * std, value + 2 * std, color=colour, alpha=0.2, linewidth=0)
        ax.plot(found.time, value, color=colour, linewidth=1.4, label="smoothed, 2-sigma band")
        for jump in found.jumps:
            is_named = jump.parameter == name
            ax.axvline(jump.time, color=PALETTE["alert"], linewidth=1.2 if is_named else 0.6, linestyle=":")
        ax.set_ylabel(name)
        limits = steady_range(value, std)
        if limits is not None:
            ax.set_ylim(*limits)
        _tidy(ax)
    axes[0].legend(loc="upper right", fontsize="small", ncols=2, framealpha=0.9)
    axes[-1].set_xlabel((labels or {}).get("time", "time (s)"))
    return axes
