"""`identify` on a dammed river, with nothing said: words and figure of the README and of docs/identify.md.

    DRIFTWISE_DATA=.. python scripts/groundwater.py

Needs the record sysid/mur_groundwater.csv, which is not shipped: groundwater head near the river Mur, its stage, rain
and evaporation, from pastas. Its weekly means go to out/groundwater.csv, for `driftwise run out/groundwater.csv`.
"""

import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from driftwise_studies.score.records import folder, groundwater

import driftwise as dw

ROOT = Path(__file__).parent.parent
FIGURE, TABLE = ROOT / "docs" / "figures" / "mur.png", ROOT / "out" / "groundwater.csv"
INK, BLUE, ORANGE, GREY = "#1f2937", "#2563eb", "#d97706", "#9ca3af"
BEFORE, AFTER, SPLIT = 0.98, 0.49, np.datetime64("2011-11-26")  # two first-order fits in hindsight, split there
DRAWN = 52  # samples until bars are drawn


def weekly():
    """Write the weekly means as a table."""
    y, u, time = groundwater(folder())
    dates = np.datetime64("2000-01-01") + np.round(time / 86400).astype("timedelta64[D]")
    TABLE.parent.mkdir(exist_ok=True)
    with TABLE.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["date", "head_m", "river_m", "rain_mm", "evaporation_mm"])
        rows.writerows([date, *(f"{v:.6g}" for v in (a, *b))] for date, a, b in zip(dates, y, u))
    return dates


def gains(found):
    """Return the gain of the first input and its standard deviation over time."""
    y, u = found.trace.y - found.center[0], found.trace.u - found.center[1:]
    trace = found.estimator.scan(y, u, keep="covariance", time=found.trace.time)
    models = [trace.model(k) for k in range(DRAWN, len(trace))]
    return (np.array([np.atleast_1d(getattr(m, name))[0] for m in models]) for name in ("dc_gain", "dc_gain_std"))


def draw(found, date):
    """Draw the output with its band, and the gain of the river."""
    fig, (top, bottom) = plt.subplots(2, 1, figsize=(9, 5.2), sharex=True, height_ratios=(3, 2), layout="constrained")
    forecast, band, late = found.forecast, found.forecast.band(), slice(DRAWN, None)
    low, high = forecast.prediction - band, forecast.prediction + band
    top.fill_between(date[late], low[late], high[late], color=BLUE, alpha=0.25, lw=0, label="95 % band, a week ahead")
    top.plot(date, forecast.y, color=INK, lw=0.8, label="groundwater (m)")
    top.set_ylim(np.nanmin(forecast.y) - 0.3, np.nanmax(forecast.y) + 0.6)
    gain, std = gains(found)
    lower, upper = gain - 2 * std, gain + 2 * std
    bottom.fill_between(date[late], lower, upper, color=BLUE, alpha=0.18, lw=0, label="two deviations")
    bottom.plot(date[late], gain, color=BLUE, lw=1.6, label="gain from river to groundwater")
    for value, a, b, label in (
        (BEFORE, date[DRAWN], SPLIT, "first-order fits in hindsight"),
        (AFTER, SPLIT, date[-1], None),
    ):
        bottom.plot([a, b], [value, value], color=ORANGE, lw=1.5, ls="--", label=label)
    bottom.set(ylim=(0, 2.7), ylabel="m per m")
    for change in found.changes:
        for ax in (top, bottom):
            ax.axvline(date[change.since], color=ORANGE, lw=1, alpha=0.7)
    for ax in (top, bottom):
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(alpha=0.25, lw=0.5)
        ax.legend(frameon=False, fontsize=9, loc="upper left", ncols=3)
    top.set_title("A dam is built, and nobody said so: groundwater beside the river Mur", loc="left", color=INK)
    fig.savefig(FIGURE, dpi=130)
    plt.close(fig)
    for weeks in (-1, 13, 26, 52, 104, 300):
        k = int(np.argmin(abs(date - SPLIT))) + weeks
        print(f"  {date[k]} ({weeks:+d} weeks): gain {gain[k - DRAWN]:.2f} +- {std[k - DRAWN]:.2f}")


def main() -> None:
    date = weekly()
    found = dw.identify(TABLE)
    print(found)
    print("\nmodel | memory | unknowns | log odds | error")
    for model, memory, unknowns, odds, rmse, _ in list(zip(*found.evidence().values()))[:6]:
        print(f"{model} | {memory} | {unknowns} | {odds:.1f} | {rmse:.3f}")
    print(", ".join(f"{name}: {rmse:.3f}" for name, rmse in found.naive.items()))
    for change in found.changes:
        print(f"{change.what}: {date[change.interval[0]]} to {date[change.interval[1]]}")
    print("the gain of the river:")
    draw(found, date)
    print("\nThe file as it is, a row a day, most of them without a reading:")
    print(dw.identify(folder() / "mur_groundwater.csv"))


if __name__ == "__main__":
    main()
