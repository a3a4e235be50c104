"""Plots from messages: Mode S frames, AIS, NMEA and GPX; whatever the bytes, an answer or a clear refusal."""

import json
import os
import random
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from draws import draws

from driftwise.engine.errors import InputError
from driftwise.tracking.formats.logs import checksum
from driftwise.tracking.formats.modes import remainder
from driftwise.tracking.frames import geographic
from driftwise.tracking.read import read_plots

DATA = Path(os.environ.get("DRIFTWISE_DATA", "")) / "tracking"
recorded = pytest.mark.skipif(not DATA.is_dir(), reason="DRIFTWISE_DATA names no folder with tracking recordings")
NOON = datetime(2024, 3, 1, 12, tzinfo=UTC).timestamp()
EVEN, ODD = "8d40621d58c382d690c8ac2863a7", "8d40621d58c386435cc412692ad6"  # a textbook's pair: 52.2572 N, 3.9194 E


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def whats(plots):
    return [(fault.offset, fault.what) for fault in plots.faults]


@pytest.fixture(scope="module")
def flight():
    """The recorded frames, and the airborne positions that were decoded when they were received."""
    if not DATA.is_dir():
        pytest.skip("DRIFTWISE_DATA names no folder with tracking recordings")
    path = next((DATA / "modes_raw").glob("*.jsonl"))
    records = [json.loads(line) for line in path.read_text().splitlines()]
    rows = []
    for r in records:
        if (
            r["df"] == "17"
            and r.get("bds") == "05"
            and "latitude" in r
            and (not rows or r["timestamp"] - rows[-1][0] >= 0.05)
        ):
            rows.append((r["timestamp"], r["latitude"], r["longitude"], r["altitude"] * 0.3048))
    return path, records, np.array(rows)


def test_frames_with_decoded_fields_need_no_decoder(flight, monkeypatch):
    path, _, rows = flight
    monkeypatch.setitem(__import__("sys").modules, "rs1090", None)
    plots = read_plots(path)
    assert len(rows) == len(plots) == 1012 and set(plots.key) == {"393322"} and not plots.faults
    np.testing.assert_array_equal(plots.time, rows[:, 0])
    np.testing.assert_allclose(geographic(plots.position, plots.origin), rows[:, 1:3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(plots.altitude, rows[:, 3])


def test_bare_frames_are_decoded_to_the_recorded_fields(flight, tmp_path):
    pytest.importorskip("rs1090")
    _, records, rows = flight
    lines = [f"{r['timestamp']:.6f} {r['frame']}" for r in records]
    lines[100] = lines[100][:-1] + ("0" if lines[100][-1] != "0" else "1")
    hurt = next(k for k, r in enumerate(records) if r["df"] == "17" and k > 500)
    text = records[hurt]["frame"]
    lines[hurt] = f"{records[hurt]['timestamp']:.6f} {text[:20]}{'0' if text[20] != '0' else '1'}{text[21:]}"
    plots = read_plots(written(tmp_path, "frames.txt", "\n".join(lines)))
    found = np.searchsorted(rows[:, 0] + 1e-3, plots.time)
    assert len(plots) >= len(rows) - 10  # a pair is needed before the first position is known
    np.testing.assert_allclose(plots.time, rows[found, 0], rtol=0, atol=2e-6)
    np.testing.assert_allclose(geographic(plots.position, plots.origin), rows[found, 1:3], rtol=0, atol=1e-9)
    assert (hurt + 1, "the parity of the frame fails (DF 17)") in whats(plots)
    assert remainder(text) == 0 != remainder(lines[hurt].split()[1])
    callsigns = {r["callsign"].strip() for r in records if r["df"] == "17" and r.get("callsign")}
    assert set(plots.name) <= callsigns | {""} and plots.name[-1] in callsigns


@pytest.mark.parametrize(
    "text",
    [
        f"@{0:012x}{EVEN};\n@{int(2 * 12e6):012x}{ODD};\n*nonsense;\n",
        f"0.0,{EVEN}\n2.0,{ODD.upper()}\n3.0,8d40\n",
        f"msg,rawmsg,time\n1,{EVEN},0\n2,{ODD},2\n3,8d40,3\n",
        "".join(
            json.dumps({"timestamp": t, "frame": f}) + "\n" for t, f in ((0, EVEN), (2, ODD), (3, "zz"), (2.01, ODD))
        ),
    ],
)
def test_frames_in_four_notations(tmp_path, text):
    pytest.importorskip("rs1090")
    plots = read_plots(written(tmp_path, "avr", text))
    assert plots.time.tolist() == [2.0] and plots.key.tolist() == ["40621D"]
    np.testing.assert_allclose(plots.origin, [52.2658, 3.9389], atol=1e-4)
    np.testing.assert_allclose(plots.altitude, 38000 * 0.3048)
    assert len(plots.faults) == 1 and "14 or 28 hex digits" in plots.faults[0].what and plots.faults[0].offset in (3, 4)


def test_frames_without_times_or_decoder_say_so(tmp_path, monkeypatch):
    path = written(tmp_path, "avr", f"*{EVEN};\n*{ODD};\n")
    with pytest.raises(InputError, match="the frames have no times"):
        read_plots(path)
    monkeypatch.setitem(__import__("sys").modules, "rs1090", None)
    with pytest.raises(ImportError, match=r"pip install driftwise\[tracking\]"):
        read_plots(written(tmp_path, "timed", f"1 {EVEN}\n2 {ODD}\n"))


def sentence(body, mark="$"):
    return f"{mark}{body}*{checksum(body):02X}"


def test_nmea_over_midnight(tmp_path):
    lines = [
        sentence("GPGGA,235958.00,4807.0380,N,01131.0000,W,1,08,0.9,545.4,M,46.9,M,,"),
        "14:00 " + sentence("GPRMC,235958.00,A,4807.0380,N,01131.0000,W,022.4,084.4,290224,003.1,W"),
        sentence("GPGSV,1,1,00"),
        sentence("GPGGA,000002.50,4807.0390,S,01131.0000,E,1,08,0.9,546.4,M,46.9,M,,"),
        sentence("GPGGA,000003.50,4807.0390,S,01131.0000,E,1,08,0.9,546.4,M,46.9,M,,")[:-1] + "x",
        sentence("GPGGA,000004.50,9907.0390,S,01131.0000,E,1,08,0.9,546.4,M,46.9,M,,"),
        sentence("GPGGA,000005.50,,,,,0,00,,,M,,M,,"),
        sentence("GPRMC,000006,A,4807.0390,S,01131.0000,E,022.4,084.4,010324,003.1,W"),
    ]
    plots = read_plots(written(tmp_path, "log.nmea", "\r\n".join(lines)))
    midnight = datetime(2024, 3, 1, tzinfo=UTC).timestamp()
    assert (plots.time - midnight).tolist() == [-2, 2.5, 6]
    assert plots.altitude[:2].tolist() == [545.4, 546.4] and np.isnan(plots.altitude[2])
    wanted = [[48 + 7.038 / 60, -11 - 31 / 60], [-48 - 7.039 / 60, 11 + 31 / 60]]
    np.testing.assert_allclose(plots.origin, wanted[0], atol=1e-12)
    assert [offset for offset, _ in whats(plots)] == [5, 6, 7]
    assert "checksum" in plots.faults[0].what and "without a fix: 1" in plots.faults[2].what


def test_gpx(tmp_path):
    def point(k, rest=""):
        rest = rest or f"<time>2024-03-01T12:00:0{k}Z</time>"
        return f'<trkpt lat="{50 + k / 1000}" lon="10"><ele>{k}</ele>{rest}</trkpt>'

    body = "".join(point(k) for k in (0, 1, 1, 2)) + point(3, "<name>no time</name>")
    head = '<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/1"><trk><name>boat</name><trkseg>'
    tail = f"</trkseg></trk><trk><trkseg>{point(5)}</trkseg></trk></gpx>"
    plots = read_plots(written(tmp_path, "log.gpx", head + body + tail))
    assert (plots.time - NOON).tolist() == [0, 1, 2, 5] and plots.altitude.tolist() == [0, 1, 2, 5]
    assert plots.key.tolist() == ["boat"] * 3 + ["track 2"]
    assert [what for _, what in whats(plots)] == [
        "points without a time or a position: 1", "points at a time that their track has already: 1",
    ]  # fmt: skip
    cut = read_plots(written(tmp_path, "cut.gpx", (head + body)[:-40]))
    assert len(cut) == 3 and "cannot be read any further" in cut.faults[0].what
    bomb = '<?xml version="1.0"?><!DOCTYPE gpx [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><gpx>&b;</gpx>'
    with pytest.raises(InputError, match="document type or entities"):
        read_plots(written(tmp_path, "bomb.gpx", bomb))


def ships():
    """Sentences of two ships and what they say."""
    encode = pytest.importorskip("pyais.encode").encode_dict

    def at(k, **fields):
        position = {"type": 1, "mmsi": "211000001", "lat": 54.5 + k / 1000, "lon": 10.25, "speed": 10.1, "second": k}
        return encode({**position, **fields}, talker_id="AI", sentence_type="VDM")

    name = encode(
        {"type": 5, "mmsi": "211000001", "shipname": "NAMED", "callsign": "DABC"},
        talker_id="AI",
        sentence_type="VDM",
        seq_id=3,
    )
    return at, name


def test_ais_with_times_written_in_four_ways(tmp_path):
    at, name = ships()
    tag = f"s:rx,c:{NOON:.0f}"
    lines = [
        f"\\{tag}*{checksum(tag):02X}\\" + at(0)[0],
        f"{NOON + 4:.3f} " + name[0],
        f"2024-03-01T12:00:05Z {at(5)[0]}",
        f"{name[1]}",
        f"{at(5)[0]},r003669945,{NOON + 6:.0f}",  # the same transmission, heard elsewhere
        f"{at(8, type=18, mmsi='002110002')[0]},{NOON + 8:.0f}",
        f"{NOON + 9:.0f} {at(0, lat=91, lon=181)[0]}",
        f"{NOON + 10:.0f} {at(10)[0][:-1]}Z",
        f"{NOON + 11:.0f} {name[1]}",
        f"{NOON + 12:.0f} " + sentence("AIVDM,1,1,,A,139Lg0,0", "!"),
        at(13)[0],
    ]
    plots = read_plots(written(tmp_path, "ais.txt", "\n".join(lines)))
    assert (plots.time - NOON).tolist() == [0, 5, 8]
    assert plots.key.tolist() == ["211000001", "211000001", "002110002"]
    assert plots.name.tolist() == ["NAMED", "NAMED", ""]
    place = geographic(plots.position, plots.origin)
    np.testing.assert_allclose(place, [[54.5, 10.25], [54.505, 10.25], [54.508, 10.25]], atol=2e-6)
    told = dict(whats(plots))
    assert set(told) == {7, 8, 9, 10, 11} and "checksum" in told[8] and "cut before its position" in told[10]
    assert told[9] == "part 2 of 2 without the part before it" and "not available" in told[7]
    with pytest.raises(InputError, match="AIS sentences have no times"):
        read_plots(written(tmp_path, "untimed.txt", "\n".join(at(k)[0] for k in range(3))))


def test_ais_without_its_library_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyais", None)
    with pytest.raises(ImportError, match=r"pip install driftwise\[tracking\]"):
        read_plots(written(tmp_path, "ais.txt", f"{NOON:.0f} {sentence('AIVDM,1,1,,A,139Lg0,0', '!')}"))


@recorded
def test_radar_recordings_go_to_their_reader():
    pytest.importorskip("asterix")
    plots = read_plots([DATA / "asterix" / "cat_062_065.pcap", DATA / "asterix" / "cat062cat065.raw"])
    assert len(plots) == 4 and plots.origin is not None
    with pytest.raises(InputError, match="sites of their radars"):
        read_plots(DATA / "asterix" / "cat_034_048.pcap")
    sites = dict.fromkeys("25/201 25/13 25/204 25/11 25/14 25/205 25/12 25/2 25/203 25/202".split(), (46.0, 15.0, 500))
    assert len(read_plots(DATA / "asterix" / "cat_034_048.pcap", sites=sites, origin=(46, 15))) > 60


def samples():
    table = "time,lat,lon,id,alt_ft\n" + "".join(
        f"{k},{50 + k / 999},{10 - k / 999},A{k % 3},{100 * k}\n" for k in range(12)
    )
    yield table
    yield table.replace(",", ";").replace(".", ",")
    yield json.dumps([{"time": k, "lat": 50 + k / 999, "lon": 10.0, "id": "é"} for k in range(8)], ensure_ascii=False)
    yield "".join(json.dumps({"timestamp": k, "frame": f}) + "\n" for k, f in enumerate([EVEN, ODD] * 4))
    yield "".join(f"{k} {f}\n" for k, f in enumerate([EVEN, ODD] * 4))
    yield "".join(sentence(f"GPGGA,00000{k},4807.0390,S,0113{k}.0,E,1,08,0.9,5,M,4,M,,") + "\n" for k in range(8))
    at, name = ships()
    yield "".join(f"{NOON + k:.0f} {at(k)[0]}\n" for k in range(6)) + f"{NOON:.0f} {name[0]}\n{name[1]}\n"
    yield (
        "<gpx><trk><trkseg>"
        + '<trkpt lat="1" lon="2"><time>2024-03-01T12:00:00Z</time></trkpt>' * 4
        + "</trkseg></trk></gpx>"
    )


def damaged(rng, data):
    """Bytes cut, flipped, doubled, inserted or in another encoding."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 40))):
        at, kind = rng.randrange(len(data) or 1), rng.randrange(6)
        if kind == 0:
            del data[at:]
        elif kind == 1:
            data[at : at + 1] = bytes([rng.randrange(256)])
        elif kind == 2:
            data[at:at] = rng.randbytes(rng.randrange(1, 9))
        elif kind == 3:
            data[at:at] = data[at : at + rng.randrange(60)]
        elif kind == 4:
            data[at : at + rng.randrange(30)] = rng.choice(
                (b"", b"\n", b'"', b"nan", b"1e999", b",,,", b"{", b"]", b"\xff\xfe")
            )
        else:
            data = bytearray(
                bytes(data).decode("utf-8", "replace").encode(rng.choice(("latin-1", "utf-16", "utf-8-sig")), "replace")
            )
    return bytes(data)


@draws("count", 150, 600)
def test_damaged_files_give_plots_and_faults_or_a_clear_refusal(count, tmp_path):
    """Inputs from one seed: nothing but `InputError`, and what is read is finite and in order."""
    pytest.importorskip("rs1090")
    rng, read, refused = random.Random(8), 0, []
    good = [text.encode() for text in samples()]
    for number in range(count):
        data = rng.randbytes(rng.randrange(1, 300)) if number % 20 == 0 else damaged(rng, good[number % len(good)])
        path = written(tmp_path, "fuzzed", data)
        try:
            plots = read_plots(path)
        except InputError as error:
            refused.append(str(error))
        else:
            read += 1
            assert np.isfinite(plots.position).all() and (np.diff(plots.time) >= 0).all()
            assert all(fault.source in (str(path), "plots") and fault.what for fault in plots.faults)
    assert read > count / 3 and len(refused) > count / 6 and all(text.startswith(str(path)) for text in refused)


def test_a_receiver_among_many_instruments_of_a_boat(tmp_path):
    """A plotter's log: one sentence in eleven has a position; all of them are the boat's own, gaps or none."""
    others = (
        "SDDBT,30.1,f,9.1,M,5.0,F WIMWV,120.0,R,10.5,N,A HCHDM,045.0,M VWVHW,,T,045.0,M,5.9,N,,K YXMTW,12.0,C".split()
    )
    others += "IIVLW,100.0,N,1.0,N TIROT,0.0,A SDDPT,9.1,0.5 ERRPM,E,1,1500,,A PMGNST,02.1,3".split()
    lines = []
    for k in [*range(60), *range(600, 660)]:
        fix = f"GPGGA,10{k // 60:02d}{k % 60:02d},50{48 + k * 2e-3:07.4f},N,00118.0000,W,1,08,1.0,5.0,M,47.0,M,,"
        lines += [sentence(body) for body in (*others, fix)]
    plots = read_plots(written(tmp_path, "gull 7.nmea", "\n".join(lines)))
    assert len(plots) == 120 and set(plots.key) == {"gull 7"} and not plots.faults


def test_what_a_receiver_writes_of_itself_is_one_object(tmp_path):
    header, rows = (
        "timestamp,latitude,longitude,{}\n",
        [f"{1.7e9 + k:.0f},{51 + k * 1e-5:.5f},0.1,8\n" for k in range(9)],
    )
    own = read_plots(written(tmp_path, "walk.csv", header.format("satellites") + "".join(rows)))
    seen = read_plots(written(tmp_path, "seen.csv", header.format("quality") + "".join(rows)))
    assert set(own.key) == {"walk"} and set(seen.key) == {""}
