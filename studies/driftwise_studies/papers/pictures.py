"""The figures of a reproduction; colours by Okabe and Ito, which colour-blind readers can tell apart."""

from __future__ import annotations

import numpy as np

INK, QUIET, GRID = "#1f2933", "#66758a", "#e6eaef"
BLUE, ORANGE, GREEN, RED, PURPLE, SKY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9"
PAPER = dict(marker="*", ms=15, mfc=RED, mec="white", mew=0.8, ls="none", zorder=5)


def panels(rows, columns, height, width=10.0, **options):
    """Return a Figure and its axes (rows, columns), tidied."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", dpi=110)
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for ax in axes.flat:
        ax.grid(True, color=GRID, lw=0.7)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.spines[["left", "bottom"]].set_color(QUIET)
        ax.tick_params(colors=INK, labelsize=9)
    return figure, axes


def title(ax, text):
    """Write what a panel shows above its left corner."""
    ax.set_title(text, loc="left", fontsize=10)


def legend(figure, ax, columns=4):
    """Put the legend above the panels, where it covers nothing."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False, fontsize=9.5)


# --- section 3.2 -------------------------------------------------------------------------------------------


def _ellipse(ax, points, quantile, label=None):
    """Draw the ellipse of the points' mean and covariance that holds a share given by its chi2(2) quantile."""
    angle = np.linspace(0, 2 * np.pi, 200)
    root = np.linalg.cholesky(np.cov(points.T))
    line = points.mean(axis=0) + np.sqrt(quantile) * np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ root.T
    ax.plot(*line.T, color=BLUE, lw=1.1, ls="-" if quantile < 7 else "--", label=label)


def clouds(found):
    """Estimates of tests 1 and 3, pair by pair, with the paper's vectors and the limits of theory."""
    figure, axes = panels(len(found), 3, 3.4 * len(found) + 0.4)
    for row, cloud in zip(axes, found):
        for ax, (i, j) in zip(row, ((0, 1), (0, 2), (1, 2))):
            points = cloud.final[:, [i, j]]
            ax.plot(*points.T, ".", color=SKY, ms=4, alpha=0.6, label="one record")
            _ellipse(ax, points, 5.99, "95 %")
            _ellipse(ax, points, 9.21, "99 %")
            ax.plot(
                cloud.test.limit[i],
                cloud.test.limit[j],
                "+",
                color=INK,
                ms=13,
                mew=2,
                label="limit in theory",
                zorder=4,
            )
            ax.plot(cloud.test.printed[i], cloud.test.printed[j], label="the paper", **PAPER)
            ax.set_xlabel(f"$a_{i}$ (printed sign)")
            ax.set_ylabel(f"$a_{j}$")
            title(ax, f"test {cloud.test.number}")
    legend(figure, axes[0, 0], 5)
    return figure


def settling(still, walking):
    """One record's estimate over time: constant parameters above, walking ones below."""
    figure, axes = panels(2, len(still), 5.6, sharex=True, sharey="col")
    for column, (calm, moving) in enumerate(zip(still, walking)):
        for ax, cloud in zip(axes[:, column], (calm, moving)):
            for i, color in zip(range(cloud.n), (BLUE, ORANGE, GREEN)):
                ax.plot(cloud.path[0][:, i], color=color, lw=1.1, label=f"$a_{i}$")
                ax.axhline(cloud.test.limit[i], color=color, lw=1.0, ls="--")
            low, high = min(cloud.test.limit), max(cloud.test.limit)
            ax.set_ylim(low - 0.6 * (high - low), high + 0.6 * (high - low))
        title(axes[0, column], f"test {calm.test.number}: Q$_\\pi$ = 0")
        title(axes[1, column], f"test {calm.test.number}: Q$_\\pi$ = 1e-4 I")
        axes[1, column].set_xlabel("sample")
    for ax in axes[:, 0]:
        ax.set_ylabel("estimate (printed sign)")
    legend(figure, axes[0, 0], 3)
    return figure


def arithmetic(errors, methods, coarse):
    """Error of the estimate after each sample, tests 5 and 6; ``coarse`` has those of four brackets in 24 bits."""
    figure, axes = panels(1, 2, 5.0, sharey=True)
    chosen = [methods[i] for i in (0, 1, 3, 4, 5)]
    styles = [
        (GREEN, "-", 2.4),
        (ORANGE, "-", 1.5),
        (PURPLE, "-", 1.5),
        (PURPLE, "--", 1.5),
        (BLUE, "-", 1.2),
    ]
    for ax, test in zip(axes[0], (5, 6)):
        for method, (color, line, width) in zip(chosen, styles):
            e = np.maximum(errors[test, method], 1e-17)
            ax.loglog(1 + np.arange(len(e)), e, color=color, ls=line, lw=width, label=method.name)
        low, high = np.fmin.reduce(coarse[test]), np.fmax.reduce(coarse[test])
        k, words = 1 + np.arange(len(low)), "(20) in 24 bits, R = 1e-8: four ways to bracket it"
        ax.fill_between(k, low, high, color=RED, alpha=0.45, lw=0, label=words)
        ax.axvline(11, color=QUIET, lw=0.9, ls=":")
        ax.text(11.6, 12, "the paper prints sample 10", fontsize=8.5, color=QUIET, va="top")
        ax.set_ylim(1e-17, 60)
        ax.set_xlim(3, 1000)
        ax.set_xlabel("samples seen")
        title(ax, f"test {test}: {'stable, ill-conditioned' if test == 5 else 'unstable, grows like $1.064^t$'}")
    axes[0, 0].set_ylabel("largest error of a")
    legend(figure, axes[0, 0], 3)
    return figure
