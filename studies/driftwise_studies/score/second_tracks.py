"""The second set of tracks: recordings on which tracks, bands or words were wrong the first time they were met.

Run: python -m driftwise_studies.score.second_tracks    (DRIFTWISE_DATA names the folder of recordings)
"""

from __future__ import annotations

import os
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.tracking.frames import east_north
from driftwise.tracking.plots import plots

from ..papers import fixed_filters as filters
from ..papers.recordings import MARINE, Kind, Series, boats, folder, radar_scans, series
from . import records
from .board import SKIP, _scored
from .motions.field import MOST_NIS
from .ours import tracked
from .tracks import frames, reports

AIS, RADAR = "SolentAIS_even.csv", "_detections.json"
BOATS = "marine radar, scenarios 17 and 22"
LONG = 30  # plots of a track that is judged alone
NEAR, GOOD = 1.1, (0.8, 1.5)  # of a series: the ratio at most, and what its NIS is to be
RESTS = 0.01  # m: the best fixed filter errs by less where nothing moves, and no ratio says anything


def ships(where: Path):
    """Yield the ships of a recording of AIS, positions that repeat themselves included."""
    table = records.columns(where / "autoferry" / AIS)
    time = np.array(table["Time"], "datetime64[ms]").astype(float) / 1e3
    who = np.array(table["MMSI"])
    place = np.stack([np.array(table[f"L{name}itude_degrees"], float) for name in ("at", "ong")], axis=1)
    for ship in np.unique(who):
        rows = np.flatnonzero(who == ship)
        rows = rows[np.argsort(time[rows], kind="stable")]
        rows = rows[np.concatenate([[True], np.diff(time[rows]) > 0.5])]
        if len(rows) >= LONG:
            yield str(ship), time[rows], east_north(*place[rows].T)


SETS = {
    BOATS: MARINE,
    "the same, each plot one boat's at most": MARINE._replace(tracks=partial(boats, twice=False)),
    "calibration flight 5 s": Kind(reports("calibration__munich*"), 400, 30, 250),
    "landing, ADS-B raw 0.5 s": Kind(frames(), 400, 60, 250),
    "landing, ADS-B raw at 4 s": Kind(frames(4.0), 400, 60, 250),
    "ships, AIS": Kind(ships, 40, LONG, 8),
}


def best_fixed(kind: Kind, found: list[Series]) -> np.ndarray:
    """Return RMSE, NIS, share in bands and log score, (4, S), of the fixed filter that is best on all series."""
    fixed = []
    for method in filters.STARTS:
        logs = filters.tuned(method, found, kind.v0, kind.a0)
        fixed.append([_scored(s, *filters.forecast(method, logs, s, kind.v0, kind.a0)) for s in found])
    return min((np.array(rows).T for rows in fixed), key=lambda t: np.mean(np.log(t[0])))


def row(name: str, found: list[Series], best: np.ndarray) -> list[str]:
    """Return how the series of a set are followed beside the fixed filter that is best in hindsight."""
    kind = SETS[name]
    mine = [m for pair in zip(found[::2], found[1::2]) for m in tracked(*pair, kind.v0)]
    ours = np.array([_scored(s, m.prediction, m.variance, m.inside, m.log_score) for s, m in zip(found, mine)]).T
    ratio = (ours[0] / best[0])[best[0] > RESTS]
    return [
        name, f"{len(ratio)} of {len(found)}", f"{np.median(ratio):.3f}", f"{ratio.max():.2f}",
        f"{np.sum(ratio <= NEAR)}", f"{np.sum(ratio > 1.25)}", f"{np.median(ours[1]):.2f}", f"{ours[1].max():.2f}",
        f"{np.median(ours[2]):.1f}",
    ]  # fmt: skip


def farthest(name: str, found: list[Series], best: np.ndarray) -> list[str]:
    """Return of each series whose mean NIS is above 3 what it is without one plot, and what the fixed filter has."""
    lines = []
    for k in range(0, len(found), 2):
        pair = found[k : k + 2]
        mine = tracked(found[k], found[k + 1], SETS[name].v0)
        both = [((s.y - m.prediction) ** 2 / m.variance)[SKIP:] for s, m in zip(pair, mine)]
        for one, z2, fixed in zip(pair, both, best[1, k:]):
            if z2.mean() > MOST_NIS:
                rest = np.mean(np.delete(z2, z2.argmax()))
                lines.append(
                    f"{one.name}: NIS {z2.mean():.2f} of {len(z2)} plots, without the farthest {rest:.2f} (which has "
                    f"{z2.max():.0f}); 3 with forecasts of {z2.mean() / MOST_NIS:.1f} times the variance; "
                    f"both coordinates {np.mean(both):.2f}, best fixed filter {fixed:.2f}"
                )
    return lines


def each(there: Path, found: list[Series], best: np.ndarray) -> list[str]:
    """Return of each series of marine radar its ratio and mean NIS, over all its plots and those of its own boat.

    What a boat is given is its own where GNSS has no other boat nearer to that plot.
    """
    own = {title: {*map(tuple, place)} for title, _, place in boats(there, twice=False)}
    mine = [m for pair in zip(found[::2], found[1::2]) for m in tracked(*pair, SETS[BOATS].v0)]
    lines, good = [], np.zeros((len(found), 3), bool)
    for k, (one, m) in enumerate(zip(found, mine)):
        east, north = found[k - k % 2].y, found[k - k % 2 + 1].y
        title = one.name.rsplit(" ", 2)[0]
        is_own = np.array([place in own.get(title, ()) for place in zip(east, north)])[SKIP:]
        ratio = _scored(one, m.prediction, m.variance, m.inside, m.log_score)[0] / best[0, k]
        z2 = ((one.y - m.prediction) ** 2 / m.variance)[SKIP:]
        all_plots, of_own = z2.mean(), z2[is_own].mean()
        good[k] = ratio <= NEAR, *(GOOD[0] <= nis <= GOOD[1] for nis in (all_plots, of_own))
        lines.append(
            f"{one.name}: ratio {ratio:.3f}, NIS {all_plots:.2f}, of the {is_own.sum()} of {len(z2)} plots that are "
            f"its own {of_own:.2f} (best fixed filter, all plots: {best[1, k]:.2f})"
        )
    near, inside, own_inside = good.sum(axis=0)
    both = [np.sum(good[:, 0] & good[:, j]) for j in (1, 2)]
    fixed = np.sum((GOOD[0] <= best[1]) & (best[1] <= GOOD[1]))
    return [
        *lines,
        f"of {len(found)} series: ratio <= {NEAR:g} on {near}, NIS in {GOOD[0]:g} to {GOOD[1]:g} on {inside}, both on "
        f"{both[0]}; by their own plots {own_inside}, both on {both[1]}; best fixed filter {fixed}",
    ]


def whole(where: Path) -> list[str]:
    """Return what a tracker makes of the files as they are."""
    lines = []
    for name, speed in (
        (AIS, "boat"),
        *((path.name, "boat") for path in sorted(where.glob(f"*{RADAR}"))),
        ("full_flight_short.lines45794-57793.jsonl", "aircraft"),
        ("calibration__munich.json.gz", "aircraft"),
    ):
        tracks = dw.track(_scans(where / name) if name.endswith(RADAR) else where / name, speed)
        keys = [t.key for t in tracks]
        nis = np.array([np.nanmean(t.trace.nis[3:]) for t in tracks if len(t) >= LONG])
        leaps = sum(int(np.sum(np.abs(np.diff(t.trace.speed)) > 20)) for t in tracks)
        lines.append(
            f"{name}: {len(set(keys))} objects in {len(keys)} tracks, NIS above 3 on {np.sum(nis > 3)} of {len(nis)} "
            f"(largest {nis.max():.2f}), {sum(int(t.trace.onset.sum()) for t in tracks)} onsets in "
            f"{sum(map(len, tracks))} plots, {leaps} leaps of the speed by 20 m/s"
        )
    return lines


def _scans(path: Path):
    """Return the plots of a marine radar, with nobody's name beside them."""
    scans = [(time, plot) for time, found in radar_scans(path) for plot in found]
    return plots(*map(np.array, zip(*scans)))


def main() -> None:
    """Print the table and what the tracker makes of the files."""
    here = folder() / "second"
    head = ["", "series", "ratio", "largest", "<= 1.10", "> 1.25", "NIS", "largest", "in 95 %"]
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    with tempfile.TemporaryDirectory() as there:  # the readers of the first set look into a folder of each kind
        for first in ("autoferry", "adsb_tracks", "modes_raw"):
            os.symlink(here, Path(there) / first)
        lines = []
        for name, kind in SETS.items():
            found = series(kind, Path(there))
            best = best_fixed(kind, found)
            print("| " + " | ".join(row(name, found, best)) + " |", flush=True)
            lines += farthest(name, found, best)
            if name == BOATS:
                series_of_boats = each(Path(there), found, best)
        print("\n" + "\n".join(lines))
    print("\n" + "\n".join(series_of_boats))
    print("\n" + "\n".join(whole(here)))


if __name__ == "__main__":
    main()
