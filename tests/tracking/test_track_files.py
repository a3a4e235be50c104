"""Files of tracks, read back by other readers; positions on earth and back."""

import csv
import json
import xml.etree.ElementTree as ET
from datetime import datetime

import numpy as np
import pyarrow.parquet as pq
import pytest

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.tracking.formats.maps import cut_at_antimeridian, write_geojson
from driftwise.tracking.frames import east_north, geographic
from driftwise.tracking.plots import plots

UNIX = 1.72e9
KML = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}


def some(origin=(48.0, 11.0), begin=UNIX, altitude=None, name="A<B>&\x07", velocity=(150.0, 80.0)):
    time = 4.0 * np.arange(12)
    noise = np.random.default_rng(1).standard_normal((12, 2))
    position = time[:, None] * velocity + 20 * noise
    altitude = None if altitude is None else np.where(np.arange(12) == 5, np.nan, altitude + time)
    return dw.track(plots(begin + time, position, key="4BAA5F", name=name, origin=origin, altitude=altitude))


def test_east_north_comes_back():
    rng = np.random.default_rng(2)
    angle, far = rng.uniform(0, 2 * np.pi, 400), 500e3 * np.sqrt(rng.uniform(size=400))
    metres = np.stack([far * np.sin(angle), far * np.cos(angle)], axis=1)
    for origin in ((0.0, 0.0), (48.0, 11.0), (-33.9, 151.2), (52.0, 179.9), (89.0, -30.0)):
        there = geographic(metres, origin)
        assert np.abs(east_north(there[:, 0], there[:, 1], origin) - metres).max() < 1e-6
    assert np.isnan(geographic([[7e6, 0.0]], (0.0, 0.0))).all()


def test_csv_and_parquet_have_a_row_for_each_plot(tmp_path):
    tracks = some(altitude=9000.0)
    paths = tracks.write(tmp_path, ("csv", "parquet"))
    with paths[0].open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = pq.read_table(paths[1]).to_pydict()
    trace = tracks[0].trace
    assert len(rows) == len(table["time"]) == 12 and list(rows[0]) == list(table)
    assert rows[3]["key"] == "4BAA5F" and rows[3]["name"] == "A<B>&\x07"
    assert datetime.fromisoformat(rows[3]["time"]).timestamp() == table["time"][3].timestamp() == UNIX + 12
    assert rows[0]["predicted_east"] == rows[0]["speed"] == "" and table["nis"][0] is None and rows[5]["altitude"] == ""
    for name, column in (("east", trace.position[:, 0]), ("nis", trace.nis), ("turn_rate", trace.turn_rate)):
        np.testing.assert_array_equal([float(row[name] or "nan") for row in rows], column)
        np.testing.assert_array_equal(np.array(table[name], float), column)
    back = east_north(np.array(table["latitude"]), np.array(table["longitude"]), tracks.origin)
    np.testing.assert_allclose(back, trace.position, atol=1e-6)


def test_times_of_a_day_stay_seconds_and_metres_need_no_origin(tmp_path):
    tracks = some(origin=None, begin=86.0)
    (path,) = tracks.write(tmp_path, "csv")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[2]["time"]) == 94.0 and "latitude" not in rows[0]
    for kind in ("geojson", "kml"):
        with pytest.raises(InputError, match="without an origin"):
            tracks.write(tmp_path, kind)
    with pytest.raises(InputError, match="formats must be of csv, parquet"):
        tracks.write(tmp_path, "shp")


def test_geojson_keeps_to_rfc_7946(tmp_path):
    tracks = some(altitude=9000.0)
    told = json.loads(write_geojson(tracks, tmp_path / "a.json", points=True).read_text(), parse_constant=pytest.fail)
    line, *points = told["features"]
    assert told["type"] == "FeatureCollection" and line["geometry"]["type"] == "LineString" and len(points) == 12
    assert {f["type"] for f in told["features"]} == {"Feature"} and "crs" not in told
    longitude, latitude, altitude = np.array(line["geometry"]["coordinates"]).T
    np.testing.assert_allclose(east_north(latitude, longitude, (48.0, 11.0)), tracks[0].trace.position, atol=0.02)
    assert np.all(np.diff(altitude) > 0) and np.abs(altitude - 9000).max() < 50  # the unknown one is between
    assert line["properties"]["start"] == "2024-07-03T09:46:40.000Z" and line["properties"]["plots"] == 12
    assert points[3]["geometry"]["coordinates"] == line["geometry"]["coordinates"][3]
    assert points[0]["properties"]["nis"] is None


def test_a_line_is_cut_at_the_antimeridian(tmp_path):
    tracks = some(origin=(10.0, 179.99))
    (path,) = tracks.write(tmp_path, "geojson")
    west, east = json.loads(path.read_text())["features"][0]["geometry"]["coordinates"]
    assert west[-1] == [180.0, east[0][1]] and east[0][0] == -180.0 and len(west) + len(east) == 14
    assert min(p[0] for p in west) > 179 and max(p[0] for p in east) < -179
    there_and_back = np.array([[-179.0, 0.0], [179.0, 2.0], [-179.0, 4.0], [-178.0, 4.0]])
    parts = cut_at_antimeridian(there_and_back)
    assert [p.tolist() for p in parts] == [
        [[-179, 0], [-180, 1]], [[180, 1], [179, 2], [180, 3]], [[-180, 3], [-179, 4], [-178, 4]]
    ]  # fmt: skip


def test_cat062_is_whole_blocks(tmp_path):
    pytest.importorskip("asterix")
    data = some().write(tmp_path, "cat062")[0].read_bytes()
    at, blocks = 0, 0
    while at < len(data):
        assert data[at] == 62
        at, blocks = at + int.from_bytes(data[at + 1 : at + 3], "big"), blocks + 1
    assert at == len(data) and blocks == 1


def test_kml_is_well_formed_and_moves(tmp_path):
    tracks = some(altitude=9000.0)
    (path,) = tracks.write(tmp_path, "kml")
    mark = ET.parse(path).getroot().find("k:Document/k:Placemark", KML)
    assert mark.find("k:name", KML).text == "A<B>&"
    moving = mark.find("gx:Track", KML)
    assert [child.tag.split("}")[1] for child in moving] == ["altitudeMode"] + ["when"] * 12 + ["coord"] * 12
    longitude, latitude, _ = np.array([c.text.split() for c in moving.findall("gx:coord", KML)], float).T
    np.testing.assert_allclose(east_north(latitude, longitude, (48.0, 11.0)), tracks[0].trace.position, atol=0.02)
    assert moving.find("k:when", KML).text == "2024-07-03T09:46:40.000Z"
    (path,) = some(begin=86.0, origin=(10.0, 179.99)).write(tmp_path, "kml")
    lines = ET.parse(path).getroot().findall(".//k:MultiGeometry/k:LineString", KML)
    assert len(lines) == 2 and lines[0].find("k:altitudeMode", KML).text == "clampToGround"
