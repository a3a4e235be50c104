"""Where radars stand and how exactly they measure."""

from __future__ import annotations

import csv
import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ..engine.errors import InputError
from ..tables.source import bounded

HOW = (
    'a site is given as sites={"25/201": Site(46.2, 15.1, 800)} or "25/201=46.2,15.1,800" '
    "(SAC/SIC=latitude,longitude,height in degrees and m), or as a CSV, JSON or TOML file of these; "
    'a radar to leave out is "25/201=none"'
)


@dataclass(frozen=True)
class Site:
    """Place and accuracy of a radar.

    Attributes
    ----------
    latitude, longitude : float
        Degrees, WGS-84.
    height : float
        m over the ellipsoid. Heights on maps are over the sea; the difference (up to 100 m) is felt below 5 km only.
    range_sd, azimuth_sd : float
        m and degrees: standard deviation of one measurement. The defaults, 70 m and 0.08 degrees, are the limits of the
        EUROCONTROL Standard for Radar Surveillance in En-Route Airspace and Major Terminal Areas
        (SUR.ET1.ST01.1000-STD-01-01, 1997) for the random errors of monopulse secondary radar. A good Mode S radar does
        better; a marine or a primary radar is another thing: give its own.

    Examples
    --------
    >>> Site(46.2, 15.1, 800)
    Site(latitude=46.2, longitude=15.1, height=800.0, range_sd=70.0, azimuth_sd=0.08)
    """

    latitude: float
    longitude: float
    height: float = 0.0
    range_sd: float = 70.0
    azimuth_sd: float = 0.08

    def __post_init__(self):
        limits = {"latitude": (-90, 90), "longitude": (-180, 360), "height": (-1000, 20_000)}
        for f in fields(self):
            value = getattr(self, f.name)
            try:
                value = float(value)
            except (TypeError, ValueError):
                raise InputError(f"{f.name} of a site must be a number, got {value!r}") from None
            low, high = limits.get(f.name, (0, math.inf))
            if not (low <= value <= high and math.isfinite(value)) or (f.name.endswith("_sd") and value == 0):
                raise InputError(f"{f.name} of a site must be within {low} .. {high}, got {value:g}{_hint(f.name)}")
            object.__setattr__(self, f.name, value)


def _hint(name):
    return "; are latitude and longitude swapped?" if name == "latitude" else ""


def sensor_name(sac, sic) -> str:
    """Return how a radar is named: "SAC/SIC"."""
    return f"{int(sac)}/{int(sic)}"


def _key(text):
    parts = str(text).replace("-", "/").split("/")
    try:
        sac, sic = (int(p) for p in parts)
        if not (0 <= sac <= 255 and 0 <= sic <= 255):
            raise ValueError
    except ValueError:
        raise InputError(f"a radar is named SAC/SIC, two numbers up to 255, got {str(text)!r}; {HOW}") from None
    return sensor_name(sac, sic)


def _site(value, name):
    try:
        if value is None or isinstance(value, Site):
            return value
        if isinstance(value, Mapping):
            return Site(**value)
        if isinstance(value, str):
            if value.strip().lower() == "none":
                return None
            value = value.split(",")
        values: list[Any] = [v.strip() if isinstance(v, str) else v for v in value]
        return Site(*values)
    except TypeError as error:
        raise InputError(f"site {name} cannot be read ({error}); {HOW}") from None
    except InputError as error:
        raise InputError(f"site {name}: {error}") from None


def _rows(path):
    """Return (name, site) of each row of a CSV file: sensor, or sac and sic, and the fields of `Site`."""
    with open(path, newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        columns = [c.strip().lower() for c in reader.fieldnames or ()]
        reader.fieldnames = columns
        missing = {"latitude", "longitude"} - set(columns)
        if missing or not ("sensor" in columns or {"sac", "sic"} <= set(columns)):
            raise InputError(
                f"{path} needs columns sensor (or sac and sic), latitude, longitude and may have height, range_sd, "
                f"azimuth_sd; it has {', '.join(columns) or 'none'}"
            )
        known = [f.name for f in fields(Site)]
        return [
            (row.get("sensor") or f"{row['sac']}/{row['sic']}", {k: row[k] for k in known if row.get(k)})
            for row in reader
        ]


def read_sites(source) -> dict[str, Site]:
    """Return a table "SAC/SIC" -> `Site`; radars to be left out are not in it, see `site_table`.

    Parameters
    ----------
    source : path, mapping, str, or sequence of str
        A file (``.csv`` with columns sac, sic or sensor, latitude, longitude and perhaps height, range_sd, azimuth_sd;
        ``.json`` or ``.toml`` with a table for each "SAC/SIC"); a mapping from "SAC/SIC" to `Site`, mapping or
        (latitude, longitude, height) or None; or texts "SAC/SIC=latitude,longitude,height", "SAC/SIC=none".

    Examples
    --------
    >>> read_sites("25/201=46.2,15.1,800")["25/201"].height
    800.0
    """
    return {name: site for name, site in site_table(source).items() if site is not None}


def site_table(source) -> dict[str, Site | None]:
    """Return what `read_sites` does, with None for radars whose plots are to be left out."""
    if source is None:
        return {}
    if isinstance(source, str) and "=" in source:
        source = [source]
    if isinstance(source, str | Path):
        source = _file(Path(source))
    if isinstance(source, Mapping):
        pairs = list(source.items())
    else:
        pairs = []
        for entry in source:
            name, equals, value = entry.partition("=") if isinstance(entry, str) else (*entry[:1], "=", entry[1])
            if not equals:
                raise InputError(f"site {entry!r} has no '='; {HOW}")
            pairs.append((name.strip(), value))
    out = {_key(name): _site(value, name) for name, value in pairs}
    if len(out) < len(pairs):
        raise InputError("sites names a radar twice")
    return out


def _text(path) -> str:
    with open(path, "rb") as file:
        return bounded(file, f"sites: {path}").decode()


def _file(path):
    kind = path.suffix.lower()
    if not path.is_file():
        raise InputError(f"sites: no file {str(path)!r}; {HOW}")
    try:
        if kind == ".csv":
            return _rows(path)
        if kind == ".json":
            table = json.loads(_text(path))
        elif kind == ".toml":
            table = tomllib.loads(_text(path))
        else:
            raise InputError(f"sites: {path} is neither .csv, .json nor .toml; {HOW}")
    except (ValueError, OSError, RecursionError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"sites: {path} cannot be read: {error}") from None
    if not isinstance(table, dict):
        raise InputError(f"sites: {path} must hold a table from SAC/SIC to site, got {type(table).__name__}")
    return table
