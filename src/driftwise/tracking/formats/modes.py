"""Plots from Mode S frames: the positions that aircraft squitter (ADS-B), one key per 24-bit address."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from ...engine.errors import InputError
from ..placed import placed
from ..plots import Fault, Plots
from .logs import stamped, text_lines

FEET = 0.3048
TWICE = 0.2  # s: a frame again within this time is the same transmission heard twice, for positions come 0.4 s apart
TICKS = 12e6  # per second, of the counter that receivers write before a frame
_LINE = re.compile(
    r"^(?P<time>\S.*?)??[\s,;]*(?P<mark>[*@]?)(?P<ticks>[0-9A-Fa-f]{12})??(?P<frame>[0-9A-Fa-f]{28}|[0-9A-Fa-f]{14});?$"
)
HEX = re.compile(r"[0-9A-Fa-f]{14}([0-9A-Fa-f]{14})?")


def read_lines(data: bytes, title: str, *, origin=None) -> Plots:
    """Return the plots of a text with a frame a line: ``*8D4840D6...;``, ``@`` with ticks, or a time before a frame.

    Parameters
    ----------
    data : bytes
        Times are Unix s or ISO 8601; ticks of the 12 MHz counter give seconds from an unknown start.
    title : str
        What to call the file in faults.
    origin : (latitude, longitude), optional
    """
    records, faults = [], []
    for number, line in text_lines(data):
        match = _LINE.match(line)
        if match is None:
            faults.append(Fault(title, number, f"no Mode S frame of 14 or 28 hex digits: {line[:40]!r}"))
        else:
            time = int(match["ticks"], 16) / TICKS if match["ticks"] else _time(match["time"])
            records.append({"timestamp": time, "frame": match["frame"], "line": number})
    if records and not any(np.isfinite(record["timestamp"]) for record in records):
        raise InputError(
            f"{title}: the frames have no times. A track needs one on each line: '1720248189.52 8d4840d6...', "
            "or AVR with ticks, '@' and 12 digits before the frame"
        )
    return read_frames(records, [record["line"] for record in records], title, origin=origin, faults=faults)


def _time(value) -> float:
    """Return s of Unix s or ms or a time stamp, NaN of anything else."""
    try:
        number = float(value)
        return number / 1e3 if number > 1e11 else number
    except (TypeError, ValueError, OverflowError):
        pass
    try:
        return stamped(str(value).strip())
    except ValueError:
        return np.nan


def is_frames(records: list[dict]) -> bool:
    """Whether most records carry a Mode S frame."""
    carry = sum(isinstance(r.get("frame"), str) and bool(HEX.fullmatch(r["frame"])) for r in records)
    return 2 * carry > len(records)


def read_frames(records, at, title: str, *, origin=None, faults=()) -> Plots:
    """Return the airborne positions of Mode S frames, as `Plots`.

    Parameters
    ----------
    records : list of dict
        ``timestamp`` (Unix s) and ``frame`` (hex). Where records carry decoded fields as rs1090 writes them (``df``,
        ``bds``, ``latitude`` ...), these are taken; otherwise frames are decoded by rs1090.
    at : sequence of int
        Where each record lies, for faults.
    title : str
    origin : (latitude, longitude), optional
    faults : sequence of Fault

    Notes
    -----
    A frame whose parity fails is a `Fault`; so is one that is not 14 or 28 hex digits or has no time. A frame again
    within 0.2 s is the same transmission. Altitudes are barometric, in m. Positions on the ground are left out: they
    are ambiguous without the place of the receiver.
    """
    good, faults, times, lines = [], list(faults), [], {}
    for record, line in zip(records, at):
        time, frame = _time(record.get("timestamp", record.get("time"))), record.get("frame")
        if not isinstance(frame, str) or not HEX.fullmatch(frame):
            faults.append(Fault(title, int(line), f"no Mode S frame of 14 or 28 hex digits: {str(frame)[:40]!r}"))
        elif not np.isfinite(time):
            faults.append(Fault(title, int(line), "the frame has no time"))
        else:
            good.append(record)
            times.append(time)
            lines[id(record)] = int(line)
    if not any("latitude" in record for record in good):
        good, times, lost = _decoded(good, times)
        faults += [Fault(title, lines[id(record)], _why(record["frame"])) for record in lost]
    return _positions(good, times, origin, faults, title)


def _decoded(records, times):
    """Return (decoded, times, lost): frames in order of time, as their positions come from pairs of them."""
    try:
        import rs1090
    except ImportError:
        raise ImportError(
            "Mode S frames are decoded by rs1090, which is not installed: pip install driftwise[tracking]"
        ) from None
    order = np.argsort(times, kind="stable")
    records, times = [records[k] for k in order], [times[k] for k in order]
    found: list[Any] = rs1090.decode([record["frame"].lower() for record in records], times) if records else []
    decoded, kept, lost, k = [], [], [], 0
    for record, time in zip(records, times):  # frames that fail are missing in what comes back
        if k < len(found) and found[k]["frame"] == record["frame"].lower() and found[k]["timestamp"] == time:
            decoded.append(found[k])
            kept.append(time)
            k += 1
        else:
            lost.append(record)
    return decoded, kept, lost


def _why(frame: str) -> str:
    df = int(frame[:2], 16) >> 3
    if df in (17, 18) and len(frame) == 28 and remainder(frame):
        return f"the parity of the frame fails (DF {df})"
    return f"the frame cannot be decoded (DF {df})"


def remainder(frame: str) -> int:
    """Return the remainder of a frame by the generator of Mode S parity; 0 where a squitter is undamaged.

    >>> remainder("8d4840d6202cc371c32ce0576098"), remainder("8d4840d6202cc371c32ce0576099")
    (0, 1)
    """
    bits, width = int(frame, 16), 4 * len(frame)
    for k in range(width - 24):
        if bits >> (width - 1 - k) & 1:
            bits ^= 0x1FFF409 << (width - 25 - k)
    return bits


def _positions(records, times, origin, faults, title) -> Plots:
    """Return the plots of decoded records: airborne positions, named by the call signs heard."""
    order = np.argsort(times, kind="stable")
    rows: list[tuple] = []
    last: dict[str, tuple] = {}
    names: dict[str, str] = {}
    spoken = []
    for k in order:
        record = records[k]
        if str(record.get("df")) not in ("17", "18"):
            continue
        who = str(record.get("icao24", "")).upper()
        if record.get("bds") == "08" and record.get("callsign"):
            names[who] = str(record["callsign"]).strip(" _#")
        if record.get("bds") != "05" or not isinstance(record.get("latitude"), int | float):
            continue
        before, last[who] = last.get(who), (times[k], record["frame"])
        if before and before[1] == record["frame"] and times[k] - before[0] < TWICE:
            continue
        rows.append((times[k], record["latitude"], record["longitude"], record.get("altitude"), who))
        spoken.append(names.get(who, ""))
    time, latitude, longitude, altitude, key = zip(*rows) if rows else ((),) * 5
    metres = np.array([np.nan if feet is None else feet * FEET for feet in altitude], float)
    name = [said or names.get(who, "") for said, who in zip(spoken, key)]  # a call sign holds for what came before it
    found = placed(time, latitude, longitude, origin=origin, altitude=metres, key=list(key), name=name)
    return replace(found, faults=tuple(faults) + found.faults)
