"""Datagrams out of network captures: pcap and pcapng, Ethernet, VLAN, Linux cooked or raw IP, UDP over IPv4 and IPv6.

What is not UDP is passed over; fragments of a datagram are not put together and are named as such.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

CLASSIC = {
    b"\xd4\xc3\xb2\xa1": ("<", 1e-6), b"\xa1\xb2\xc3\xd4": (">", 1e-6),
    b"\x4d\x3c\xb2\xa1": ("<", 1e-9), b"\xa1\xb2\x3c\x4d": (">", 1e-9),
}  # fmt: skip
NEXT = b"\x0a\x0d\x0d\x0a"
LINKS = {0: "null", 1: "ethernet", 101: "ip", 12: "ip", 14: "ip", 113: "cooked", 276: "cooked2", 228: "ip", 229: "ip"}
TAGS = (0x8100, 0x88A8, 0x9100)


class Datagram(NamedTuple):
    """The payload of one UDP packet."""

    offset: int  # of the payload's first byte in the file
    time: float  # s, Unix time of the capture
    flow: bytes  # addresses and ports: who speaks to whom
    payload: bytes


class Trouble(NamedTuple):
    """A packet that cannot be read."""

    offset: int
    what: str


def is_capture(data: bytes) -> bool:
    """Return whether the bytes begin like a pcap or pcapng file."""
    return data[:4] in CLASSIC or data[:4] == NEXT


def datagrams(data: bytes):
    """Yield a `Datagram` for each UDP packet of a capture, and a `Trouble` for each packet that cannot be read."""
    for packet in _next_generation(data) if data[:4] == NEXT else _classic(data):
        if isinstance(packet, Trouble):
            yield packet
            continue
        start, end, time, link = packet
        found = _udp(data, start, end, link)
        if isinstance(found, Trouble):
            yield found
        elif found is not None:
            flow, first, last = found
            yield Datagram(first, time, flow, data[first:last])


def _classic(data):
    """Yield (first byte, end, time, link) of each packet."""
    order, tick = CLASSIC[data[:4]]
    if len(data) < 24:
        yield Trouble(0, "the header of the capture is cut off")
        return
    link = struct.unpack_from(order + "I", data, 20)[0] & 0xFFFF
    i = 24
    while i < len(data):
        if i + 16 > len(data):
            yield Trouble(i, "the header of a packet is cut off")
            return
        seconds, fraction, size, _ = struct.unpack_from(order + "4I", data, i)
        if i + 16 + size > len(data):
            yield Trouble(i, f"a packet of {size} bytes where {len(data) - i - 16} are left")
            return
        yield i + 16, i + 16 + size, seconds + fraction * tick, link
        i += 16 + size


def _next_generation(data):
    """Yield (first byte, end, time, link) of each enhanced or simple packet block."""
    order, i = "<", 0
    interfaces: list[tuple[int, float, int]] = []
    while i < len(data):
        if data[i : i + 4] == NEXT:
            order, interfaces = ("<" if data[i + 8 : i + 12] == b"\x4d\x3c\x2b\x1a" else ">"), []
        if i + 12 > len(data):
            yield Trouble(i, "the header of a block of the capture is cut off")
            return
        kind, size = struct.unpack_from(order + "2I", data, i)
        if size < 12 or i + size > len(data):
            yield Trouble(i, f"a block of the capture of {size} bytes where {len(data) - i} are left")
            return
        body, end = i + 8, i + size - 4
        if kind == 1 and size >= 20:
            interfaces.append((struct.unpack_from(order + "H", data, body)[0], *_clock(data, body + 8, end, order)))
        elif kind == 6 and size >= 32:
            port, high, low, length = struct.unpack_from(order + "4I", data, body)
            if port >= len(interfaces) or body + 20 + length > end:
                yield Trouble(i, "a packet that does not fit its block, or of an interface not described")
            else:
                link, tick, start = interfaces[port]
                yield body + 20, body + 20 + length, start + (high << 32 | low) * tick, link
        elif kind == 3 and size >= 16 and interfaces:  # no time
            length = min(struct.unpack_from(order + "I", data, body)[0], end - body - 4)
            yield body + 4, body + 4 + length, float("nan"), interfaces[0][0]
        i += size


def _clock(data, i, end, order):
    """Return the tick (s) and the start of the clock of an interface, from its options."""
    tick, start = 1e-6, 0
    while i + 4 <= end:
        code, size = struct.unpack_from(order + "2H", data, i)
        value = data[i + 4 : i + 4 + size]
        if code == 0:
            break
        if code == 9 and size == 1:
            tick = 2.0 ** -(value[0] & 127) if value[0] & 128 else 10.0 ** -value[0]
        elif code == 14 and size == 8:
            start = struct.unpack(order + "q", value)[0]
        i += 4 + size + -size % 4
    return tick, start


def _udp(data, i, end, link):
    """Return (flow, first byte, end) of the payload of a packet, None where it is not UDP, or what is wrong."""
    head = i
    kind = LINKS.get(link)
    if kind is None:
        return Trouble(i, f"link type {link} of the capture is not read; Ethernet, Linux cooked and raw IP are")
    skip, at = {"null": (4, None), "ethernet": (14, 12), "ip": (0, None), "cooked": (16, 14), "cooked2": (20, 0)}[kind]
    if i + skip + 20 > end:
        return None
    protocol = int.from_bytes(data[i + at : i + at + 2], "big") if at is not None else None
    i += skip
    while protocol in TAGS and i + 4 <= end:
        protocol = int.from_bytes(data[i + 2 : i + 4], "big")
        i += 4
    if i + 20 > end:
        return None
    version = data[i] >> 4
    if protocol not in (None, 0x0800, 0x86DD) or version not in (4, 6):
        return None
    if version == 4:
        size = (data[i] & 15) * 4
        if data[i + 9] != 17:
            return None
        if int.from_bytes(data[i + 6 : i + 8], "big") & 0x3FFF:
            return Trouble(head, "a fragment of a datagram; fragments are not put together")
        addresses, i = data[i + 12 : i + 20], i + size
    else:
        if i + 40 > end or data[i + 6] != 17:  # extension headers are not read
            return None
        addresses, i = data[i + 8 : i + 40], i + 40
    if i + 8 > end:
        return Trouble(head, "a UDP header is cut off")
    size = int.from_bytes(data[i + 4 : i + 6], "big")
    if size < 8 or i + size > end:
        return Trouble(head, f"a UDP packet of {size} bytes where {end - i} were captured")
    return addresses + data[i : i + 4], i + 8, i + size
