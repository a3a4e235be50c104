"""The figures of the recorded radars."""

from __future__ import annotations

import textwrap

import numpy as np

from .flight import AXES, CV, LENGTH, MANOEUVRE, PAPERS, RHOS, SHIPPED, SKIP
from .pictures import BLUE, GREEN, INK, ORANGE, QUIET, RED, SKY, legend, panels, title

SHORT = {PAPERS: "the paper's form", MANOEUVRE: "Manoeuvre", SHIPPED: "TrackEstimator", CV: "constant velocity"}


def track(flight):
    """Coordinates measured and predicted, first by the paper's form, then by the one with two poles held."""
    figure, axes = panels(3, 2, 9.0)
    minutes = flight.time / 60
    rows = [(PAPERS, slice(3, LENGTH)), (MANOEUVRE, slice(3, LENGTH)), (PAPERS, slice(3, None))]
    for i, axis in enumerate(AXES):
        y = flight.y[:, i] / 1e3
        for ax, (name, part) in zip(axes[:, i], rows):
            outcome = flight.outcome(name)[i]
            center, half = outcome.prediction[part] / 1e3, 2 * np.sqrt(outcome.variance[part]) / 1e3
            ax.fill_between(minutes[part], center - half, center + half, color=SKY, alpha=0.35, lw=0, label="± 2σ")
            ax.plot(minutes[part], center, color=BLUE, lw=1.2, label="predicted one scan ahead")
            ax.plot(minutes[part], y[part], ".", color=INK, ms=3, label="measured")
            margin = 0.12 * np.ptp(y[part])
            ax.set_ylim(y[part].min() - margin, y[part].max() + margin)
            ax.set_ylabel(f"{axis}, km")
            title(ax, f"{axis}, {SHORT[name]}: the first {LENGTH} plots" if part.stop else f"{axis}: the whole record")
        axes[-1, i].set_xlabel("minutes since the first plot")
    legend(figure, axes[0, 0])
    return figure


def innovations(flight):
    """Innovations with two standard deviations of four filters, and how many stay inside."""
    figure, axes = panels(len(SHORT), 2, 2.7 * len(SHORT), sharex=True)
    minutes = flight.time[SKIP:] / 60
    for i, axis in enumerate(AXES):
        for ax, (name, words) in zip(axes[:, i], SHORT.items()):
            e, sigma = flight.error(name, i)[SKIP:], np.sqrt(flight.outcome(name)[i].variance[SKIP:])
            outside = np.abs(e) > 2 * sigma
            ax.fill_between(minutes, -2 * sigma, 2 * sigma, color=SKY, alpha=0.35, lw=0, label="± 2σ")
            ax.plot(minutes, e, ".-", color=INK, ms=3, lw=0.5, label="innovation")
            ax.plot(minutes[outside], e[outside], ".", color=RED, ms=5, label="outside ± 2σ")
            ax.set_ylim(-2000, 2000)
            white = flight.calibration(name)[3][i]
            title(ax, f"{axis}, {words}: {100 * np.mean(~outside):.0f} % inside, Ljung–Box(5) {white:.1f}")
            ax.set_ylabel("innovation, m")
        axes[-1, i].set_xlabel("minutes since the first plot")
    legend(figure, axes[0, 0])
    return figure


def parameters(flight):
    """Estimates of a with two standard deviations: the first 50 samples, then the whole record."""
    figure, axes = panels(2, 2, 6.6, sharey="col")
    for column, (axis, (a, std, last)) in enumerate(zip(AXES, flight.settling)):
        for ax, end in zip(axes[:, column], (LENGTH, len(a))):
            k = np.arange(1, end)
            for i, color in zip(range(3), (BLUE, ORANGE, GREEN)):
                value, half = a[1:end, i], 2 * std[1:end, i]
                ax.fill_between(k, value - half, value + half, color=color, alpha=0.2, lw=0)
                ax.plot(k, value, color=color, lw=1.4, label=f"$a_{i}$")
            for level in (-1, 3, -3):
                ax.axhline(level, color=QUIET, lw=1.0, ls=":", label="three poles at 1" if level == -1 else None)
            ax.set_ylim(-4, 4)
            ax.set_xlabel("plot")
            title(ax, f"{axis}: {'the first 50 plots' if end == LENGTH else 'the whole record'}")
        axes[0, column].axvline(last, color=RED, lw=1.0, ls="--")
        axes[0, column].text(last + 0.6, 0.3, f"last step\n> 2 %: {last}", fontsize=8.5, color=RED)
    for ax in axes[:, 0]:
        ax.set_ylabel("estimate of a (D(z) = z³ + a₂ z² + a₁ z + a₀)")
        ax.yaxis.label.set_fontsize(8.5)
    legend(figure, axes[0, 0], 4)
    return figure


def sweep(flight):
    """RMSE over rho for four forms, with the tuned constant-velocity filter as a line."""
    figure, axes = panels(1, 2, 4.6)
    styles = [(RED, "o-"), (RED, "s--"), (BLUE, "o-"), (BLUE, "s--")]
    for i, (ax, axis) in enumerate(zip(axes[0], AXES)):
        for ((name, m), value), (color, style) in zip(flight.sweep.items(), styles):
            ax.plot(RHOS, value[i], style, color=color, ms=5, lw=1.4, label=f"{name}, m = {m}")
        level = flight.errors(CV)[i]
        ax.axhline(level, color=INK, lw=1.0, ls=":", label="tuned constant velocity")
        ax.set_ylim(0.7 * level, 2.2 * level)
        ax.set_xlabel("ρ in C = (1 − ρq)$^m$")
        title(ax, axis)
    axes[0, 0].set_ylabel("one-step RMSE, m")
    legend(figure, axes[0, 0], 3)
    return figure


def fifty(found):
    """A dot per record of 50 and coordinate, over tuned constant velocity; bars are medians. A row per radar."""
    figure, axes = panels(len(found), 2, 3.6 * len(found), sharey=True, sharex=True)
    for row, (radar, table) in zip(axes, found.items()):
        names = (PAPERS, MANOEUVRE, SHIPPED)
        for w, ax in enumerate(row):
            for at, name in enumerate(names):
                value = table[name][0, :, :, w].ravel()
                spread = np.linspace(-0.18, 0.18, value.size)
                ax.plot(value, at + spread, ".", color=BLUE, ms=7, alpha=0.7)
                ax.plot([np.median(value)] * 2, [at - 0.32, at + 0.32], color=RED, lw=2.2)
            ax.axvline(1, color=INK, lw=1.0, ls=":")
            ax.set_xscale("log")
            ax.set_xticks([0.5, 0.7, 1, 1.5, 2, 3], labels=["0.5", "0.7", "1", "1.5", "2", "3"])
            ax.minorticks_off()
            title(ax, f"{radar}: plots {('6–14', '15–49')[w]}")
        row[0].set_yticks(range(len(names)), labels=[textwrap.fill(name, 24) for name in names])
    for ax in axes[-1]:
        ax.set_xlabel("RMSE over tuned constant velocity")
    axes[0, 0].invert_yaxis()
    return figure
