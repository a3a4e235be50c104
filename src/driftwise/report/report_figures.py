"""The figures of the report of one output, by name, over one time axis."""

from __future__ import annotations

from typing import Any

from driftwise.engine.status import Status
from driftwise.report import report_bars as bars
from driftwise.report import report_dynamics as parts_of
from driftwise.report import report_plots as plots
from driftwise.report import report_roots
from driftwise.report.figure import LINES
from driftwise.report.report_axes import Timeline
from driftwise.report.report_marks import marks
from driftwise.report.report_parts import named

__all__ = ["draw", "scaled"]

STATES_SHOWN = 6
INPUTS_SHOWN = 4
UNUSED = int(Status.REJECTED | Status.OUTLIER)


def draw(trace, summary, labels, events, directions, smoothed, orders) -> tuple[Timeline, dict[str, Any]]:
    """Return the time axis and the figures; what they show is said in `report.write`."""
    line = Timeline(trace.time, labels["time"], labels.get("origin"), getattr(trace, "rows", None))
    outlier = (trace.status & UNUSED) != 0
    found = marks(events, trace.time, trace.status)
    below, options = inputs(line, trace, labels), {"outlier": outlier, "marks": found}
    columns = trace.y, trace.prediction, trace.band(0.95)
    figures = {"output": plots.output(line, *columns, labels["output"], **options, is_named=not below)}
    figures |= named("input", below)
    if getattr(trace, "keep", "std") != "innovations":
        figures |= named("parameter", parameters(line, trace, smoothed, found))
        if smoothed is not None and smoothed.estimator.model.n:
            figures |= named("state", states(line, trace, smoothed, found))
    figures |= named("adaptation", adaptation(line, trace, found))
    figures["innovations"] = plots.innovations(line, scaled(trace), **options)
    figures["acf"] = bars.autocorrelations(summary.correlations[1:], summary.observed)
    if summary.is_enough and not summary.is_static:
        figures["poles"] = report_roots.plane(summary.model)
        window = report_roots.smallest_window(summary.model)
        figures |= {} if window is None else {"closeup": report_roots.plane(summary.model, window)}
    figures["excitation"] = bars.excitation(directions, parts_of.UNLEARNED)
    if orders is not None:
        figures["orders"] = bars.orders(orders.orders, orders.probability)
    return line, figures


def scaled(trace):
    """Return the innovations over their predicted deviation."""
    import numpy as np

    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(trace.innovation, float) / np.sqrt(np.asarray(trace.variance, float))


def inputs(line, trace, labels) -> list:
    """Return a low panel for each of the first inputs."""
    if trace.u is None:
        return []
    columns = trace.u.reshape(len(trace), -1).T[:INPUTS_SHOWN]
    names = labels.get("inputs") or ([labels["input"]] if "input" in labels else [])
    names = [*names, *(f"input {k + 1}" if len(columns) > 1 else "input" for k in range(len(names), len(columns)))]
    return plots.inputs(line, columns, names)


def parameters(line, trace, smoothed, found) -> list:
    """Return a panel for each parameter, with its band where the trace kept one."""
    import numpy as np

    values = np.asarray(trace.parameters, float)
    has_band = getattr(trace, "keep", "std") != "means"
    stds = np.asarray(trace.parameters_std, float) if has_band else np.zeros_like(values)
    more = None if smoothed is None else (smoothed.parameters, smoothed.parameters_std)
    colors = [LINES["abcdefgh".find(name[0]) % len(LINES)] for name in trace.names]
    return plots.panels(line, trace.names, values, stds, smoothed=more, colors=colors, marks=found)


def states(line, trace, smoothed, found) -> list:
    """Return a panel for each of the first states, filtered and smoothed."""
    n = trace.estimator.model.n
    names, more = [f"x{n - i}" for i in range(n)][:STATES_SHOWN], (smoothed.x, smoothed.x_std)
    return plots.panels(line, names, trace.x, trace.x_std, smoothed=more, colors=[LINES[5]], marks=found)


def adaptation(line, trace, found) -> list:
    """Return the memory in samples, and the detector's statistic where there is a detector."""
    import numpy as np

    if "weight" not in trace.estimator.columns:
        return []
    memory, made = trace.estimator.options.get("memory"), []
    if parts_of.has_weight(memory):
        made.append(plots.weight(line, trace.weight, found))
    if np.nanmax(trace.statistic, initial=0.0) > 0:
        made.append(plots.statistic(line, trace.statistic, found))
    return made
