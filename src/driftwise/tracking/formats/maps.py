"""Tracks on maps: GeoJSON (RFC 7946) and KML (OGC 2.3 with Google's track), positions in WGS-84."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from ...engine.atomic import write_text
from ...engine.errors import InputError
from ...results.numbers import finite
from ..frames import geographic
from ..times import dated, iso
from ..tracks import Track, Tracks

DIGITS = 7  # of degrees: a centimetre
NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def _places(track: Track, what: str) -> np.ndarray:
    """Return (T, 2 or 3) longitude, latitude and, where any is known, altitude (interpolated where a plot has none)."""
    if track.origin is None:
        raise InputError(
            f"{what} needs positions on earth, and these plots are metres without an origin: give one to "
            "read_plots or plots(.., origin=(latitude, longitude)); CSV and Parquet take metres"
        )
    degrees = geographic(track.trace.position, track.origin)[:, ::-1].round(DIGITS)
    known = np.isfinite(track.altitude)
    if not known.any():
        return degrees
    time, upwards = track.plots.time, track.vertical
    if upwards is not None and track.is_smoothed:
        return np.column_stack([degrees, upwards.position[:, 0].round(1)])
    return np.column_stack([degrees, np.interp(time, time[known], track.altitude[known]).round(1)])


def cut_at_antimeridian(places: np.ndarray) -> list[np.ndarray]:
    """Return the parts of a line that do not cross longitude 180, each ending and beginning on it."""
    crossings = np.flatnonzero(np.abs(np.diff(places[:, 0])) > 180) + 1
    parts = np.split(places, crossings)
    for n, k in enumerate(crossings):
        a, b = places[k - 1], places[k].copy()
        edge = math.copysign(180.0, a[0])
        b[0] += 2 * edge
        on = a + (edge - a[0]) / (b[0] - a[0]) * (b - a) if b[0] != a[0] else b
        parts[n] = np.vstack([parts[n], on])
        parts[n + 1] = np.vstack([[-edge, *on[1:]], parts[n + 1]])
    return parts


def write_geojson(tracks: Tracks, path, points: bool = False) -> Path:
    """Write a line for each track with its summary, cut at longitude 180; with ``points`` one for each plot too."""
    features = []
    for track in tracks:
        places, times = _places(track, "GeoJSON"), track.plots.time
        named = iso(times) if dated(times) else times.tolist()
        about = track.summary() | {"start": named[0], "end": named[-1]}
        features.append(_feature(_geometry(places), about))
        if points:
            features += _points(track, places, named)
    text = json.dumps(finite({"type": "FeatureCollection", "features": features}), allow_nan=False, ensure_ascii=False)
    write_text(path, text)
    return Path(path)


def _geometry(places: np.ndarray) -> dict[str, Any]:
    if len(places) == 1:
        return {"type": "Point", "coordinates": places[0].tolist()}
    parts = [part.tolist() for part in cut_at_antimeridian(places)]
    if len(parts) == 1:
        return {"type": "LineString", "coordinates": parts[0]}
    return {"type": "MultiLineString", "coordinates": parts}


def _points(track: Track, places: np.ndarray, named: list) -> list[dict]:
    trace = track.trace
    columns = {name: getattr(trace, name).tolist() for name in ("speed", "course", "turn_rate", "manoeuvre", "nis")}
    return [
        _feature(
            {"type": "Point", "coordinates": place},
            {"track": track.id, "key": track.key, "time": named[k]}
            | {name: column[k] for name, column in columns.items()},
        )
        for k, place in enumerate(places.tolist())
    ]


def _feature(geometry: dict, properties: dict) -> dict:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def write_kml(tracks: Tracks, path) -> Path:
    """Write a placemark for each track: with Unix times a moving one (gx:Track), else a line."""
    marks = "\n".join(_placemark(track) for track in tracks)
    write_text(
        path,
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">\n'
        f"<Document>\n<name>Tracks</name>\n{marks}\n</Document>\n</kml>\n",
    )
    return Path(path)


def _placemark(track: Track) -> str:
    places, times = _places(track, "KML"), track.plots.time
    name = xml(track.name or track.key or f"track {track.id}")
    about = {name: value for name, value in track.summary().items() if value not in (None, "")}
    if dated(times):
        about |= {"start": iso(times)[0], "end": iso(times)[-1]}
    data = "".join(f'<Data name="{key}"><value>{xml(str(value))}</value></Data>' for key, value in about.items())
    mode = f"<altitudeMode>{'absolute' if places.shape[1] == 3 else 'clampToGround'}</altitudeMode>"
    if dated(times):
        when = "".join(f"<when>{stamp}</when>" for stamp in iso(times))
        where = "".join(f"<gx:coord>{' '.join(map(str, _height(p)))}</gx:coord>" for p in places.tolist())
        shape = f"<gx:Track>{mode}{when}{where}</gx:Track>"
    elif len(places) == 1:
        shape = f"<Point>{mode}<coordinates>{_tuple(places[0])}</coordinates></Point>"
    else:
        lines = [
            f"<LineString>{mode}<coordinates>{' '.join(map(_tuple, part))}</coordinates></LineString>"
            for part in cut_at_antimeridian(places)
        ]
        shape = lines[0] if len(lines) == 1 else f"<MultiGeometry>{''.join(lines)}</MultiGeometry>"
    return f"<Placemark><name>{name}</name><ExtendedData>{data}</ExtendedData>{shape}</Placemark>"


def _tuple(place: np.ndarray) -> str:
    return ",".join(map(str, place.tolist()))


def _height(place: list[float]) -> list[float]:
    """A coordinate of a gx:Track has three numbers."""
    return place if len(place) == 3 else [*place, 0.0]


def xml(text: str) -> str:
    """Return text as XML can hold it."""
    return escape(NOT_XML.sub("", text))
