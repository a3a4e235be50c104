"""Tracks as ASTERIX category 062, edition 1.20, encoded by libasterix.

Items written: 010 source, 015 service, 070 time, 105 position (WGS-84), 100 position, 185 velocity, 210 acceleration
(East and North of the origin), 060 Mode A, 380 address and callsign, 040 track number, 080 status (tentative,
first and last record of a track), 200 turning left or right, 136 flight level, 500 the error bars of 100, 185 and 210.
What is not known is left out. A number beyond the scale of its item is written as the largest there is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...engine.errors import InputError
from ..frames import geographic

TOGETHER = 14  # records in a block: together less than an Ethernet frame
STRAIGHT = np.radians(0.5)  # rad/s: a turn rate known to this, and not told from none, is a constant course
LEVEL = 25 * 0.3048  # a quarter of a flight level, m
SIX_BITS = {" ": 32, **{str(k): 48 + k for k in range(10)}, **{chr(65 + k): 1 + k for k in range(26)}}


def encode_cat062(tracks, sac, sic, *, service=1) -> bytes:
    """Return tracks as blocks of ASTERIX CAT062, a record for each plot, in order of time.

    Parameters
    ----------
    tracks : Tracks or mapping of columns
        Columns: ``time`` (T,) s since a midnight or the Unix epoch, ``track`` (T,) numbers, ``latitude`` and
        ``longitude`` (T,) degrees; and, where known (NaN, infinite or "" where not), ``position``, ``velocity``,
        ``acceleration`` and their ``position_sd``, ``velocity_sd``, ``acceleration_sd`` (T, 2) in m and s East and
        North, ``altitude`` (T,) m of the pressure altitude, ``turn_rate``, ``turn_rate_sd`` (T,) rad/s, ``key`` (T,)
        ("4BAA5F" an address, "A1234" a Mode A code), ``name`` (T,) callsign, ``tentative`` (T,) bool.
    sac, sic : int
        System area and identification code of the sender.
    service : int
        Service identification.

    Notes
    -----
    Bad at: keeping small numbers. Velocity and acceleration come in steps of 0.25 m/s and 0.25 m/s^2, their error bars
    as well, and end at 63.75. Track numbers are taken modulo 65536. Slow: one to two thousand records a second.

    Examples
    --------
    >>> rows = {"time": [27354.6], "track": [7], "latitude": [46.2], "longitude": [15.1], "key": ["A4276"]}
    >>> encode_cat062(rows, 25, 201).hex()
    '3e0019b94c19c901356d4d008369d0002af37c08be00070162'
    """
    rows = _columns(tracks if isinstance(tracks, Mapping) else rows_of(tracks))
    for name, value in {"sac": sac, "sic": sic, "service": service}.items():
        if not (isinstance(value, int | np.integer) and 0 <= value <= 255):
            raise InputError(f"{name} must be a whole number from 0 to 255, got {value!r}")
    spec = _library().Cat_062_1_20
    head = {"010": (("SAC", int(sac)), ("SIC", int(sic))), "015": int(service)}
    records = [spec.cv_record.create(head | items) for items in _items(rows)]
    blocks = [spec.create(records[k : k + TOGETHER]) for k in range(0, len(records), TOGETHER)]
    return b"".join(block.unparse().to_bytes() for block in blocks)


def rows_of(tracks) -> dict[str, Any]:
    """Return the columns `encode_cat062` takes, of `Tracks`.

    Parameters
    ----------
    tracks : sequence of Track
        With an origin on earth.
    """
    parts: dict[str, list] = {}
    for track in tracks:
        if track.origin is None:
            raise InputError("tracks have no origin on earth, and CAT062 needs one; give the radar's site when reading")
        trace, T = track.trace, len(track.plots)
        latitude, longitude = geographic(trace.position, track.origin).T
        columns = {
            "time": track.plots.time, "track": [track.id] * T, "latitude": latitude, "longitude": longitude,
            **{f"{name}{sd}": getattr(trace, name + sd) for name in ("position", "velocity", "acceleration")
               for sd in ("", "_sd")},
            "turn_rate": trace.turn_rate, "turn_rate_sd": trace.turn_rate_sd, "altitude": track.altitude,
            "key": [track.key] * T, "name": [track.name] * T, "tentative": [track.status == "tentative"] * T,
        }  # fmt: skip
        for name, column in columns.items():
            parts.setdefault(name, []).append(np.asarray(column))
    return {name: np.concatenate(columns) for name, columns in parts.items()}


def _library():
    try:
        import asterix.generated as generated
    except ImportError:
        raise InputError('encoding ASTERIX needs libasterix: pip install "driftwise[tracking]"') from None
    return generated


SHAPES: dict[str, tuple] = {
    **dict.fromkeys(("time", "track", "latitude", "longitude", "altitude", "turn_rate", "turn_rate_sd"), ()),
    **{name + sd: (2,) for name in ("position", "velocity", "acceleration") for sd in ("", "_sd")},
}
NEEDED = ("time", "track", "latitude", "longitude")


def _columns(rows):
    """Return the columns as arrays, checked and sorted by time."""
    if not rows:
        return {name: np.zeros((0, *SHAPES[name])) for name in NEEDED}
    missing = [name for name in NEEDED if name not in rows]
    if missing:
        raise InputError(f"tracks need columns {', '.join(NEEDED)}; missing: {', '.join(missing)}")
    T, out = len(rows["time"]), {}
    for name, column in rows.items():
        if name in SHAPES:
            column = np.asarray(column, float)
            if column.shape != (T, *SHAPES[name]):
                raise InputError(f"{name} must have shape {(T, *SHAPES[name])}, got {column.shape}")
        elif name in ("key", "name", "tentative"):
            column = np.asarray(column, object)
            if column.shape != (T,):
                raise InputError(f"{name} must have an entry for each of {T} times, got shape {column.shape}")
        else:
            known = ", ".join((*SHAPES, "key", "name", "tentative"))
            raise InputError(f"tracks have a column {name!r} that is not known; known are {known}")
        out[name] = column
    for name in ("time", "track"):
        if not np.isfinite(out[name]).all():
            raise InputError(f"{name} must be finite, got {out[name][~np.isfinite(out[name])][0]}")
    bad = ~((np.abs(out["latitude"]) <= 90) & (np.abs(out["longitude"]) <= 360))
    if bad.any():
        k = int(np.flatnonzero(bad)[0])
        raise InputError(
            f"latitude and longitude must be degrees, got {out['latitude'][k]}, {out['longitude'][k]} in row {k}; "
            "are they radians, swapped or missing?"
        )
    order = np.argsort(out["time"], kind="stable")
    return {name: column[order] for name, column in out.items()}


def _whole(values, unit, bits, signed=True):
    """Return whole numbers of a unit as two's complement, at the end of the scale where beyond; None: not finite."""
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    values = np.asarray(values, float)
    known = np.isfinite(values)
    whole = np.clip(np.rint(np.where(known, values, 0.0) / unit), low, high).astype(np.int64) & (1 << bits) - 1
    return np.where(known, whole.astype(object), None)


def _pair(values, names, unit, bits, signed=True):
    """Return an item of two numbers for each row, None where one of them is not known."""
    whole = _whole(values, unit, bits, signed)
    return [None if None in (a, b) else ((names[0], a), (names[1], b)) for a, b in whole]


def _items(rows):
    """Yield the items of each record."""
    T = len(rows["time"])
    none = [None] * T
    columns = {
        "070": np.rint(rows["time"] % 86400 * 128).astype(int) % (86400 * 128),
        "105": [
            (("LAT", a), ("LON", b))
            for a, b in zip(
                _whole(rows["latitude"], 180 / 2**25, 32),
                _whole((rows["longitude"] + 180) % 360 - 180, 180 / 2**25, 32),
            )
        ],
        "040": rows["track"].astype(np.int64) % 65536,
        "136": _whole(rows["altitude"], LEVEL, 16) if "altitude" in rows else none,
    }
    for item, name, names, unit, bits in (
        ("100", "position", "XY", 0.5, 24),
        ("185", "velocity", ("VX", "VY"), 0.25, 16),
        ("210", "acceleration", ("AX", "AY"), 0.25, 8),
    ):
        columns[item] = _pair(rows[name], names, unit, bits) if name in rows else none
    errors = {
        part: _pair(rows[name], "XY", unit, bits, signed=False) if name in rows else none
        for part, name, unit, bits in (
            ("APC", "position_sd", 0.5, 16),
            ("ATV", "velocity_sd", 0.25, 8),
            ("AA", "acceleration_sd", 0.25, 8),
        )
    }
    number = columns["040"]
    first = {int(number[k]): k for k in range(T - 1, -1, -1)}
    last = {int(number[k]): k for k in range(T)}
    turning = _turning(rows)
    for k in range(T):
        items = {item: _plain(column[k]) for item, column in columns.items() if column[k] is not None}
        items |= _who(rows["key"][k] if "key" in rows else "", rows["name"][k] if "name" in rows else "")
        bars = {part: _plain(column[k]) for part, column in errors.items() if column[k] is not None}
        if bars:
            items["500"] = bars
        if turning[k] is not None:
            items["200"] = (("TRANS", turning[k]), ("LONG", 3), ("VERT", 3), ("ADF", 0), 0)
        n = int(number[k])
        tentative = bool(rows["tentative"][k]) if "tentative" in rows else False
        items["080"] = _status(tentative, first[n] == k, last[n] == k)
        yield items


def _plain(value):
    return int(value) if isinstance(value, int | np.integer) else value


def _turning(rows):
    """Return for each row 1 (right), 2 (left), 0 (constant course), 3 (not known), or None where there is no rate."""
    T = len(rows["time"])
    if "turn_rate" not in rows or "turn_rate_sd" not in rows:
        return [None] * T
    rate, sd = rows["turn_rate"], rows["turn_rate_sd"]
    out = np.select([rate > 2 * sd, rate < -2 * sd, sd < STRAIGHT], [1, 2, 0], 3)
    return [int(v) if known else None for v, known in zip(out, np.isfinite(rate) & np.isfinite(sd))]


def _status(tentative, first, last):
    basic = (("MON", 0), ("SPI", 0), ("MRH", 0), ("SRC", 0), ("CNF", int(tentative)), None)
    if not (first or last):
        return (basic,)
    more = (("SIM", 0), ("TSE", int(last)), ("TSB", int(first)), ("FPC", 0), ("AFF", 0), ("STP", 0), ("KOS", 1), None)
    return (basic, more)


def _who(key, name):
    """Return the items of Mode A code, address and callsign that a key and a name make."""
    items: dict[str, Any] = {}
    known: dict[str, int] = {}
    if len(key) == 5 and key[0] == "A" and all(c in "01234567" for c in key[1:]):
        items["060"] = (("V", 0), ("G", 0), ("CH", 0), 0, ("MODE3A", int(key[1:], 8)))
    elif len(key) == 6 and all(c in "0123456789ABCDEF" for c in key):
        known["ADR"] = int(key, 16)
    letters = [SIX_BITS.get(c) for c in name.upper().ljust(8)[:8]]
    if name.strip() and None not in letters:
        known["ID"] = sum(c << 6 * (7 - k) for k, c in enumerate(letters) if c is not None)
    return items | ({"380": known} if known else {})
