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
    """The gain from roll to track of the shipped flight as `driftwise demo` finds it, beside physics."""
    record = dw.sample_data("flight")
    columns = {name: record[name] for name in ("time_s", "track_deg", "roll_deg")}
    trace = dw.identify(columns, output="track_deg", input="roll_deg").trace
    part = slice(90, 401)
    time, track, roll = (column[part] for column in columns.values())
    physics = 2 * 9.80665 / record["ground_speed_mps"][part]

    fig, (top, bottom) = plt.subplots(2, 1, figsize=(9, 5), sharex=True, height_ratios=(2, 3), layout="constrained")
    top.plot(time, track, color=INK, lw=1.5, label="track (deg)")
    top.plot(time, 200 + 2 * roll, color=GREY, lw=1, marker=".", ms=3, label="roll, when it was heard (not to scale)")
    top.legend(frameon=False, fontsize=9)
    b1, std = trace.parameters[part, 1], trace.parameters_std[part, 1]
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


def surprises(seed=3):
    """Return y, u and b1 of y = .8 y1 + b1 u1 + e: b1 drifts and jumps, a sample is a glitch, e becomes louder."""
    rng, k = np.random.default_rng(seed), np.arange(3000)
    b1 = 1 + 0.3 * np.sin(k / 300) + 0.5 * (k >= 1500)
    noise_std = np.where(k < 2400, 0.1, 0.3)
    u, y = rng.choice([-1.0, 1.0], 3000), np.zeros(3000)
    for t in range(1, 3000):
        y[t] = 0.8 * y[t - 1] + b1[t] * u[t - 1] + noise_std[t] * rng.standard_normal()
    y[1000] += 3.0
    return y, u, b1


def auto():
    """One record with everything `dw.AutoMemory` tells apart: truth, estimate, bars, events."""
    y, u, b1 = surprises()
    trace = dw.ARX(1, 1, memory=dw.AutoMemory()).scan(y, u)
    error, bar = trace.innovation, trace.band(0.95)

    fig, axes = plt.subplots(3, 1, figsize=(9, 6.5), sharex=True, height_ratios=(2, 3, 2), layout="constrained")
    top, middle, bottom = axes
    top.plot(error, ".", color=GREY, ms=2, label="innovation")
    top.fill_between(trace.time, -bar, bar, color=ORANGE, alpha=0.25, lw=0, label="its 95 % band")
    top.set(ylim=(-1.9, 3.4), ylabel="y less prediction")
    for ax, i, truth in ((middle, 1, b1), (bottom, 0, np.full(len(y), -0.8))):
        mean, std = trace.parameters[:, i], trace.parameters_std[:, i]
        ax.fill_between(trace.time, mean - 1.96 * std, mean + 1.96 * std, color=BLUE, alpha=0.22, lw=0, label="95 %")
        ax.plot(mean, color=BLUE, lw=1.1, label="estimate")
        ax.plot(truth, color=INK, lw=1.1, ls="--", label="truth")
    middle.set(ylim=(0.35, 2.25), ylabel="b1")
    bottom.set(ylim=(-0.9, -0.7), ylabel="a1", xlabel="sample")
    for event in trace.events():
        if event.kind in ("JUMP", "NOISE") or (event.kind == "OUTLIER" and event.sample == 1000):
            words = "outlier" if event.kind == "OUTLIER" else event.text.split(", it")[0]
            odds = f"\nodds {event.odds:.0f}:1" if event.odds else ""
            top.annotate(words + odds, (event.sample + 15, 3.2), va="top", color=ORANGE, fontsize=9)
            for ax in axes:
                ax.axvline(event.sample, color=ORANGE, lw=0.8, alpha=0.6)
    top.legend(frameon=False, fontsize=9, ncols=2, loc="lower left")
    middle.legend(frameon=False, fontsize=9, ncols=3, loc="upper left")
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(alpha=0.25, lw=0.5)
    top.set_title(
        "One gain drifts and jumps, a sample is wrong, the noise grows: nothing was told", loc="left", color=INK
    )
    fig.savefig(FOLDER / "auto.png", dpi=130)
    print("auto:", *(f"  {event.sample} {event.kind} {event.text}" for event in trace.events()), sep="\n")
    theta = np.c_[np.full(len(y), -0.8), b1]
    inside = np.abs(trace.parameters - theta)[50:] < 1.96 * trace.parameters_std[50:]
    print(f"  95 % bars of a1, b1 hold {inside.mean(axis=0).round(3)}", end="; ")
    print(f"bands of the prediction {np.mean(np.abs(error[50:]) < bar[50:]):.3f}")
    for name, memory in {
        "AutoMemory()": dw.AutoMemory(),
        "ExponentialForgetting(.98)": dw.ExponentialForgetting(0.98),
        "Constant()": dw.Constant(),
    }.items():
        other = dw.ARX(1, 1, memory=memory).scan(y, u).parameters
        print(f"  {name}: error of a1, b1 {np.sqrt(np.mean((other - theta)[50:] ** 2, axis=0)).round(4)}")
    plt.close(fig)


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    flight()
    auto()
