"""Draw docs/figures/tracks.png: the first minutes of an airliner, from its own Mode S frames, as estimated.

The recording (tracking/modes_raw) is not part of the package: DRIFTWISE_DATA names the folder where it is.
"""

import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

OUT = Path(__file__).parents[1] / "docs" / "figures" / "tracks.png"
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#8a8f98"
EVERY = 4.0  # s: what an airport's radar would have seen


def main():
    files = Path(os.environ.get("DRIFTWISE_DATA", "../shared/data"), "tracking", "modes_raw").glob("*.jsonl")
    track = dw.track(next(files))[0]
    _, first = np.unique(np.floor((track.trace.time - track.trace.time[0]) / EVERY), return_index=True)
    time = track.trace.time[first] - track.trace.time[0]
    plots = track.trace.plot[first] + 50.0 * np.random.default_rng(1).standard_normal((len(first), 2))
    trace = dw.TrackEstimator("aircraft").scan(time, plots)
    minutes, used = time / 60, slice(3, None)

    fig = plt.figure(figsize=(10, 4.4), layout="constrained")
    grid = fig.add_gridspec(3, 2, width_ratios=(1, 1.25))
    plan = fig.add_subplot(grid[:, 0])
    plan.plot(*plots.T / 1e3, ".", color=GREY, ms=3, label="plots, 50 m and 4 s")
    plan.plot(*trace.position[used].T / 1e3, color=BLUE, lw=1.2, label="TrackEstimator")
    moving = np.where((trace.manoeuvre > 0.5)[:, None], trace.position, np.nan) / 1e3
    plan.plot(*moving.T, color=ORANGE, lw=5, alpha=0.35, label="manoeuvre, more likely than not")
    plan.set(xlabel="East, km", ylabel="North, km", aspect="equal")
    plan.legend(frameon=False, fontsize=8)
    rows = (
        ("speed, m/s", trace.speed, trace.speed_sd, (60, 220)),
        ("turn rate, degrees/s", np.degrees(trace.turn_rate), np.degrees(trace.turn_rate_sd), (-4, 4)),
    )
    for k, (label, value, sd, limits) in enumerate(rows):
        ax = fig.add_subplot(grid[k, 1])
        ax.fill_between(
            minutes[used], (value - 1.96 * sd)[used], (value + 1.96 * sd)[used], color=BLUE, alpha=0.2, lw=0
        )
        ax.plot(minutes[used], value[used], color=BLUE, lw=1.2)
        ax.set(ylabel=label, ylim=limits)
        ax.tick_params(labelbottom=False)
    ax = fig.add_subplot(grid[2, 1])
    ax.fill_between(minutes, trace.manoeuvre, color=ORANGE, alpha=0.35, lw=0)
    ax.set(ylabel="P(manoeuvre)", xlabel="minutes", ylim=(0, 1))
    for ax in fig.axes:
        ax.spines[["top", "right"]].set_visible(False)
    fig.savefig(OUT, dpi=130)


if __name__ == "__main__":
    main()
