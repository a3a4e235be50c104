"""The second set of tracks: what its readers find."""

import os

import numpy as np
import pytest
from driftwise_studies.papers.recordings import folder, series
from driftwise_studies.score import second_tracks


def test_ships_are_series_of_both_coordinates_in_order_of_time(tmp_path):
    here = folder() / "second"
    if not here.is_dir():
        pytest.skip("the second set is not there; set DRIFTWISE_DATA to the folder of recordings")
    os.symlink(here, tmp_path / "autoferry")
    found = series(second_tracks.SETS["ships, AIS"], tmp_path)
    assert len(found) == 46 and all(len(s.y) >= second_tracks.LONG for s in found)
    assert all(np.all(np.diff(s.time) > 0) for s in found)


def test_plots_of_another_boat_are_counted_apart(tmp_path):
    here = folder() / "second"
    if not here.is_dir():
        pytest.skip("the second set is not there; set DRIFTWISE_DATA to the folder of recordings")
    os.symlink(here, tmp_path / "autoferry")
    found = series(second_tracks.SETS[second_tracks.BOATS], tmp_path)
    *lines, last = second_tracks.each(tmp_path, found, np.ones((4, len(found))))
    assert len(lines) == len(found) == 8 and last.startswith("of 8 series: ratio <= 1.1 on ")
    assert "of the 26 of 27 plots that are its own" in lines[4]
