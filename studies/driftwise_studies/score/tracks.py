"""Recorded tracks of every kind, as series of one coordinate each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from driftwise.tracking.frames import east_north

from ..papers.recordings import LONG_RANGE, MARINE, Kind, Series, moving, read_json, thinned
from ..papers.recordings import series as series_of
from . import records


def series(name: str, where: Path) -> list[Series]:
    """Return the series of one of ``SETS``."""
    return series_of(SETS[name], where)


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
            rows = read_json(path)
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
    "marine radar 1.68 s": MARINE,
    "12 s long-range radar, C-130": LONG_RANGE,
    "ADS-B raw 0.5 s": Kind(frames(), 400, 200, 250),
    "ADS-B raw at 4 s": Kind(frames(4.0), 400, 60, 250),
    "orbiting aircraft at 4 s": Kind(reports("featured__*", 4.0), 400, 60, 250),
    "calibration flights 5 s": Kind(reports("calibration__*"), 400, 100, 250),
    "gliders": Kind(reports("gliders__*"), 150, 60, 40),
    "helicopter 1 s": Kind(reports("ambulances__*"), 150, 60, 60),
    "UAV GPS 1 s": Kind(rotor, 60, 60, 20),
}
