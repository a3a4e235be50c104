"""What the trace of an observer draws: outputs, then every state, disturbance and derived output with its band."""

from __future__ import annotations

from driftwise.report.figure import LINES, PALETTE, POINTS, _changes, _innovations, _output, _tidy, steady_range
from driftwise.report.thin import envelope
from driftwise.results.observer_summary import views

__all__ = ["plot"]


def plot(trace, *, labels=None, figure=None):
    """Draw the trace of an observer; return its Axes: each output, its innovations, then each estimate with 2 sigma.

    Parameters
    ----------
    trace : an ObserverTrace
    labels : dict of names (of outputs, states, .. and "time") with what to write at their axes
    figure : a matplotlib Figure to draw into; a new one if omitted
    """
    import matplotlib.pyplot as plt
    import numpy as np

    form = trace.estimator.model
    names = form.state_names + form.names if trace.keep != "innovations" else []
    rows, labels = 2 * form.outputs + len(names), {"time": "time (s)", **(labels or {})}
    if figure is None:
        figure = plt.figure(figsize=(9.5, 1.5 * rows + 1.0), layout="constrained")
    heights = [1.7, 1.0] * form.outputs + [1.2] * len(names)
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights})[:, 0]
    time = np.asarray(trace.time)
    for i, (name, one) in enumerate(zip(form.output_names, views(trace))):
        _output(axes[2 * i], one, time)
        if i:
            axes[2 * i].get_legend().remove()  # the first one serves all
        _innovations(axes[2 * i + 1], one, time)
        axes[2 * i].set_ylabel(labels.get(name, name))
        axes[2 * i + 1].set_ylabel("innovation\n/ sigma")
    for i, name in enumerate(names):
        ax, value = axes[2 * form.outputs + i], trace.estimates[:, i]
        std = trace.std[:, i] if trace.keep == "std" else np.zeros(len(value))
        colour = LINES[0] if i < form.n else LINES[1] if i < trace.estimator.model.m else LINES[2]
        at = envelope(value, POINTS)
        with np.errstate(invalid="ignore"):
            ax.fill_between(time[at], (value - 2 * std)[at], (value + 2 * std)[at], color=colour, alpha=0.16, lw=0)
        ax.plot(time[at], value[at], color=colour, lw=1.3)
        shown = steady_range(value, std)
        if shown:
            ax.set_ylim(*shown)
        ax.set_ylabel(labels.get(name, name))
    for event in trace.events():
        if event.kind == "READY":
            for ax in axes[2 * form.outputs :]:
                ax.axvline(event.time, color=PALETTE["good"], lw=0.9, ls=":", zorder=0)
    _changes(axes, trace.events())
    axes[-1].set_xlabel(labels["time"])
    for ax in axes:
        _tidy(ax)
    figure.align_ylabels(axes)
    return axes
