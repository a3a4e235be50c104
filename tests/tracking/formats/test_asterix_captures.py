"""ASTERIX in captures of a network, of every kind."""

import struct

import pytest

pytest.importorskip("asterix.generated", reason='pip install "driftwise[tracking]"')


from asterix_written import classic, ethernet, file_of, next_generation, polar

from driftwise.engine.errors import InputError
from driftwise.tracking.formats.asterix import read_asterix


def test_captures_of_every_kind():
    payload = file_of(polar(25199.0, **{"220": 0x4BAA5F}))
    framed = struct.pack(">H4x", len(payload) + 6) + payload
    vlan, cooked = b"\x81\x00\x00\x05", bytes(14) + b"\x08\x00"
    plain = ethernet(payload)
    captures = [
        classic([plain]), classic([plain], ">"), classic([plain], magic=0xA1B23C4D, fraction=250_000_000),
        classic([ethernet(payload, tags=vlan)]), classic([ethernet(payload, tags=vlan * 2)]),
        classic([ethernet(payload, ip=6)]), classic([ethernet(payload, padding=b"\x30\x00\x10" * 5)]),
        classic([cooked + plain[14:]], link=113), classic([plain[14:]], link=101), classic([ethernet(framed)]),
        classic([b"\x08\x00" + bytes(18) + plain[14:]], link=276),
        next_generation([plain]), next_generation([plain], ">"),
    ]  # fmt: skip
    for data in captures:
        plots = read_asterix(data)
        assert list(plots.key) == ["4BAA5F"] and not plots.faults
        assert plots.time[0] == 1719990000 - 1719990000 % 86400 + 25199
    cut = classic([plain, plain])[:-5]
    (fault,) = read_asterix(cut).faults
    assert "where" in fault.what and fault.offset == len(cut) + 5 - len(plain) - 16
    other = [ethernet(b"not a radar").replace(b"\x13\x88", b"\x00\x35")] * 3  # from port 53
    (fault,) = read_asterix(classic([*other, plain, *other])).faults
    assert fault.what.startswith("6 packets of one sender hold no ASTERIX block")
    broken = bytearray(plain)
    broken[20] |= 0x20  # more fragments follow
    assert "fragment" in read_asterix(classic([plain, bytes(broken)])).faults[0].what
    with pytest.raises(InputError, match="link type 147"):
        read_asterix(classic([plain], link=147))


def test_bytes_that_a_recorder_adds_to_every_packet_are_no_record():
    """A time stamp, say; a packet that ends otherwise has lost something, and only that is told."""
    payloads = [file_of(polar(25199.0 + k, **{"220": 0x4BAA5F})) for k in range(30)]
    stamp = struct.pack(">2I", 0, 0xFFFF0007)
    plots = read_asterix(classic([ethernet(payload + stamp) for payload in payloads]))
    assert len(plots) == 30 and not plots.faults
    plots = read_asterix(classic([ethernet(payload + stamp) for payload in [*payloads[:-1], payloads[-1] + b"\x30"]]))
    assert len(plots) == 30 and "9 bytes are left" in plots.faults[0].what and len(plots.faults) == 1
