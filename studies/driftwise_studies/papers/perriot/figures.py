"""The figures of this reproduction, in the style of `reproduce.pictures`."""

from __future__ import annotations

import numpy as np

from ..pictures import BLUE, GREEN, INK, ORANGE, PURPLE, RED, SKY, legend, panels, title


def plates(paths, truth, errors):
    """Gain of each method over time against K_opt, and the alarms of the one that raises them."""
    figure, axes = panels(5, 1, 12.5, sharex=True, height_ratios=[3, 3, 3, 1.2, 3])
    n, rows = np.arange(len(truth)), iter(axes[:, 0])
    for name, path in paths.items():
        ax = next(rows)
        low, middle, high = np.quantile(path.K, [0.1, 0.5, 0.9], axis=1)
        ax.fill_between(n, low, high, color=SKY, alpha=0.35, lw=0, label="middle 80 % of the records")
        ax.plot(n, path.K[:, 3], color=ORANGE, lw=0.9, label="one record")
        ax.plot(n, middle, color=BLUE, lw=1.5, label="median")
        ax.plot(n, truth, color=INK, lw=1.1, ls="--", label="optimal gain")
        ax.set_ylim(0, 0.55)
        ax.set_ylabel("K")
        title(ax, f"{name} (K-MSE {errors[name]:.1f})")
        if path.alarms.any():
            _alarms(next(rows), path.alarms)
    axes[-1, 0].set_xlabel("sample")
    axes[-1, 0].set_xlim(0, len(truth))
    legend(figure, axes[0, 0])
    return figure


def _alarms(ax, alarms):
    width = 25
    at = np.arange(0, len(alarms), width)
    for side, color, name in ((1, GREEN, "increase"), (-1, RED, "decrease")):
        count = (alarms == side).reshape(-1, width, alarms.shape[1]).sum(axis=(1, 2)) / alarms.shape[1]
        ax.bar(at, side * count, width, align="edge", color=color, alpha=0.8)
        ax.text(1995, side * 0.24, name, color=color, ha="right", va="center", fontsize=9)
    for jump in (500, 1000, 1500):
        ax.axvline(jump, color=INK, lw=1.0, ls="--")
    ax.set_ylim(-0.4, 0.4)
    ax.set_yticks([-0.2, 0, 0.2], labels=["0.2", "0", "0.2"])
    ax.set_ylabel(f"alarms per\n{width} samples", fontsize=8.5)


def methods(scores, names):
    """Error of the gain with two standard errors, Q jumps and R jumps."""
    figure, axes = panels(1, 2, 5.2, sharey=True)
    for ax, jumps in zip(axes[0], "QR"):
        for row, name in enumerate(names):
            found = scores[name, jumps]
            color = ORANGE if "Plate" in name or "printed" in name else BLUE
            ax.plot([0, found.error], [row, row], color=color, lw=7, alpha=0.75, solid_capstyle="butt")
            ax.plot(found.error + 2 * found.deviation * np.array([-1, 1]), [row, row], color=INK, lw=1.4)
            ax.text(found.error + 2.4 * found.deviation + 0.3, row, f"{found.error:.1f}", va="center", fontsize=9)
        ends = [scores[name, j].error + 2 * scores[name, j].deviation for name in names for j in "QR"]
        ax.set_xlim(0, 1.22 * max(ends))
        ax.set_xlabel("K-MSE: mean square error of K, times 1000", fontsize=9)
        title(ax, f"{jumps} jumps")
    axes[0, 0].set_yticks(range(len(names)), labels=names)
    axes[0, 0].invert_yaxis()
    return figure


def detection(tests, seen):
    """Share of each jump seen by each test, with what is expected."""
    figure, axes = panels(1, 2, 4.6, sharey=True)
    jumps = (("first increase", BLUE, -0.2), ("decrease", RED, 0.0), ("second increase", SKY, 0.2))
    for ax, kind in zip(axes[0], "QR"):
        for row, test in enumerate(tests):
            for i, (name, color, offset) in enumerate(jumps):
                value, listed = seen[test.name, kind][i], getattr(test, kind)[i]
                ax.plot([0, value], [row + offset] * 2, color=color, lw=4.5, solid_capstyle="butt", label=name)
                ax.plot(listed, row + offset, "o", ms=5.5, mfc="white", mec=INK, zorder=4)
        ax.set_xlim(0, 1.03)
        ax.set_xlabel("share of the records that see the jump")
        title(ax, f"{kind} jumps")
    axes[0, 0].set_yticks(range(len(tests)), labels=[test.name for test in tests])
    axes[0, 0].invert_yaxis()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles[:3], labels[:3], loc="outside upper center", ncols=3, frameon=False, fontsize=9.5)
    return figure


def paying(jumps, errors):
    """Error of each way over that of the random walk, by size of the jump."""
    figure, axes = panels(1, 1, 5.0)
    ax, base = axes[0, 0], np.array(errors["random walk, matched q"])
    styles = {  # a colour and a marker each: some lines lie on one another
        "Hinkley, best (h, N0)": (INK, "D"),
        "Hinkley, minimum of J*": (GREEN, "o"),
        "run-length rule, N0 = 1 + G²/d²": (SKY, "^"),
        "the same, warm start": (BLUE, "v"),
        "variable forgetting, best": (PURPLE, "P"),
        "run-length mixture": (ORANGE, "s"),
        "the paper's h = 15, N0 = 6": (RED, "X"),
    }
    for name, (color, marker) in styles.items():
        mine = np.array(errors[name]) / base
        ax.plot(jumps, mine, marker, ls="-", color=color, lw=1.7, ms=7, mec="white", mew=0.7, label=name)
    ax.axhline(1, color=INK, lw=1.2, ls=":")
    ax.set_xscale("log")
    ax.set_xticks(jumps, labels=[f"{d:g}" for d in jumps])
    ax.minorticks_off()
    ax.set_xlabel("size of the jumps over the standard deviation of the noise")
    ax.set_ylabel("error over the random walk's")
    legend(figure, ax, 3)
    return figure


def run_lengths(points):
    """Each formula's run length over the simulated one, by threshold; one panel for each dmu."""
    drifts = sorted({point[0] for point in points})
    figure, axes = panels(1, len(drifts), 4.4, sharey=True)
    names = (("T1", RED), ("T1 at h + 1.165 G", PURPLE), ("exponent of products", GREEN), ("two-point fit", BLUE))
    for ax, dmu in zip(axes[0], drifts):
        mine = np.array([point[1:] for point in points if point[0] == dmu])
        for i, (name, color) in enumerate(names):
            ax.plot(mine[:, 0], mine[:, 2 + i] / mine[:, 1], "o-", color=color, lw=1.6, ms=5, label=name)
        ax.axhline(1, color=INK, lw=1.0, ls=":")
        ax.set_yscale("log")
        ax.set_yticks([0.5, 1, 2, 5, 10, 20], labels=["0.5", "1", "2", "5", "10", "20"])
        ax.minorticks_off()
        ax.set_xlabel("threshold h")
        title(ax, f"Δμ = {dmu}")
    axes[0, 0].set_ylabel("run length over the simulated one")
    legend(figure, axes[0, 0])
    return figure
