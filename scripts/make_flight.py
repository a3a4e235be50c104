"""Make src/driftwise/data/flight.csv, a regular record of one airliner's climb, from raw Mode S frames.

    pip download traffic==2.13 --no-deps --no-binary traffic
    python scripts/make_flight.py traffic-2.13.tar.gz src/driftwise/data/flight.csv

The source is the sdist itself or the file `full_flight_short.jsonl` inside it: one JSON object a line, the
frame in hexadecimal with its time of reception and the fields that the decoder rs1090 found in it. Lines 1 to
45000 are read and no more; the rest is left for independent checks. What happens to them:

1. Lines before the first airborne position (taxiing) are dropped; so is a frame whose bits were heard less
   than 0.2 s before (one reply, two receivers).
2. ADS-B position (type 0,5) and velocity (0,9) and all pressure altitudes are taken as rs1090 decoded them.
3. The answers to radars (downlink formats 20 and 21) do not say which register they hold, so the decoder has
   to guess. Here the 56 bits are read again, and a frame counts as BDS 5,0 (roll, track, speeds) only if its
   ground speed and track agree with ADS-B at that moment, as BDS 6,0 (heading, airspeed, Mach) only if its
   Mach number agrees with its own airspeed at the reported altitude and its heading lies near the track.
4. Spikes (readings far from the median of eleven neighbours) are dropped and counted.
5. The mean of what was received within half a step of the grid time is the cell; nothing received, empty
   cell. Position moves too fast for a mean: it is interpolated between the plots before and after the grid
   time, both within half a step, or left empty.
"""

import argparse
import hashlib
import json
import tarfile
from collections import Counter
from pathlib import Path

import numpy as np

MEMBER = "src/traffic/data/samples/rs1090/full_flight_short.jsonl"
LAST_LINE = 45000
KNOT, FOOT = 1852 / 3600, 0.3048
ECHO = 0.2  # seconds within which the same bits are the same reply

# series -> largest distance from the median of eleven neighbours, in the units of the frame
SPIKE = {
    "latitude": 0.02, "longitude": 0.02, "altitude": 300.0, "ground_speed": 20.0, "track": 8.0,
    "vertical_rate": 1500.0, "roll": 20.0, "track_rate": 1.5, "true_airspeed": 20.0, "heading": 8.0,
    "indicated_airspeed": 20.0, "mach": 0.05,
}  # fmt: skip


def read_lines(path):
    """Return the frames of lines 1 to LAST_LINE and the sha256 of the whole file of lines."""
    path = Path(path)
    if path.suffix == ".jsonl":
        raw = path.read_bytes()
    else:
        with tarfile.open(path) as archive:
            name = next(n for n in archive.getnames() if n.endswith(MEMBER))
            raw = archive.extractfile(name).read()
    lines = raw.split(b"\n", LAST_LINE)[:LAST_LINE]
    return [json.loads(line) for line in lines], hashlib.sha256(raw).hexdigest()


def without_echoes(frames):
    """Return the frames whose bits were not heard less than ECHO seconds before."""
    heard, kept = {}, []
    for frame in frames:
        now, bits = frame["timestamp"], frame["frame"]
        if now - heard.get(bits, -np.inf) >= ECHO:
            kept.append(frame)
        heard[bits] = now
    return kept


def field(bits56, first, last, sign=None):
    """Return bits first..last (1 is leftmost of 56) as a number, two's complement if `sign` names a bit."""
    value = (bits56 >> (56 - last)) & ((1 << (last - first + 1)) - 1)
    negative = sign is not None and (bits56 >> (56 - sign)) & 1
    return value - (1 << (last - first + 1)) if negative else value


def register_50(bits56):
    """Return roll, track, ground speed, track rate, true airspeed (deg, deg, kt, deg/s, kt), or None."""
    if not all(field(bits56, b, b) for b in (1, 12, 24, 46)):
        return None
    rate = field(bits56, 37, 45, 36) * 8 / 256 if field(bits56, 35, 35) else np.nan
    return {
        "roll": field(bits56, 3, 11, 2) * 45 / 256,
        "track": field(bits56, 14, 23, 13) * 90 / 512 % 360,
        "ground_speed": 2.0 * field(bits56, 25, 34),
        "track_rate": rate,
        "true_airspeed": 2.0 * field(bits56, 47, 56),
    }


def register_60(bits56):
    """Return heading, indicated airspeed, Mach number (deg, kt, 1), or None."""
    if not all(field(bits56, b, b) for b in (1, 13, 24, 35, 46)):
        return None
    return {
        "heading": field(bits56, 3, 12, 2) * 90 / 512 % 360,
        "indicated_airspeed": float(field(bits56, 14, 23)),
        "mach": field(bits56, 25, 34) * 2.048 / 512,
    }


def mach_of(airspeed_kt, altitude_ft):
    """Return the Mach number of a calibrated airspeed at a pressure altitude below 36089 ft."""
    pressure = (1 - 6.8756e-6 * altitude_ft) ** 5.2559
    impact = (1 + 0.2 * (airspeed_kt / 661.48) ** 2) ** 3.5 - 1
    return np.sqrt(5 * ((impact / pressure + 1) ** (2 / 7) - 1))


def turn(a, b):
    """Return the angle from b to a in -180..180 degrees."""
    return (a - b + 180) % 360 - 180


def adsb(frames):
    """Return name -> (times, values) for what rs1090 decoded without having to guess."""
    names = ("latitude", "longitude", "altitude", "ground_speed", "track", "vertical_rate")
    table = {k: ([], []) for k in names}
    for frame in frames:
        kind, now = (frame["df"], frame.get("bds")), frame["timestamp"]
        found = {}
        if kind == ("17", "05"):
            found = {k: frame.get(k) for k in ("latitude", "longitude", "altitude")}
        elif kind == ("17", "09"):
            found = {"ground_speed": frame.get("groundspeed"), "track": frame.get("track")}
            found["vertical_rate"] = frame.get("vertical_rate")
        elif kind[0] in ("0", "4", "16", "20"):
            found = {"altitude": frame.get("altitude")}
        for name, value in found.items():
            if value is not None:
                table[name][0].append(now)
                table[name][1].append(float(value))
    return {k: (np.array(t), np.array(v)) for k, (t, v) in table.items()}


def radar_answers(frames, clean):
    """Return name -> (times, values) of registers 5,0 and 6,0, and how many frames were what."""
    names = ("roll", "track_rate", "true_airspeed", "heading", "indicated_airspeed", "mach")
    table, count = {k: ([], []) for k in names}, Counter()
    for frame in frames:
        if frame["df"] not in ("20", "21"):
            continue
        now, bits56 = frame["timestamp"], int(frame["frame"][8:22], 16)
        speed, track, altitude = (np.interp(now, *clean[k]) for k in ("ground_speed", "track", "altitude"))
        guess, found, is_now = frame.get("bds") or "no register", register_50(bits56), "other"
        if found and abs(found["ground_speed"] - speed) <= 8 and abs(turn(found["track"], track)) < 4:
            is_now = "50"
        else:
            found = register_60(bits56)
            if found and abs(turn(found["heading"], track)) < 20:
                if abs(mach_of(found["indicated_airspeed"], altitude) - found["mach"]) < 0.03:
                    is_now = "60"
        count[f"rs1090 says {guess}, accepted as {is_now}"] += 1
        if is_now == "50" and frame.get("track_rate", 0) is None:
            count["track rates of -1/32 deg/s that rs1090 reads as absent"] += 1
        for name in names if is_now != "other" else ():
            if name in found and np.isfinite(found[name]):
                table[name][0].append(now)
                table[name][1].append(found[name])
    return {k: (np.array(t), np.array(v)) for k, (t, v) in table.items()}, count


def without_spikes(t, v, limit):
    """Return (t, v) less the readings further than `limit` from the median of eleven neighbours."""
    order = np.argsort(t, kind="stable")
    t, v = t[order], v[order]
    around = np.lib.stride_tricks.sliding_window_view(np.pad(v, 5, mode="edge"), 11)
    good = np.abs(v - np.median(around, axis=1)) <= limit
    return t[good], v[good]


def cell_means(t, v, grid, step):
    """Return the mean of the readings within step/2 of each grid time, NaN where there are none."""
    cell = np.floor((t - grid[0]) / step + 0.5).astype(int)
    inside = (cell >= 0) & (cell < len(grid))
    total = np.bincount(cell[inside], v[inside], len(grid))
    number = np.bincount(cell[inside], minlength=len(grid))
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def interpolated(t, v, grid, step):
    """Return v at the grid times, NaN unless readings lie within step/2 on both sides."""
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    far = (grid - t[after - 1] > step / 2) | (t[after] - grid > step / 2) | (t[after] < grid)
    return np.where(far, np.nan, np.interp(grid, t, v))


def east_north(latitude, longitude, origin):
    """Return east and north of points on the WGS84 ellipsoid in the tangent plane at `origin`, in metres."""
    a, f = 6378137.0, 1 / 298.257223563
    e2 = f * (2 - f)

    def centred(lat, lon):
        n = a / np.sqrt(1 - e2 * np.sin(lat) ** 2)
        return n * np.cos(lat) * np.cos(lon), n * np.cos(lat) * np.sin(lon), n * (1 - e2) * np.sin(lat)

    lat0, lon0 = np.radians(origin)
    here = centred(np.radians(latitude), np.radians(longitude))
    dx, dy, dz = (p - p0 for p, p0 in zip(here, centred(lat0, lon0), strict=True))
    east = -np.sin(lon0) * dx + np.cos(lon0) * dy
    north = -np.sin(lat0) * (np.cos(lon0) * dx + np.sin(lon0) * dy) + np.cos(lat0) * dz
    return east, north


def make(path, step):
    """Return the table (name -> column), the counts and the sha256 of the lines."""
    frames, digest = read_lines(path)
    count = Counter({"lines read": len(frames)})
    first = next(i for i, f in enumerate(frames) if (f["df"], f.get("bds")) == ("17", "05"))
    count["first line used"] = first + 1
    kept = without_echoes(frames[first:])
    count["echoes dropped"] = len(frames) - first - len(kept)
    count["frames examined"] = len(kept)
    count.update({f"downlink format {df}": n for df, n in Counter(f["df"] for f in kept).items()})

    def despike(table):
        clean = {}
        for name, (t, v) in table.items():
            v = np.degrees(np.unwrap(np.radians(v))) if name in ("track", "heading") else v
            clean[name] = without_spikes(t, v, SPIKE[name])
            count[f"{name}: readings used"] = len(clean[name][0])
            count[f"{name}: spikes dropped"] = len(t) - len(clean[name][0])
        return clean

    clean = despike(adsb(kept))
    answers, kinds = radar_answers(kept, clean)
    clean |= despike(answers)
    count.update(kinds)

    begin, end = np.ceil(kept[0]["timestamp"]), kept[-1]["timestamp"]
    grid = begin + step * np.arange(int((end - begin - step / 2) / step) + 1)
    count["unix time of row 0"] = int(begin)
    lat, lon = (interpolated(*clean[k], grid, step) for k in ("latitude", "longitude"))
    origin = [clean["latitude"][1][0], clean["longitude"][1][0]]
    count.update({"origin latitude": origin[0], "origin longitude": origin[1]})
    east, north = east_north(lat, lon, origin)
    mean = {k: cell_means(t, v, grid, step) for k, (t, v) in clean.items()}
    table = {
        "time_s": (grid - begin, 0 if step == int(step) else 3),
        "latitude_deg": (lat, 6),
        "longitude_deg": (lon, 6),
        "east_m": (east, 1),
        "north_m": (north, 1),
        "altitude_m": (mean["altitude"] * FOOT, 2),
        "vertical_rate_mps": (mean["vertical_rate"] * FOOT / 60, 3),
        "ground_speed_mps": (mean["ground_speed"] * KNOT, 2),
        "track_deg": (mean["track"], 3),
        "roll_deg": (mean["roll"], 3),
        "track_rate_degps": (mean["track_rate"], 4),
        "heading_deg": (mean["heading"], 3),
        "true_airspeed_mps": (mean["true_airspeed"] * KNOT, 2),
        "indicated_airspeed_mps": (mean["indicated_airspeed"] * KNOT, 2),
        "mach": (mean["mach"], 4),
    }
    return table, count, digest


def write(table, path):
    """Write the columns as CSV, empty where NaN."""
    rows = [",".join(table)]
    for i in range(len(table["time_s"][0])):
        rows.append(",".join("" if np.isnan(c[i]) else f"{c[i]:.{d}f}" for c, d in table.values()))
    Path(path).write_text("\n".join(rows) + "\n", encoding="utf-8", newline="\n")


def main():
    """Read the arguments, write the file, print the hashes and the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("source", help="traffic-2.13.tar.gz or full_flight_short.jsonl")
    parser.add_argument("out", help="the CSV to write")
    parser.add_argument("--step", type=float, default=2.0, help="seconds between rows (default 2)")
    args = parser.parse_args()
    table, count, digest = make(args.source, args.step)
    write(table, args.out)
    print("sha256 of", args.source, hashlib.sha256(Path(args.source).read_bytes()).hexdigest())
    print("sha256 of the JSON lines", digest)
    print("sha256 of", args.out, hashlib.sha256(Path(args.out).read_bytes()).hexdigest())
    for name, number in count.items():
        print(f"{name}: {number}")
    for name, (column, _) in table.items():
        print(f"missing in {name}: {np.isnan(column).sum()} of {len(column)} ({np.isnan(column).mean():.1%})")


if __name__ == "__main__":
    main()
