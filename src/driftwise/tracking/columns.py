"""Which column of a table says what about a plot, and in which unit: known by its name."""

from __future__ import annotations

import re
from typing import NamedTuple

from ..engine.errors import InputError
from ..tables.source import resolve

NAMES = {  # the commonest first
    "time": "timestamp time datetime dateandtime basedatetime datetimeutc utcdatetime utc utctime timeutc gpstime "
    "epoch unixtime unix ts t receivetime recvtime rxtime mintime timeofday tod daytime zeitstempel zeit uhrzeit now "
    "stamp headerstamp fieldheaderstamp",
    "position_time": "lastposupdate lastposition lastpositionupdate timeposition positiontime",
    "date": "date day datum",
    "latitude": "latitude lat breite breitengrad",
    "longitude": "longitude lon lng long laenge länge längengrad",
    "east": "east easting e x ost positionx posx tx translationx posepositionx fieldposepositionx prsrx",
    "north": "north northing n y nord positiony posy ty translationy posepositiony fieldposepositiony prsry",
    "range": "range slantrange rho distance dist r",
    "azimuth": "azimuth azi az theta bearing",
    "altitude": "altitude alt height geoaltitude altgeom baroaltitude altbaro altitudebaro flightlevel fl modec ele "
    "elevation z höhe hoehe positionz posz tz translationz posepositionz fieldposepositionz prsrz",
    "key": "icao24 icao icaoaddress hexident hex address modesaddress targetaddress mmsi trackid tracknumber targetid "
    "target objectid object id vehicleid vesselid aircraftid deviceid",
    "name": "vesselname shipname name callsign flight flightid ident registration",
    "sensor": "sensor sensorid site radar radarid station receiver sacsic",
    "speed": "groundspeed gs velocity speed sog",
    "frame": "frame rawmsg rawmessage",
}
RECEIVER = frozenset(  # what a satellite receiver tells of a fix: the positions are its own
    "satellites satellitesused numsatellites numsats nsats nsat sats numsv hdop pdop vdop fixtype fixquality gpsfix "
    "hacc horizontalaccuracy".split()
)
ROLES = {role: {word: rank for rank, word in enumerate(words.split())} for role, words in NAMES.items()}
FRAMES = (("latitude", "longitude"), ("east", "north"), ("range", "azimuth"))  # of position; the first complete is used
METRES = {
    "m": 1.0,
    "mm": 1e-3,
    "cm": 1e-2,
    "km": 1e3,
    "ft": 0.3048,
    "kft": 304.8,
    "NM": 1852.0,
    "FL": 30.48,
    "mi": 1609.344,
}
UNITS = {
    "m": "m", "metre": "m", "metres": "m", "meter": "m", "meters": "m", "mm": "mm", "cm": "cm",
    "millimetres": "mm", "millimeters": "mm", "km": "km", "nm": "NM", "nmi": "NM", "mi": "mi",
    "ft": "ft", "feet": "ft", "foot": "ft", "kft": "kft", "fl": "FL", "deg": "deg", "degree": "deg", "degrees": "deg",
    "°": "deg", "rad": "rad", "radian": "rad", "radians": "rad", "s": "s", "sec": "s", "seconds": "s", "ms": "ms",
    "us": "us", "µs": "us", "ns": "ns", "min": "min", "h": "h", "kt": "kt", "kts": "kt", "knots": "kt", "m/s": "m/s",
}  # fmt: skip
_BRACKETS = re.compile(r"^(.*?)\s*[\[({]([^\])}]*)[\])}]\s*$")
_SUFFIX = re.compile(r"^(.*?)(?:[_\s.\-]+([A-Za-z/°µ]+)|(?<=[a-z])(Ft|M|Km|Nm|Deg|Rad|Ms))$")


class Column(NamedTuple):
    """A column of a table and the unit its values are taken in."""

    name: str
    unit: str = ""


def unit_of(text: str) -> str:
    """Return the unit a word stands for, "" where it is none."""
    return UNITS.get(text.strip().casefold(), "")


def meaning(name: str) -> tuple[str, str]:
    """Return the bare word of a name, and its unit.

    >>> meaning("Altitude (ft)"), meaning("x_km"), meaning("# Timestamp"), meaning("BaseDateTime")
    (('altitude', 'ft'), ('x', 'km'), ('timestamp', ''), ('basedatetime', ''))
    """
    for pattern in (_BRACKETS, _SUFFIX):
        match = pattern.match(name.strip())
        if match and _bare(match[1]) and (unit := unit_of(next(filter(None, match.groups()[1:]), ""))):
            return _bare(match[1]), unit
    return _bare(name), ""


def _bare(name: str) -> str:
    return re.sub(r"[\W_]+", "", name).casefold()


def recognise(names, columns=None, units=None) -> dict[str, list[Column]]:
    """Return what may play each part, the likeliest first, of the columns called ``names``.

    Parameters
    ----------
    names : sequence of str
    columns : dict from part to name, or (name, unit), or None, optional
        Overrides what is recognised; None says that nothing plays the part.
    units : dict from name to unit, optional
        What the file says about units.
    """
    names, units = list(names), {name: unit_of(unit) for name, unit in (units or {}).items()}
    found: dict[str, list] = {role: [] for role in NAMES}
    for name in names:
        word, unit = meaning(name)
        for role, ranks in ROLES.items():
            rank = ranks.get(_bare(name), ranks.get(word))
            if rank is not None:
                found[role].append((rank, Column(name, unit or units.get(name, ""))))
    taken = {role: [column for _, column in sorted(ranked, key=lambda pair: pair[0])] for role, ranked in found.items()}
    return _overridden(taken, names, columns or {}, units)


def _overridden(taken, names, columns, units):
    for role, said in columns.items():
        if role not in NAMES or role == "frame":
            raise InputError(f"columns names {role!r}; what a column can be is one of {', '.join(sorted(NAMES))}")
        if said is None:
            taken[role] = []
            continue
        name, unit = (said, "") if isinstance(said, str) else said
        if unit and not unit_of(unit):
            raise InputError(
                f"columns gives {role} in {unit!r}; units known are {', '.join(dict.fromkeys(UNITS.values()))}"
            )
        name = resolve(names, name, role)
        taken[role] = [Column(name, unit_of(unit) or meaning(name)[1] or units.get(name, ""))]
        if role == "time" and "position_time" not in columns:
            taken["position_time"] = []
    asked = [frame for frame in FRAMES if any(columns.get(role) for role in frame)]
    for frame in FRAMES:
        if asked and frame not in asked:
            taken.update({role: [] for role in frame})
    return taken


def is_receiver(names) -> bool:
    """Say whether columns of such names are what a satellite receiver writes of itself."""
    return any(meaning(name)[0] in RECEIVER or _bare(name) in RECEIVER for name in names)


def position_roles(taken, names) -> tuple[Column, Column, tuple[str, str]]:
    """Return the two columns of position and which frame they are of, or say what is missing or ambiguous."""
    shown = f"The columns are: {', '.join(names[:40])}{' ...' if len(names) > 40 else ''}."
    for frame in FRAMES:
        if not all(taken[role] for role in frame):
            continue
        for role in frame:
            alike = [column.name for column in taken[role]]
            if len(alike) > 1:
                raise InputError(
                    f"{' and '.join(map(repr, alike))} can both be the {role}; say which: "
                    f"columns={{{role!r}: {alike[0]!r}}}"
                )
        return taken[frame[0]][0], taken[frame[1]][0], frame
    half = next((frame for frame in FRAMES if any(taken[role] for role in frame)), None)
    if half:
        have, lack = half if taken[half[0]] else half[::-1]
        what = f"there is a column of {have}, {taken[have][0].name!r}, but none of {lack}"
    else:
        what = "no columns of position are recognised: latitude and longitude, east and north, or range and azimuth"
    raise InputError(f"{what}. {shown} Name them: columns={{'latitude': ..., 'longitude': ...}}")


def altitude_unit(column: Column, taken) -> str:
    """Return the unit of altitudes: as said, or feet beside a ground speed (in knots) as receivers write, else m."""
    if column.unit in METRES:
        return column.unit
    word = meaning(column.name)[0]
    if word in ("flightlevel", "fl"):
        return "FL"
    speeds = {meaning(speed.name)[0] for speed in taken["speed"] if speed.unit in ("", "kt")}
    if word in ("modec", "altbaro", "altgeom") or speeds & {"groundspeed", "gs"}:
        return "ft"
    return "m"
