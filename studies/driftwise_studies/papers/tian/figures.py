"""The figures of this reproduction, in the style of `reproduce.pictures`."""

from __future__ import annotations

import numpy as np

from ..pictures import BLUE, GREEN, INK, ORANGE, PURPLE, RED, SKY, legend, panels, title

STATES = ("x1, angle (rad)", "x2, speed (rad/s)", "x3, current (A)")
EPSILON = 150  # samples


def clean(one):
    """Figure 1: states without noise; the errors beside them."""
    figure, axes = panels(3, 2, 7.6, sharex=True)
    r = one.records
    for i, (left, right) in enumerate(axes):
        left.plot(r.t, r.x[:, i], color=INK, lw=2.2, label="true")
        left.plot(r.t[EPSILON:], one.clean[EPSILON:, i], color=RED, lw=1.2, ls="--", label="estimated")
        left.set_ylabel(STATES[i])
        right.semilogy(r.t[EPSILON:], np.abs(one.clean[EPSILON:, i] - r.x[EPSILON:, i]) + 1e-16, color=BLUE, lw=0.7)
        right.set_ylabel("|error|")
        right.set_ylim(1e-13, 1e-3)
    for ax in axes[-1]:
        ax.set_xlabel("t (s)")
    legend(figure, axes[0, 0])
    return figure


def noisy(one):
    """Figure 2: one record with noise, with two deviations; the first second in detail."""
    figure, axes = panels(3, 2, 7.6, sharex="col")
    r = one.records
    for i, row in enumerate(axes):
        for ax, until in zip(row, (10000, 1000)):
            part = slice(EPSILON, until + 1)
            low, high = one.noisy[part, i] - 2 * one.std[part, i], one.noisy[part, i] + 2 * one.std[part, i]
            ax.fill_between(r.t[part], low, high, color=SKY, alpha=0.35, lw=0, label="two deviations")
            ax.plot(r.t[part], one.noisy[part, i], color=RED, lw=0.8, label="estimated")
            ax.plot(r.t[: until + 1], r.x[: until + 1, i], color=INK, lw=1.6, label="true")
            if i == 2:
                ax.set_ylim(-60, 60)
        row[0].set_ylabel(STATES[i])
    title(axes[0, 0], "10 s")
    title(axes[0, 1], "the first second")
    for ax in axes[-1]:
        ax.set_xlabel("t (s)")
    legend(figure, axes[0, 0])
    return figure


def angle(one):
    """Figure 3: the noise, and a quarter of a second of the angle."""
    figure, axes = panels(1, 2, 3.4)
    r, part = one.records, slice(2000, 2251)
    axes[0, 0].plot(r.t[:1000], (r.y[0] - r.x[:, 0])[:1000], ".", color=BLUE, ms=2)
    title(axes[0, 0], "the noise, one second")
    axes[0, 0].set_ylabel("rad")
    ax = axes[0, 1]
    ax.plot(r.t[part], r.y[0, part], ".", color=SKY, ms=3, label="measured")
    ax.plot(r.t[part], one.noisy[part, 0], color=RED, lw=1.6, label="estimated")
    ax.plot(r.t[part], r.x[part, 0], color=INK, lw=1.0, ls="--", label="true")
    title(ax, "the angle")
    for each in axes[0]:
        each.set_xlabel("t (s)")
    legend(figure, ax)
    return figure


def disturbance(one):
    """Figure 4: y''' and the disturbance, without noise and with it."""
    figure, axes = panels(2, 2, 5.6, sharex=True)
    r, part = one.records, slice(2000, 4001)
    for row, found, word in zip(axes, (one.clean, one.noisy), ("without noise", "with noise")):
        for ax, truth, column, name in ((row[0], r.disturbance, 3, "the disturbance"), (row[1], r.y3, 7, "y'''")):
            ax.plot(r.t[part], found[part, column], color=RED, lw=0.9, label="estimated")
            ax.plot(r.t[part], truth[part], color=INK, lw=1.2, ls="--", label="true")
            title(ax, f"{name} {word}")
    for ax in axes[-1]:
        ax.set_xlabel("t (s)")
    legend(figure, axes[0, 0])
    return figure


def deviations(one):
    """Deviation of the current against time: theorem, least squares with and without the cosine."""
    figure, axes = panels(1, 1, 3.8)
    ax, t = axes[0, 0], one.records.t
    for values, color, name in (
        (one.std, RED, "theorem"),
        (one.least, BLUE, "least squares, same 6 modes"),
        (one.plain, GREEN, "least squares without the cosine"),
    ):
        ax.loglog(t[50:], values[50:, 2], color=color, lw=1.7, label=name)
    ax.axhline(24, color=INK, lw=1.0, ls=":", label="the current's amplitude")
    ax.axvline(0.15, color=PURPLE, lw=1.0, ls="--", label="the paper's epsilon")
    ax.axhline(0.098, color=ORANGE, lw=1.0, ls="-.", label="bias of leaving the cosine out, at most")
    ax.set_xlabel("t (s)")
    ax.set_ylabel("standard deviation of x3 (A)")
    ax.set_xlim(0.05, 10)
    ax.set_ylim(3e-5, 3e4)
    legend(figure, ax, 3)
    return figure
