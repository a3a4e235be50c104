"""Records of JSON, however they are nested, as the columns of a table."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .plots import Fault
from .tables import Table

STATES = (  # the rows of the OpenSky network's interface have no names
    "icao24 callsign country time_position last_contact longitude latitude baro_altitude on_ground velocity true_track "
    "vertical_rate sensors geo_altitude squawk spi position_source"
).split()
SCANNERS = {1: "lidar", 2: "radar"}


def json_records(data: bytes, title: str) -> tuple[list[dict], np.ndarray, list[Fault]]:
    """Return (records, number of each, faults) of a JSON document, or of JSON lines, numbered by lines."""
    text = data.decode("utf-8-sig", "replace")
    try:
        value = json.loads(text)
        records = shaped(value)
        return records, np.arange(1, len(records) + 1), _bearings(value, title)
    except ValueError as error:  # JSON lines, or a document that is cut
        whole = error
    except RecursionError:
        raise InputError(f"{title}: the JSON is nested too deeply to be plots") from None
    records, at, faults = [], [], []
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip():
            continue
        try:
            record = json.loads(line)
        except (ValueError, RecursionError) as error:
            faults.append(Fault(title, number, f"no JSON: {error}"))
            continue
        if isinstance(record, dict):
            records.append(record)
            at.append(number)
        else:
            faults.append(Fault(title, number, "no record: a line must be a JSON object"))
    if len(records) <= len(faults):
        raise InputError(f"{title}: the JSON cannot be read ({whole}). Was the copy cut short?")
    return records, np.array(at, int), faults


def _bearings(value, title) -> list[Fault]:
    """Return a fault that counts the scans of cameras and the like, which see directions only."""
    scans = (
        [k for k, r in enumerate(value, 1) if "measurement" in r and r.get("sensorID") not in SCANNERS]
        if (_is_scans(value))
        else []
    )
    return (
        [Fault(title, scans[0], f"scans of bearings, no positions: {len(scans)}, this is the first")] if scans else []
    )


def _is_scans(value) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(r, dict) and "measurement" in r for r in value)


def shaped(value: Any) -> list[dict]:
    """Return the records of a JSON document: a list of them, a dictionary of columns, GeoJSON, or a list inside.

    >>> shaped({"t": [1, 2], "x": [3, 4]}) == shaped({"t": {"0": 1, "1": 2}, "x": {"0": 3, "1": 4}})
    True
    >>> shaped({"name": "a radar", "waypoints": [{"t": 1, "x": 3}]})
    [{'t': 1, 'x': 3}]
    """
    if isinstance(value, list):
        if _is_scans(value):
            return [plot for record in value for plot in _scan(record)]
        return [record if isinstance(record, dict) else {} for record in value]
    if not isinstance(value, dict):
        raise InputError(f"the JSON holds {type(value).__name__}, not records")
    if value.get("type") in ("FeatureCollection", "Feature"):
        features = value.get("features", [value])
        return [record for feature in features if isinstance(feature, dict) for record in _feature(feature)]
    if isinstance(value.get("data"), list) and isinstance(value.get("columns"), list):  # pandas, split
        return [dict(zip(map(str, value["columns"]), row)) for row in value["data"] if isinstance(row, list)]
    if isinstance(value.get("states"), list):
        return [
            {"now": value.get("time"), **dict(zip(STATES, row))} for row in value["states"] if isinstance(row, list)
        ]
    inside = [part for part in value.values() if isinstance(part, list) and part and isinstance(part[0], dict)]
    if inside:
        shared = {name: part for name, part in value.items() if name in ("now", "time", "timestamp")}
        return [{**shared, **record} for record in shaped(max(inside, key=len))]
    lists = {name: part for name, part in value.items() if isinstance(part, list)}
    if lists:
        return [dict(zip(lists, row)) for row in zip(*lists.values())]
    dicts = {name: part for name, part in value.items() if isinstance(part, dict)}
    if len(dicts) > 1:  # pandas, columns
        index = dict.fromkeys(row for part in dicts.values() for row in part)
        return [{name: part.get(row) for name, part in dicts.items()} for row in index]
    return [value]


def _feature(feature) -> list[dict]:
    """Return the records of a GeoJSON feature: a point, or a line with a time for each of its points."""
    geometry, properties = feature.get("geometry"), feature.get("properties")
    geometry = geometry if isinstance(geometry, dict) else {}
    properties = properties if isinstance(properties, dict) else {}
    points = geometry.get("coordinates")
    if geometry.get("type") == "Point":
        return [{**properties, **_coordinates(points)}]
    times = next((properties[n] for n in ("coordTimes", "times") if isinstance(properties.get(n), list)), None)
    if geometry.get("type") in ("LineString", "MultiPoint") and isinstance(points, list) and times:
        rest = {name: part for name, part in properties.items() if not isinstance(part, list)}
        return [{**rest, **_coordinates(point), "time": time} for point, time in zip(points, times)]
    return []


def _coordinates(point) -> dict:
    point = point if isinstance(point, list) else []
    return dict(zip(("longitude", "latitude", "altitude_m"), point))


def _scan(record) -> list[dict]:
    """Return the plots of a scan seen from a ship: metres North and East of it, one column a plot."""
    sensor, found, own = record.get("sensorID"), record["measurement"], record.get("ownshipPosition", [0.0, 0.0])
    if sensor not in SCANNERS or not isinstance(found, list) or len(found) != 2:
        return []
    try:
        north, east = (np.atleast_1d(np.asarray(row, float)) + own[k] for k, row in enumerate(found))
    except (TypeError, ValueError, IndexError):
        return []
    time = record.get("time")
    return [
        {"time": time, "north": float(n), "east": float(e), "sensor": SCANNERS[sensor]} for n, e in zip(north, east)
    ]


def record_table(records: list[dict], at, title: str, faults=()) -> Table:
    """Return the table of records: a column for every name, of those inside a record too."""
    import pyarrow as pa

    flat = [_flat(record) for record in records]
    names = list(dict.fromkeys(str(name) for record in flat for name in record))
    if not names:
        raise InputError(f"{title}: the JSON holds no records of plots: a list of objects with a time and a position")
    columns: dict[str, Any] = {}
    for name in names:
        cells = [record.get(name) for record in flat]
        if all(cell is None or isinstance(cell, int | float) for cell in cells):
            columns[name] = pa.array(np.array([np.nan if c is None else _number(c) for c in cells]), from_pandas=True)
        else:
            columns[name] = pa.array(
                [None if c is None or isinstance(c, list) else _text(c) for c in cells], pa.string()
            )
    return Table(title, columns, np.asarray(at), faults=tuple(faults))


def _text(cell) -> str:
    return str(cell).encode("utf-8", "replace").decode()


def _number(cell) -> float:
    try:
        return float(cell)
    except OverflowError:
        return np.inf


def _flat(record):
    """Return a record with the names of those inside it beside its own."""
    if not any(isinstance(part, dict) for part in record.values()):
        return record
    flat = {name: part for name, part in record.items() if not isinstance(part, dict)}
    for part in record.values():
        if isinstance(part, dict):
            flat = {**{name: cell for name, cell in part.items() if not isinstance(cell, dict)}, **flat}
    return flat
