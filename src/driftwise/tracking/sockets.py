"""Where plots come from while they come: UDP (multicast too), TCP, a capture through a pipe."""

from __future__ import annotations

import select
import socket
import struct
import sys
import time as clock
from collections.abc import Iterator
from typing import NamedTuple
from urllib.parse import parse_qs, urlsplit

from ..engine.errors import InputError

MOST = 1 << 20  # bytes taken at a time
LONGEST = 1 << 16  # bytes of a datagram
WAIT = 1.0, 30.0  # s until a lost connection is tried again: at first, at most
TRIED = 10.0  # s that a connection may take
BUFFER = 1 << 24  # bytes that the system is asked to keep for us
IS_LINUX = sys.platform.startswith("linux")
SO_RCVBUFFORCE, SO_MEMINFO = 33, 55  # of Linux: a buffer beyond net.core.rmem_max, for who may; how the socket stands
DROPS = 8  # where among the numbers of SO_MEMINFO the datagrams are that found the buffer full
HOW = (
    "udp://239.1.2.3:8600 (a group; ?interface=ADDRESS of the card), udp://:8600, tcp://localhost:30003, or - for a "
    "capture (pcap) on standard input"
)


class Place(NamedTuple):
    """What is listened to."""

    kind: str  # "udp", "tcp" or "pipe"
    host: str = ""
    port: int = 0
    interface: str = ""


class Packet(NamedTuple):
    """What came, and when: a datagram, or a stretch of a stream."""

    time: float  # Unix s
    data: bytes


def place(url: str) -> Place:
    """Return what a URL names.

    >>> place("udp://239.1.2.3:8600?interface=127.0.0.1")
    Place(kind='udp', host='239.1.2.3', port=8600, interface='127.0.0.1')
    """
    if url == "-":
        return Place("pipe")
    try:
        parts = urlsplit(url)
        port, host = parts.port, parts.hostname or ""
    except ValueError:
        port, host, parts = None, "", urlsplit("")
    asked = parse_qs(parts.query)
    good = parts.scheme in ("udp", "tcp") and port and not parts.path.strip("/") and set(asked) <= {"interface"}
    if not good or (parts.scheme == "tcp" and not host):
        raise InputError(f"{url!r} is no place to listen to: {HOW}")
    return Place(parts.scheme, host, int(port or 0), asked.get("interface", [""])[0])


class Listener:
    """Hands out packets as they come.

    Attributes
    ----------
    has_ended : bool
        Nothing more will come: a pipe was closed.
    lost : int
        How often a connection was lost, and made again.
    has_broken : bool
        The connection was lost behind what was read last.
    """

    def __init__(self, url: str, pause: float = 0.1):
        self.place, self.pause, self.url = place(url), pause, url
        self.has_ended, self.has_broken, self.lost = False, False, 0
        self._socket: socket.socket | None = None
        self._next, self._wait = 0.0, WAIT[0]  # of a connection to be made again
        if self.place.kind != "pipe":
            try:
                self._socket = _bound(self.place) if self.place.kind == "udp" else _connected(self.place)
            except OSError as error:
                raise InputError(f"{url}: {error.strerror or error}; is that the right address?") from None

    @property
    def dropped(self) -> int:
        """How many datagrams the system threw away, since they came faster than they were read; 0 if it says nothing.

        Linux does.
        """
        if self._socket is None or self.place.kind != "udp" or not IS_LINUX:
            return 0
        try:
            numbers = self._socket.getsockopt(socket.SOL_SOCKET, SO_MEMINFO, 4 * (DROPS + 1))
        except OSError:  # older than 4.12
            return 0
        return int(struct.unpack_from("I", numbers, 4 * DROPS)[0]) if len(numbers) == 4 * (DROPS + 1) else 0

    @property
    def is_stream(self) -> bool:
        """Whether packets are pieces of a stream, that may be cut anywhere."""
        return self.place.kind != "udp"

    def read(self) -> list[Packet]:
        """Return what came within the pause, [] where nothing did."""
        self.has_broken = False
        if self.place.kind == "pipe":
            return self._piped()
        if self._socket is None:
            self._again()
            return []
        ready, _, _ = select.select([self._socket], [], [], self.pause)
        found: list[Packet] = []
        size = 0
        while ready and size < MOST:
            try:
                data = self._socket.recv(LONGEST)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:
                data = b""
            if not data and self.place.kind == "tcp":
                self._drop()
                break
            found.append(Packet(clock.time(), data))
            size += len(data) + 1
        return found

    def waiting(self) -> Iterator[list[Packet]]:
        """Yield what has come already, without waiting for more; of a sender that is faster than we are, `BUFFER`."""
        self.pause, size = 0.0, 0
        while size < BUFFER and not (self.has_ended or self.has_broken) and (packets := self.read()):
            yield packets
            size += sum(len(packet.data) for packet in packets)

    def close(self) -> None:
        """Let go of the socket."""
        if self._socket is not None:
            self._socket.close()

    def _piped(self) -> list[Packet]:
        source = sys.stdin.buffer.raw  # type: ignore[union-attr]  # a pipe's buffer has one
        ready, _, _ = select.select([source], [], [], self.pause)
        if not ready:
            return []
        data = source.read(MOST)
        self.has_ended = data == b""
        return [Packet(clock.time(), data)] if data else []

    def _drop(self) -> None:
        self.close()
        self._socket, self.has_broken, self.lost = None, True, self.lost + 1
        self._next = clock.monotonic() + self._wait

    def _again(self) -> None:
        """Make a lost connection again, after a while."""
        if clock.monotonic() < self._next:
            clock.sleep(self.pause)
            return
        try:
            self._socket, self._wait = _connected(self.place), WAIT[0]
        except OSError:
            self._wait = min(2 * self._wait, WAIT[1])
            self._next = clock.monotonic() + self._wait


def _bound(place: Place) -> socket.socket:
    """Return a socket that takes datagrams, of a group where the host is one."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _widen(made)
        is_group = bool(place.host) and 224 <= int(socket.gethostbyname(place.host).partition(".")[0]) < 240
        made.bind((place.host, place.port))
        if is_group:
            member = socket.inet_aton(socket.gethostbyname(place.host)) + socket.inet_aton(place.interface or "0.0.0.0")
            made.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, struct.pack("8s", member))
        made.setblocking(False)
    except OSError:
        made.close()
        raise
    return made


def _widen(made: socket.socket) -> None:
    """Ask for a buffer of `BUFFER`, or half of it and so on: systems cut what they do not grant, or refuse it."""
    asked = [(SO_RCVBUFFORCE, BUFFER)] if IS_LINUX else []
    for option, size in [*asked, *((socket.SO_RCVBUF, BUFFER >> k) for k in range(8))]:
        try:
            made.setsockopt(socket.SOL_SOCKET, option, size)
            return
        except OSError:
            continue


def _connected(place: Place) -> socket.socket:
    made = socket.create_connection((place.host, place.port), TRIED)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    made.setblocking(False)
    return made
