"""The page of a comparison: the table of estimators, and when each of them was ahead."""

from __future__ import annotations

from pathlib import Path

from driftwise.report.axes import Timeline, legend
from driftwise.report.figure import LINES
from driftwise.report.page import Card, Page, Panel, group, table
from driftwise.report.panels import zoom_words
from driftwise.results.numbers import number

HEAD = ("estimator", "fit %", "rmse", "-log p", "behind best", "NIS", "in 95 %", "alarms", "µs/sample", "unknowns")


def cells(found) -> list[list[str]]:
    """Return the rows of the table, best first; ``=`` marks those that are not clearly worse than the best."""
    rows = []
    for row in found.rows:
        behind = f"{row.difference:.3f} \u00b1 {row.difference_std:.3f}{' =' * row.is_tied}" if row.difference else ""
        rows.append(
            [
                row.name, f"{row.fit:.1f}", number(row.rmse, 4), f"{row.nlpd:.3f}", behind, f"{row.nis:.2f}",
                f"{100 * row.coverage:.1f}", str(row.alarms), number(row.us_per_sample, 2), str(row.unknowns),
            ]
        )  # fmt: skip
    return rows


def write(found, path, title: str = "Comparison of estimators", facts=(), labels=None) -> Path:
    """Write one page about a `Comparison` and return its path."""
    best, (line, figure) = found.rows[0], _lead(found, labels or {})
    well = [
        Card("One-step fit", f"{best.fit:.1f}", "100 = perfect, 0 = the mean", unit="%"),
        Card("NIS", f"{best.nis:.2f}", "1 = right error bars"),
        Card("Held by 95 % bands", f"{100 * best.coverage:.1f}", "should be about 95", unit="%"),
    ]
    first = group("Which predicts best?", [Card("Best", best.name, "by log predictive density")])
    words = (
        "One step ahead, in one pass, on the same samples. -log p: mean negative log density given to what came, lower "
        "is better. Behind best: the difference and its deviation; = marks those not clearly worse. Unknowns: numbers "
        "that are estimated."
    )
    how = (
        "Log density given to the samples so far, less that of the best: where a line falls, that estimator loses; "
        "where it rises, it wins. Those far behind fall out of the window."
    )
    panels = [
        Panel("table", "Best first", words, (table(list(HEAD), cells(found)),)),
        Panel("lead", "Who was ahead when?", how, (figure, zoom_words(line))),
    ]
    return Page(title, panels, found.words, facts, [first, group("How well?", well)]).write(path)


def _lead(found, labels):
    """Return the time axis, and the log densities so far less that of the best over it."""
    import numpy as np

    time, log = found.path
    line = Timeline(time, labels.get("time", "time (s)"), labels.get("origin"))
    order = [found.names.index(row.name) for row in found.rows]
    behind = log[:, order] - log[:, [order[0]]]
    columns = {f"lead{k}": behind[:, k] for k in range(len(order))}
    source = line.source(np.arange(len(time)), **columns)
    shown = behind[:, : (len(order) + 1) // 2 + 1]  # the others may fall out of the window
    low, high = 1.1 * float(shown.min(initial=-1.0)), float(max(behind.max(initial=0.0), 0.0))
    fig = line.figure(340, "nats behind the best", y_range=(low, high - 0.05 * low), name="lead")
    drawn = [
        fig.line("t", f"lead{k}", source=source, line_width=1.8, color=LINES[k % len(LINES)],
                 line_dash="solid" if k < len(LINES) else "dashed")
        for k in range(len(order))
    ]  # fmt: skip
    names = [found.names[i] for i in order]
    line.hover(fig, drawn[:1], *((name, f"lead{k}") for k, name in enumerate(names)))
    legend(fig, [(name, [mark]) for name, mark in zip(names, drawn)])
    return line, fig
