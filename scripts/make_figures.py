"""Draw the figures of the README and the documentation: python scripts/make_figures.py"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

FOLDER = Path(__file__).parent.parent / "docs" / "figures"
INK, BLUE, ORANGE, GREY = "#1f2937", "#2563eb", "#d97706", "#9ca3af"


def flight():
    """The gain from roll to track of the shipped flight, found without knowing the speed, beside physics."""
    record = dw.sample_data("flight")
    part = slice(90, 401)
    time, track, roll = (record[k][part] for k in ("time_s", "track_deg", "roll_deg"))
    y, u = track - np.nanmedian(track), roll - np.nanmedian(roll)
    est = dw.Joint(1, inputs=1, noise=dw.EquationError(), memory=dw.Walk(0.01), dt=2.0).scaled_to(y, u)
    trace = est.scan(y, u, time=time)
    physics = 2 * 9.80665 / record["ground_speed_mps"][part]

    fig, (top, bottom) = plt.subplots(2, 1, figsize=(9, 5), sharex=True, height_ratios=(2, 3), layout="constrained")
    top.plot(time, track, color=INK, lw=1.5, label="track (deg)")
    top.plot(time, 200 + 2 * roll, color=GREY, lw=1, marker=".", ms=3, label="roll, when it was heard (not to scale)")
    top.legend(frameon=False, fontsize=9)
    b1, std = trace.parameters[:, 1], trace.parameters_std[:, 1]
    bottom.fill_between(time, b1 - 2 * std, b1 + 2 * std, color=BLUE, alpha=0.18, lw=0, label="two standard errors")
    bottom.plot(time, b1, color=BLUE, lw=1.8, label="gain b1, estimated sample by sample")
    bottom.plot(time, physics, color=ORANGE, lw=1.5, ls="--", label="what physics says: 2 s · g / speed")
    bottom.set(ylim=(0.0, 0.3), xlabel="seconds since take-off", ylabel="degrees of track per degree of roll")
    bottom.legend(frameon=False, fontsize=9)
    for ax in (top, bottom):
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(alpha=0.25, lw=0.5)
    top.set_title("An airliner gathers speed: the same bank turns it less and less", loc="left", color=INK)
    fig.savefig(FOLDER / "flight.png", dpi=130)
    inside = np.abs(b1 - physics) <= 2 * std
    late = time >= 260
    print(f"flight: physics inside the band for {100 * np.mean(inside[late]):.0f} % of the samples after t = 260 s;")
    for t in (300, 440, 710, 800):
        k = int(np.argmin(abs(time - t)))
        print(f"  t = {t:3d} s   b1 = {b1[k]:.3f} +- {std[k]:.3f}   physics {physics[k]:.3f}")
    plt.close(fig)


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    flight()
