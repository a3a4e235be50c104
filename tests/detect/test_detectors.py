"""Detectors: the sums of the book, their promised rates by simulation, dates, directions, gaps, ways of feeding."""

from functools import cache

import numpy as np
import pytest
from alarms_counted import run_length
from draws import slow

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten

DETECTORS = {
    "hinkley": dw.PageHinkley(50, jump=1.0),
    "hinkley, up": dw.PageHinkley(50, jump=0.6, sides="up"),
    "hinkley, each side its own": dw.PageHinkley(jump=(1.0, 0.5), threshold=(3.0, 5.0)),
    "hinkley, growing": dw.PageHinkley(jump=1.0, threshold=2.0, growing=True),
    "variance": dw.detect.VarianceCUSUM(threshold=2.0, sides="both"),
    "GLR": dw.detect.GLR(100, window=12),
}


# --- the others ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sides, ratio", [slow("up", 4.0), slow("down", 4.0), ("both", 2.0)])
def test_variance_change_keeps_its_promise(sides, ratio):
    detector = dw.detect.VarianceCUSUM(ratio, "1 per 500", sides=sides)
    assert np.isclose(detector.run_length, 500, rtol=1e-6)
    assert abs(run_length(detector.resolve(), 6000) / 500 - 1) < 0.05


def test_variance_change_names_the_direction():
    rng = np.random.default_rng(0)
    z = rng.standard_normal(900) * np.repeat([1.0, 3.0, 0.2], 300)
    found = dw.detect.VarianceCUSUM(false_alarms="1 per 100_000", sides="both").scan(z)
    first = {d: int(s) for s, d in zip(found.samples[::-1], found.directions[::-1])}
    assert 300 <= first[1] < 320
    assert 600 <= first[-1] < 630


def glr(z, window, threshold):
    """Every stretch of the definition."""
    best = (-1.0, 0, 0.0)
    for m in range(1, min(window, len(z)) + 1):
        A = z[len(z) - m :].sum()
        best = max(best, (A * A / (2 * m), m, np.sign(A)))
    return best


def test_glr_is_its_definition():
    rng = np.random.default_rng(2)
    z = rng.standard_normal(300) + np.repeat([0.0, 1.0, -0.5], 100)
    found, start, told = dw.detect.GLR(window=30, threshold=6.0).scan(z), 0, []
    for t in range(len(z)):
        level, m, sign = glr(z[start : t + 1], 30, 6.0)
        assert np.isclose(found.statistic[t], level / 6.0, rtol=1e-9)
        if level >= 6.0:
            told.append((t, t - m + 1, int(sign)))
            start = t + 1
    assert told == list(zip(found.samples.tolist(), found.changes.tolist(), found.directions.tolist()))
    assert told


@pytest.mark.parametrize("wanted, window", [(300, 20), (1000, 100)])
def test_glr_run_length_is_nearly_the_promised_one(wanted, window):
    """Rarer by up to 15 %, never more often (4000 alarms: 3 % is two standard errors)."""
    detector = dw.detect.GLR(wanted, window)
    assert np.isclose(detector.run_length, wanted, rtol=1e-9)
    assert 0.97 < run_length(detector.resolve(), 4000) / wanted < 1.18


def hostile(rng, T):
    """Slopes that follow from the innovations before, as in a loop, with a heavy tail."""
    z = rng.standard_normal(T)
    before = np.concatenate([[0.0], z[:-1]])
    return z, np.column_stack([before, np.exp(before), np.ones(T), rng.standard_t(3, T)])


@pytest.mark.parametrize("jump", [0.3, 1.0, 3.0])
def test_the_likelihood_ratio_sums_keep_their_guarantee_whatever_the_slopes(jump):
    detector = dw.detect.ScoreCUSUM("1 per 400", jump=jump)
    assert np.isclose(detector.run_length(4), 400)
    assert run_length(detector.resolve(4), 500, make=hostile) > 400


def test_calibrated_score_is_sooner_and_nearly_at_its_rate():
    slopes = np.array([1.0, 0.5, 2.0])

    def make(rng, T):
        return rng.standard_normal(T), slopes * rng.choice([-1.0, 1.0], (T, 3))

    safe = dw.detect.ScoreCUSUM("1 per 1000", jump=0.5)
    near = safe.calibrated_to(slopes)
    assert np.isclose(near.typical_run_length(slopes), 1000, rtol=1e-4)
    assert near.resolve(3).h[0] < safe.resolve(3).h[0] - 1
    assert 0.95 < run_length(near.resolve(3), 3000, make=make) / 1000 < 1.2


def test_score_names_parameter_and_direction_where_the_mean_tells_nothing():
    rng, right, silent = np.random.default_rng(7), 0, 0
    for i in range(200):
        slopes, z = rng.standard_normal((400, 4)), rng.standard_normal(400)
        which, sign = i % 4, 1 - 2 * (i // 4 % 2)
        z[200:] += 0.7 * sign * slopes[200:, which]
        found = dw.detect.ScoreCUSUM("1 per 10_000", jump=0.7).scan(z, slopes)
        right += len(found) > 0 and (found.which[0], found.directions[0]) == (which, sign)
        silent += len(dw.PageHinkley("1 per 10_000", jump=0.7).scan(z)) == 0
    assert right >= 190
    assert silent >= 150


def test_probes_of_a_regression_are_the_score():
    rng, d = np.random.default_rng(3), np.array([0.5, 0.8])
    slopes, z = rng.standard_normal((500, 2)), rng.standard_normal(500)
    z[250:] -= 0.8 * slopes[250:, 1]
    shifted = np.stack([z - s * d[i] * slopes[:, i] for i in range(2) for s in (1, -1)], axis=1)
    score = dw.detect.ScoreCUSUM(threshold=6.0, jump=d).scan(z, slopes)
    bank = dw.detect.probe_bank(3.0 * z, 3.0 * shifted, 9.0, threshold=6.0)
    np.testing.assert_allclose(bank.statistic, score.statistic, atol=1e-12)
    assert np.array_equal(bank.samples, score.samples)
    assert np.array_equal(bank.which // 2, score.which)
    assert set(bank.which) == {3}


def test_score_test_has_its_distribution_and_names_the_parameter():
    from scipy.stats import kstest

    rng = np.random.default_rng(0)
    values, named = [], 0
    for i in range(400):
        nu = rng.standard_normal((100, 4)) @ np.array([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 2, 0], [0, 0, 0, 0.1]])
        e = 1.5 * rng.standard_normal(100)
        values.append(dw.detect.score_test(nu, e, 2.25).p_value)
        jump = 1.0 * np.eye(4)[i % 4] / np.array([1.0, 1.1, 2.0, 0.1])
        told = dw.detect.score_test(nu, e - nu @ jump, 2.25)
        named += (told.which, told.direction) == (i % 4, -1)
        if i == 0:
            q, R = nu.T @ (e - nu @ jump), nu.T @ nu / 100
            assert np.isclose(told.statistic, q @ np.linalg.solve(R, q) / (2.25 * 100))
            assert np.allclose(told.scores, q / np.sqrt(2.25 * 100 * np.diag(R)))
    assert kstest(values, "uniform").pvalue > 0.01
    assert named >= 360


def test_score_test_without_excitation():
    nu = np.column_stack([np.ones(50), np.ones(50), np.zeros(50)])
    e = np.random.default_rng(1).standard_normal(50)
    nu[3], e[7] = np.nan, np.nan
    told = dw.detect.score_test(nu, e, 1.0)
    assert told.degrees == 1
    assert told.scores[2] == 0
    with pytest.raises(dw.InputError, match="nothing to test"):
        dw.detect.score_test(np.zeros((5, 2)), np.ones(5), 1.0)


# --- every detector --------------------------------------------------------------------------------------------


@cache
def example(samples=400):
    rng = np.random.default_rng(11)
    z = rng.standard_normal(samples) * np.repeat([1.0, 2.0], samples // 2) + np.repeat([0, 1.5, 0, -1.0], samples // 4)
    z[rng.random(samples) < 0.1] = np.nan
    return z


def same(a, b):
    return all(
        np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True)
        for name in ("samples", "directions", "statistic", "state")
    )


@pytest.mark.parametrize("name", DETECTORS)
def test_the_same_numbers_one_by_one_in_halves_and_uncompiled(name):
    detector, z = DETECTORS[name], example()
    whole, state, told = detector.scan(z), None, []
    assert len(whole) > 2
    for t in range(len(z)):
        one = detector.scan(z[t : t + 1], state=state)
        state = one.state
        told += [(t, int(d)) for d in one.directions]
    assert told == list(zip(whole.samples.tolist(), whole.directions.tolist()))
    assert np.array_equal(state, whole.state)
    first = detector.scan(z[:150])
    rest = detector.scan(z[150:], state=first.state)
    assert np.array_equal(rest.state, whole.state)
    assert np.array_equal(np.concatenate([first.statistic, rest.statistic]), whole.statistic, equal_nan=True)
    kernel = detector.resolve()
    there = z[np.isfinite(z)]
    marks, outs = np.zeros((1, kernel.state_size(0))), np.empty((1, len(there), 2))
    plain = compile.plain_watcher(type(kernel))
    plain(marks, there[None], np.zeros((1, len(there), 0)), outs, flatten((kernel,)))
    assert np.allclose(marks[0], whole.state, rtol=1e-12)
    assert np.allclose(outs[0, :, 1], whole.statistic[np.isfinite(z)], rtol=1e-12)


@pytest.mark.parametrize("name", DETECTORS)
def test_missing_samples_are_skipped(name):
    detector, z = DETECTORS[name], example()
    there = np.flatnonzero(np.isfinite(z))
    gappy, whole = detector.scan(z), detector.scan(z[there])
    assert np.array_equal(gappy.samples, there[whole.samples])
    assert np.array_equal(gappy.changes, there[whole.changes])
    assert np.array_equal(gappy.statistic[there], whole.statistic)
    assert np.isnan(np.delete(gappy.statistic, there)).all()
    assert len(detector.scan(np.full(5, np.nan))) == 0


@pytest.mark.parametrize("name", DETECTORS)
def test_units(name):
    z, detector = example(), DETECTORS[name]
    assert same(detector.scan(z), detector.scan(8.0 * z, std=8.0))
    shifted = detector.scan(z + 64.0, mean=64.0)
    assert np.allclose(detector.scan(z).statistic, shifted.statistic, atol=1e-9, equal_nan=True)


@pytest.mark.parametrize("name", DETECTORS)
def test_the_statistic_is_relative_to_the_threshold(name):
    found = DETECTORS[name].scan(example())
    alarms = np.zeros(400, bool)
    alarms[found.samples] = True
    known = np.isfinite(found.statistic)
    assert np.array_equal(found.statistic[known] >= 1, alarms[known])


def test_a_change_before_the_record_has_a_negative_date():
    z = np.full(6, 1.0)
    detector = dw.PageHinkley(jump=1.0, threshold=3.0, sides="up")
    first = detector.scan(z[:4])
    assert first.changes.size == 0
    assert detector.scan(z[4:], state=first.state).changes.tolist() == [-4]
    assert repr(detector.scan(z)) == "1 alarm in 6 samples: up at 5 since 0"


def test_words():
    assert "a shift of -0.8 sd is found after" in dw.PageHinkley("1 per 10_000", jump=0.8, sides="down").words
    words = dw.PageHinkley("1 per 10_000", jump=1.0).words
    assert "one false alarm per 10 000 samples on average (exact" in words
    assert "a shift of 1 sd is found after 15.7 samples" in words
    assert "approximately" in dw.detect.GLR(1000, window=20).words
    assert "at most one false alarm per 1 000 samples on average (guaranteed" in dw.detect.ScoreCUSUM(1000, 1.0).words
    assert (
        "per 202 samples" in dw.detect.ScoreCUSUM(jump=1.0, threshold=6.0).words
        and "for each parameter" in dw.detect.ScoreCUSUM(jump=1.0, threshold=6.0).words
    )
    calibrated = dw.detect.ScoreCUSUM("1 per 1000", jump=0.5).calibrated_to([-1.0, 0.3]).words
    assert (
        calibrated.startswith("one false alarm per 1 000 samples") and "slopes of size 1, 0.3; no guarant" in calibrated
    )
    assert "no fixed rate" in dw.PageHinkley(threshold=4.0, growing=True).words
    assert "4 times as large is found after 16.7 samples" in dw.detect.VarianceCUSUM().words


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: dw.PageHinkley("0 per 100").resolve(), "false alarms"),
        (lambda: dw.PageHinkley(2, jump=1.0, sides="up").resolve(), "impossible"),
        (lambda: dw.PageHinkley(jump=-1.0).resolve(), "jump"),
        (lambda: dw.PageHinkley(jump=(1.0, 2.0, 3.0)).resolve(), "jump"),
        (lambda: dw.PageHinkley(sides="left").resolve(), "sides"),
        (lambda: dw.PageHinkley(growing=True).resolve(), "growing"),
        (lambda: dw.PageHinkley(threshold=3.0, growing=True).run_length, "no run length"),
        (lambda: dw.PageHinkley(sides="up").delay(-1.0), "does not watch"),
        (lambda: dw.PageHinkley().scan(np.zeros((3, 2))), r"signal must be \(T,\)"),
        (lambda: dw.PageHinkley().scan([np.inf]), "infinite"),
        (lambda: dw.PageHinkley().scan(["a"]), "numbers"),
        (lambda: dw.PageHinkley().scan([1.0], std=0.0), "std"),
        (lambda: dw.PageHinkley().scan([1.0], state=np.zeros(3)), "state"),
        (lambda: dw.detect.VarianceCUSUM(ratio=0.5).resolve(), "ratio > 1"),
        (lambda: dw.detect.VarianceCUSUM().delay(0.5), "does not watch"),
        (lambda: dw.detect.VarianceCUSUM().delay(start="late"), "steady"),
        (lambda: dw.detect.GLR(window=0).resolve(), "window"),
        (lambda: dw.detect.GLR(window=10**12).resolve(), "window may be 100000 samples"),
        (lambda: dw.detect.GLR(1.5).resolve(), "too often"),
        (lambda: dw.detect.ScoreCUSUM().scan(np.zeros(3), np.zeros(3)), "slopes"),
        (lambda: dw.detect.ScoreCUSUM(jump=[1.0, 2.0]).scan(np.zeros(3), np.zeros((3, 3))), "jump"),
        (lambda: dw.detect.ScoreCUSUM().scan(np.zeros(3), np.zeros((4, 3))), r"\(4, 3\)"),
        (lambda: dw.detect.probe_bank(np.zeros(3), np.zeros(3)), "probe_innovations"),
        (lambda: dw.detect.probe_bank(np.zeros(3), np.zeros((3, 2)), variance=-1.0), "variance"),
        (lambda: dw.detect.score_test(np.zeros((3, 2)), np.zeros(4), 1.0), "Transposed"),
    ],
)
def test_bad_settings_are_told(call, words):
    with pytest.raises(dw.InputError, match=words):
        call()
