"""The roofline as a figure: operations per byte against operations per second, on both axes in powers of ten."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .page import Found
from .roofline import COLUMNS, MACHINE, STEPS, TICKS
from .verdicts import Table


def draw(path: Path, found: Found) -> None:
    """Draw the figure, if the roofline was measured."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "roofline", "font.size": 9})
    import matplotlib.pyplot as plt

    tables = {one.title: one for _, one in found if isinstance(one, Table)}
    if MACHINE not in tables or STEPS not in tables:
        return
    limit = {row[0]: row[1] for row in tables[MACHINE].rows}
    intensity = np.geomspace(0.05, 300, 100)
    figure, axes = plt.subplots(figsize=(7.5, 4.2), layout="constrained")
    vector = limit["the same in vectors, fused"]
    for where in ("L1", "L3", "memory"):
        rate = limit[f"triad, arrays in {where}"]
        axes.plot(intensity, np.minimum(intensity * rate, vector), color="0.6", lw=1)
        axes.text(
            0.055,
            0.068 * rate,
            f"{where} {rate:.0f} GB/s",
            rotation=39,
            rotation_mode="anchor",
            fontsize=7,
            color="0.4",
        )
    for name, height in (
        ("vectors, fused", vector),
        ("one at a time", limit["sums and products, one number at a time"]),
    ):
        axes.axhline(height, color="0.3", lw=1, ls="--")
        axes.annotate(f"{name}: {height:.0f} GFLOP/s", (280, height * 1.08), ha="right", fontsize=7, color="0.3")
    colours: dict[str, str] = {}
    for row in tables[STEPS].rows:
        cell = dict(zip(COLUMNS, row))
        colour = colours.setdefault(cell["estimator"], f"C{len(colours)}")
        is_fleet = cell["fed as"] == TICKS
        label = None if is_fleet else cell["estimator"]
        at = cell["operations"] / cell["bytes"]
        axes.plot(
            at, cell["GFLOP/s"], "o" if is_fleet else "s", color=colour, label=label, mfc="w" if is_fleet else None
        )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="operations per byte moved",
        ylabel="GFLOP/s of one core",
        xlim=(0.05, 300),
        ylim=(0.7, 300),
    )
    told = "square: series after series; circle: tick after tick"
    figure.legend(fontsize=7, title=told, title_fontsize=7, loc="outside lower center", ncols=5)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
