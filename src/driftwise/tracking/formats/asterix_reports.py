"""What the items of ASTERIX records mean, as far as a plot needs them.

| category | items read |
|---|---|
| 048 | 010 140 020 040 042 070 090 220 240 |
| 001 | 010 020 040 042 070 090 141 |
| 021 | 010 040 030 071 073 077 080 070 090 130 131 140 145 170 |
| 062 | 010 040 060 070 080 105 130 135 136 245 380 (ADR, ID) 390 (CS) 500 (APC) |
| 034, 002 | 000 010 030 041 and, of 034, 120 |

All others are stepped over: velocities, quality of single replies, Mode S registers, weather, plans, and the contents
of special and reserved fields. Category 065 carries no plots and is only checked.
"""

from __future__ import annotations

from struct import Struct
from typing import NamedTuple

from .asterix_records import Malformed, parts

NAN = float("nan")
NAUTICAL_MILE, FOOT = 1852.0, 0.3048
LEVEL = 25 * FOOT  # a quarter of a flight level, m
NOWHERE, POLAR, PLANE, EARTH = range(4)  # how a position is told
CONSPICUITY = frozenset({"0000", "1000", "1200", "2000", "7000"})  # Mode A codes that many aircraft share
# 95 % radius, m, of the navigation accuracy categories for position (NACp) 1 .. 11
RADII = (18520.0, 7408.0, 3704.0, 1852.0, 926.0, 555.6, 185.2, 92.6, 30.0, 10.0, 3.0)
ACCURACY = dict(enumerate(RADII, 1))
RADIUS = 2.4477  # 95 % radius of a circular normal error, in standard deviations

_pair = Struct(">HH").unpack_from
_signed_pair = Struct(">hh").unpack_from
_long_pair = Struct(">ii").unpack_from
_two = Struct(">H").unpack_from
_signed = Struct(">h").unpack_from
_site = Struct(">h3s3s").unpack_from
LETTERS = [""] * 64
for _k in range(26):
    LETTERS[_k + 1] = chr(ord("A") + _k)
for _k in range(10):
    LETTERS[_k + 48] = str(_k)
LETTERS[32] = " "


class Report(NamedTuple):
    """One target report."""

    time: float  # s of the day; modulo 512 s in category 1; NaN
    kind: int
    first: float  # range m, East m, or latitude in degrees
    second: float  # azimuth in radians, North m, or longitude in degrees
    altitude: float  # m; NaN
    key: str
    name: str
    sd: tuple[float, float] | None = None  # m East and North, where the record tells


class Message(NamedTuple):
    """A service message of a radar: north crossing, sector crossing and others."""

    type: int  # 1 north, 2 sector
    time: float  # s of the day; NaN
    period: float  # s of a turn of the antenna; NaN
    place: tuple[float, float, float] | None = None  # degrees and m: where the radar says it stands


def _int24(b, i):
    value = b[i] << 16 | b[i + 1] << 8 | b[i + 2]
    return value - (1 << 24) if value & 0x800000 else value


def _time(b, at, *items):
    """Return the time of day in the first of the items that is present."""
    for item in items:
        i = at.get(item)
        if i is not None:
            time = (b[i] << 16 | b[i + 1] << 8 | b[i + 2]) / 128
            if time >= 86400:
                raise Malformed(i, f"a time of day of {time:.0f} s, beyond 24 h")
            return time
    return NAN


def _code(b, i):
    """Return the key of a Mode A code, empty where it is not validated, garbled, or shared by many."""
    (word,) = _two(b, i)
    code = f"{word & 0xFFF:04o}"
    return "" if word & 0xC000 or code in CONSPICUITY else "A" + code


def _altitude(quarters):
    """Return metres of quarters of flight levels, NaN outside what the specification allows (-15 .. 1500 levels)."""
    return quarters * LEVEL if -60 <= quarters <= 6000 else NAN


def _mode_c(b, i):
    """Return the altitude of a flight level of 14 bits, NaN where not validated or garbled."""
    (word,) = _two(b, i)
    return NAN if word & 0xC000 else _altitude(word - 0x4000 if word & 0x2000 else word)


def _address(b, i):
    address = b[i : i + 3].hex().upper()
    return "" if address in ("000000", "FFFFFF") else address


def _callsign(b, i):
    """Return eight characters of six bits, empty where one of them is not a letter, a digit or a blank."""
    word = int.from_bytes(b[i : i + 6], "big")
    letters = [LETTERS[word >> shift & 63] for shift in range(42, -1, -6)]
    return "" if "" in letters else "".join(letters).strip()


def _earth(latitude, longitude, i):
    if not (-90 <= latitude <= 90 and -180 <= longitude <= 180):
        raise Malformed(i, f"a position at latitude {latitude:.3f}, longitude {longitude:.3f}, which is nowhere")
    return EARTH, latitude, longitude


def _long(b, i, parts) -> tuple[float, float]:
    """Return two angles of four bytes in degrees; ``parts`` of them are half a turn."""
    first, second = _long_pair(b, i)
    return first * (180 / parts), second * (180 / parts)


def _polar(b, i, mile):
    """Return a polar position; ``mile`` is how many parts of range make one."""
    distance, angle = _pair(b, i)
    return POLAR, distance * (NAUTICAL_MILE / mile), angle * (6.283185307179586 / 65536)


def _plane(b, i, mile):
    x, y = _signed_pair(b, i)
    return PLANE, x * (NAUTICAL_MILE / mile), y * (NAUTICAL_MILE / mile)


def _no_plot(b, i, simulated, seen):
    """Return why the record of a radar is no plot of an aircraft, "" where it is one."""
    if b[i] & simulated or (b[i] & 1 and b[i + 1] & 0x80):
        return "simulated, test or monitor targets"
    return "" if b[i] & seen else "no detection"


def monoradar(b, spec, at, edition):
    """Category 48: target reports of one radar."""
    i = at.get("020")
    if i is not None and (why := _no_plot(b, i, 0x12, 0xE0)):
        return why
    where = (NOWHERE, NAN, NAN)
    if "040" in at:
        where = _polar(b, at["040"], 256)
    elif "042" in at:
        where = _plane(b, at["042"], 128)
    key = _address(b, at["220"]) if "220" in at else ""
    if not key and "070" in at:
        key = _code(b, at["070"])
    return Report(
        _time(b, at, "140"), *where, _mode_c(b, at["090"]) if "090" in at else NAN, key,
        _callsign(b, at["240"]) if "240" in at else "",
    )  # fmt: skip


def older_radar(b, spec, at, edition):
    """Category 1: plots and tracks of a radar; its time is modulo 512 s."""
    if why := _no_plot(b, at["020"], 0x42, 0x30):
        return why
    where = (NOWHERE, NAN, NAN)
    if "040" in at:
        where = _polar(b, at["040"], 128)
    elif "042" in at:
        where = _plane(b, at["042"], 64)
    time = _two(b, at["141"])[0] / 128 if "141" in at else NAN
    key = _code(b, at["070"]) if "070" in at else ""
    return Report(time, *where, _mode_c(b, at["090"]) if "090" in at else NAN, key, "")


def self_reported(b, spec, at, edition):
    """Category 21: what an aircraft broadcasts of itself."""
    old, i = edition.startswith("0."), at.get("040")
    if i is not None and (b[i] & 0x38 if old else b[i] & 2 or (b[i] & 1 and b[i + 1] & 0x30)):
        return "simulated, test or monitor targets"
    where, sd = (NOWHERE, NAN, NAN), None
    if "131" in at and not old:
        i = at["131"]
        where = _earth(*_long(b, i, 2**30), i)
    elif "130" in at:
        i = at["130"]
        if old and edition != "0.23":
            where = _earth(*_long(b, i, 2**25), i)
        else:
            where = _earth(_int24(b, i) * (180 / 2**23), _int24(b, i + 3) * (180 / 2**23), i)
    i = at.get("090")
    if i is not None and not old and b[i] & 1 and (radius := ACCURACY.get(b[i + 1] >> 1 & 15)):
        sd = (radius / RADIUS, radius / RADIUS)
    altitude = _altitude(_signed(b, at["145"])[0]) if "145" in at else NAN
    if altitude != altitude and "140" in at and _signed(b, at["140"])[0] < 0x7FFF:  # all ones: beyond the scale
        altitude = _signed(b, at["140"])[0] * 6.25 * FOOT
    key = _address(b, at["080"]) if "080" in at else ""
    if not key and "070" in at:
        key = _code(b, at["070"])
    name = _callsign(b, at["170"]) if "170" in at else ""
    return Report(_time(b, at, "071", "073", "077", "030"), *where, altitude, key, name, sd)


def system_track(b, spec, at, edition):
    """Category 62: tracks of a surveillance data processor; already filtered, so their errors are not independent."""
    i = at.get("080")
    if i is not None and b[i] & 1:
        if b[i + 1] & 0x80:
            return "simulated, test or monitor targets"
        if b[i + 1] & b[i + 2] & 1 and b[i + 3] & 0x80:  # coasting
            return "no detection"
    where, sd, key, name = (NOWHERE, NAN, NAN), None, "", ""
    if "105" in at:
        i = at["105"]
        where = _earth(*_long(b, i, 2**25), i)
    if "380" in at:
        part = parts(spec, "380", b, at["380"], len(b))
        key = _address(b, part["ADR"]) if "ADR" in part else ""
        name = _callsign(b, part["ID"]) if "ID" in part else ""
    if not key and "060" in at:
        key = _code(b, at["060"])
    if not key and "040" in at:
        key = f"T{_two(b, at['040'])[0]}"
    if not name and "245" in at:
        name = _callsign(b, at["245"] + 1)
    if not name and "390" in at:
        part = parts(spec, "390", b, at["390"], len(b))
        text = bytes(b[part["CS"] : part["CS"] + 7]) if "CS" in part else b""
        name = text.decode("ascii", "replace").strip() if text.isascii() and text.replace(b" ", b"").isalnum() else ""
    if "500" in at:
        part = parts(spec, "500", b, at["500"], len(b))
        if "APC" in part:
            x, y = _pair(b, part["APC"])
            sd = (x * 0.5, y * 0.5)
    altitude = NAN
    if "136" in at:
        altitude = _altitude(_signed(b, at["136"])[0])
    elif "135" in at:
        (word,) = _two(b, at["135"])
        altitude = _altitude((word & 0x7FFF) - (0x8000 if word & 0x4000 else 0))
    elif "130" in at:
        altitude = _signed(b, at["130"])[0] * 6.25 * FOOT
    return Report(_time(b, at, "070"), *where, altitude, key, name, sd)


def service(b, spec, at, edition):
    """Categories 34, 2 and 65: messages of a radar or a processor about itself."""
    place = None
    if "120" in at:
        height, latitude, longitude = _site(b, at["120"])
        place = (_int24(latitude, 0) * (180 / 2**23), _int24(longitude, 0) * (180 / 2**23), float(height))
        _earth(place[0], place[1], at["120"])
    return Message(
        b[at["000"]] if "000" in at else 0, _time(b, at, "030"),
        _two(b, at["041"])[0] / 128 if "041" in at else NAN, place,
    )  # fmt: skip


MEANING = {1: older_radar, 2: service, 21: self_reported, 34: service, 48: monoradar, 62: system_track, 65: service}
