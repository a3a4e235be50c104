"""Plots from the logs of GPS receivers: NMEA 0183 and GPX."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, date, datetime
from typing import cast
from xml.etree import ElementTree

import numpy as np

from ...engine.errors import InputError
from ...tables.clock import DAY, TimeOfDay
from ..placed import outside, placed, repeats
from ..plots import Fault, Plots, own_name

SENTENCE = re.compile(r"[$!]([A-Z][A-Z0-9]{3,},[^*$!]*)\*([0-9A-Fa-f]{2})")


NO_FIX = (None, None, None, None, None)


def checksum(body: str) -> int:
    """Return the checksum of an NMEA 0183 sentence: the exclusive or of what lies between ``$`` and ``*``.

    >>> f"{checksum('GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,'):02X}"
    '47'
    """
    value = 0
    for character in body:
        value ^= ord(character)
    return value


def text_lines(data: bytes):
    for number, line in enumerate(data.decode("utf-8-sig", "replace").splitlines(), 1):
        if line.strip():
            yield number, line.strip()


def sentences(data, title, faults, kind, comments=""):
    """Yield (line number, line, match) of the sentences whose checksum holds; other lines are faults, or comments."""
    for number, line in text_lines(data):
        sentence = SENTENCE.search(line)
        if sentence and checksum(sentence[1]) == int(sentence[2], 16):
            yield number, line, sentence
        elif line[:1] not in tuple(comments):
            what = "the checksum fails" if sentence else f"no {kind} sentence with a checksum"
            faults.append(Fault(title, number, f"{what}: {line[:60]!r}"))


def read_nmea(data: bytes, title: str, *, origin=None) -> Plots:
    """Return the plots of a GPS log of NMEA 0183 sentences: GGA and RMC, one plot an instant.

    They are the receiver's own positions, and its key is the name of the file. The day comes from RMC or ZDA; without
    one, times are seconds of the first day. A sentence whose checksum fails is a `Fault`; fixes of quality 0 or status
    V are counted.

    Parameters
    ----------
    data : bytes
    title : str
        What to call the file in faults.
    origin : (latitude, longitude), optional
    """
    rows: list[list] = []  # time of day, latitude, longitude, altitude, day, line
    faults: list[Fault] = []
    void = []
    for number, line, sentence in sentences(data, title, faults, "NMEA"):
        fields = sentence[1].split(",")
        try:
            fix = _fix(fields[0][2:], fields)
        except (ValueError, IndexError):
            faults.append(Fault(title, number, f"the sentence cannot be read: {line[:60]!r}"))
            continue
        if fix is None:
            continue
        tod, latitude, longitude, altitude, day = fix
        if latitude is None and day is None:
            void.append(number)
        elif rows and rows[-1][0] == tod:  # GGA and RMC of one instant: the former has the height, the latter the day
            rows[-1][1:5] = [new if old is None else old for old, new in zip(rows[-1][1:5], fix[1:])]
        else:
            rows.append([tod, latitude, longitude, altitude, day, number])
    if void:
        faults.append(Fault(title, void[0], f"sentences without a fix: {len(void)}, this is the first"))
    time, latitude, longitude, altitude = (np.array([row[j] for row in rows], float) for j in range(4))
    known = np.isfinite(latitude)
    time = _dated(time, [row[4] for row in rows])
    key = [own_name(title)] * int(known.sum())
    found = placed(time[known], latitude[known], longitude[known], origin=origin, altitude=altitude[known], key=key)
    return replace(found, faults=tuple(faults) + found.faults)


def _fix(kind, fields):
    """Return (time of day, latitude, longitude, altitude, day as Unix s) of a sentence, None where it does not tell."""
    if kind == "GGA":
        if fields[6] in ("", "0"):
            return NO_FIX
        altitude = float(fields[9]) if fields[9] else None
        return _of_day(fields[1]), _angle(fields[2], fields[3], 90), _angle(fields[4], fields[5], 180), altitude, None
    if kind == "RMC":
        if fields[2] != "A":
            return NO_FIX
        day = _day(2000 + int(fields[9][4:6]), int(fields[9][2:4]), int(fields[9][:2])) if fields[9] else None
        return _of_day(fields[1]), _angle(fields[3], fields[4], 90), _angle(fields[5], fields[6], 180), None, day
    if kind == "ZDA" and fields[4]:
        return _of_day(fields[1]), None, None, None, _day(int(fields[4]), int(fields[3]), int(fields[2]))
    return None


def _of_day(text) -> float:
    seconds = float(text[4:])
    if not (text[:4].isdigit() and int(text[:2]) < 24 and int(text[2:4]) < 60 and 0 <= seconds < 61):
        raise ValueError(text)
    return 3600.0 * int(text[:2]) + 60.0 * int(text[2:4]) + seconds


def _angle(text, side, most) -> float:
    """Return degrees of (d)ddmm.mmmm and N, S, E or W."""
    whole, minutes = divmod(float(text), 100.0)
    angle = whole + minutes / 60
    if minutes >= 60 or not 0 <= angle <= most or side not in ("NS" if most == 90 else "EW") or not side:
        raise ValueError(text)
    return -angle if side in "SW" else angle


def _day(year, month, day) -> float:
    return (date(year, month, day) - date(1970, 1, 1)).days * DAY


def _dated(time, days):
    """Return times of day on the days that some of them tell; those before the first take its."""
    whole = TimeOfDay(goes_back=True).push(time)
    offset, start = np.full(len(whole), np.nan), np.nan
    for k, day in enumerate(days):
        if day is not None:
            start = day - DAY * round((whole[k] - time[k]) / DAY)  # the day on which this count of midnights began
        offset[k] = start
    known = offset[np.isfinite(offset)]
    return whole + np.where(np.isfinite(offset), offset, known[0]) if known.size else whole


def read_gpx(data: bytes, title: str, *, origin=None) -> Plots:
    """Return the plots of a GPX file: the points of its tracks, whose names are their keys.

    Points without a time are counted as a `Fault`. A file that is cut gives what came before. Document types and
    entities, which could make a small file very large, are refused.

    Parameters
    ----------
    data : bytes
    title : str
        What to call the file in faults.
    origin : (latitude, longitude), optional
    """
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InputError(
            f"{title}: the GPX file declares a document type or entities, which no GPS writes; remove them"
        )
    parser: ElementTree.XMLPullParser = ElementTree.XMLPullParser(("start", "end"))
    rows, faults, missing, track = [], [], 0, 0
    names: dict[int, str] = {}
    try:
        inside: list[str] = []
        for start in range(0, len(data), 1 << 16):
            parser.feed(data[start : start + (1 << 16)])
            for event, element in cast("list[tuple[str, ElementTree.Element]]", parser.read_events()):
                tag = element.tag.rpartition("}")[2]
                if event == "start":
                    inside.append(tag)
                    track += tag == "trk"
                    continue
                inside.pop()
                if tag == "name" and inside[-1:] == ["trk"]:
                    names[track] = (element.text or "").strip()
                elif tag == "trkpt":
                    row = _point(element)
                    rows += [(*row, track)] if row else []
                    missing += row is None
                    element.clear()
        parser.close()
    except ElementTree.ParseError as error:
        faults.append(Fault(title, error.position[0], f"the GPX file cannot be read any further: {error}"))
    if missing:
        faults.append(Fault(title, 0, f"points without a time or a position: {missing}"))
    time, latitude, longitude, altitude, number = (np.array(part) for part in zip(*rows)) if rows else [np.empty(0)] * 5
    if rows:
        twice, _ = repeats(time, np.stack([latitude, longitude], axis=-1), number.astype(str))
        time, latitude, longitude, altitude, number = (c[~twice] for c in (time, latitude, longitude, altitude, number))
        if twice.any():
            faults.append(Fault(title, 0, f"points at a time that their track has already: {twice.sum()}"))
    key = [names.get(int(n)) or (f"track {n}" if track > 1 else "") for n in number.tolist()]
    found = placed(time, latitude, longitude, origin=origin, altitude=altitude, key=key)
    return replace(found, faults=tuple(faults) + found.faults)


def _point(element):
    """Return (Unix s, latitude, longitude, altitude) of a track point, or None."""
    known = {child.tag.rpartition("}")[2]: (child.text or "").strip() for child in element}
    try:
        latitude, longitude = float(element.get("lat", "")), float(element.get("lon", ""))
        altitude = float(known["ele"]) if known.get("ele") else np.nan
        time = stamped(known.get("time", ""))
    except ValueError:
        return None
    return None if outside(np.array([latitude]), np.array([longitude]))[0] else (time, latitude, longitude, altitude)


def stamped(text) -> float:
    stamp = datetime.fromisoformat(text.replace(",", "."))
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
