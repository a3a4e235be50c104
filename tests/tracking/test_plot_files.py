"""Plots from tables: recordings against an independent small reading, newcomers' tables, what is said of bad ones."""

import csv
import gzip
import json
import os
import tracemalloc
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from driftwise.engine.errors import InputError
from driftwise.tracking import read
from driftwise.tracking.frames import geographic
from driftwise.tracking.read import read_plots, recognise_plots, unpacked

DATA = Path(os.environ.get("DRIFTWISE_DATA", "")) / "tracking"
recorded = pytest.mark.skipif(not DATA.is_dir(), reason="DRIFTWISE_DATA names no folder with tracking recordings")
NOON = datetime(2024, 3, 1, 12, tzinfo=UTC).timestamp()


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def agree(plots, rows):
    """Plots are these rows (time, latitude, longitude, altitude in m or None, key), in order of time."""
    rows = sorted(rows, key=lambda row: row[0])
    np.testing.assert_allclose(plots.time, [row[0] for row in rows], rtol=0, atol=1e-6)
    place = geographic(plots.position, plots.origin)
    np.testing.assert_allclose(place, [row[1:3] for row in rows], rtol=0, atol=1e-9)
    np.testing.assert_allclose(plots.altitude, [np.nan if row[3] is None else row[3] for row in rows], atol=1e-6)
    assert plots.key.tolist() == [row[4] for row in rows]


def news(rows):
    """The rows (time, latitude, longitude, altitude, key) that are no repeats; theirs is the first of equal times."""
    kept, last = [], {}
    for row in sorted(rows, key=lambda row: row[0]):
        before = last.get(row[4])
        if before is None or (row[0] != before[0] and row[1:3] != before[1:3]):
            kept.append(row)
        if before is None or row[0] != before[0]:
            last[row[4]] = row
    return kept


@recorded
@pytest.mark.parametrize("path", sorted((DATA / "adsb_tracks").glob("*.gz")), ids=lambda path: path.name)
def test_state_vectors_are_read_with_the_age_of_their_positions(path):
    rows = []
    for r in json.loads(gzip.decompress(path.read_bytes())):
        time = (r.get("last_position") or r["timestamp"]) / 1000
        high = r["altitude"]
        rows.append((time, r["latitude"], r["longitude"], None if high is None else high * 0.3048, r["icao24"].upper()))
    plots = read_plots(path)
    assert len(plots) >= 680
    agree(plots, news([row for row in rows if row[1] is not None]))


@recorded
def test_opensky_states_take_the_time_of_the_position_and_metres():
    path = DATA / "stonesoup" / "OpenSky_Plane_States.csv"
    with open(path) as file:
        rows = [
            (float(r["lastposupdate"]), float(r["lat"]), float(r["lon"]), float(r["geoaltitude"]), r["icao24"].upper())
            for r in csv.DictReader(file)
        ]
    plots = read_plots(path)
    agree(plots[np.lexsort((plots.key.astype(str), plots.time))], sorted(news(rows), key=lambda r: (r[0], r[4])))
    assert len(rows) - len(plots) == int(plots.faults[0].what.split(": ")[1].split(",")[0]) > 600
    assert {part: column.unit for part, column in recognise_plots(path).items() if column.unit} == {
        "time": "Unix s", "position_time": "Unix s", "latitude": "deg", "longitude": "deg", "altitude": "m",
    }  # fmt: skip


@recorded
def test_gps_log_of_a_uav_and_returns_of_a_radar():
    plots = read_plots(DATA / "stonesoup" / "UAV_Rot.csv")
    with open(DATA / "stonesoup" / "UAV_Rot.csv") as file:
        rows = list(csv.DictReader(file))
    start = datetime(2019, 12, 9, 10, 49, 35, tzinfo=UTC).timestamp()
    times = start + np.array([float(r["timestamp"]) for r in rows]) - float(rows[0]["timestamp"])
    agree(
        plots,
        [(t, float(r["latitude"]), float(r["longitude"]), float(r["altitude (m)"]), "") for t, r in zip(times, rows)],
    )
    path = DATA / "longrange_radar" / "gofer06.json"
    returns = [w for w in json.loads(path.read_text())["waypoints"] if w["site"] != "anchor"]
    plots = read_plots(path)
    stamp = [datetime.fromisoformat(w["utc"]).timestamp() for w in returns]
    agree(plots, [(t, w["lat"], w["lon"], w["alt_ft"] * 0.3048, "") for t, w in zip(stamp, returns)])
    assert len(plots) == 284 and set(plots.sensor) == {"PLA"} and "anchors of a track" in plots.faults[0].what


@recorded
def test_scans_from_a_ship_and_what_is_no_table_of_plots():
    path = DATA / "autoferry" / "scenario2_detections.json"
    plots = read_plots(path)
    scans = [s for s in json.loads(path.read_text()) if s["sensorID"] == 2]
    north = np.concatenate([np.ravel(s["measurement"][0]) + s["ownshipPosition"][0] for s in scans if s["measurement"]])
    radar = plots[plots.sensor == "radar"]
    np.testing.assert_allclose(np.sort(radar.position[:, 1]), np.sort(north))
    assert plots.origin is None and "bearings" in plots.faults[0].what
    with pytest.raises(InputError, match="holds no records of plots"):
        read_plots(DATA / "autoferry" / "scenario2_groundTruth.json")


TABLES = {  # the same two plots at 12:00:00 and 12:00:04 of 1 March 2024, as people write them
    "semicolon": "\ufeffZeit;Breite;Länge;Höhe [ft];ID\n01.03.2024 12:00:00;50,5;-1,25;1000;A1\n"
    "01.03.2024 12:00:04;50,501;-1,25;1000;A1\n",
    "units": "time_ms,lat_rad,lon (deg),altitude_m,track id\n"
    + "".join(f"{1000 * (NOON + k):.0f},{np.radians(50.5 + k / 4000)},-1.25,304.8,A1\n" for k in (0, 4)),
    "danish": "# Timestamp,Type of mobile,MMSI,Latitude,Longitude,SOG,Name,alt_ft\n"
    "01/03/2024 12:00:00,Class A,A1,50.5,-1.25,9,X,1000\n"
    "13/03/2024 12:00:00,Class A,A2,91,0,9,Y,0\n01/03/2024 12:00:04,Class A,A1,50.501,-1.25,9,X,1000\n",
    "cadastre": "MMSI,BaseDateTime,LAT,LON,SOG,VesselName,alt_m\nA1,2024-03-01T12:00:00,50.5,-1.25,9,X,304.8\n"
    "A1,2024-03-01T12:00:04,50.501,-1.25,9,X,304.8\n",
    "date and time": "date,time,id,lat,lng,alt\n2024-03-01,12:00:00,A1,50.5,-1.25,304.8\n"
    "2024-03-01,12:00:04,A1,50.501,-1.25,304.8\n",
    "utf16": "utc\tlatitude\tlongitude\talt_ft\tid\n2024-03-01T12:00:00Z\t50.5\t-1.25\t1000\tA1\n"
    "2024-03-01T13:00:04+01:00\t50.501\t-1.25\t1000\tA1\n",
    "flight levels": "timestamp;target;lat;lon;FL\n1709294400;A1;50.5;-1.25;10\n1709294404;A1;50.501;-1.25;10\n",
    "receiver": "timestamp,icao24,latitude,longitude,altitude,groundspeed\n1709294400,a1,50.5,358.75,1000,200\n"
    "1709294404,a1,50.501,358.75,1000,200\n",
    "records": json.dumps({"now": NOON + 99, "aircraft": [
        {"time": NOON, "hex": "a1", "where": {"lat": 50.5, "lon": -1.25}, "alt_baro": 1000},
        {"time": NOON + 4, "hex": "a1", "where": {"lat": 50.501, "lon": -1.25}, "alt_baro": 1000}]}),
    "columns": json.dumps({"t": {"0": NOON, "1": NOON + 4}, "id": {"0": "A1", "1": "A1"},
                           "lat": {"0": 50.5, "1": 50.501}, "lon": {"0": -1.25, "1": -1.25},
                           "height": {"0": 304.8, "1": 304.8}}),
    "split": json.dumps({"columns": ["t", "id", "lat", "lon", "z"], "index": [0, 1],
                         "data": [[NOON, "A1", 50.5, -1.25, 304.8], [NOON + 4, "A1", 50.501, -1.25, 304.8]]}),
    "geojson": json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [-1.25, 50.5 + k / 4000, 304.8]},
         "properties": {"time": NOON + k, "id": "A1"}} for k in (0, 4)]}),
    "line": json.dumps({"type": "Feature", "geometry": {"type": "LineString", "coordinates": [
        [-1.25, 50.5, 304.8], [-1.25, 50.501, 304.8]]}, "properties": {
            "id": "A1", "coordTimes": ["2024-03-01T12:00:00Z", "2024-03-01T12:00:04Z"]}}),
    "json lines": f'{{"time": {NOON}, "id": "A1", "lat": 50.5, "lon": -1.25, "alt": 304.8}}\n'
    f'{{"time": {NOON + 4}, "id": "A1", "lat": 50.501, "lon": -1.25, "alt": 304.8}}\n',
}  # fmt: skip


@pytest.mark.parametrize("name", TABLES)
def test_tables_as_people_write_them_give_the_same_plots(tmp_path, name):
    data = TABLES[name].encode("utf-16" if name == "utf16" else "utf-8")
    rows = [(NOON, 50.5, -1.25, 304.8, "A1"), (NOON + 4, 50.501, -1.25, 304.8, "A1")]
    plots = read_plots(written(tmp_path, "table.txt", data))
    agree(plots, rows)
    packed = gzip.compress(data[:40]) + gzip.compress(data[40:])
    agree(read_plots(written(tmp_path, "table.gz", packed)), rows)
    assert [fault.offset for fault in plots.faults] == ([3] if name == "danish" else [])


def test_frames_of_memory_and_parquet(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({
        "t": pa.array([datetime(2024, 3, 1, 12, 0, k, tzinfo=UTC) for k in (4, 0)], pa.timestamp("us", "UTC")),
        "id": pa.array([7, 7]), "lat": [50.501, 50.5], "lon": [-1.25, -1.25],
        "site": pa.array(["N", "N"]).dictionary_encode(),
    })  # fmt: skip
    pq.write_table(table, tmp_path / "plots.parquet")
    for source in (tmp_path / "plots.parquet", table):
        plots = read_plots(source)
        agree(plots, [(NOON, 50.5, -1.25, None, "7"), (NOON + 4, 50.501, -1.25, None, "7")])
        assert plots.sensor.tolist() == ["N", "N"]


def test_ranges_of_radars(tmp_path):
    text = "time,range_nm,azimuth,sensor,altitude_ft\n1,10,90,25/201,\n5,10,0,25/201,20000\n"
    path = written(tmp_path, "radar.csv", text)
    plots = read_plots(path)  # about the radar, as nobody says where it stands; height brings the second nearer
    np.testing.assert_allclose(plots.position, [[18520, 0], [0, 18520 * 0.944]], atol=15)
    assert plots.origin is None
    placed = read_plots(path, site=(46.2, 15.1, 0))
    np.testing.assert_allclose(placed.position, plots.position, atol=40)
    assert placed.origin == (46.2, 15.1)
    same = read_plots(path, sites="25/201=46.2,15.1,0", origin=(46.2, 15.1))
    np.testing.assert_array_equal(placed.position, same.position)
    with pytest.raises(InputError, match=r"missing: '25/202'"):
        read_plots(written(tmp_path, "two.csv", text + "9,10,0,25/202,\n"), sites="25/201=46.2,15.1,0")


def test_midnight_and_several_files_in_one_frame(tmp_path):
    first = written(
        tmp_path,
        "a1.csv",
        "time of day,lat,lon,id\n23:59:58,50,10,A\n00:00:02,50.001,10,A\n23:59:59,50,11,B\n0:0:3.5,50.001,11,B\n",
    )
    plots = read_plots(first)
    assert plots.time.tolist() == [86398, 86399, 86402] and "'0:0:3.5'" in plots.faults[0].what
    written(tmp_path, "a2.csv", "tod,lat,lon,id\n86390,50,10.5,C\n86399.5,50,10.501,C\n3,50,10.502,C\n")
    both = read_plots(str(tmp_path / "a?.csv"))
    assert both.time.tolist() == [86390, 86398, 86399, 86399.5, 86402, 86403] and both.origin == plots.origin
    assert both.key.tolist() == ["C", "A", "B", "C", "A", "C"]
    np.testing.assert_allclose(geographic(both.position, both.origin)[0], [50, 10.5], atol=1e-9)


def test_an_override_says_what_a_column_is_and_units(tmp_path):
    path = written(tmp_path, "odd.csv", "when,px,py,lat,lon\n0,1,2,50,10\n1,1.5,2,50,10\n")
    columns = {"time": ("when", "min"), "east": ("px", "km"), "north": ("py", "km")}
    plots = read_plots(path, columns=columns)
    assert plots.time.tolist() == [0, 60] and plots.position.tolist() == [[1000, 2000], [1500, 2000]]
    assert recognise_plots(path, columns)["east"] == ("px", "km")
    for wrong, words in (
        ({"when": "time"}, "columns names 'when'"),
        ({"time": "wen"}, "no column 'wen' for the time. Did you mean 'when'"),
        ({"time": ("when", "fortnights")}, "units known"),
        ({"time": "when", "east": "px"}, "none of north"),
    ):
        with pytest.raises(InputError, match=words):
            read_plots(path, columns=wrong)


def test_rows_that_cannot_be_used_are_faults_with_their_line(tmp_path):
    lines = """# recorded by hand
        time,lat,lon,id,sog
        0,50,10,A,9
        1,50,10,A,9

        2,x,10,A,9
        3,,10,A,9
        4,50.1,10,A
        oops,50.1,10,A,9
        5,0,0,A,9
        6,99,10,A,9
        7,50.1,10,A,0
        8,50.1,10,A,0
        8,50.2,10,A,0
        8,50.2,10,,9
        8,50.3,10,,9""".replace(" " * 8, "")
    plots = read_plots(written(tmp_path, "rows.csv", lines))
    assert plots.time.tolist() == [0, 7, 8, 8, 8]  # standing still is news; two unknown objects may share a time
    assert {fault.offset: fault.what for fault in plots.faults} == {
        4: "stale rows, which repeat the position before them: 1, this is the first",
        6: "'lat' is no number below 1e100: 'x'",
        7: "rows without a position: 1, this is the first",
        8: "more or fewer cells than the header",
        9: "'time' is no time: 'oops'",
        10: "latitude and longitude are both 0: no fix",
        11: "position 99, 10 is not on earth",
        14: "rows at a time that their object has already: 1, this is the first",
    }


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("time,lat,lon\n", "no rows"),
        ("lat,lon\n1,2\n3,4\n", "no column of time is recognised"),
        ("time,lat\n1,2\n3,4\n", "a column of latitude, 'lat', but none of longitude"),
        ("time,a,b\n1,2,3\n3,4,5\n", "no columns of position are recognised.* The columns are: time, a, b"),
        ("time,lat,latitude,lon\n1,2,3,4\n5,6,7,8\n", "'latitude' and 'lat' can both be the latitude"),
        ("time,lat,lon\n1,500000,600000\n2,500000,600010\n", "not on earth in degrees"),
        ("time,lat,lon\n1,,\n2,,\n", "no plot has a time and a position; .* rows without a position"),
        ("time,lat,lon\nx,1,2\ny,1,2\n", "no cell of 'time' can be read as a time"),
        ('[{"time": 1, "lat": 2, "lon": 3}, {"time": 2', "cannot be read .*cut short"),
        ("[" * 100_000, "cut short|nested"),
        ("3", "no columns of position|no column of time"),
        ("[[1, 2], [3, 4]]", "no records of plots"),
        ("<html><body>404</body></html>", "but not GPX"),
        (b"PK\x03\x04\x00\x00", "zip archive"),
        (b"\x1f\x8b\x08\x00garbage", "gzip file, which is cut short"),
        (b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03garbage", "gzip file is damaged"),
        (b"PAR1\x00\x00", "Parquet"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "binary, but neither ASTERIX"),
    ],
)
def test_what_cannot_be_read_is_said_at_the_door(tmp_path, text, words):
    path = written(tmp_path, "bad", text)
    with pytest.raises(InputError, match=words) as told:
        read_plots(path)
    assert str(told.value).startswith(str(path))
    with pytest.raises(InputError, match="no such file"):
        read_plots(tmp_path / "nowhere.csv")
    with pytest.raises(InputError, match="no file matches"):
        read_plots(str(tmp_path / "nowhere*.csv"))


def test_a_file_that_grows_a_thousandfold_is_no_log():
    data = gzip.compress(b"time,lat,lon\n" + b'"\n' * (40 << 20), 1)
    with pytest.raises(InputError, match="unpacks to more than 64 MB; 100 times its size"):
        unpacked(data, "bomb.csv.gz")


def test_what_unpacks_without_end_is_refused_before_it_is_held(monkeypatch):
    monkeypatch.setattr(read, "SMALL", 1 << 20)
    monkeypatch.setattr(read, "PIECE", 1 << 10)
    data = gzip.compress(bytes(40 << 20))
    tracemalloc.start()
    with pytest.raises(InputError, match="unpacks to more than 1 MB; 100 times its size"):
        unpacked(data, "bomb.csv.gz")
    assert tracemalloc.get_traced_memory()[1] < 8 << 20
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("head", "row", "scale"),
    [
        ("#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_w", "{ns},{x},{y},1.5,1", 1.0),
        ("Frame,Time (s),Position X (mm),Position Y (mm),Position Z (mm)", "{k},{s},{x},{y},1500", 1e-3),
        ("header.stamp;pose.position.x;pose.position.y;pose.position.z", "{ns};{x};{y};1.5", 1.0),
        ("timestamp tx ty tz qx qy qz qw", "{s} {x} {y} 1.5 0 0 0 1", 1.0),
    ],
)
def test_tables_of_motion_capture(tmp_path, head, row, scale):
    """Positions of a rigid body in a room, whole nanoseconds, pictures counted beside."""
    rows = [
        row.format(k=k, s=1.7e9 + k / 100, ns=1_700_000_000 * 10**9 + k * 10**7, x=1.2 + k, y=0.7) for k in range(40)
    ]
    plots = read_plots(written(tmp_path, "body.csv", "\n".join([head, *rows])))
    np.testing.assert_allclose(np.diff(plots.time), 0.01, atol=1e-6)
    np.testing.assert_allclose(plots.position[:, 0], scale * (1.2 + np.arange(40)))
    np.testing.assert_allclose(plots.altitude, 1.5)
