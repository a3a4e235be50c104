"""What the trace of several outputs draws: for each output a picture of one, beside the parameters of its equation."""

from __future__ import annotations

from driftwise.report.figure import _changes, _innovations, _output, _parameters, _tidy

__all__ = ["plot"]


def plot(trace, *, labels=None, figure=None):
    """Draw a trace of several outputs and return its Axes (p, 3): output, innovations, parameters of its equation.

    A trace that kept no parameters has (p, 2).

    Parameters
    ----------
    trace : a TraceMIMO
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
    axes, time, first = np.empty((p, columns + 1), object), np.asarray(trace.time), None
    for i, one in enumerate(trace.outputs):
        axes[i, 0] = first = figure.add_subplot(grid[2 * i, 0], sharex=first)
        axes[i, 1] = figure.add_subplot(grid[2 * i + 1, 0], sharex=first)
        _output(axes[i, 0], one, time)
        if i:
            axes[i, 0].get_legend().remove()  # the first one serves all
        axes[i, 0].set_ylabel(labels["outputs"][i])
        axes[i, 0].tick_params(labelbottom=False)
        _innovations(axes[i, 1], one, time)
        axes[i, 1].set_ylabel("innovation\n/ sigma")
        axes[i, 1].tick_params(labelbottom=i == p - 1)
        if has_parameters:
            axes[i, 2] = figure.add_subplot(grid[2 * i : 2 * i + 2, 1], sharex=first)
            _equation(axes[i, 2], trace, time, list(range(form.theta_at[i], form.theta_at[i + 1])))
            axes[i, 2].set_title(f"equation of {labels['outputs'][i]}", fontsize=9, loc="left")
            axes[i, 2].tick_params(labelbottom=i == p - 1)
        _changes(axes[i], one.events())
    for ax in axes[-1, 1:]:
        ax.set_xlabel(labels["time"])
    for ax in axes.ravel():
        _tidy(ax)
    figure.align_ylabels(axes[:, :2])
    return axes


def _equation(ax, trace, time, columns):
    """Draw the parameters of an equation."""
    _parameters(ax, trace, time, columns)
    many = len(columns) > 12
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8, handlelength=1.6, ncols=1 + many)
