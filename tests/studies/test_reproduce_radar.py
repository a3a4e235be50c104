"""`driftwise reproduce radar`: what it says without recordings, its verdicts on them, its grid and tables by hand."""

import re

import numpy as np
import pytest
from driftwise_studies.papers import radar_data, radar_fifty, recordings
from driftwise_studies.papers.flight import CV, IMM, Flight
from test_reproduce_abid import assert_contract, command

SETS = (recordings.LONG_RANGE, recordings.MARINE)
needs_data = pytest.mark.skipif(
    not (recordings.folder() / "longrange_radar").is_dir(), reason="no recordings: set DRIFTWISE_DATA to their folder"
)


def test_missing_recordings_are_skipped_aloud(tmp_path, monkeypatch):
    monkeypatch.setenv("DRIFTWISE_DATA", str(tmp_path / "nothing"))
    code, found = command("radar", tmp_path, 20)
    assert code == 0 and len(found["verdicts"]) == 2
    for row in found["verdicts"]:
        assert row["skipped"] and row["pass"] and "DRIFTWISE_DATA" in row["value"]


@pytest.mark.slow
@needs_data
def test_every_finding_holds_on_the_recordings(tmp_path):
    code, found = command("radar", tmp_path, 20, "--figures", tmp_path / "page")
    assert code == 0
    assert_contract(found, "radar", 20, ["TrackEstimator", "three free poles", "within 50 samples", "50 plots"])
    assert not any(row["skipped"] for row in found["verdicts"])
    page = (tmp_path / "page" / "radar.html").read_text()
    assert "http" not in page and len(re.findall(r'src="data:image/png', page)) == 5


@needs_data
def test_the_recordings_are_those_of_the_study():
    aircraft, boats = ([(len(t), y) for t, y in radar_data.tracks(kind)] for kind in SETS)
    assert [n for n, _ in aircraft] == [284]
    assert sum(n for n, _ in boats) == 662 and len(boats) == 10
    assert sum(n // 50 for n, _ in boats) * 2 == 18


def test_the_grid_has_a_row_for_every_scan():
    time = np.array([0.0, 12, 24, 47, 60])
    y, period = radar_data.on_grid(time, np.arange(10.0).reshape(5, 2))
    assert period == 12.0
    assert np.flatnonzero(np.isnan(y[:, 0])).tolist() == [3]
    assert y[[0, 1, 2, 4, 5], 1].tolist() == [1, 3, 5, 7, 9]


def test_a_track_falls_into_whole_records():
    time = np.arange(127.0)
    pieces = Flight(time, np.stack([time, -time], 1), recordings.MARINE, {}).cut()
    assert [(p.time[0], p.y[0, 0], len(p.y)) for p in pieces] == [(0, 0, 50), (0, 50, 50)]


def test_medians_are_over_records_and_coordinates():
    """Two references, three records, two coordinates, two windows."""
    table = {CV: np.ones((2, 3, 2, 2)), IMM: np.ones((2, 3, 2, 2)), "it": np.arange(24.0).reshape(2, 3, 2, 2)}
    assert radar_fifty.medians(table, "it").tolist() == [[5, 6], [17, 18]]
