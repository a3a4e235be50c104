"""Recorded tracks as series of one coordinate each: East and North of the first plot in metres, irregular times."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..tracking.frames import east_north
from . import records

MOST = 1500  # plots of a series
NEAR = 30.0  # m: a radar plot farther from the truth is somebody else's


class Series(NamedTuple):
    """One coordinate of one track."""

    name: str
    time: np.ndarray  # (T,) s
    y: np.ndarray  # (T,) m


class Kind(NamedTuple):
    """A set of tracks: how it is read, what speeds are possible, what a filter may assume of speed and acceleration."""

    tracks: Callable[[Path], Iterator[tuple[str, np.ndarray, np.ndarray]]]
    fastest: float  # m/s between plots; beyond it a track is cut
    least: int  # plots of a piece worth keeping
    v0: float
    a0: float = 5.0


def series(name: str, where: Path) -> list[Series]:
    """Return the series of one of ``SETS``."""
    kind, found = SETS[name], []
    for title, time, position in kind.tracks(where):
        for k, piece in enumerate(_pieces(time, position, kind)):
            found += [
                Series(f"{title} {k} {axis}", time[piece][:MOST] - time[piece][0], position[piece][:MOST, i])
                for i, axis in enumerate(("East", "North"))
            ]
    return found


def _pieces(time, position, kind) -> list[slice]:
    """Cut a track where it pauses or leaps."""
    step = np.diff(time)
    speed = np.hypot(*np.diff(position, axis=0).T) / step
    cuts = np.flatnonzero((step > 8 * np.median(step)) | (speed > kind.fastest)) + 1
    ends = [0, *cuts, len(time)]
    return [slice(a, b) for a, b in pairwise(ends) if b - a >= kind.least]


def moving(time, position):
    """Return the plots that are new: later than the one before, and elsewhere."""
    keep = [0]
    for k in range(1, len(time)):
        if time[k] > time[keep[-1]] and np.any(position[k] != position[keep[-1]]):
            keep.append(k)
    return time[keep], position[keep]


def thinned(time, *others, every: float = 4.0):
    """Return the first plot of each interval."""
    _, first = np.unique(np.floor((time - time[0]) / every), return_index=True)
    return time[first], *(o[first] for o in others)


def _json(path: Path):
    try:
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(path, "rt") as file:
            return json.load(file)
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}. Is DRIFTWISE_DATA the folder of recordings?") from None


# --- one reader for each kind of file ----------------------------------------------------------------------


def boats(where: Path):
    """Yield marine radar plots: of each scan the one nearest to where GNSS puts the boat."""
    for path in sorted((where / "autoferry").glob("*_detections.json")):
        truths = _json(path.with_name(path.name.replace("detections", "groundTruth")))
        plots: dict[int, list] = {}
        for scan, targets in zip(_json(path), truths):
            found = np.atleast_2d(np.array(scan["measurement"], float)) if scan["sensorID"] == 2 else np.zeros((0, 0))
            if found.size < 2:
                continue
            found = found.reshape(2, -1).T + scan["ownshipPosition"]
            for target in targets if isinstance(targets, list) else [targets]:
                off = np.hypot(*(found - target["position"][:2]).T)
                if off.min() <= NEAR:
                    plots.setdefault(target["targetID"], []).append((scan["time"], *found[off.argmin()][::-1]))
        for target, rows in sorted(plots.items()):
            table = np.array(rows)
            yield f"{path.name.split('_')[0]}, boat {target}", *moving(table[:, 0], table[:, 1:])


def long_range(where: Path):
    """Yield the track of the 12 s long-range radar."""
    from datetime import datetime

    for path in sorted((where / "longrange_radar").glob("*.json")):
        plots = [p for p in _json(path)["waypoints"] if p["site"] != "anchor"]
        time = np.array([datetime.fromisoformat(p["utc"].replace("Z", "+00:00")).timestamp() for p in plots])
        yield (
            "C-130",
            *moving(time, east_north(np.array([p["lat"] for p in plots]), np.array([p["lon"] for p in plots]))),
        )


def frames(every: float | None = None):
    """Return a reader of the airborne positions among raw Mode S frames."""

    def read(where: Path):
        for path in sorted((where / "modes_raw").glob("*.jsonl")):
            with path.open() as file:
                rows = [json.loads(line) for line in file]
            rows = [r for r in rows if r.get("df") == "17" and r.get("bds") == "05" and r.get("latitude") is not None]
            table, last = [], -np.inf
            for r in rows:
                if r["timestamp"] - last >= 0.05:
                    last = r["timestamp"]
                    table.append((last, r["latitude"], r["longitude"]))
            yield "departure", *_geographic(np.array(table), every)

    return read


def reports(pattern: str, every: float | None = None):
    """Return a reader of state vectors received by volunteers, an aircraft a track."""

    def read(where: Path):
        for path in sorted((where / "adsb_tracks").glob(pattern)):
            rows = _json(path)
            for aircraft in sorted({r["icao24"] for r in rows}):
                table = np.array(
                    [
                        (1e-3 * r["timestamp"], r["latitude"], r["longitude"])
                        for r in rows
                        if r["icao24"] == aircraft and r["latitude"] is not None and r["longitude"] is not None
                    ],
                    float,
                )
                table = table[np.isfinite(table).all(axis=1)]
                if len(table) > 2:
                    yield f"{path.name.split('.')[0]} {aircraft}", *_geographic(table, every)

    return read


def rotor(where: Path):
    """Yield the log of a satellite receiver on a small rotary aircraft."""
    table = records.columns(where / "stonesoup" / "UAV_Rot.csv")
    rows = records.stack(table, ["timestamp", "latitude", "longitude"])
    yield "UAV", *_geographic(rows, None)


def _geographic(table, every):
    """Return times and metres of rows (time, latitude, longitude)."""
    table = table[np.argsort(table[:, 0], kind="stable")]
    time, position = moving(table[:, 0], table[:, 1:])
    if every:
        time, position = thinned(time, position, every=every)
    return time, east_north(*position.T)


SETS = {
    "marine radar 1.68 s": Kind(boats, 40, 30, 8, 0.5),
    "12 s long-range radar, C-130": Kind(long_range, 400, 30, 250),
    "ADS-B raw 0.5 s": Kind(frames(), 400, 200, 250),
    "ADS-B raw at 4 s": Kind(frames(4.0), 400, 60, 250),
    "orbiting aircraft at 4 s": Kind(reports("featured__*", 4.0), 400, 60, 250),
    "calibration flights 5 s": Kind(reports("calibration__*"), 400, 100, 250),
    "gliders": Kind(reports("gliders__*"), 150, 60, 40),
    "helicopter 1 s": Kind(reports("ambulances__*"), 150, 60, 60),
    "UAV GPS 1 s": Kind(rotor, 60, 60, 20),
}
