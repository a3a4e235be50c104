"""The self-starting detector: its promise on clean, fat, rounded and coloured innovations, delays, ways of feeding."""

import numpy as np
import pytest
from scipy.special import ndtri

import driftwise as dw
from driftwise.detect.watch import OWN
from driftwise.engine.normal import deviate

N = 100_000
CLEAN = {
    "Gaussian": lambda rng: rng.standard_normal(N),
    "Student's t, 3": lambda rng: rng.standard_t(3, N) / 3**0.5,
    "Laplace": lambda rng: rng.laplace(size=N) / 2**0.5,
    "rounded": lambda rng: np.round(rng.standard_normal(N)) / 1.04,
    "one in a hundred ten times as wide": lambda rng: rng.standard_normal(N) * np.where(rng.random(N) < 0.01, 10, 1),
}


def coloured(rng, a, samples):
    e = rng.standard_normal(samples)
    for t in range(1, samples):
        e[t] += a * e[t - 1]
    return e


@pytest.mark.parametrize("noise", ["given", "learnt"])
@pytest.mark.parametrize("make", CLEAN.values(), ids=CLEAN.keys())
def test_the_promise_is_kept_whatever_the_tails(make, noise):
    """100 are promised; their number is about Poisson, so 120 would be two standard deviations more."""
    e = make(np.random.default_rng(0))
    assert 10 <= len(dw.detect.SelfStarting("1 per 1000", noise=noise).scan(e)) <= 120


def test_a_plain_sum_does_not_keep_it():
    e = CLEAN["Student's t, 3"](np.random.default_rng(0))
    assert len(dw.PageHinkley("1 per 1000", jump=3.0).scan(e)) > 400


def test_colour_is_learnt():
    """In the long run; a plain sum alarms ten times as often as promised, for ever."""
    e = coloured(np.random.default_rng(1), 0.6, N) * (1 - 0.36) ** 0.5
    found = dw.detect.SelfStarting("1 per 1000").scan(e)
    assert np.count_nonzero(found.samples > N // 2) <= 60
    assert np.count_nonzero(dw.PageHinkley("1 per 1000", jump=1.5).scan(e).samples > N // 2) > 300


@pytest.mark.parametrize("noise", ["given", "learnt"])
def test_the_delay_is_near_that_of_a_sum_that_is_told_everything(noise):
    rng, shift, at = np.random.default_rng(2), 1.5, 300
    delays = []
    for _ in range(200):
        e = rng.standard_normal(500)
        e[at:] += shift
        found = dw.detect.SelfStarting("1 per 1000", noise=noise).scan(e)
        later = found.samples >= at
        assert later.any()
        delays.append(found.samples[later][0] - at + 1)
    best = dw.PageHinkley("1 per 1000", jump=shift).delay()
    assert 0.9 * best < np.mean(delays) < 1.5 * best


def test_the_change_is_dated_and_has_a_direction():
    """One in thirty such shifts is told as louder noise, which has direction +1."""
    dates, directions = [], []
    for seed in range(60):
        e = np.random.default_rng(seed).standard_normal(620)
        e[600:] -= 3.0
        found = dw.detect.SelfStarting().scan(e)
        first = np.flatnonzero(found.samples >= 600)[0]
        directions.append(found.directions[first])
        dates.append(found.changes[first])
    assert directions.count(-1) >= 54
    assert np.mean(np.abs(np.array(dates) - 600) <= 2) >= 0.8


def test_louder_noise_is_found_and_then_known():
    """With the level learnt the alarms stop, and a shift in the louder noise is found."""
    e = np.random.default_rng(4).standard_normal(3000)
    e[1000:] *= 5.0
    e[2990:] += 25.0
    found = dw.detect.SelfStarting(noise="learnt").scan(e)
    assert 1000 <= found.samples[0] < 1010
    assert np.count_nonzero((found.samples > 1100) & (found.samples < 2990)) <= 3
    assert found.samples[-1] >= 2990


def test_units_do_not_matter_where_the_level_is_learnt():
    e = np.random.default_rng(5).standard_normal(600)
    e[300:] += 3.0
    detector = dw.detect.SelfStarting(noise="learnt")
    one, other = detector.scan(e), detector.scan(2.0**40 * e)
    assert len(one) > 0
    assert np.array_equal(one.samples, other.samples)
    assert np.array_equal(one.statistic, other.statistic, equal_nan=True)


@pytest.mark.parametrize("noise", ["given", "learnt"])
def test_one_by_one_in_halves_and_at_once(noise):
    e = np.random.default_rng(6).standard_normal(600)
    e[300:] += 2.0
    e[::17] = np.nan
    detector = dw.detect.SelfStarting("1 per 200", noise=noise)
    whole, first = detector.scan(e), detector.scan(e[:333])
    second = detector.scan(e[333:], state=first.state)
    assert len(whole) > 1
    assert np.array_equal(whole.samples, np.r_[first.samples, 333 + second.samples])
    assert np.array_equal(whole.state, second.state)
    monitor = dw.detect.Monitor(detector)
    state, alarms = monitor.start(), []
    for t, value in enumerate(e):
        state, sign = monitor.update(state, value)
        alarms += [t] if sign.alarm else []
    assert alarms == list(whole.samples)
    assert np.array_equal(state, whole.state)


@pytest.mark.parametrize("noise", ["given", "learnt"])
def test_rest_and_absurd_numbers_do_not_break_it(noise):
    e = np.zeros(400)
    e[200:] = 1e300 * np.random.default_rng(7).standard_normal(200)
    found = dw.detect.SelfStarting(noise=noise).scan(e)
    assert found.samples[0] == 200
    assert np.isfinite(found.state[OWN:]).all()
    assert len(dw.detect.SelfStarting(noise=noise).scan(np.zeros(400))) == 0


def test_the_normal_deviate_of_a_tail_area():
    areas = np.r_[0.5, 0.4999, np.logspace(-0.31, -290, 200)]
    np.testing.assert_allclose([deviate(p) for p in areas], -ndtri(areas), rtol=1e-9, atol=1e-9)
    assert deviate(0.0) > 37.0


@pytest.mark.parametrize(
    "settings, words",
    [
        (dict(shifts=(1.5, -3.0)), "shifts must be positive"),
        (dict(shifts=()), "shifts must be positive"),
        (dict(ratio=0.5), "ratio > 1"),
        (dict(noise="unknown"), "noise must be 'given'"),
        (dict(noise=0.1), "noise must be 'given'"),
        (dict(warm=3), "at least 10"),
        (dict(false_alarms="never"), "1 per 10_000"),
    ],
)
def test_bad_settings_are_told(settings, words):
    with pytest.raises(dw.InputError, match=words):
        dw.detect.SelfStarting(**settings).resolve()
    assert dw.detect.SelfStarting().run_length == 1000.0
    assert "at most one false alarm per 1 000 samples" in dw.detect.SelfStarting().words


def test_thresholds_that_are_known_are_those_that_would_be_found():
    from driftwise.detect import variance

    asked = {
        dw.detect.SelfStarting(*more).resolve().h[-1] for more in (("1 per 1000",), ("1 per 1500",), ("1 per 3000",))
    }
    assert asked <= set(variance.KNOWN.values())
    key = (4500.0, 4.0, 0)
    assert variance.KNOWN[key] == pytest.approx(variance._searched(*key), rel=1e-9)
