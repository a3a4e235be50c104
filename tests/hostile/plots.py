"""Plots of radars and receivers in every format that is read, damaged: records from memory, bytes from a generator."""

from __future__ import annotations

import json


def cat048(rng, count: int = 20) -> bytes:
    """Return data blocks of category 048, as EUROCONTROL's specification lays them out: time, range and azimuth."""
    blocks = []
    for i in range(count):
        seconds = int((36_000 + 4 * i) * 128).to_bytes(3, "big")
        rho = int(min(65535, (20 + 0.1 * i) * 256)).to_bytes(2, "big")
        theta = int((45 + 0.2 * i) * 65536 / 360 % 65536).to_bytes(2, "big")
        # FSPEC 1101 0000: I048/010, /140, /040 (FX clear)
        record = bytes([0b11010000]) + bytes([25, 201]) + seconds + rho + theta
        blocks.append(bytes([48]) + (3 + len(record)).to_bytes(2, "big") + record)
    return b"".join(blocks)


def table(rng, count: int = 30) -> bytes:
    """Return plots as a table of times, latitudes and longitudes."""
    lines = ["time,lat,lon,id"]
    lines += [f"{4 * i},{46 + 0.005 * i:.6f},{15 + 0.004 * i:.6f},A{i % 2}" for i in range(count)]
    return "\n".join(lines).encode() + b"\n"


def lines_of_json(rng, count: int = 30) -> bytes:
    """Return plots as lines of JSON."""
    rows = [{"time": 4 * i, "lat": 46 + 0.005 * i, "lon": 15 + 0.004 * i, "id": f"A{i % 2}"} for i in range(count)]
    text = "\n".join(map(json.dumps, rows)) if rng.random() < 0.5 else json.dumps(rows)
    return text.encode() + b"\n"


def nmea(rng, count: int = 30) -> bytes:
    """Return fixes of a satellite receiver."""
    lines = []
    for i in range(count):
        body = f"GPRMC,{120000 + i:06d},A,46{6 + 0.01 * i:07.4f},N,015{3 + 0.01 * i:07.4f},E,12.0,45.0,230394,,,A"
        check = 0
        for letter in body:
            check ^= ord(letter)
        lines.append(f"${body}*{check:02X}")
    return "\r\n".join(lines).encode() + b"\r\n"


def ships(rng, count: int = 10) -> bytes:
    """Return an AIS sentence, again and again."""
    return b"!AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0*24\n" * count


def frames(rng, count: int = 20) -> bytes:
    """Return Mode S frames with the time they came, as receivers print them."""
    known = ("8D40621D58C382D690C8AC2863A7", "8D40621D58C386435CC412692AD6")
    return "".join(f"{i * 0.5:.1f},{known[i % 2]}\n" for i in range(count)).encode()


def geojson(rng, count: int = 20) -> bytes:
    """Return points of GeoJSON."""
    points = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [15 + 0.01 * i, 46]},
            "properties": {"time": i},
        }
        for i in range(count)
    ]
    return json.dumps({"type": "FeatureCollection", "features": points}).encode()


def gpx(rng, count: int = 20) -> bytes:
    """Return a track of a hand-held receiver."""
    rows = "".join(
        f'<trkpt lat="46.{i:03d}" lon="15.{i:03d}"><time>2024-01-01T00:00:{i:02d}Z</time></trkpt>' for i in range(count)
    )
    return f'<?xml version="1.0"?><gpx version="1.1"><trk><trkseg>{rows}</trkseg></trk></gpx>'.encode()


LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "haha">' + "".join(
        f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">' for i in range(9)
    ) + "]><gpx><trk><name>&j;</name></trk></gpx>"
).encode()  # fmt: skip
OUTSIDE = (
    b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><gpx><trk><name>&e;</name></trk></gpx>'
)

FORMATS = {
    "a.ast": cat048, "p.csv": table, "p.jsonl": lines_of_json, "p.json": lines_of_json, "p.nmea": nmea, "p.ais": ships,
    "p.avr": frames, "p.geojson": geojson, "p.gpx": gpx, "p.txt": table, "p.pcap": cat048,
}  # fmt: skip
WORDS = [
    b"1e400", b"-1", b"nan", b"null", b'"', b"[[[[", b"{}", b"\x00", b"99999999999999999999", b"\xff\xff", b"<",
    b"&a;", b"true", b"1e308", b"91", b"-181", b"", b"\n", b"\r", b",",
]  # fmt: skip


def hostile(rng) -> tuple[str, bytes, str]:
    """Return a file's name, its bytes, and what was done to them."""
    draw = rng.random()
    if draw < 0.03:
        return ("p.gpx", LAUGHS, "entities that grow") if draw < 0.015 else ("p.gpx", OUTSIDE, "an entity outside")
    if draw < 0.08:
        return "p.json", b"[" * int(rng.choice([10, 100_000])), "deep brackets"
    name = str(rng.choice(list(FORMATS)))
    data = FORMATS[name](rng)
    return name, mutated(data, rng, int(rng.choice([0, 1, 3, 30]))), "bytes altered"


def mutated(data: bytes, rng, times: int) -> bytes:
    """Return bytes with so many things done to them: flipped, cut out, doubled, moved, words put in."""
    for _ in range(times):
        at, size = (int(rng.integers(len(data) + 1)) for _ in range(2))
        end, what = min(len(data), at + 1 + size % 40), int(rng.integers(7))
        if what == 0:
            data = data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
        elif what == 1:
            data = data[:at] + data[end:]
        elif what == 2:
            data = data[:end] + data[at:end] + data[end:]
        elif what == 3:
            data = data[:at]
        elif what == 4:
            data = data[:at] + WORDS[int(rng.integers(len(WORDS)))] + data[end:]
        elif what == 5 and at < len(data):
            data = data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
        else:
            data = data[:at] + data[at:end] * int(rng.integers(2, 20)) + data[end:]
        if len(data) > 1 << 18:
            break
    return data
