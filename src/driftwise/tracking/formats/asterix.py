"""Plots out of ASTERIX: categories 048, 034, 001, 002, 021, 062 and 065, raw or in a network capture.

`asterix_records` has the structure (strict, all editions), `asterix_reports` what the items mean and which are read.
"""

from __future__ import annotations

from collections import ChainMap, Counter
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...engine.errors import InputError
from ..plots import Fault, Plots, plots
from ..sites import Site, sensor_name, site_table
from . import asterix_records as structure
from . import pcap
from .asterix_positions import positions
from .asterix_reports import MEANING, NAN, NOWHERE, Message, Report
from .asterix_time import midnight_of, periods, times

DOUBT = {False: 0.1, True: 0.5}  # share of blocks that do not fit from which a stream is refused; True: edition named
TRAILER, EVERY = 64, 0.9  # bytes that a recorder adds to a packet at most; share of the packets that have them
SAMPLE = 200  # blocks that other editions are tried on


class Row(NamedTuple):
    """A report or message with where it came from."""

    stream: tuple
    category: int
    sensor: str
    offset: int
    captured: float  # Unix time of the packet, s; NaN
    body: Report | Message
    octets: bytes


@dataclass(frozen=True)
class Recording:
    """What an ASTERIX recording holds.

    Attributes
    ----------
    reports : tuple of Row
        Target reports whose time is known, in order of the file, each once.
    time : (T,)
        s, of each report.
    sites : dict
        "SAC/SIC" -> `Site`, of the radars that say where they stand (I034/120).
    periods : dict
        "SAC/SIC" -> s, of a turn of the antenna: as told (I034/041, I002/041) or between north crossings.
    counts : dict
        What was met and what was left out: "category 48", "repeated", "without position", "without time" ...
    faults : tuple of Fault
        Blocks and records that do not have the structure they should.
    """

    reports: tuple[Row, ...]
    time: np.ndarray
    sites: dict[str, Site]
    periods: dict[str, float]
    counts: dict[str, int]
    faults: tuple[Fault, ...]


def read_asterix(source, sites=None, day=None, *, origin=None, editions=None, label=None) -> Plots:
    """Return the plots of an ASTERIX recording, metres East and North of one origin.

    Polar plots go through slant range, flight level and the earth's curvature (`polar.place`); a level that is missing
    is the median of the same aircraft's, and where it has none the slant range is taken as range on the ground, which
    is wrong by kilometres near the radar. Time is that of the record; `key` is the 24-bit address, else the Mode A
    code (validated, and not one that many share), else the number of a system track.

    Parameters
    ----------
    source : path or bytes
        Raw blocks, or a pcap or pcapng capture of UDP.
    sites : see `read_sites`, optional
        Where the radars stand, None for one to leave out. One radar alone needs none: its plots are then relative to
        it and `origin` is None.
    day : date or "YYYY-MM-DD", optional
        Of the first record, where times of day become Unix time. A capture knows its day; without either, time is in
        seconds since the midnight before the first record.
    origin : (latitude, longitude), optional
        Degrees, of East = North = 0. The site of the first plot's radar, else the first position.
    editions : dict, optional
        Category -> edition, such as ``{62: "1.16"}``; the newest otherwise. It cannot be read off the bytes: where too
        many blocks do not fit, all plots of that stream are refused, and the fault says which editions fit better.

    label : str, optional
        What faults call the source; its path, or "bytes".

    Raises
    ------
    InputError
        Where the source is not ASTERIX, or several radars are met and the site of one is not known.

    Examples
    --------
    A plot of radar 25/201, 365 km to the north-west:

    >>> block = "300030fdf70219c9356d4da0c5aff1e0020005283c660c10c236d4182001c0780031bc0000400deb07b9582e410020f5"
    >>> found = read_asterix(bytes.fromhex(block))
    >>> found.key[0], found.name[0], found.sensor[0], float(found.altitude[0])
    ('3C660C', 'DLH65A', '25/201', 10058.4)
    >>> found.position.round()
    array([[-124268.,  343975.]])
    """
    data, name = _bytes(source)
    label, given = label or name, site_table(sites)
    recording = decode(data, day=day, editions=editions, label=label)
    return placed(recording, given, origin, label)


def decode(source, *, day=None, editions=None, label=None) -> Recording:
    """Return everything `read_asterix` knows before positions are worked out: reports, sites, periods, counts, faults.

    Parameters
    ----------
    source, day, editions
        As for `read_asterix`.
    """
    data, name = _bytes(source)
    label = label or name
    midnight = midnight_of(day)
    rows, faults, counts = _rows(data, label, editions)
    time = times(rows, midnight)
    messages, kept, seen = [], [], set()
    for k, row in enumerate(rows):
        if isinstance(row.body, Message):
            messages.append((row, time[k]))
            continue
        once = (row.sensor, time[k], row.octets)
        if once in seen:
            counts["repeated"] += 1
        elif time[k] != time[k]:
            counts["without time"] += 1
        else:
            seen.add(once)
            kept.append(k)
            counts["without position"] += row.body.kind == NOWHERE
    places = {row.sensor: row.body.place for row, _ in messages if row.body.place}
    return Recording(
        tuple(rows[k] for k in kept), time[kept],
        {sensor: Site(*place) for sensor, place in places.items() if -1000 <= place[2] <= 20_000},
        periods(messages), {k: v for k, v in sorted(counts.items()) if v}, tuple(faults),
    )  # fmt: skip


def _bytes(source):
    if isinstance(source, bytes | bytearray | memoryview):
        return bytes(source), "bytes"
    path = Path(source)
    if not path.is_file():
        raise InputError(f"source must be a file or bytes; there is no file {str(path)!r}")
    return path.read_bytes(), str(path)


def _runs(data, label, faults):
    """Yield (Unix time, stream, blocks) of each run of blocks; senders of other things than blocks are told once.

    As many bytes after the blocks of nearly every packet of a sender are what its recorder adds: nothing is lost there.
    """
    if not pcap.is_capture(data):
        blocks, fault = _blocks(data, 0, len(data), label)
        faults += fault
        yield NAN, b"", blocks
        return
    speak, lost, tails = Counter[bytes](), [], Counter[tuple[bytes, int]]()
    for packet in pcap.datagrams(data):
        if isinstance(packet, pcap.Trouble):
            faults.append(Fault(label, packet.offset, packet.what))
            continue
        end = packet.offset + len(packet.payload)
        blocks, fault = _blocks(data, packet.offset, end, label)
        lost += [(packet.flow, end - one.offset, one) for one in fault]
        if blocks:
            speak[packet.flow] += 1
            tails.update((packet.flow, end - one.offset) for one in fault)
            yield packet.time, packet.flow, blocks
    strange = Counter(flow for flow, _, _ in lost if flow not in speak)
    for flow, left, fault in lost:
        if flow in speak:
            if not (left <= TRAILER and tails[flow, left] > max(EVERY * speak[flow], 2)):
                faults.append(fault)
        elif flow in strange:
            what = f"{strange.pop(flow)} packets of one sender hold no ASTERIX block; is it other traffic?"
            faults.append(Fault(label, fault.offset, what))


def _blocks(data, i, end, label):
    """Return the blocks of a run of bytes, and faults; each block may be in a frame of its own (length, four bytes)."""
    try:
        return structure.blocks(data, i, end), []
    except structure.Malformed as error:
        try:
            framed, j = [], i
            while j < end:
                size = int.from_bytes(data[j : j + 2], "big")
                if size < 9 or j + size > end:
                    raise structure.Malformed(j, "no frame") from None
                framed += structure.blocks(data, j + 6, j + size)
                j += size
            return framed, []
        except structure.Malformed:
            what = f"{error}; the rest of the {'packet' if i else 'file'} is skipped"
            return error.blocks, [Fault(label, error.offset, what)]


def _rows(data, label, editions):
    """Return the rows, faults and counts of the whole recording, streams that do not fit their edition left out."""
    lists, named = structure.lists(editions), {int(c): str(e) for c, e in (editions or {}).items()}
    newest = {c: list(known)[-1] for c, known in structure.table().items()} | named
    rows: list[Row] = []
    faults: list[Fault] = []
    counts: Counter = Counter()
    met: dict[tuple, list] = {}  # stream -> [(first byte, end, fits) of each block]
    framed = 0
    for captured, flow, blocks in _runs(data, label, faults):
        for category, first, last in blocks:
            framed += 1
            if category not in lists:
                counts[f"blocks of category {category}, not read"] += 1
                continue
            stream, fits = (flow, category), True
            try:
                found = structure.records(lists[category], data, first, last)
            except structure.Malformed as error:
                faults.append(Fault(label, error.offset, f"category {category}: {error}; its block is skipped"))
                met.setdefault(stream, []).append((first, last, False))
                continue
            counts[f"category {category}"] += len(found)
            for spec, at, start, stop in found:
                try:
                    if "010" not in at:
                        raise structure.Malformed(start, "no data source (I010)")
                    body = MEANING[category](data, spec, at, newest[category])
                except structure.Malformed as error:
                    fits = False
                    what = f"category {category}: {error}; the record is skipped"
                    faults.append(Fault(label, error.offset, what))
                    continue
                if isinstance(body, str):
                    counts[body] += 1
                    continue
                sensor = sensor_name(data[at["010"]], data[at["010"] + 1])
                rows.append(Row(stream, category, sensor, start, captured, body, data[start:stop]))
            met.setdefault(stream, []).append((first, last, fits))
    if not framed:
        why = faults[0].what if faults else "it has no bytes" if not data else "it has no UDP packets"
        raise InputError(f"{label} holds no ASTERIX block: {why}; is it raw ASTERIX, or a capture of it?")
    faults.sort(key=lambda fault: fault.offset)
    refused = {}
    for stream, blocks in met.items():
        bad = sum(not fits for *_, fits in blocks)
        if bad > DOUBT[stream[1] in named] * len(blocks):
            refused[stream] = _refusal(data, stream[1], newest[stream[1]], blocks, bad)
            faults.insert(0, Fault(label, blocks[0][0] - 3, refused[stream]))  # what matters comes first
    if refused:
        counts["in streams refused"] = sum(row.stream in refused for row in rows)
        rows = [row for row in rows if row.stream not in refused]
    return rows, faults, counts


def _refusal(data, category, edition, blocks, bad):
    """Return what is said of a stream whose blocks do not fit: how many, and which editions fit how many."""
    some, fit = blocks[:SAMPLE], {}
    for other in structure.table()[category]:
        lists, fit[other] = structure.lists({category: other}), 0
        for first, last, _ in some:
            try:
                for spec, at, _, _ in structure.records(lists[category], data, first, last):
                    MEANING[category](data, spec, at, other)
                fit[other] += 1
            except structure.Malformed:
                pass
    best = max(fit.values())
    better = [e for e, n in fit.items() if n == best] if best > fit[edition] else []
    advice = (
        f"edition {' or '.join(better)} fits {best} of {len(some)}: editions={{{category}: {better[-1]!r}}}"
        if better
        else f"none of the editions known ({', '.join(fit)}) fits better"
    )
    return (
        f"category {category}: {bad} of {len(blocks)} blocks do not fit edition {edition}, so the others cannot be "
        f"trusted and all are refused; {advice}"
    )


def placed(recording, given, origin, label) -> Plots:
    """Return the plots of a recording, radars standing where ``given`` says, else where they say themselves."""
    left = {sensor for sensor, site in given.items() if site is None}
    chosen = [k for k, row in enumerate(recording.reports) if row.body.kind != NOWHERE and row.sensor not in left]
    rows = [recording.reports[k] for k in chosen]
    position, covariance, origin, lost = positions(rows, ChainMap(given, recording.sites), origin)
    faults = recording.faults + tuple(Fault(label, rows[k].offset, what) for k, what in lost)
    good = np.isfinite(position).all(axis=1)
    rows = [row for row, keep in zip(rows, good) if keep]
    return plots(
        recording.time[chosen][good], position[good], covariance=covariance[good],
        altitude=[row.body.altitude for row in rows], key=[row.body.key for row in rows],
        name=[row.body.name for row in rows], sensor=[row.sensor for row in rows], origin=origin, faults=faults,
    )  # fmt: skip
