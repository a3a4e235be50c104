"""Smoothed tracks: files of them, altitudes, distances and climbs with their bars."""

from xml.etree import ElementTree

import numpy as np
import pyarrow.csv
import pytest

import driftwise as dw
from driftwise.tracking.formats.gpx import NAMESPACE
from driftwise.tracking.plots import plots
from driftwise.tracking.tracks import Tracks
from driftwise.tracking.travelled import travelled

GPX = "{http://www.topografix.com/GPX/1/1}"


def hike(seed=4, n=150, noise=4.0):
    """Return plots of a walk of 1.3 m/s that bends, over a hill of 100 m, and its truth (n, 3); one plot is wild."""
    rng, time = np.random.default_rng(seed), 2.0 * np.arange(n)
    course = 0.8 * np.sin(time / 60)
    path = np.cumsum(2.6 * np.stack([np.sin(course), np.cos(course), 0 * time], axis=1), axis=0)
    path[:, 2] = 400 + 50 * (1 - np.cos(2 * np.pi * time / time[-1]))
    seen = path[:, :2] + noise * rng.standard_normal((n, 2))
    seen[77] += [60.0, -80.0]
    altitude = np.round(path[:, 2] + 2.0 * rng.standard_normal(n), 1)
    altitude[30:40] = np.nan
    return plots(1.7e9 + time, seen, altitude=altitude, name="hill", origin=(46.5, 8.0)), path


@pytest.fixture(scope="module")
def walked():
    seen, path = hike()
    (track,) = dw.track(seen, 2.0, single=True)
    return track, path[np.searchsorted(seen.time, track.plots.time)]  # the wild plot is set aside


def test_altitudes_are_estimated_and_smoothed_with_bars(walked):
    track, path = walked
    smooth = track.smoothed()
    assert len(track.vertical) == len(smooth.vertical) == len(track) and smooth.is_smoothed and not track.is_smoothed
    rate = np.gradient(path[:, 2], track.plots.time)
    errors = []
    for one in (track, smooth):
        e, sd = one.vertical.velocity[10:, 0] - rate[10:], one.vertical.velocity_sd[10:, 0]
        assert np.mean(np.abs(e) <= 1.96 * sd) > 0.85
        errors.append(np.sqrt(np.mean(e**2)))
    assert errors[1] < 0.5 * errors[0]
    assert np.abs(smooth.vertical.position[30:40, 0] - path[30:40, 2]).max() < 6.0, "where no altitude came"
    flat = plots(np.arange(9.0), np.zeros((9, 2)))
    assert dw.track(flat, 2.0, single=True)[0].vertical is None


def test_distance_and_climb_are_corrected_and_lie_in_their_bars(walked):
    track, path = walked
    found = travelled(track)
    length = np.hypot(*np.diff(path[:, :2], axis=0).T).sum()
    raw = np.hypot(*np.diff(track.plots.position, axis=0).T).sum()
    assert raw > 2 * length and abs(found.distance - length) < 2.5 * found.distance_sd < 0.1 * length
    for told, sd in ((found.ascent, found.ascent_sd), (found.descent, found.descent_sd)):
        assert abs(told - 100) < 2.5 * sd < 60


def test_a_gpx_file_becomes_a_better_one(walked, tmp_path):
    track, path = walked
    tracks = Tracks([track.smoothed()], track.origin)
    (file,) = tracks.write(tmp_path, "gpx")
    root = ElementTree.parse(file).getroot()
    points = root.findall(f".//{GPX}trkpt")
    assert len(points) == len(track) and root.find(f".//{GPX}desc").text.count("give or take") == 3
    again = dw.tracking.read.read_plots(file, origin=(46.5, 8.0))
    assert np.abs(again.position - tracks[0].trace.position).max() < 0.02
    assert np.sqrt(np.mean((again.position - path[:, :2]) ** 2)) < 2.5 < 4.0
    np.testing.assert_allclose(again.altitude, tracks[0].vertical.position[:, 0], atol=0.006)
    assert float(points[9].find(f".//{{{NAMESPACE}}}sd").text) > 0
    with pytest.raises(dw.InputError, match="GPX needs positions on earth"):
        dw.track(plots(np.arange(9.0), np.zeros((9, 2))), 2.0, single=True).write(tmp_path, "gpx")


def test_other_files_hold_what_was_smoothed(walked, tmp_path):
    smooth = Tracks([walked[0].smoothed()], walked[0].origin)
    paths = smooth.write(tmp_path, ("csv", "geojson", "kml", "cat062"))
    table = pyarrow.csv.read_csv(paths[0])
    np.testing.assert_allclose(table["east"].to_numpy(), smooth[0].trace.position[:, 0], rtol=1e-12)
    np.testing.assert_allclose(table["vertical_rate"].to_numpy(), smooth[0].vertical.velocity[:, 0], rtol=1e-12)
    assert all(path.stat().st_size > 1000 for path in paths)


@pytest.mark.parametrize("step", [7.62, 30.48])
def test_the_vertical_rate_of_rounded_pressure_altitudes_lies_in_its_bands(step):
    """Level, climbing at 10 m/s, sinking at 8 m/s; altitudes come in steps of 25 or 100 feet."""
    rng, time = np.random.default_rng(0), 4.0 * np.arange(200)
    rate = np.where((time > 200) & (time < 400), 10.0, np.where(time > 600, -8.0, 0.0))
    height = 3000 + 4.0 * np.cumsum(rate) + 3 * rng.standard_normal(200)
    position = np.stack([200 * time, 50 * time], axis=1) + 30 * rng.standard_normal((200, 2))
    (track,) = dw.track(plots(time, position, altitude=step * np.round(height / step), key="4BAA5F"))
    for one, most in ((track, 1.6), (track.smoothed(), 1.0)):
        e = one.vertical.velocity[5:, 0] - rate[5:]
        assert np.sqrt(np.mean(e**2)) < most
        assert np.mean(np.abs(e) <= 1.96 * one.vertical.velocity_sd[5:, 0]) > 0.93
