"""Whether the errors of forecasts are white: what is counted."""

import numpy as np
from driftwise_studies.papers.records import ljung_box
from driftwise_studies.score.motions import whiteness


def test_each_coordinate_of_a_scene_is_a_series():
    name, found = whiteness.series(0, 7)
    assert name == "glider" and len(found) == 2 and all(len(one) == 1 + whiteness.LAGS for one in found)
    assert all(one[0] in (0.0, 1.0) and np.all(np.abs(one[1:]) < 0.3) for one in found)


def test_a_row_has_the_means():
    assert whiteness.row("all", [(1.0, -0.1), (0.0, 0.1)]) == ["all", "2", "0.500", "0.000"]


def test_white_series_are_refused_as_often_as_said():
    z = np.random.default_rng(0).standard_normal((2000, 272))
    assert abs(np.mean(ljung_box(z, whiteness.LAGS) < whiteness.REFUSED) - whiteness.REFUSED) < 0.015
