"""Missing cells of inputs, as the output tells them."""

import numpy as np
import pytest
from scipy.signal import lfilter

from driftwise.analysis.lost_inputs import MOST, between, completed
from driftwise.analysis.segmentation import GAIN, hindsight


def plant(seed=1, samples=800, after=1.0, many=16):
    """Return y, u and u with cells lost: equation noise of second order, two inputs, the second far from the output."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((samples, 2))
    A = np.real(np.poly([0.8 + 0.2j, 0.8 - 0.2j]))
    moved = np.roll(u[:, 0], 1) * np.where(np.arange(samples) >= samples // 2, after, 1.0)
    y = 3 + lfilter([1.0], A, moved + 0.5 * rng.standard_normal(samples))
    given = u.copy()
    for x in given.T:
        x[rng.choice(np.arange(40, samples - 40), many, replace=False)] = np.nan
    return y, u, given


def lines(given):
    """Return inputs with lines through the cells that are lost."""
    every = np.arange(len(given))
    return np.column_stack([np.interp(every, every[np.isfinite(x)], x[np.isfinite(x)]) for x in given.T])


def test_cells_are_as_the_output_says():
    y, u, given = plant()
    lost, whole = np.isnan(given), completed(y, given)
    np.testing.assert_array_equal(whole[~lost], u[~lost])
    error, plain = ((x - u)[lost[:, 0], 0].std() for x in (whole, lines(given)))
    assert error < 0.6 < 0.9 < plain  # the noise of the equation is .5


def test_cells_of_an_input_that_does_nothing_are_nearly_lines():
    moved = [abs(completed(y, x) - lines(x))[np.isnan(x[:, 1]), 1].max() for y, _, x in map(plant, range(1, 8))]
    assert np.median(moved) < 0.35


def test_the_least_squares_of_the_pulses_and_their_prior():
    """Beside white noise: the mean of a Gaussian pulse of the size of lines, given what follows it."""
    rng, T = np.random.default_rng(2), 600
    u = rng.standard_normal((T, 1))
    h = 0.7 ** np.arange(T)
    y = np.convolve(u[:, 0], h)[:T] + 0.3 * rng.standard_normal(T)
    given = u.copy()
    given[300] = np.nan
    line = np.where(np.isnan(given[:, 0]), 0.5 * (u[299, 0] + u[301, 0]), u[:, 0])
    left, way = (y - np.convolve(line, h)[:T])[300:], h[:300]
    size = way @ left / (way @ way + 0.3**2 / between(given[:, 0]) ** 2)
    assert completed(y, given)[300, 0] == pytest.approx(line[300] + size, abs=0.06)


def test_inputs_without_gaps_and_those_of_which_too_much_is_lost_stay():
    y, u, given = plant(samples=1200)
    assert completed(y, u) is u
    given[:, 1] = np.nan
    assert completed(y, given) is given
    given = u.copy()
    given[: MOST + 1, 0] = np.nan
    assert completed(y, given) is given


def test_a_gain_that_changes_a_little_is_told_beside_lost_cells_and_the_noise_is_its_own():
    y, _, given = plant(seed=3, after=1.35)
    seen = hindsight(y, given)
    (jump,) = seen.jumps()
    assert jump.kind == GAIN and jump.input == 0 and abs(jump.at - 400) < 30
    noise = np.std(seen.response.left * seen.response.deviations) * seen.units.y_scale
    assert noise == pytest.approx(0.5, rel=0.1)
