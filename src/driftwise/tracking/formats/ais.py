"""Plots from the automatic identification system (AIS) of ships."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from ...engine.errors import InputError
from ..placed import placed, repeats
from ..plots import Fault, Plots
from .logs import sentences, stamped

_TAGGED = re.compile(r"\\[^\\]*\bc:(\d{9,16})[^\\]*\\")
_UNIX = re.compile(r"(?<![\w.])(\d{10}(?:\.\d+)?|\d{13})(?![\w.])")
_STAMP = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d([.,]\d+)?)?\s*(Z|[+-]\d\d:?\d\d)?")
SAME = 10.0  # s: an AIS payload again within this time is the same transmission, heard by another receiver
MOVING = (1, 2, 3, 9, 18, 19, 27)  # types of AIS messages with the position of a ship, or of an aircraft that searches


def read_ais(data: bytes, title: str, *, origin=None) -> Plots:
    r"""Return the plots of an AIS log, AIVDM or AIVDO sentences, one key per MMSI.

    The time of a sentence is that of its tag block (``\c:1616844000*5A\``), or a Unix or ISO 8601 time before or
    after it.

    Parameters
    ----------
    data : bytes
    title : str
        What to call the file in faults.
    origin : (latitude, longitude), optional
    """
    try:
        import pyais
    except ImportError:
        raise ImportError(
            "AIS messages are decoded by pyais, which is not installed: pip install driftwise[tracking]"
        ) from None
    rows, away, untimed = [], [], []
    names: dict[str, str] = {}
    last: dict[str, tuple] = {}
    faults: list[Fault] = []
    for number, time, parts in _messages(data, title, faults):
        try:
            message: dict[str, Any] = pyais.decode(*(part.encode() for part in parts)).asdict()
        except Exception as error:  # the library raises whatever its bits lead to
            faults.append(Fault(title, number, f"the message cannot be decoded: {type(error).__name__} {error}"[:120]))
            continue
        who, kind = f"{message.get('mmsi') or 0:09d}", message.get("msg_type")
        if name := (message.get("shipname") or "").strip(" @"):
            names[who] = name
        payload = tuple(part.split(",")[5] for part in parts)
        if kind not in MOVING or message.get("lat") is None or message.get("lon") is None:
            if kind in MOVING:
                faults.append(Fault(title, number, f"the message of type {kind} is cut before its position"))
        elif abs(message["lat"]) > 90 or abs(message["lon"]) > 180:  # 91 and 181 are "not available"
            away.append(number)
        elif time is None:
            untimed.append(number)
        elif who in last and last[who][0] == payload and abs(time - last[who][1]) < SAME:
            continue
        else:
            last[who] = payload, time
            high = message.get("alt") if kind == 9 else None  # m; 4095 is "not available"
            rows.append((time, message["lat"], message["lon"], np.nan if high in (None, 4095) else high, who))
    if untimed and not rows:
        raise InputError(
            f"{title}: the AIS sentences have no times; write the time of reception (Unix s, or ISO 8601) before each, "
            "or a tag block \\c:1616844000*5A\\"
        )
    for lines, what in ((away, "positions not available"), (untimed, "positions without a time")):
        if lines:
            faults.append(Fault(title, lines[0], f"{what}: {len(lines)}, this is the first"))
    time, latitude, longitude, altitude, key = zip(*rows) if rows else ((),) * 5
    name = [names.get(who, "") for who in key]
    found = placed(time, latitude, longitude, origin=origin, altitude=altitude, key=list(key), name=name)
    twice, _ = repeats(found.time, found.position, found.key)
    return replace(found[~twice], faults=tuple(faults) + found.faults)


def _messages(data, title, faults):
    """Yield (line, time or None, sentences) of whole AIS messages; the time is that of the first part that has one."""
    waiting: dict[tuple, list] = {}
    for number, line, sentence in sentences(data, title, faults, "AIS", comments="#%"):
        fields = sentence[1].split(",")
        if fields[0][2:] not in ("VDM", "VDO"):
            continue
        if len(fields) != 7 or not (fields[1].isdigit() and fields[2].isdigit()):
            faults.append(Fault(title, number, f"the sentence has not the fields of AIS: {line[:60]!r}"))
            continue
        time, total, part = _received(line, sentence.span()), int(fields[1]), int(fields[2])
        if total == 1:
            yield number, time, ["!" + sentence[1] + "*" + sentence[2]]
            continue
        where = (fields[0], fields[3], fields[4], total)
        if part == 1:
            waiting[where] = [number, time]
        held = waiting.get(where)
        if held is None or len(held) != part + 1:
            waiting.pop(where, None)
            faults.append(Fault(title, number, f"part {part} of {total} without the part before it"))
            continue
        held[1] = time if held[1] is None else held[1]
        held.append("!" + sentence[1] + "*" + sentence[2])
        if part == total:
            del waiting[where]
            yield held[0], held[1], held[2:]
    faults += [Fault(title, held[0], "the message lacks its last part") for held in waiting.values()]


def _received(line, span):
    """Return the time (Unix s) written beside a sentence, or None."""
    if tagged := _TAGGED.search(line[: span[0]]):
        value = float(tagged[1])
        return value / 1e3 if value > 1e11 else value
    for text in (line[: span[0]], line[span[1] :]):
        if stamp := _STAMP.search(text):
            try:
                return stamped(stamp[0].strip())
            except ValueError:
                continue
        if unix := _UNIX.search(text):
            value = float(unix[1])
            return value / 1e3 if value > 1e11 else value
    return None
