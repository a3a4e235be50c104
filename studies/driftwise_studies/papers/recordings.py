"""Recorded radar tracks as series of one coordinate each: East and North of the first plot in metres, irregular times.

The recordings are no part of the package: ``DRIFTWISE_DATA`` names the folder they lie in.
"""

from __future__ import annotations

import gzip
import json
import os
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from driftwise.engine.errors import InputError
from driftwise.tracking.frames import east_north

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


def folder() -> Path:
    """Return where recorded tracks lie, or should lie: below ``DRIFTWISE_DATA``, or a neighbour of the project."""
    default = Path(__file__).resolve().parents[4] / "shared" / "data"
    return Path(os.environ.get("DRIFTWISE_DATA") or default) / "tracking"


def series(kind: Kind, where: Path) -> list[Series]:
    """Return the series of one kind of tracks."""
    found = []
    for title, time, position in kind.tracks(where):
        for k, piece in enumerate(pieces(time, position, kind)):
            found += [
                Series(f"{title} {k} {axis}", time[piece][:MOST] - time[piece][0], position[piece][:MOST, i])
                for i, axis in enumerate(("East", "North"))
            ]
    return found


def pieces(time, position, kind) -> list[slice]:
    """Return the stretches of a track between pauses and leaps."""
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


def read_json(path: Path):
    try:
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(path, "rt") as file:
            return json.load(file)
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}. Is DRIFTWISE_DATA the folder of recordings?") from None


def radar_scans(path: Path):
    """Yield (s, plots (n, 2) East and North in m) of each scan of a marine radar; no plots for other sensors."""
    for scan in read_json(path):
        found = np.array(scan["measurement"] if scan["sensorID"] == 2 else [], float)
        yield (
            scan["time"],
            (found.reshape(2, -1).T + scan["ownshipPosition"])[:, ::-1] if found.size else found.reshape(0, 2),
        )


def boats(where: Path, twice: bool = True):
    """Yield marine radar plots: of each scan the one nearest to where GNSS puts the boat.

    Two boats near each other may be given the same plot; if not ``twice``, the nearer one alone is.
    """
    for path in sorted((where / "autoferry").glob("*_detections.json")):
        truths = read_json(path.with_name(path.name.replace("detections", "groundTruth")))
        plots: dict[int, list] = {}
        for (time, found), targets in zip(radar_scans(path), truths):
            if not len(found):
                continue
            targets = targets if isinstance(targets, list) else [targets]
            where_to = [target["position"][1::-1] for target in targets]
            off = np.array([np.hypot(*(found - place).T) for place in where_to])  # (boats, plots)
            for target, own in zip(targets, off):
                which = own.argmin()
                if own[which] <= NEAR and (twice or own[which] == off[:, which].min()):
                    plots.setdefault(target["targetID"], []).append((time, *found[which]))
        for target, rows in sorted(plots.items()):
            table = np.array(rows)
            yield f"{path.name.split('_')[0]}, boat {target}", *moving(table[:, 0], table[:, 1:])


def long_range(where: Path):
    """Yield the track of the 12 s long-range radar."""
    from datetime import datetime

    for path in sorted((where / "longrange_radar").glob("*.json")):
        plots = [p for p in read_json(path)["waypoints"] if p["site"] != "anchor"]
        time = np.array([datetime.fromisoformat(p["utc"].replace("Z", "+00:00")).timestamp() for p in plots])
        yield (
            "C-130",
            *moving(time, east_north(np.array([p["lat"] for p in plots]), np.array([p["lon"] for p in plots]))),
        )


MARINE = Kind(boats, 40, 30, 8, 0.5)
LONG_RANGE = Kind(long_range, 400, 30, 250)
