"""The figures of these reproductions, in the style of `reproduce.pictures`."""

from __future__ import annotations

import numpy as np

from ..pictures import BLUE, GREEN, INK, ORANGE, PURPLE, QUIET, RED, SKY, legend, panels, title
from .example import AUXILIARY, GAINS, KNOWN, SLOW, TUNED
from .systems import SIGMA2

METHODS = {KNOWN: BLUE, TUNED: RED, AUXILIARY: GREEN}
SHOWN = 1e-3


def errors(found):
    """Figure 3: the prediction error of one record, three methods, the gain printed and correct."""
    figure, axes = panels(3, 2, 6.6, sharex=True, sharey=True)
    for column, printed in enumerate((True, False)):
        for ax, (name, color) in zip(axes[:, column], METHODS.items()):
            e = found[SHOWN, printed, name].e
            ax.axhspan(-2 * np.sqrt(SIGMA2), 2 * np.sqrt(SIGMA2), color=SKY, alpha=0.25, lw=0)
            ax.plot(e, color=color, lw=0.8)
            title(ax, f"{name}, {GAINS[printed]} gain: RMS {np.sqrt(np.mean(e[50:] ** 2)):.3f}")
        axes[-1, column].set_xlabel("sample")
    for ax in axes[:, 0]:
        ax.set_ylabel("ε(k)")
    axes[0, 0].set_xlim(0, 600)
    axes[0, 0].set_ylim(-0.9, 0.9)  # the first samples, before anything is known, reach further
    return figure


def estimates(found):
    """Figure 4: b1 and its prediction, one record."""
    figure, axes = panels(2, 1, 6.4, sharex=True, sharey=True)
    for ax, printed in zip(axes[:, 0], (True, False)):
        ax.plot(found[SHOWN, printed, KNOWN].truth, color=INK, lw=2.0, label="b1")
        for name, color in METHODS.items():
            ax.plot(found[SHOWN, printed, name].estimate, color=color, lw=1.0, label=name)
        ax.set_ylabel("b1 and its prediction")
        title(ax, f"{GAINS[printed]} gain")
    axes[-1, 0].set_xlabel("sample")
    axes[0, 0].set_xlim(0, 600)
    legend(figure, axes[0, 0])
    return figure


def duels(shares, listed, sizes):
    """How often fuzzy wins, by size of Q; the gain printed and correct."""
    figure, axes = panels(1, 2, 4.6, sharey=True)
    x = np.arange(len(sizes))
    kinds = {(TUNED, AUXILIARY): RED, (TUNED, SLOW): ORANGE}
    for ax, printed in zip(axes[0], (True, False)):
        for (fuzzy, other, gain), share in shares.items():
            if gain is printed:
                color = kinds.get((fuzzy, other), BLUE if other == AUXILIARY else PURPLE)
                ax.plot(x, [100 * p for p, _ in share], "o-", color=color, lw=1.7, ms=6, label=f"{fuzzy} / {other}")
                expected = [100 * p for p in listed[fuzzy, other, gain]]
                ax.plot(x, expected, "o", ms=10, mfc="none", mec=color, mew=0.9)
        ax.axhline(50, color=INK, lw=1.1, ls=":")
        ax.set_xticks(x, labels=[f"{size:g}" for size in sizes])
        ax.set_xlabel("true q")
        ax.set_ylim(-3, 103)
        title(ax, f"{GAINS[printed]} gain")
    axes[0, 0].set_ylabel("records in which fuzzy predicts better, %")
    legend(figure, axes[0, 0], 2)
    return figure


def ranking(lines):
    """Geometric mean and range of every memory over the systems."""
    figure, axes = panels(1, 1, 0.27 * len(lines) + 1.2)
    ax = axes[0, 0]
    for row, one in enumerate(lines):
        color = RED if one.entrant.name.startswith("AutoMemory") else BLUE if one.entrant.sigma2 == "known" else GREEN
        ax.plot([min(one.ratio.values()), one.worst], [row, row], color=color, lw=1.6, alpha=0.6)
        ax.plot(one.mean, row, "o", color=color, ms=6)
        ax.text(1.03 * one.worst, row, f"{one.mean:.2f}", va="center", fontsize=8.5, color=INK)
    ax.axvline(1, color=QUIET, lw=1.1)
    ax.set_xscale("log")
    ticks = [0.8, 1, 1.5, 2, 3, 5, 10]
    ax.set_xticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    ax.set_yticks(range(len(lines)), labels=[one.name for one in lines], fontsize=8.5)
    ax.set_ylim(len(lines) - 0.4, -0.6)
    ax.set_xlabel("parameter error over that of the filter that knows Q and σ²")
    for color, words in ((RED, "AutoMemory"), (GREEN, "σ² learnt"), (BLUE, "σ² known")):
        ax.plot([], [], "o-", color=color, label=words)
    legend(figure, ax)
    return figure


def calibration(lines):
    """Share of the true parameters within the 95 % bars, a dot for each system."""
    figure, axes = panels(1, 1, 0.27 * len(lines) + 1.2)
    ax = axes[0, 0]
    colors = dict(zip(lines[0].ratio, (INK, ORANGE, GREEN, RED, PURPLE, SKY, BLUE, QUIET)))
    ax.axvspan(0.92, 0.97, color=GREEN, alpha=0.15, lw=0)
    for row, one in enumerate(lines):
        for name, color in colors.items():
            ax.plot(one.outcome[name].inside, row, "o", color=color, ms=5, alpha=0.8, label=name)
    ax.axvline(0.95, color=QUIET, lw=1.1)
    ax.set_xlim(-0.02, 1.02)
    ax.set_yticks(range(len(lines)), labels=[one.name for one in lines], fontsize=8.5)
    ax.set_ylim(len(lines) - 0.4, -0.6)
    ax.set_xlabel("share of the true parameters within the 95 % bars")
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles[:8], labels[:8], loc="outside upper center", ncols=8, frameon=False, fontsize=9.5)
    return figure
