"""Plots out of ASTERIX: values against libasterix, recordings, time, sites, captures, refusals, damaged bytes."""

import datetime
import json
import math
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("asterix.generated", reason='pip install "driftwise[tracking]"')

import asterix_oracle as oracle
from asterix_written import NEWEST, classic, ethernet, file_of, polar

from driftwise.engine.errors import InputError
from driftwise.tracking.formats import asterix_records as structure
from driftwise.tracking.formats import asterix_time
from driftwise.tracking.formats.asterix import decode, read_asterix
from driftwise.tracking.formats.asterix_reports import MEANING
from driftwise.tracking.frames import east_north
from driftwise.tracking.sites import Site, read_sites

DATA = Path(os.environ.get("DRIFTWISE_DATA", Path(__file__).parents[4] / "shared" / "data")) / "tracking" / "asterix"
recorded = pytest.mark.skipif(not DATA.exists(), reason=f"no recordings in {DATA}: set DRIFTWISE_DATA")


def message(time, sic=1, category=34, type=1, **items):
    spec = oracle.SPECS[category, NEWEST[category]]
    return oracle.block(category, [oracle.lists(spec)["-"].create(
        {"010": (("SAC", 25), ("SIC", sic)), "000": type, "030": float(time), **items})])  # fmt: skip


def same(ours, theirs):
    return (ours != ours and theirs is None) or math.isclose(ours, theirs, rel_tol=1e-12, abs_tol=1e-12)


def meant(category, edition, body):
    """Return what our reader says of the first record of a body; None where its values cannot be."""
    spec, at, _, _ = structure.records(structure.table()[category][edition], body, 0, len(body))[0]
    try:
        return MEANING[category](body, spec, at, edition)
    except structure.Malformed:
        return None


def test_values_of_radar_reports_are_libasterixs():
    rng, tried = oracle.generator("values"), 0
    for k in range(300):
        category = (48, 1)[k % 2]
        _, record = oracle.random_record(rng, category, NEWEST[category], 0.6)
        got = meant(category, NEWEST[category], record.unparse().to_bytes())
        if got is None or isinstance(got, str):
            continue
        tried += 1
        q = lambda *path: oracle.quantity(record, *path)  # noqa: E731
        assert same(got.time, q("140") if category == 48 else q("141"))
        if (rho := q("040", "RHO")) is not None:
            assert same(got.first, rho * 1852) and same(got.second, math.radians(q("040", "THETA")))
        elif (x := q("042", "X")) is not None:
            assert same(got.first, x * 1852) and same(got.second, q("042", "Y") * 1852)
        level, item = q("090", "FL" if category == 48 else "HGT"), record.items_regular.get("090")
        if item and item.unparse().to_bytes()[0] & 0xC0 == 0:
            assert same(got.altitude, level * 30.48 if -15 <= level <= 1500 else None)
        else:
            assert got.altitude != got.altitude
        items = record.items_regular
        if category == 48 and "220" in items:
            assert got.key == f"{items['220'].as_uint():06X}"
        elif "070" in items and items["070"].as_uint() < 0x4000:
            assert got.key == "A" + items["070"].variation.get_item("MODE3A").variation.content.as_string()
        else:
            assert got.key == ""
        if got.name:
            assert got.name == items["240"].variation.content.as_string().strip()
    assert tried > 50


def test_values_of_wgs84_reports_are_libasterixs():
    rng, tried = oracle.generator("earth"), 0
    for k in range(400):
        category, edition = [(62, "1.21"), (21, "2.7"), (21, "0.26"), (21, "0.23")][k % 4]
        _, record = oracle.random_record(rng, category, edition, 0.5)
        q = lambda *path: oracle.quantity(record, *path)  # noqa: E731
        times = [q(item) for item in (("071", "073", "077", "030") if category == 21 else ("070",))]
        first = next((t for t in times if t is not None), None)
        fine = edition > "2" and "131" in record.items_regular
        where = "105" if category == 62 else "131" if fine else "130"
        place = (q(where, "LAT"), q(where, "LON"))
        got = meant(category, edition, record.unparse().to_bytes())
        if got is None:  # random times and latitudes are mostly impossible
            assert (first or 0) >= 86400 or abs(place[0]) > 90 or abs(place[1]) > 180
        elif not isinstance(got, str):
            tried += 1
            assert same(got.time, first) and same(got.first, place[0]) and same(got.second, place[1])
            level = q("145") if category == 21 else q("136")
            if level is not None and -15 <= level <= 1500:
                assert same(got.altitude, level * 30.48)
            if category == 21 and "080" in record.items_regular:
                assert got.key == f"{record.items_regular['080'].as_uint():06X}"
    assert tried > 60


@recorded
@pytest.mark.parametrize("name, expected", {
    "cat034.raw": {34: 1}, "cat048.raw": {48: 1}, "cat062cat065.raw": {62: 2, 65: 1},
    "cat_001_002.pcap": {1: 7, 2: 1}, "cat_034_048.pcap": {34: 34, 48: 128}, "cat_062_065.pcap": {62: 2, 65: 1},
}.items())  # fmt: skip
def test_recordings_are_read_completely(name, expected):
    found = decode(DATA / name)
    assert found.faults == ()
    assert {c: found.counts[f"category {c}"] for c in expected} == expected
    for row in found.reports:  # record by record against libasterix
        (record,) = oracle.decode(row.category, NEWEST[row.category], row.octets)
        if row.category == 48:
            assert same(row.body.time, oracle.quantity(record, "140"))
            assert same(row.body.first, oracle.quantity(record, "040", "RHO") * 1852)
            assert same(row.body.second, math.radians(oracle.quantity(record, "040", "THETA")))
            if "220" in record.items_regular:
                assert row.body.key == f"{record.items_regular['220'].as_uint():06X}"
        if row.category == 62:
            assert same(row.body.first, oracle.quantity(record, "105", "LAT"))
            assert same(row.body.time, oracle.quantity(record, "070"))


@recorded
def test_a_capture_of_seven_radars():
    with pytest.raises(InputError, match=r"missing: 25/201, 25/13, .*SAC/SIC.*sites="):
        read_asterix(DATA / "cat_034_048.pcap")
    found = decode(DATA / "cat_034_048.pcap")
    assert found.counts["repeated"] == 63 and found.counts["no detection"] == 2  # both networks were captured
    told = found.sites["25/12"]
    assert (round(told.latitude, 3), round(told.longitude, 3), told.height) == (43.571, 16.406, 780.0)
    assert found.periods == {"25/12": 4.9453125}
    sites = {row.sensor: Site(45.0, 15.0) for row in found.reports if row.sensor not in found.sites}
    plots = read_asterix(DATA / "cat_034_048.pcap", sites=sites)
    assert len(plots) == 63 and plots.origin == (45.0, 15.0) and np.isfinite(plots.covariance).all()
    assert np.abs(plots.time - 1462433758).max() < 30  # Unix time, from the packets' day
    assert plots.key[0] == "3C660C" and plots.name[0] == "DLH65A" and plots.altitude[0] == 330 * 30.48


@recorded
def test_an_edition_that_is_not_known_is_refused_whole():
    plots = read_asterix(DATA / "asterix.pcap")
    assert len(plots) == 0
    assert {f.what.split(":")[0] for f in plots.faults} == {"category 62"}
    assert "100 of 100 blocks do not fit edition 1.21" in plots.faults[0].what
    assert "none of the editions known" in plots.faults[0].what
    for edition in structure.table()[62]:
        assert len(read_asterix(DATA / "asterix.pcap", editions={62: edition})) == 0


def test_a_stream_in_another_edition_names_the_edition_that_fits():
    rng = oracle.generator("edition")
    records = [oracle.random_record(rng, 21, "0.24", 1.0, {"030": 128 * k, "130": k})[1] for k in range(20)]
    data = file_of(*records, category=21)
    plots = read_asterix(data)
    assert len(plots) == 0
    assert "0.24" in plots.faults[0].what and "editions={21:" in plots.faults[0].what
    found = decode(data, editions={21: "0.24"})
    assert found.faults == () and found.counts["category 21"] == 20


def test_one_damaged_block_does_not_cost_the_others():
    records = [polar(3600 + k).unparse().to_bytes() for k in range(30)]
    blocks = [oracle.block(48, [r]) for r in records]
    blocks[7] = oracle.block(48, [records[7][:-1]])
    plots = read_asterix(b"".join(blocks))
    assert len(plots) == 29 and 3607.0 not in plots.time
    (fault,) = plots.faults
    at = sum(map(len, blocks[:7]))
    assert at < fault.offset <= at + len(blocks[7]) and "item 090 runs past the end of its block" in fault.what
    wild = [polar(3600 + k if k != 9 else 90000) for k in range(30)]
    (fault,) = read_asterix(file_of(*wild)).faults
    assert "beyond 24 h" in fault.what


def test_midnight_and_the_day():
    times = [86399.5, 0.25, 86399.75, 4.0]
    data = file_of(*[polar(t) for t in times])
    assert read_asterix(data).time.tolist() == [86399.5, 86399.75, 86400.25, 86404.0]
    midnight = 1719964800.0  # 3 July 2024
    for day in ("2024-07-03", datetime.date(2024, 7, 3), datetime.datetime(2024, 7, 3, 12)):
        assert read_asterix(data, day=day).time[-1] == midnight + 86404
    with pytest.raises(InputError, match="day must be a date"):
        read_asterix(data, day="yesterday")
    wild = [80000, 80004, 20000, 80008, 3000, 80012, 80016]  # two wild clocks do not move the day
    found = read_asterix(file_of(*[polar(t) for t in wild])).time
    assert found.tolist() == [80000, 80004, 80008, 80012, 80016, 86400 + 3000, 86400 + 20000]


def test_one_wild_time_does_not_move_the_day():
    """Half a day back, but for seconds: what comes after it is of the same day all the same."""
    day = 86400.0
    told = [*(86000.0 + np.arange(10)), 86004.0 - 43190.0, *(86030.0 + np.arange(5)), *np.arange(-370.0, -360.0)]
    rows = [
        SimpleNamespace(category=48, sensor="one", captured=np.nan, body=SimpleNamespace(time=time % day))
        for time in told
    ]
    found = asterix_time.times(rows, 0.0)
    expected = np.array(told)
    expected[16:] += day  # after midnight
    expected[10] = found[10]
    np.testing.assert_array_equal(found, expected)


def test_category_1_takes_its_time_from_category_2():
    def plot(seconds):
        items = {"020": ((0, 0, ("SSRPSR", 2), 0, 0, 0, None),), "070": (0, 0, 0, 0, ("MODE3A", "4271"))}
        items |= {"010": 0x1901, "040": (("RHO", 10.0), ("THETA", 90.0)), "141": float(seconds % 512)}
        return oracle.block(1, [oracle.lists(oracle.SPECS[1, "1.4"])["plot"].create(items)])

    wanted = [40000.0, 40005.5, 40510.0, 40516.0]
    data = plot(wanted[0]) + message(40001, category=2) + plot(wanted[1]) + message(40509, category=2)
    data += plot(wanted[2]) + plot(wanted[3])
    plots = read_asterix(data)
    assert plots.time.tolist() == wanted and list(plots.key) == ["A4271"] * 4
    late = classic([ethernet(message(40001, category=2))]) + classic([ethernet(plot(41000))], when=1719990999)[24:]
    assert read_asterix(late).time[0] % 86400 == 41000  # the capture bridges two turns of the short clock
    alone = decode(plot(100))
    assert len(alone.reports) == 0 and alone.counts["without time"] == 1


def test_who_it_is():
    def key(**items):
        return read_asterix(file_of(polar(1, **items))).key[0]

    def code(v, g, text):
        return {"070": (v, g, 0, 0, ("MODE3A", text))}

    assert key(**code(0, 0, "4271")) == "A4271" and key(**code(1, 0, "4271")) == "" == key(**code(0, 1, "4271"))
    assert [key(**code(0, 0, shared)) for shared in ("7000", "2000", "1000", "0000")] == [""] * 4
    assert key(**code(0, 0, "4271"), **{"220": 0x4BAA5F}) == "4BAA5F"
    assert read_asterix(file_of(polar(1, **{"240": "DLH65A"}))).name[0] == "DLH65A"
    for simulated in ((5, 1, 0, 0, 0, None), (5, 0, 0, 0, 1, None)):
        found = decode(file_of(polar(1, **{"020": (simulated,)})))
        assert not found.reports and found.counts["simulated, test or monitor targets"] == 1


def test_two_radars_and_an_aircraft_agree_on_where_it_is():
    """A target at one place is seen by two radars and says itself where it is: one point on one plane."""
    from driftwise.tracking.frames import ecef
    from driftwise.tracking.polar import axes

    place, height = np.radians((46.5, 14.0)), 350 * 30.48
    sites = {"25/1": Site(46.0, 15.0, 780), "25/2": Site(48.0, 12.5, 100)}
    target, records = ecef(*place, height), []
    for sic, site in enumerate(sites.values(), 1):
        phi, lam = np.radians((site.latitude, site.longitude))
        line = target - ecef(phi, lam, site.height)
        east, north, _ = axes(phi, lam)
        azimuth = np.degrees(np.arctan2(line @ east, line @ north)) % 360
        records.append(polar(10 + sic, np.linalg.norm(line) / 1852, azimuth, sic, 350.0))
    items = {"010": 0x1909, "071": 14.0, "131": (("LAT", 46.5), ("LON", 14.0)), "145": 350.0, "080": 0x4BAA5F}
    own = oracle.lists(oracle.SPECS[21, "2.7"])["-"].create(items)
    plots = read_asterix(file_of(*records) + oracle.block(21, [own]), sites=sites)
    truth = east_north([46.5], [14.0], (46.0, 15.0))
    assert plots.origin == (46.0, 15.0) and list(plots.sensor) == ["25/1", "25/2", "25/9"]
    assert np.abs(plots.position - truth).max() < 20  # 1/256 NM and 0.0055 degrees at 200 km
    assert np.abs(plots.position[2] - truth).max() < 1e-2
    # errors are long across the line of sight of each radar
    for k, site in enumerate(sites.values()):
        far = np.linalg.norm(truth - east_north([site.latitude], [site.longitude], plots.origin))
        sd = np.sqrt(np.linalg.eigvalsh(plots.covariance[k]))
        assert sd == pytest.approx(sorted([70, np.radians(0.08) * far]), rel=0.02)
    with pytest.raises(InputError, match=r"missing: 25/2 \(SAC/SIC\)"):
        read_asterix(file_of(*records), sites={"25/1": sites["25/1"]})
    assert list(read_asterix(file_of(*records), sites=["25/1=46,15,780", "25/2=none"]).sensor) == ["25/1"]


def test_one_radar_needs_no_site_and_may_tell_its_own():
    data = file_of(polar(1, 10.0, 90.0, level=100.0), polar(2, 2.0, 0.0, level=400.0))
    plots = read_asterix(data)
    assert plots.origin is None and len(plots) == 1  # the second would be 12 km high at a range of 3.7 km
    assert plots.position[0] == pytest.approx([math.sqrt(18520**2 - 3048**2), 0], abs=5)
    assert "altitude of 12192 m is further from the radar" in plots.faults[0].what
    own = message(0.5, **{"120": (("HGT", 500.0), ("LAT", 46.0), ("LON", 15.0))})
    assert read_asterix(own + data).origin == pytest.approx((46.0, 15.0), abs=3e-5)
    assert decode(b"".join(message(t) for t in (1, 5, 9))).periods == {"25/1": 4.0}


def test_sites_come_in_many_forms(tmp_path):
    expected = {"25/201": Site(46.2, 15.1, 800.0), "25/2": Site(47.0, 13.0, 0.0, 50.0, 0.1)}
    (tmp_path / "a.csv").write_text(
        "SAC,SIC,latitude,longitude,height,range_sd,azimuth_sd\n25,201,46.2,15.1,800,,\n25,2,47,13,,50,0.1\n"
    )
    other = {"latitude": 47, "longitude": 13, "range_sd": 50, "azimuth_sd": 0.1}
    (tmp_path / "a.json").write_text(json.dumps({"25/201": [46.2, 15.1, 800], "25/2": other}))
    (tmp_path / "a.toml").write_text(
        '["25/201"]\nlatitude = 46.2\nlongitude = 15.1\nheight = 800\n["25/2"]\n'
        + "".join(f"{name} = {value}\n" for name, value in other.items())
    )
    for name in ("a.csv", "a.json", "a.toml"):
        assert read_sites(tmp_path / name) == read_sites(str(tmp_path / name)) == expected
    assert read_sites(["25/201=46.2, 15.1, 800", "25/2=47,13,0,50,0.1"]) == expected == read_sites(expected)
    (tmp_path / "bad.csv").write_text("name,lat\nx,1\n")
    for bad, what in {
        "25/201=146.2,15.1": "latitude of a site must be within -90 .. 90.*swapped", "25=46,15": "SAC/SIC",
        "25/1=a,b": "latitude of a site must be a number", "nowhere.csv=": "SAC/SIC", "nowhere.csv": "no file",
        str(tmp_path / "bad.csv"): "needs columns sensor", "25/1=46": "cannot be read",
    }.items():  # fmt: skip
        with pytest.raises(InputError, match=what):
            read_sites(bad)


def test_what_is_not_asterix_is_refused_at_the_door(tmp_path):
    for data in (b"", b"time,x,y\n1,2,3\n", b"\x30\x00", classic([]), b"\xff" * 100):
        with pytest.raises(InputError, match="no ASTERIX block"):
            read_asterix(data)
    with pytest.raises(InputError, match="there is no file"):
        read_asterix(tmp_path / "nothing.raw")
    path = tmp_path / "x.raw"
    path.write_bytes(file_of(polar(1)) + file_of(polar(2))[:-1])
    (fault,) = read_asterix(path).faults
    assert fault.source == str(path) and fault.offset > 0
