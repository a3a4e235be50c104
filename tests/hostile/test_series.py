"""Series that no sensor gives, through every estimator: states stay finite, or say LOST; variances are not negative."""

import numpy as np
import pytest

from driftwise.engine.errors import InputError
from hostile.series import ESTIMATORS, SERIES, broken, drawn
from hostile.soak import KINDS, friendly, soak


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name == "GreyBox")) for name in ESTIMATORS]
)
def test_extreme_series_leave_a_finite_state(name):
    found = [
        f"{shape}: {wrong}" for shape in SERIES if (wrong := broken(name, *SERIES[shape](np.random.default_rng(3))))
    ]
    assert not found


@pytest.mark.parametrize("shape", ["zeros", "huge inputs"])
def test_a_start_that_nothing_can_be_fitted_to_is_told(shape):
    assert not broken("GreyBox", *SERIES[shape](np.random.default_rng(3)))


@pytest.mark.parametrize("shape", SERIES)
def test_a_grey_box_looks_back_at_extreme_series_or_says_why_not(shape):
    y, u = (column[:80] for column in SERIES[shape](np.random.default_rng(3)))
    found, said = None, ""
    try:
        found = ESTIMATORS["GreyBox exact gradient"]().smooth(y, u)
    except InputError as error:
        said = str(error)
    if found is None:
        assert "cannot be looked back at" in said or "must be" in said
    else:
        assert np.isfinite(found.x).all() and np.isfinite(found.parameters).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ESTIMATORS)
def test_drawn_series_leave_a_finite_state(name):
    rng = np.random.default_rng(4)
    found = [f"{number}: {wrong}" for number in range(200) if (wrong := broken(name, *drawn(rng)))]
    assert not found


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_million_updates_leave_a_finite_state_and_no_memory(kind):
    found = soak(kind, 1_000_000)
    assert found.updates == 1_000_000


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_updates_one_by_one_leave_no_memory(kind):
    friendly(kind, 100_000)
