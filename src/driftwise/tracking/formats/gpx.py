"""Tracks as GPX 1.1: what receivers, watches and route planners read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...engine.atomic import write_text
from ...engine.errors import InputError
from ..frames import geographic
from ..times import dated, iso
from ..tracks import Track, Tracks
from ..travelled import travelled
from .maps import DIGITS, xml

NAMESPACE = "https://driftwise/gpx/1"


def write_gpx(tracks: Tracks, path) -> Path:
    """Write a track (trk) for each: positions as estimated, smoothed where they are, altitudes, times.

    The description says how far it went and how far up, each with its standard deviation (`travelled`); each point has
    the deviations of its place and altitude as extensions, and whether its plot was set aside.

    Raises
    ------
    InputError
        Where positions are not on earth, or times have no day: GPX has no word for either.
    """
    parts = "\n".join(_track(track) for track in tracks)
    write_text(
        path,
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<gpx version="1.1" creator="driftwise" xmlns="http://www.topografix.com/GPX/1/1" xmlns:d="{NAMESPACE}">\n'
        f"{parts}\n</gpx>\n",
    )
    return Path(path)


def _track(track: Track) -> str:
    if track.origin is None or not dated(track.plots.time):
        raise InputError("GPX needs positions on earth and dates; CSV and Parquet take metres and seconds")
    trace, places = track.trace, geographic(track.trace.position, track.origin).round(DIGITS)
    sd = np.hypot(*trace.position_sd.T).round(2)
    points, upwards = [], track.vertical
    for k, stamp in enumerate(iso(track.plots.time)):
        height = told = ""
        if upwards is not None and np.isfinite(upwards.position[k, 0]):
            height = f"<ele>{upwards.position[k, 0]:.2f}</ele>"
            told = f"<d:ele_sd>{upwards.position_sd[k, 0]:.2f}</d:ele_sd>"
        if np.isfinite(sd[k]):
            told = f"<d:sd>{sd[k]:.2f}</d:sd>{told}"
        latitude, longitude = places[k].tolist()
        points.append(
            f'<trkpt lat="{latitude:.7f}" lon="{longitude:.7f}">{height}<time>{stamp}</time>'
            f"<extensions>{told}</extensions></trkpt>"
        )
    name = xml(track.name or track.key or f"track {track.id}")
    return f"<trk><name>{name}</name><desc>{xml(words(track))}</desc><trkseg>" + "\n".join(points) + "</trkseg></trk>"


def words(track: Track) -> str:
    """Return how far a track went and how far up, in words."""
    found = travelled(track)
    text = f"{found.distance:.0f} m, give or take {2 * found.distance_sd:.0f}"
    if np.isfinite(found.ascent):
        text += f"; {found.ascent:.0f} m up, give or take {2 * found.ascent_sd:.0f}"
        text += f"; {found.descent:.0f} m down, give or take {2 * found.descent_sd:.0f}"
    return text
