"""`driftwise reproduce radar`: what it says without recordings, its verdicts on them, its grid and tables by hand."""

import re

import numpy as np
import pytest
from driftwise_studies.papers import radar_data, radar_drawn, radar_fifty, recordings
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


@pytest.mark.slow
def test_drawn_flights_are_seen_as_the_recorded_one_and_are_the_same_whenever_drawn():
    few, more = radar_drawn.drawn(flights=2), radar_drawn.drawn.__wrapped__(flights=3)
    assert np.array_equal(few.ratios, more.ratios[:2]) and np.array_equal(few.bank, more.bank[:2])
    assert np.all((0.3 < more.ratios) & (more.ratios < 2))


def test_claims_on_drawn_flights_can_fail():
    rng = np.random.default_rng(5)
    ratios = np.exp(rng.normal(np.log(0.92), 0.12, (199, 2)))
    box = rng.chisquare(5, 199)
    held = radar_drawn.Drawn(box, box + rng.normal(3, 3, 199), ratios)
    assert held.is_whiter and np.all(held.most <= 0.95)
    lost = radar_drawn.Drawn(box, box + rng.normal(0, 3, 199), 1.03 * ratios)
    assert not lost.is_whiter and np.all(lost.most > 0.95) and np.all(lost.mean < 0.96)


def test_a_rank_counts_the_recording_as_one_of_them():
    assert radar_drawn.rank(5.0, np.arange(9.0)) == 0.5
    assert radar_drawn.rank(99.0, np.arange(199.0) - 200) == 0.005


def test_the_bound_of_a_mean_is_above_the_truth_but_once_in_a_hundred():
    """400 tables of 199 flights whose mean is known: at 99 %, 4 lie below; at most 11 do once in 1000."""
    rng = np.random.default_rng(6)
    tables = (np.exp(rng.normal(np.log(0.95), 0.12, (199, 1))) for _ in range(400))
    below = sum(radar_drawn.Drawn(np.zeros(1), np.zeros(1), one).most[0] < 0.95 for one in tables)
    assert below <= 11
