"""Values that cannot be believed are dropped, real moves are not eaten."""

import numpy as np
import pytest
from plants_of_tables import NaN

from driftwise.tables.cleaning import Cleaner, believe, doubtful


def dirty(n=3000):
    """A smooth signal with drop-outs of one to three samples to three different values, and two absurd ones."""
    rng = np.random.default_rng(1)
    y = 200 + 30 * np.sin(np.arange(n) / 40) + rng.normal(size=n)
    bad = [100, 101, 500, 502, 900, 901, 902, 1500, 2999 - 40]
    y[bad] = [30, 31, 28, 30, 30, 32, 29, 30, -1e8]
    y[1700] = 3e9
    return y, sorted([*bad, 1700])


def test_drop_outs_are_found_and_the_good_sample_between_two_is_kept():
    y, bad = dirty()
    assert np.flatnonzero(doubtful(y, believe(y))).tolist() == bad


def test_a_rail_is_told_by_three_largest_moves_anything_else_by_eight():
    y = np.random.default_rng(0).normal(size=400)  # moves by up to 4
    at = [50, 51, 120, 200, 300]
    for low, found in ((-8.0, 0), (-25.0, 5)):
        y[at] = low
        assert doubtful(y, believe(y)).sum() == found
    y[at] = [-25, -24, -23, -22, -21]
    assert not doubtful(y, believe(y)).any()


def test_codes_for_missing_only_far_outside_the_others():
    y = np.sin(np.arange(300.0))
    y[40:90] = -999.0
    assert believe(y).codes == (-999.0,) and doubtful(y, believe(y)).sum() == 50
    y = np.linspace(-1500, 1500, 3001)  # a ramp goes through -999
    assert not believe(y).codes


SHAPES = {
    "rain": lambda rng, n: np.where(rng.random(n) < 0.1, rng.gamma(0.4, 15, n), 0).round(1),
    "rare rain": lambda rng, n: np.where(rng.random(n) < 0.01, rng.gamma(0.4, 15, n), 0).round(1),
    "flood": lambda rng, n: np.convolve(np.where(rng.random(n) < 0.03, rng.gamma(0.3, 50, n), 0), 0.6 ** np.arange(30))[
        :n
    ],
    "steps": lambda rng, n: np.repeat(rng.normal(size=n // 50 + 1), 50)[:n] * 100 + rng.normal(size=n),
    "binary": lambda rng, n: np.where(np.cumsum(rng.random(n) < 0.1) % 2, 6.41, 3.41) + 0.01 * rng.normal(size=n),
    "pulses": lambda rng, n: (rng.random(n) < 0.01) * 1.0,
    "heavy-tailed walk": lambda rng, n: np.cumsum(rng.standard_t(2, n)),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_real_moves_are_not_eaten(shape):
    for seed in range(20):
        for n in (300, 3000):
            y = SHAPES[shape](np.random.default_rng(seed), n)
            assert not doubtful(y, believe(y)).any()


def test_a_later_drop_out_must_leave_the_range_and_a_later_step_stays():
    y = np.sin(np.arange(2000.0) / 10)
    belief = believe(y)
    assert not belief.seen
    y[500], y[700:] = 50.0, y[700:] + 80.0
    assert np.flatnonzero(doubtful(y, belief)).tolist() == [500]


@pytest.mark.parametrize("rows", [1, 5, 17, 700])
def test_cleaning_does_not_depend_on_the_chunks(rows):
    y, bad = dirty()
    y[600:630], y[105] = NaN, NaN
    both = np.column_stack((y, y[::-1]))
    cleaner = Cleaner([believe(y), believe(y[::-1])])
    out = [cleaner.push(both[k : k + rows]) for k in range(0, len(y), rows)] + [cleaner.flush()]
    whole = np.concatenate(out)
    assert cleaner.cleaned.tolist() == [len(bad)] * 2
    for j, column in enumerate(both.T):
        np.testing.assert_array_equal(whole[:, j], np.where(doubtful(column, believe(column)), NaN, column))
