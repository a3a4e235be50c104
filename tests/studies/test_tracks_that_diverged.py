"""Drawn tracks whose errors were beyond ten of their deviations five plots in a row."""

import pytest
from driftwise_studies.score.motions import draw
from driftwise_studies.score.motions.measured import one


@pytest.mark.parametrize("number", [584, 6184, 10872, 11191, 13384, 15052, 17637, 19654])
def test_noise_that_jumps_after_a_precise_start_is_in_the_bars_of_the_place(number):
    (track,) = one(draw(52602, number)).tracks
    assert "precise start" in track.scene.troubles and track.diverged == 0


@pytest.mark.parametrize("number", [3052, 19549])
def test_steps_of_the_same_number_of_cells_do_not_make_a_place_known(number):
    found = one(draw(52602, number))
    assert "lattice" in found.scene.troubles and sum(track.diverged for track in found.tracks) == 0
