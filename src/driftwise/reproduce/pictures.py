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


# --- section 3.3 -------------------------------------------------------------------------------------------


def radar_track(flight):
    """Coordinates measured and predicted, then innovations with two standard deviations of three filters."""
    from .flight import AXES, CV, LENGTH, PAPERS, SKIP, WALKING

    figure, axes = panels(5, 2, 13.6)
    minutes = flight.track.time / 60
    names = {PAPERS: "the paper's form", WALKING: "two poles held at 1", CV: "constant velocity"}
    for i, axis in enumerate(AXES):
        y, outcome = flight.y[:, i] / 1e3, flight.whole[PAPERS][i]
        for ax, part in zip(axes[:2, i], (slice(3, LENGTH), slice(3, None))):
            center, half = outcome.prediction[part] / 1e3, 2 * np.sqrt(outcome.variance[part]) / 1e3
            ax.fill_between(minutes[part], center - half, center + half, color=SKY, alpha=0.35, lw=0, label="± 2σ")
            ax.plot(minutes[part], center, color=BLUE, lw=1.2, label="predicted one scan ahead")
            ax.plot(minutes[part], y[part], ".", color=INK, ms=3, label="measured, innovation")
            ax.set_ylabel(f"{axis}, km")
            ax.set_xlabel("minutes since the first plot")
        seen = y[:LENGTH][np.isfinite(y[:LENGTH])]
        margin = 0.15 * (seen.max() - seen.min())
        axes[0, i].set_ylim(seen.min() - margin, seen.max() + margin)
        title(axes[0, i], f"{axis}, the paper's form: the first {LENGTH} plots")
        title(axes[1, i], f"{axis}, the paper's form: the whole record")
        for ax, (name, words) in zip(axes[2:, i], names.items()):
            outcome = flight.whole[name][i]
            scored = np.where(np.arange(len(y)) < SKIP, np.nan, 1.0)
            e, sigma = scored * (1e3 * y - outcome.prediction), scored * np.sqrt(outcome.variance)
            ax.fill_between(minutes, -2 * sigma, 2 * sigma, color=SKY, alpha=0.35, lw=0)
            ax.plot(minutes, e, ".-", color=INK, ms=3, lw=0.5)
            ok, outside = np.isfinite(e), np.abs(e) > 2 * sigma
            ax.plot(minutes[outside], e[outside], ".", color=RED, ms=5)
            ax.set_ylim(-2000, 2000)
            title(ax, f"{axis}, {words}: {100 * np.mean(~outside[ok]):.0f} % inside ± 2σ")
            ax.set_ylabel("innovation, m")
        axes[-1, i].set_xlabel("minutes since the first plot")
    axes[0, 0].plot([], [], ".", color=RED, ms=6, label="outside ± 2σ")
    legend(figure, axes[0, 0])
    return figure


def radar_parameters(flight):
    """Estimates of a with two standard deviations: the first 50 samples, then the whole record."""
    from .flight import AXES, LENGTH

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


def radar_sweep(flight):
    """RMSE over rho for four forms, with the tuned constant-velocity filter as a line."""
    from .flight import AXES, CV, RHOS

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


def radar_pieces(flight):
    """A dot per record of 50 and coordinate; bars are medians."""
    from .flight import CV

    names = [name for name in flight.pieces if name != CV]
    figure, axes = panels(1, 2, 3.9, sharey=True, sharex=True)
    for w, ax in enumerate(axes[0]):
        for row, name in enumerate(names):
            value = flight.pieces[name][:, :, w].ravel()
            spread = np.linspace(-0.18, 0.18, value.size)
            ax.plot(value, row + spread, ".", color=BLUE, ms=7, alpha=0.7)
            ax.plot([np.median(value)] * 2, [row - 0.32, row + 0.32], color=RED, lw=2.2)
        ax.axvline(1, color=INK, lw=1.0, ls=":")
        ax.set_xscale("log")
        ax.set_xticks([0.7, 1, 1.5, 2, 3], labels=["0.7", "1", "1.5", "2", "3"])
        ax.minorticks_off()
        title(ax, ("plots 6–14", "plots 15–49")[w])
        ax.set_xlabel("RMSE over tuned constant velocity")
    axes[0, 0].set_yticks(range(len(names)), labels=[_folded(name) for name in names])
    axes[0, 0].invert_yaxis()
    return figure


def _folded(name, width=28):
    import textwrap

    return "\n".join(textwrap.wrap(name, width))
