"""Plots of what comes over a wire: ASTERIX, Beast, SBS, AVR, AIS and NMEA sentences, lines of CSV or JSON.

Binary kinds are turned into what the readers of files know: datagrams of ASTERIX into a capture, frames and sentences
into lines with the time at which they came.
"""

from __future__ import annotations

import re
import struct
from collections import deque
from collections.abc import Sequence

from ..engine.errors import InputError
from .live_plots import LivePlots, without
from .merge import joined
from .plots import Fault, Plots
from .read import blocks
from .sites import site_table
from .sockets import Packet

PAST, MINUTE = 400, 60.0  # datagrams of ASTERIX, and s, from which altitudes, days and sites are known
CALLED = 3000  # aircraft whose call sign is remembered
LONGEST_LINE = 1 << 14  # bytes: a longer line is none
ENOUGH = 4  # bytes that tell what a stream is
LENGTHS = {0x31: 2, 0x32: 7, 0x33: 14, 0x34: 14}  # bytes of a Beast frame behind time and signal, by its type
ESCAPE = 0x1A
SBS_HEAD = b"timestamp,latitude,longitude,altitude_ft,icao24,callsign\n"
_SBS = re.compile(rb"^MSG,\d,")
_AVR = re.compile(rb"^[*@](?:[0-9A-Fa-f]{12})?([0-9A-Fa-f]{28}|[0-9A-Fa-f]{14});$")
_SENTENCE = re.compile(rb"[!$][A-Z][A-Z0-9]{3,},")
_STAMPED = re.compile(rb"\bc:\d{9,16}|(?<![\w.])\d{10}(?:\.\d+)?(?![\w.])|\d{4}-\d\d-\d\dT")
CAPTURE = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 1 << 16, 101)  # of raw IP packets


class Wire:
    """Turns packets into `Plots`.

    Parameters
    ----------
    title : what the source is called in faults
    is_stream : pieces may be cut anywhere; else each packet is whole
    site, sites : of radars, as `read_plots` takes them
    """

    def __init__(self, title: str, is_stream: bool, site=None, sites=None):
        self.title, self.is_stream, self.sites = title, is_stream, sites
        self.kind = ""  # of a stream: "capture", "Beast" or "lines"
        self.lines = LivePlots(title, site)
        self._rest = b""
        self._is_left_out = False
        self._past: deque[tuple[float, bytes]] = deque(maxlen=PAST)
        self._called: dict[bytes, bytes] = {}
        self._has_head = self._has_plots = False
        self._capture = b""  # head of a capture that comes through a pipe

    def take(self, packets: Sequence[Packet]) -> Plots | None:
        """Return the plots of what came; None where there is nothing yet."""
        packets = [packet for packet in packets if packet.data]
        if not packets:
            return None
        if not self.is_stream:
            return self._datagrams(packets)
        if not self.kind:
            first = self._rest + packets[0].data
            if len(first) < ENOUGH and not first.endswith(b"\n"):
                self._rest = first
                return self.take(packets[1:])
            self.kind = self._recognised(first)
        if self.kind == "capture":
            return self._captured(b"".join(packet.data for packet in packets))
        if self.kind == "Beast":
            return self._read(b"".join(self._frames(packet) for packet in packets))
        return self._read(b"".join(self._stamped(packet) for packet in packets))

    def end(self, time: float) -> Plots | None:
        """Return the plots of a last line that has no end, once a stream has."""
        return self.take([Packet(time, b"\n")]) if self.kind == "lines" else None

    def cut(self) -> None:
        """Leave out what was cut off where a connection was lost: what the next one brings does not go on with it."""
        if self._rest:
            self.lines.leave_out("cut off where the connection was lost")
        self._rest, self._capture, self._is_left_out = b"", b"", False

    def _recognised(self, data: bytes) -> str:
        from .formats.pcap import is_capture

        if is_capture(data):
            return "capture"
        return "Beast" if data[0] == ESCAPE and len(data) > 1 and data[1] in LENGTHS else "lines"

    def _read(self, lines: bytes) -> Plots | None:
        """Return the plots of lines; what they are is looked at anew where they turn out to be nothing."""
        try:
            return self.lines.take(lines)
        except InputError as error:
            before, self.lines = self.lines, LivePlots(self.title, self.lines.site)
            self.lines.origin = before.origin
            if self.is_stream and before.origin is None:
                raise  # nothing has ever come that is a plot
            return self.lines.nothing(str(error))

    def _datagrams(self, packets: Sequence[Packet]) -> Plots | None:
        """Return the plots of datagrams, each of which may be anything: anybody can send one."""
        binary = [packet for packet in packets if blocks(packet.data, most=64)]
        text = [packet for packet in packets if b"\0" not in packet.data and not blocks(packet.data, most=64)]
        if strange := len(packets) - len(binary) - len(text):
            self.lines.leave_out_many(strange, "a datagram that is neither a chain of ASTERIX blocks nor text")
        found = self._read(b"".join(self._stamped(packet) for packet in text)) if text else None
        if binary:
            more = self._asterix([(packet.time, packet.data) for packet in binary])
            try:
                found = more if found is None else joined([found, more])
            except InputError as error:  # some on earth, some in metres from nowhere
                self.lines.leave_out(str(error))
                found = more
        return self.lines.nothing() if found is None and strange else found

    # --- binary --------------------------------------------------------------------------------------------

    def _asterix(self, datagrams: list[tuple[float, bytes]]) -> Plots:
        """Return the plots of datagrams; the ones before say which day it is, how high an aircraft is, who is where."""
        before = [one for one in self._past if one[0] >= datagrams[0][0] - MINUTE]
        self._past.extend(datagrams)
        return self._new(capture([*before, *datagrams]), capture(before) if before else b"")

    def _new(self, data: bytes, before: bytes) -> Plots:
        """Return the plots of a capture less those of its beginning."""
        from .formats.asterix import read_asterix

        options: dict = dict(sites=self.sites, origin=self.lines.origin, label=self.title)
        try:
            found = read_asterix(data, **options)
        except InputError as error:
            if "SAC/SIC" not in str(error):
                return self.lines.nothing(str(error))
            if not self._has_plots:
                raise  # at the beginning it can be told where a radar stands; later one that nobody knows is left out
            lacking = re.findall(r"\b\d{1,3}/\d{1,3}\b", str(error).partition("missing: ")[2].partition(" (SAC")[0])
            self.sites = {**site_table(self.sites), **dict.fromkeys(lacking)}
            return self._new(data, before) if lacking else self.lines.nothing(str(error))
        self._has_plots = self._has_plots or len(found) > 0
        if found.origin is not None:
            self.lines.origin = options["origin"] = found.origin
        if before:
            try:
                found = without(found, read_asterix(before, **options))
            except InputError:
                pass
        return found

    def _captured(self, data: bytes) -> Plots | None:
        """Return the plots of the whole packets of a classic capture that comes in pieces."""
        from .formats.pcap import CLASSIC

        self._rest += data
        if not self._capture:
            if len(self._rest) < 24:
                return None
            if self._rest[:4] not in CLASSIC:
                raise InputError(f"{self.title}: a pipe of pcapng is not read; write classic pcap (tcpdump -w - does)")
            self._capture, self._rest = self._rest[:24], self._rest[24:]
        order, at, whole = CLASSIC[self._capture[:4]][0], 0, []
        while at + 16 <= len(self._rest):
            size = struct.unpack_from(order + "I", self._rest, at + 8)[0]
            if size > 1 << 18:
                raise InputError(f"{self.title}: a packet of {size} bytes; the capture is damaged")
            if at + 16 + size > len(self._rest):
                break
            whole.append(self._rest[at : at + 16 + size])
            at += 16 + size
        self._rest = self._rest[at:]
        if not whole:
            return None
        before = [packet for _, packet in self._past]
        self._past.extend((0.0, packet) for packet in whole)
        head = self._capture
        return self._new(head + b"".join([*before, *whole]), head + b"".join(before) if before else b"")

    def _frames(self, packet: Packet) -> bytes:
        """Return a line for each Beast frame: 1a, type, ticks (6 bytes), signal, frame; a 1a within is doubled."""
        data, lines, start = self._rest + packet.data, [], -1
        at = data.find(ESCAPE)
        while 0 <= at < len(data) - 1:
            if data[at + 1] == ESCAPE:
                at = data.find(ESCAPE, at + 2)
                continue
            if start >= 0:
                lines.append(_beast(packet.time, data[start:at]))
            start, at = at, data.find(ESCAPE, at + 2)
        self._rest = data[max(start, 0) :]
        if start >= 0 and data[start + 1] in LENGTHS:
            plain = self._rest[:2] + self._rest[2:].replace(b"\x1a\x1a", b"\x1a")
            if len(plain) == 9 + LENGTHS[data[start + 1]] and not self._rest.endswith(b"\x1a"):  # it is whole
                lines.append(_beast(packet.time, self._rest))
                self._rest = b""
        if len(self._rest) > LONGEST_LINE:
            self._rest = b""
            self.lines.leave_out("bytes without a Beast frame")
        return b"".join(lines)

    # --- text ----------------------------------------------------------------------------------------------

    def _stamped(self, packet: Packet) -> bytes:
        """Return the whole lines of a packet, each with the time at which it came where it says none."""
        data = self._rest + packet.data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        if not self.is_stream and not data.endswith(b"\n"):
            data += b"\n"
        if self._is_left_out:
            _, end, data = data.partition(b"\n")
            self._is_left_out = not end
        whole, end, self._rest = data.rpartition(b"\n")
        if len(self._rest) > LONGEST_LINE:
            self._rest, self._is_left_out = b"", True
            self.lines.leave_out(f"a line of more than {LONGEST_LINE} bytes")
        return b"".join(self._line(packet.time, line) for line in whole.split(b"\n") if line.strip()) if end else b""

    def _line(self, time: float, line: bytes) -> bytes:
        line = line.strip()
        if frame := _AVR.match(line):
            return b"%.6f %s\n" % (time, frame[1])
        if _SBS.match(line):
            return self._sbs(time, line)
        if _SENTENCE.search(line) and not _STAMPED.search(line):
            return b"%.3f %s\n" % (time, line)
        return line + b"\n"

    def _sbs(self, time: float, line: bytes) -> bytes:
        """Return a row of a table for a line of BaseStation's port 30003 that has a position, else nothing."""
        cells = line.split(b",")
        if len(cells) < 16 or not re.fullmatch(rb"[0-9A-Fa-f]{6}", cells[4]):
            self.lines.leave_out("a line of SBS without its cells")
            return b""
        who, name = cells[4].upper(), re.sub(rb"[^A-Za-z0-9]", b"", cells[10])[:8]
        if name:
            self._called.pop(who, None)
            self._called[who] = name
            for old in list(self._called)[:-CALLED]:
                del self._called[old]
        if not (cells[14].strip() and cells[15].strip()):
            return b""
        row = b"%.3f,%s,%s,%s,%s,%s\n" % (time, cells[14], cells[15], cells[11], who, self._called.get(who, b""))
        head, self._has_head = b"" if self._has_head else SBS_HEAD, True
        return head + row


def _beast(time: float, frame: bytes) -> bytes:
    """Return a line of a Beast frame, b"" of what is none or no Mode S."""
    plain = frame[2:].replace(b"\x1a\x1a", b"\x1a")
    size = LENGTHS.get(frame[1], 0)
    if frame[1] not in (0x32, 0x33) or len(plain) != 7 + size:
        return b""
    return b"%.6f %s\n" % (time, plain[7:].hex().encode())


def capture(datagrams: Sequence[tuple[float, bytes]]) -> bytes:
    """Return datagrams (Unix s, payload) as a capture of UDP packets between nobody and nobody."""
    parts = [CAPTURE]
    for time, data in datagrams:
        udp = struct.pack(">HHHH", 0, 0, 8 + len(data), 0) + data
        ip = struct.pack(">BBHHHBBHII", 0x45, 0, 20 + len(udp), 0, 0, 1, 17, 0, 0, 0) + udp
        parts.append(struct.pack("<IIII", int(time), int(time % 1 * 1e6), len(ip), len(ip)) + ip)
    return b"".join(parts)


def faults_kept(faults: list[Fault], most: int = 1000) -> int:
    """Keep the first of many faults; return how many were let go."""
    lost = max(len(faults) - most, 0)
    del faults[most:]
    return lost
