"""Plots from files of any kind: what a file is, is seen from its content."""

from __future__ import annotations

import glob
import os
import re
import sys
import zlib
from dataclasses import replace
from pathlib import Path

from ..engine.errors import InputError
from ..tables.source import bounded, refuse_missing
from ..tables.source import title_of as named
from .columns import Column
from .merge import joined
from .plots import Fault, Plots, checked

LARGEST = 4 << 30  # bytes a compressed file may grow to
RATIO, SMALL = 100, 64 << 20  # beyond so many bytes it may not grow by more: logs grow by 3 to 30
PIECE = 1 << 16  # packed bytes taken at a time: at most 64 MB unpacked
PCAP = (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d", b"\x0a\x0d\x0d\x0a")
ASTERIX_NAMES = (".raw", ".ast", ".asterix", ".asx", ".pcap", ".pcapng")
_AIS = re.compile(rb"[!$][A-Z]{2}VD[MO],\d")
_NMEA = re.compile(rb"\$[A-Z]{2}(GGA|RMC|GLL|GSA|GSV|ZDA|VTG),")
_SENTENCE = re.compile(rb"[!$][A-Z][A-Z0-9]{3,},[^*]*\*[0-9A-Fa-f]{2}")
_FRAME = re.compile(rb"(^|[\s,;*@])([0-9A-Fa-f]{12})?[0-9A-Fa-f]{14}([0-9A-Fa-f]{14})?;?\s*$")


def read_plots(path, *, site=None, sites=None, origin=None, columns=None, progress=None) -> Plots:
    """Return the plots in a file, or in several, in order of time.

    ASTERIX (raw or pcap), Mode S and ADS-B frames, CSV, JSON, GeoJSON, Parquet, GPS logs (NMEA, GPX) and AIS are told
    apart by their content; any of them may be packed by gzip. Columns are recognised by their names, see
    `recognise_plots`.

    Parameters
    ----------
    path : file name, pattern ("radar*.csv"), "-" for standard input, data frame, mapping of columns, or a list of them
        Several files become one set of plots around the origin of the first.
    site : (latitude, longitude) or (latitude, longitude, height m), optional
        Of the radar whose ranges and azimuths a table holds.
    sites : see `driftwise.tracking.sites.read_sites`, optional
        Of the radars of ASTERIX files, or of a table with ranges of several.
    origin : (latitude, longitude), optional
        Degrees, where East = North = 0; the first position if not given.
    columns : dict, optional
        Which column plays which part, where its name does not tell: ``{"time": "t", "east": ("x", "km")}``.
    progress : function of a number from 0 to 1, optional
        Called as files are read.

    Raises
    ------
    InputError
        Where a file is none of these, lacks a time or a position, or holds no plot at all.

    Notes
    -----
    Bad at: positions half a continent apart, as East and North are on one tangent plane; and at telling a mere number
    of seconds from a time of day. Whole files are held in memory. What could not be used is in ``plots.faults``.

    Examples
    --------
    >>> from driftwise.tracking.read import read_plots
    >>> table = {"time": [0, 4, 8], "x_km": [1.0, 1.2, 1.4], "y_km": [0.0, 0.1, None], "icao24": ["4baa5f"] * 3}
    >>> plots = read_plots(table)
    >>> plots.position.tolist(), plots.key.tolist(), plots.faults[0].what
    ([[1000.0, 0.0], [1200.0, 100.0]], ['4BAA5F', '4BAA5F'], 'rows without a position: 1, this is the first')
    """
    if origin is not None:
        origin = checked(origin)
    parts: list[Plots] = []
    asked = files_of(path)
    for number, one in enumerate(asked):
        data, title, faults = read_bytes(one)
        shared = origin if origin is not None or not parts else parts[0].origin
        parts.append(_read(data, title, site=site, sites=sites, origin=shared, columns=columns)[0])
        parts[-1] = replace(parts[-1], faults=(*faults, *parts[-1].faults))
        if progress is not None:
            progress((number + 1) / len(asked))
    found = joined(parts)
    if not len(found):
        why = (
            f"; the first of {len(found.faults)} records that could not be used, at {found.faults[0].offset}: "
            f"{found.faults[0].what}"
            if found.faults
            else ""
        )
        raise InputError(f"{title_of(asked[0])}: no plot has a time and a position{why}")
    return found


def recognise_plots(path, columns=None) -> dict[str, Column]:
    """Return which column of a table is taken for what, and in which unit; empty where a file is no table.

    Parameters
    ----------
    path : file name, data frame or mapping of columns
    columns : dict, optional
        As for `read_plots`.

    Examples
    --------
    >>> from driftwise.tracking.read import recognise_plots
    >>> table = {"ts": [1626098400000], "lat": [51.5], "lon": [-0.4], "geoaltitude": [10843.0], "hex": ["3c4591"]}
    >>> {part: tuple(column) for part, column in recognise_plots(table).items()}  # doctest: +NORMALIZE_WHITESPACE
    {'time': ('ts', 'Unix ms'), 'latitude': ('lat', 'deg'), 'longitude': ('lon', 'deg'),
     'altitude': ('geoaltitude', 'm'), 'key': ('hex', '')}
    """
    data, title, _ = read_bytes(path)
    return _read(data, title, columns=columns)[1]


def files_of(path) -> list:
    """Return the files, frames or mappings that ``path`` names."""
    if isinstance(path, list | tuple):
        if not path:
            raise InputError("path is an empty list; give at least one file")
        return [one for part in path for one in files_of(part)]
    if isinstance(path, str | os.PathLike) and not os.path.exists(path) and re.search(r"[*?\[]", str(path)):
        names = sorted(glob.glob(str(path), recursive=True))
        if not names:
            raise InputError(f"no file matches {path}")
        return names
    return [path]


def title_of(path) -> str:
    """Return what to call a file in messages."""
    return named(path) if isinstance(path, str | os.PathLike) else "the table"


def read_bytes(path):
    """Return the bytes of a file, unpacked (a data frame or mapping as it is), what to call it, and faults."""
    title = title_of(path)
    if not isinstance(path, str | os.PathLike):
        return path, title, []
    if title == "standard input":
        data = bounded(sys.stdin.buffer, title, LARGEST)
    else:
        refuse_missing(path)
        with open(path, "rb") as file:
            data = bounded(file, title, LARGEST)
    faults: list[Fault] = []
    if data[:2] == b"\x1f\x8b":
        data, faults = unpacked(data, title)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", "replace").encode()
    if not data.strip(b"\xef\xbb\xbf \t\r\n"):
        raise InputError(f"{title} is empty. Was the recording ever started?")
    return data, title, faults


def unpacked(data: bytes, title: str) -> tuple[bytes, list[Fault]]:
    """Return what is packed by gzip, in one part or several, and faults: of a file that is cut, whole lines."""
    out, size, at, faults = [], 0, 0, []
    while data[at : at + 2] == b"\x1f\x8b":
        unpack = zlib.decompressobj(wbits=31)
        while at < len(data) and not unpack.eof:
            part = data[at : at + PIECE]
            try:
                out.append(unpack.decompress(part))
            except zlib.error as error:
                raise InputError(f"{title}: the gzip file is damaged ({error}). Was it copied as text?") from None
            at += len(part) - len(unpack.unused_data)
            size += len(out[-1])
            most = min(LARGEST, max(SMALL, RATIO * at))
            if size > most:
                why = "split it" if most == LARGEST else f"{RATIO} times its size, as no log does: what is in it?"
                raise InputError(f"{title} unpacks to more than {most >> 20} MB; {why}")
        if not unpack.eof:
            faults.append(Fault(title, at, "the gzip file is cut short here; whole lines before it are read"))
    whole = b"".join(out)
    if faults and not whole:
        raise InputError(f"{title}: nothing is left in the gzip file, which is cut short. Was the copy interrupted?")
    return whole[: whole.rfind(b"\n") + 1] or whole if faults else whole, faults


def kind_of(data: bytes, title: str) -> str:
    """Return what a file is: "ASTERIX", "Parquet", "JSON", "GPX", "AIS", "NMEA", "Mode S" or "CSV"."""
    if data[:4] == b"PAR1":
        return "Parquet"
    if data[:4] in PCAP:
        return "ASTERIX"
    head = data[: 1 << 16].removeprefix(b"\xef\xbb\xbf").lstrip()
    extension = Path(title.removesuffix(".gz")).suffix.lower()
    if b"\x00" in head or sum(byte < 32 and byte not in b"\t\n\r\f" for byte in head) > 0.02 * len(head):
        if head[:2] == b"PK":
            raise InputError(
                f"{title} is a zip archive or an Excel workbook; export the sheet as CSV and pass that file"
            )
        if blocks(data) or extension in ASTERIX_NAMES:
            return "ASTERIX"
        raise InputError(f"{title} is binary, but neither ASTERIX, a capture of packets, nor Parquet")
    if head[:1] in (b"{", b"["):
        return "JSON"
    if head[:1] == b"<":
        if b"<gpx" in head:
            return "GPX"
        raise InputError(f"{title} is XML or a web page, but not GPX")
    lines = [line.strip() for line in head.splitlines()[:200] if line.strip()]
    for pattern, kind in ((_AIS, "AIS"), (_NMEA, "NMEA"), (_FRAME, "Mode S")):
        if 3 * sum(bool(pattern.search(line)) for line in lines) > len(lines):
            return kind
    told = sum(bool(_SENTENCE.search(line)) for line in lines)
    if 3 * told > len(lines) and any(_NMEA.search(line) for line in lines):  # a bus on which a receiver is one of many
        return "NMEA"
    return "CSV"


def blocks(data: bytes, most: int = 8) -> bool:
    """Whether bytes are a chain of ASTERIX blocks: a category, and a length that leads to the next."""
    at = 0
    for count in range(most):
        if at == len(data):
            return count > 0
        length = int.from_bytes(data[at + 1 : at + 3])
        if not data[at] or length < 4 or at + length > len(data):
            return False
        at += length
    return True


def _read(data, title: str, *, site=None, sites=None, origin=None, columns=None) -> tuple[Plots, dict[str, Column]]:
    from .formats.ais import read_ais
    from .formats.logs import read_gpx, read_nmea
    from .formats.modes import is_frames, read_frames, read_lines
    from .records import json_records, record_table
    from .tables import csv_table, frames_of, memory_table, parquet_table, read_table

    def of_table(table):
        if frames := frames_of(table, columns):
            return read_frames(frames[0], frames[1], title, origin=origin, faults=table.faults), {}
        return read_table(table, site=site, sites=sites, origin=origin, columns=columns)

    if not isinstance(data, bytes):
        return of_table(memory_table(data, title))
    kind = kind_of(data, title)
    if kind == "CSV":
        return of_table(csv_table(data, title))
    if kind == "Parquet":
        return of_table(parquet_table(data, title))
    if kind == "JSON":
        records, at, faults = json_records(data, title)
        if is_frames(records):
            return read_frames(records, at, title, origin=origin, faults=faults), {}
        return of_table(record_table(records, at, title, faults))
    if kind == "ASTERIX":
        return _asterix(data, title, sites, origin), {}
    reader = {"Mode S": read_lines, "AIS": read_ais, "NMEA": read_nmea, "GPX": read_gpx}[kind]
    return reader(data, title, origin=origin), {}


def _asterix(data, title, sites, origin) -> Plots:
    from .formats.asterix import read_asterix

    try:
        found = read_asterix(data, sites=sites, origin=origin)
    except InputError as error:
        raise InputError(f"{title}: {str(error).removeprefix('bytes ')}") from None
    return replace(found, faults=tuple(replace(fault, source=title) for fault in found.faults))
