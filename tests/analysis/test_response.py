"""A response in hindsight: gains of plants that are known, where difference equations have no rows, or other noise."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws
from scipy.signal import lfilter

from driftwise.analysis.change_places import colourless
from driftwise.analysis.change_search import lines
from driftwise.analysis.effects import borne_out, deviations, of_response
from driftwise.analysis.response_covariance import covariance
from driftwise.analysis.response_orders import begin, cleaned, fitted, orders, plainest, raised, stripped
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import GAIN, LEVEL, hindsight

T, A = 1500, np.array([1.0, -1.5, 0.56])  # poles at 0.8 and 0.7


def inputs(seed=0, k=1):
    rng = np.random.default_rng(seed)
    return np.column_stack([np.repeat(rng.choice([-1.5, -0.5, 0.5, 1.0, 1.5], T // 12), 12) for _ in range(k)])


def clean(u, gains=(3.0,), delays=(7,), shape=lambda x: x, factor=None):
    """Return what inputs do: a delay each, and one denominator."""
    f = np.ones(T) if factor is None else factor
    x = sum(g * A.sum() * f * np.concatenate([np.zeros(d), shape(v)[: T - d]]) for g, d, v in zip(gains, delays, u.T))
    return lfilter([1.0], A, x)


def noise(seed=1, colour=(1.0,), size=0.3):
    return size * lfilter([1.0], colour, np.random.default_rng(seed).standard_normal(T))


def effect(y, u, i=0):
    return of_response(hindsight(y, u)).of[i]


@pytest.mark.parametrize("colour", [(1.0,), (1.0, -0.9), tuple(A)])
@draws("seeds", range(1), range(5))
def test_a_gain_and_its_time_are_known_whatever_the_colour_of_the_noise(colour, seeds):
    """Three plants' noises, five records each: the truth lies within 1.5 times the 95 % interval in nearly all.

    Beside a slow noise one may be taken for a slow mode of the plant: then no gain is claimed, and it does not count.
    """
    held, done = 0, np.argmax(lfilter([A.sum()], A, np.ones(200)) >= 1 - np.exp(-1)) + 7
    for seed in seeds:
        u = inputs(seed)
        found = effect(20 + clean(u) + noise(100 + seed, colour, 0.3 if len(colour) < 3 else 0.05), u)
        is_timed = found.step is None or abs(found.step.time - done) < 1.0  # None: not told
        held += is_timed and found.std < 0.5 and abs(found.gain - 3.0) < 1.5 * 1.96 * found.std
        assert found.bend is None
    assert held >= 0.8 * len(seeds)


def test_one_output_in_eight_is_enough():
    u = inputs(3, 2)
    y = np.where(np.arange(T) % 8 == 0, clean(u, (3.0, -2.0), (7, 2)) + noise(4), np.nan)
    found = of_response(hindsight(y, u)).of
    for one, gain in zip(found, (3.0, -2.0)):
        assert abs(one.gain - gain) < 1.5 * 1.96 * one.std and one.std < 0.2


def test_a_gain_that_bends_is_told_with_its_slopes_and_steps_are_no_jumps():
    u = inputs(5)
    seen = hindsight(clean(u, shape=lambda x: x + 0.35 * x * abs(x)) + noise(6), u)
    (one,) = of_response(seen).of
    assert seen.jumps() == [] and one.bend is not None and 3.0 < one.bend[0] < 4.2 < one.bend[1] < 6.5


def test_a_gain_that_bends_is_the_mean_of_the_slopes_it_is_told_with():
    """Rain is nothing at nine samples of ten: the slopes of where it mostly is are not those of which its gain is."""
    rng = np.random.default_rng(3)
    rain = np.where(rng.random(T) < 0.1, rng.exponential(1.0, T), 0.0)
    y = clean(rain[:, None], shape=lambda x: x + 0.35 * x * abs(x)) + noise(6)
    (one,) = of_response(hindsight(y, rain[:, None])).of
    assert one.bend is not None and one.bend[0] < one.gain < one.bend[1]


def test_a_plant_of_six_poles_that_ring_is_raised_to_as_many():
    u, y, end = inputs(9, 1), np.zeros(T), 0.0
    for tau, period, part in ((20, 7, 1.0), (12, 20, -0.5), (30, 3.3, 0.8)):
        a = np.real(np.poly(np.exp(-1 / tau + 2j * np.pi / period * np.array([1, -1]))))
        y, end = y + part * lfilter([0.0, a.sum()], a, u[:, 0]), end + part
    seen = hindsight(y + 0.05 * np.random.default_rng(10).standard_normal(T), u)
    (one,) = of_response(seen).of
    assert len(seen.response.a) >= 6 and abs(one.gain - end) < 3 * one.std and one.std < 0.02


def test_a_level_that_steps_at_the_sensor_is_found_beside_noise_of_the_plant():
    """In a difference equation it is a spike, which an outlier filter takes away, and a shelf."""
    u, after = inputs(7), np.arange(T) >= 700
    (jump,) = hindsight(clean(u) + noise(8, tuple(A), 0.05) + 2.0 * after, u).jumps()
    assert jump.kind == LEVEL and abs(jump.at - 700) <= 2 and jump.after == pytest.approx(2.0, abs=0.4)


def test_a_season_is_no_jump_and_hides_no_gain():
    u, t = inputs(9), np.arange(T)
    y = clean(u, factor=np.where(t < 900, 1.0, 0.6)) + noise(10) + 1.5 * np.sin(2 * np.pi * t / 140)
    (jump,) = hindsight(y, u).jumps()
    assert jump.kind == GAIN and abs(jump.at - 900) < 15 and jump.after == pytest.approx(1.8, abs=0.15)


@pytest.mark.parametrize("periods", [2.0, 5.3, 20.6])
@draws("seeds", range(1), range(4))
def test_a_season_is_a_line_and_no_pair_of_poles_of_the_plant(periods, seeds):
    """However few periods there are: its frequency is found beside the answer, and the gain is that of the plant."""
    held = 0
    for seed in seeds:
        u, t = inputs(seed), np.arange(T)
        season = 2.0 * np.sin(2 * np.pi * periods * t / T + seed)
        found = hindsight(20 + clean(u) + season + noise(100 + seed, (1.0,), 0.3), u)
        now, e = found.response, of_response(found).of[0]
        assert np.all(abs(np.roots(now.denominator)) < 1 - 8 / T)
        is_line = len(now.columns) == 4 and not now.levels and not now.gains
        held += is_line and abs(e.gain - 3.0) < 1.5 * 1.96 * e.std and e.std < 0.3
    assert held >= 0.75 * len(seeds)


def test_lines_are_looked_for_in_any_unit():
    """Squares of what is left of a response that is far off would overflow."""
    now = colourless(begin(recorded(clean(inputs(0)) + noise(1) + np.sin(0.3 * np.arange(T)), inputs(0))[0]))
    with np.errstate(over="raise", invalid="raise"):
        one, far = (lines(replace(now, sigma=now.sigma * scale)) for scale in (1.0, 1e-200))
    assert one == far and abs(one[0] - 0.3) < 0.01


def test_delays_of_more_than_forty_samples_are_found():
    u = inputs(3, 2)
    seen = hindsight(clean(u, (3.0, -2.0), (4, 55)) + noise(5), u).response
    assert abs(seen.nk[0] - 4) <= 1 and abs(seen.nk[1] - 55) <= 1


def test_a_start_that_is_over_before_a_long_delay_leaves_gains_their_bars():
    """Two numbers of it looked alike by then, and no gain was told any more."""
    u, B = inputs(4), np.poly([0.9, 0.1])
    y = lfilter(np.append(np.zeros(60), 3.0 * B.sum()), B, u[:, 0]) + noise(6, size=0.1)
    found = hindsight(y, u)
    effect = of_response(found).of[0]
    assert found.response.nk[0] >= 58 and np.isfinite(covariance(found.response)).all()
    assert abs(effect.gain - 3.0) < 0.05 and 0 < effect.std < 0.05


def test_outliers_are_left_out_where_that_is_likelier():
    u = inputs(2)
    first = orders(plainest(recorded(clean(u) + noise(), u)[0]))[1]
    assert cleaned(first).criterion <= first.criterion


def test_a_swing_is_told_where_one_order_more_swings_as_well():
    rng, B = np.random.default_rng(4), np.poly([0.9 * np.exp(0.3j), 0.9 * np.exp(-0.3j)]).real
    u = rng.standard_normal((500, 1))
    y = lfilter([0.0, B.sum()], B, u[:, 0]) + 0.1 * rng.standard_normal(500)
    seen = hindsight(y, u)
    swing = of_response(seen).swing
    assert swing.period == pytest.approx(2 * np.pi / 0.3, rel=0.05)
    assert borne_out(seen.response, swing._replace(period=1.3 * swing.period)) is None


def test_a_period_beside_a_mode_that_is_too_weak_to_be_seen_is_held_by_its_interval():
    """Of two poles where there are three the period is too long by more than its bars."""
    pair = np.exp(-1 / 15 + 2j * np.pi / 54)
    B, rng = np.poly([pair, pair.conjugate(), np.exp(-1 / 5)]).real, np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 20), 50)[:, None]
    y = lfilter([0.0, B.sum()], B, u[:, 0]) + 0.3 * rng.standard_normal(1000)
    seen = hindsight(y, u)
    own = 2 * np.pi / abs(np.angle(np.roots(seen.response.denominator)))
    swing = of_response(seen).swing
    assert len(own) == 2 and own[0] > 58
    assert abs(swing.period - 54) < 2 and swing.interval[0] < 54 < swing.interval[1]


def test_draws_have_the_covariance_that_is_asked_for_however_small_a_part_of_it():
    """A pole known to 1e-9 beside a start that nobody knows; whichever way eigenvectors point."""
    size = np.array([1e-9, 3e-9, 1e9])
    P = np.array([[1.0, 0.6, 0.3], [0.6, 1.0, 0.0], [0.3, 0.0, 1.0]]) * size * size[:, None]
    draws = deviations(P, 4000) / size
    np.testing.assert_allclose(draws.T @ draws / 4000, P / size / size[:, None], atol=0.06)


def test_an_order_that_was_fitted_already_is_what_fitting_it_again_gives():
    u = inputs()
    y = clean(u) + noise()
    _, one, two, *_ = orders(plainest(recorded(y, u)[0]))
    again = fitted(stripped(one), (stripped(one), one), 2, 2)
    assert raised(one) is two
    np.testing.assert_array_equal(again.theta, two.theta)
