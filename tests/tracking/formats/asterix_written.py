"""Records of ASTERIX as radars write them, for tests."""

import struct

import pytest

pytest.importorskip("asterix.generated", reason='pip install "driftwise[tracking]"')

import asterix_oracle as oracle

from driftwise.tracking.formats import asterix_records as structure

NEWEST = {c: list(known)[-1] for c, known in structure.table().items()}


def polar(time, rho=10.0, theta=45.0, sic=1, level=100.0, **items):
    """Return a CAT048 record: s, NM, degrees, flight level."""
    items = {"010": (("SAC", 25), ("SIC", sic)), "140": float(time), "020": ((("TYP", 5), 0, 0, 0, 0, None),),
             "040": (("RHO", rho), ("THETA", theta)), "090": (0, 0, ("FL", level)), **items}  # fmt: skip
    return oracle.lists(oracle.SPECS[48, "1.32"])["-"].create(items)


def file_of(*records, category=48):
    return b"".join(oracle.block(category, [r]) for r in records)


def ethernet(payload, ip=4, tags=b"", padding=b""):
    udp = struct.pack(">4H", 5000, 8600, len(payload) + 8, 0) + payload
    if ip == 4:
        head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, bytes(4), bytes(4))
    else:
        head = struct.pack(">IHBB16s16s", 6 << 28, len(udp), 17, 64, bytes(16), bytes(16))
    kind = struct.pack(">H", 0x0800 if ip == 4 else 0x86DD)
    return bytes(12) + tags + kind + head + udp + padding


def classic(packets, order="<", magic=0xA1B2C3D4, link=1, fraction=250_000, when=1719990000):
    out = struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 65535, link)
    return out + b"".join(struct.pack(order + "4I", when, fraction, len(p), len(p)) + p for p in packets)


def next_generation(packets, order="<", when=1719990000):
    def block(kind, body):
        body += b"\0" * (-len(body) % 4)
        return struct.pack(order + "2I", kind, len(body) + 12) + body + struct.pack(order + "I", len(body) + 12)

    ticks = when * 10**9 + 250_000_000
    option = struct.pack(order + "2HB3x2H", 9, 1, 9, 0, 0)  # nanoseconds
    out = block(0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    out += block(1, struct.pack(order + "HHI", 1, 0, 65535) + option)
    return out + b"".join(
        block(6, struct.pack(order + "5I", 0, ticks >> 32, ticks & 0xFFFFFFFF, len(p), len(p)) + p) for p in packets
    )
