"""Detectors: the sums of the book, their promised rates by simulation, dates, directions, gaps, ways of feeding."""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import driftwise as dw
from driftwise.detect.alarms import simulated_delay
from driftwise.detect.watch import OWN, STATISTIC, watch
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "perriot.json").read_text())
DETECTORS = {
    "hinkley": dw.PageHinkley(50, jump=1.0),
    "hinkley, up": dw.PageHinkley(50, jump=0.6, sides="up"),
    "hinkley, each side its own": dw.PageHinkley(jump=(1.0, 0.5), threshold=(3.0, 5.0)),
    "hinkley, growing": dw.PageHinkley(jump=1.0, threshold=2.0, growing=True),
    "variance": dw.detect.VarianceCUSUM(threshold=2.0, sides="both"),
    "GLR": dw.detect.GLR(100, window=12),
}


def golden(name):
    return next(case for case in GOLDEN["cases"] if case["name"] == name)


def run_length(detector, alarms, seed=0, make=None, block=50_000):
    """Samples over alarms, as every alarm starts afresh; the relative standard error is alarms^-1/2."""
    rng, found, samples, state = np.random.default_rng(seed), 0, 0, None
    while found < alarms:
        z, slopes = make(rng, block) if make else (rng.standard_normal(block), None)
        outs = np.empty((1, block, 1))
        slopes = np.zeros((1, block, 0)) if slopes is None else slopes[None]
        state = np.zeros((1, detector.state_size(slopes.shape[2]))) if state is None else state
        compile.watcher(type(detector))(state, z[None], slopes, outs, flatten((detector,)))
        found, samples = found + np.count_nonzero(outs), samples + block
    return samples / found


def two_sums(Z, k, h):
    """The batch formulas: cumulative sums against their extremes so far, all anew after an alarm."""
    Z, start, alarms = np.asarray(Z, float), 0, []
    while start < len(Z):
        n = np.arange(1, len(Z) - start + 1)
        S = np.cumsum(Z[start:])
        up, down = np.concatenate([[0], S - k * n]), np.concatenate([[0], S + k * n])
        rise, fall = up - np.minimum.accumulate(up), np.maximum.accumulate(down) - down
        hit = np.flatnonzero((rise >= h) | (fall >= h))
        if not hit.size:
            break
        at = hit[0]
        is_up = rise[at] >= h
        path = up if is_up else -down
        last = np.flatnonzero(path[: at + 1] == path[: at + 1].min())[-1]  # samples before the change
        alarms.append((start + at - 1, start + last, 1 if is_up else -1))
        start += at
    return alarms


# --- Hinkley ---------------------------------------------------------------------------------------------------


def test_golden_hinkley_two_sided():
    case = golden("hinkley_two_sided")
    given, expected = case["input"], case["expected"]
    found = dw.PageHinkley(jump=2 * given["dmu"], threshold=given["h"]).scan(given["Z"])
    assert [[int(s) + 1, int(d)] for s, d in zip(found.samples, found.directions)] == expected["alarms_with_reset"]
    assert found.samples[0] + 1 == expected["first_up_alarm"]
    assert found.changes[0] == expected["change_time_estimate"]  # 2 samples before the change: the third is the first
    for side, name in (("up", "delta_up"), ("down", "Delta_down")):
        never = dw.PageHinkley(jump=2 * given["dmu"], threshold=1e6, sides=side)  # no alarm: the whole path
        np.testing.assert_allclose(1e6 * never.scan(given["Z"]).statistic, expected[name], rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_two_sums_equal_the_batch_formulas(seed):
    rng = np.random.default_rng(seed)
    Z = rng.standard_normal(400) + np.repeat(rng.choice([-1.0, 0.0, 1.0], 8), 50)
    found = dw.PageHinkley(jump=0.8, threshold=4.0).scan(Z)
    told = list(zip(found.samples.tolist(), found.changes.tolist(), found.directions.tolist()))
    assert told == two_sums(Z, 0.4, 4.0)
    assert told


def test_one_sum_for_both_directions_is_wrong():
    """The printed S serves both tests: its decrease test fires on clean data every 201 samples, not every 1496."""
    rng, k, h, G = np.random.default_rng(0), 0.07, 20.0, 1 / 0.99
    S = np.cumsum(G * rng.standard_normal((300, 4000)) - k, axis=1)
    fired = np.maximum(np.maximum.accumulate(S, axis=1), 0) - S >= h
    assert fired.any(axis=1).all()
    printed = np.mean(np.argmax(fired, axis=1) + 1)
    assert abs(printed - 201) < 15
    down = dw.PageHinkley(jump=2 * k / G, threshold=h / G, sides="down").resolve()
    assert run_length(down, 400) > 1300


@pytest.mark.parametrize("runs", [4000, pytest.param(40_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("k, h, G, expected", [(0.5, 4, 1, 334.5), (0.15, 15, 1.01, 2524), (0.07, 20, 1.01, 1501)])
def test_one_sided_run_lengths(k, h, G, expected, runs):
    """Against an independent study of 40 000 runs (its standard error .5 %), four standard errors together."""
    detector = dw.PageHinkley(jump=2 * k / G, threshold=h / G, sides="up")
    measured = run_length(detector.resolve(), runs, seed=runs)
    assert abs(measured / expected - 1) < 4 * np.hypot(runs**-0.5, 0.005)
    assert abs(measured / detector.run_length - 1) < 4 * runs**-0.5


def test_two_sided_keeps_its_promise():
    detector = dw.PageHinkley("1 per 1000", jump=1.0)
    assert np.isclose(detector.run_length, 1000, rtol=1e-6)
    assert abs(run_length(detector.resolve(), 10_000) / 1000 - 1) < 0.03


@pytest.mark.parametrize("jump", [0.5, -1.0])
def test_delay_is_that_of_simulation(jump):
    detector = dw.PageHinkley("1 per 10_000", jump=1.0)
    mean, error = simulated_delay(detector.resolve(), jump, runs=8000, seed=1)
    assert abs(mean - detector.delay(jump)) < 3.5 * error
    assert detector.delay(jump, start="zero") > detector.delay(jump)


@pytest.mark.parametrize("start", ["steady", "zero"])
def test_delay_of_a_change_of_variance_is_that_of_simulation(start):
    detector, rng, runs = (
        dw.detect.VarianceCUSUM(ratio=2.0, false_alarms="1 per 10_000"),
        np.random.default_rng(7),
        20_000,
    )
    h, g, delay, n = detector.resolve().h[0], np.zeros(runs), np.zeros(runs), 0
    for t in range(-200 if start == "steady" else 0, 1000):
        z = rng.standard_normal(len(g)) * (2.0**0.5 if t >= 0 else 1.0)
        g = np.maximum(0.0, g - 0.5 * np.log(2.0) + 0.25 * z**2)
        if t < 0:
            g[g >= h] = 0.0
            continue
        done = int(np.count_nonzero(g >= h))
        delay[n : n + done] = t + 1
        g, n = g[g < h], n + done
    assert n == runs
    assert abs(delay.mean() - detector.delay(start=start)) < 3.5 * delay.std() / runs**0.5
    assert detector.delay() < 0.96 * detector.delay(start="zero")


def test_the_growing_threshold_lets_false_alarms_die_out():
    z = np.random.default_rng(0).standard_normal(300_000)
    fixed = dw.PageHinkley(jump=0.5, threshold=6.0).scan(z)
    growing = dw.PageHinkley(jump=0.5, threshold=6.0, growing=True).scan(z)
    assert len(fixed) > 1500
    assert len(growing) <= 3
    n = 1000
    state = dw.PageHinkley(jump=0.5, threshold=6.0, growing=True).scan(z[:n]).state
    assert np.isclose(state[OWN + 4], 6.0 + 1.1 / (2 * 0.25) * np.log(n), rtol=1e-12)


def test_change_times():
    """Half the dates of a jump of 1 sd lie within 4 samples of the truth; the median is right to 1."""
    rng, off = np.random.default_rng(5), []
    for _ in range(300):
        z = rng.standard_normal(400)
        z[200:] += 1.0
        found = dw.PageHinkley("1 per 10_000", jump=1.0).scan(z)
        off += [int(c) - 200 for s, c in zip(found.samples, found.changes) if s >= 200][:1]
    assert len(off) >= 299
    assert abs(np.median(off)) <= 1
    assert np.mean(np.abs(off) <= 4) > 0.5


# --- the others ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sides, ratio", [("up", 4.0), ("down", 4.0), ("both", 2.0)])
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


# --- inside an estimator ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "detector",
    [
        dw.PageHinkley(threshold=2.0),
        dw.detect.VarianceCUSUM(threshold=2.0, sides="both"),
        dw.detect.GLR(threshold=2.0, window=5),
    ],
    ids=["hinkley", "variance", "GLR"],
)
def test_every_detector_of_innovations_obeys_the_laws_in_an_estimator(detector):
    dw.check_policy(detector)


class Loud(NamedTuple):
    """A user's own: alarms at every innovation beyond a bound."""

    bound: float

    def state_size(self, parameters):
        return OWN


@watch.on(Loud)
def _(detector, marks, z, slope):
    marks[STATISTIC] = abs(z) / detector.bound
    return 1.0 if z >= detector.bound else -1.0 if -z >= detector.bound else 0.0


def test_a_detector_of_ones_own():
    dw.check_policy(Loud(2.0))
    y, u = dw.simulate([-0.5], [1.0], samples=300, noise_std=0.1, seed=1)
    trace = dw.Joint(
        1,
        1,
        noise=dw.models.EquationError(0.01),
        memory=dw.RestartOnChange(Loud(2.5), dw.memory.CovarianceInflation(0.01), 9),
    ).scan(y, u)
    z = trace.innovation / np.sqrt(trace.variance)
    expected = (abs(z) >= 2.5) & (np.arange(300) >= 9)
    assert expected.any()
    assert np.array_equal((trace.status & int(dw.Status.JUMP)) > 0, expected)


def test_an_estimator_watches_as_the_detector_alone_would():
    """Until the first alarm the marks in the state are those of a scan of the whitened innovations."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    detector = dw.PageHinkley(jump=0.4, threshold=1e3)
    est = dw.Joint(2, 1, noise=dw.models.EquationError(0.01), memory=dw.RestartOnChange(detector, settle=50))
    trace = est.scan(y, u)
    z = trace.innovation[50:] / np.sqrt(trace.variance[50:])
    np.testing.assert_allclose(trace.state["detector_state"], detector.scan(z).state, rtol=1e-9, atol=1e-9)
    assert trace.state["detector_state"][STATISTIC] > 0


def test_a_bias_that_widens_nothing_is_found_by_the_mean():
    """An offset of 1 sd on the equation: the mean moves, the variance hardly."""
    rng, T = np.random.default_rng(0), 1500
    e = 0.1 * (rng.standard_normal((20, T)) + (np.arange(T) >= 1000))
    alarms = {}
    for detector in (dw.PageHinkley("1 per 100_000"), dw.detect.VarianceCUSUM(false_alarms="1 per 100_000")):
        est = dw.Joint(
            1,
            noise=dw.models.EquationError(0.01),
            memory=dw.RestartOnChange(detector, dw.memory.CovarianceInflation(0.01)),
        )
        found = np.zeros((20, T), bool)
        for i in range(20):
            y = np.zeros(T)
            for t in range(1, T):
                y[t] = 0.5 * y[t - 1] + e[i, t]
            found[i] = (est.scan(y).status & int(dw.Status.JUMP)) > 0
        assert found[:, :1000].sum() <= 1
        alarms[type(detector).__name__] = found[:, 1000:1050].any(axis=1).sum()
    assert alarms["PageHinkley"] >= 19
    assert alarms["VarianceCUSUM"] <= 15


def test_each_output_has_its_detector():
    y, u = dw.simulate(np.where(np.arange(1200)[:, None] < 600, [-1.5, 0.72], [-1.2, 0.5]), [1.0, 0.5],
                       samples=1200, noise_std=0.1, seed=3)  # fmt: skip
    est = dw.JointMIMO(
        (2, 2), 1, noise=dw.models.EquationError(0.01), memory=dw.RestartOnChange(dw.detect.VarianceCUSUM())
    )
    still, _ = dw.simulate([-1.5, 0.72], [1.0, 0.5], u=u, samples=1200, noise_std=0.1, seed=4)
    status = est.scan(np.column_stack([y, still]), u).status & int(dw.Status.JUMP)
    assert 600 <= np.flatnonzero(status[:, 0])[0] < 620
    assert not status[:, 1].any()


def test_continuous_time_until_a_jump():
    rng, T, dt = np.random.default_rng(0), 2000, 0.1
    u, y = np.repeat(rng.standard_normal(T // 10), 10), np.zeros(T)
    for t in range(1, T):
        a = 1.0 if t < 1000 else 3.0
        y[t] = np.exp(-a * dt) * y[t - 1] + (1 - np.exp(-a * dt)) / a * u[t - 1]
    y += 0.02 * rng.standard_normal(T)
    est = dw.ContinuousJoint(1, 1, noise=dw.models.EquationError(0.0004), dt=dt, memory=dw.RestartOnChange())
    trace = est.scan(y, u)
    alarms = np.flatnonzero(trace.status & int(dw.Status.JUMP))
    assert 1000 <= alarms[0] < 1050
    stubborn = dw.ContinuousJoint(1, 1, noise=dw.models.EquationError(0.0004), dt=dt).scan(y, u)
    assert abs(trace.parameters[-1, 0] - 3.0) < 0.2 < abs(stubborn.parameters[-1, 0] - 3.0)
    dw.check_estimator(dw.ContinuousJoint(1, 1, memory=dw.RestartOnChange(dw.PageHinkley(threshold=2.0), settle=10)))


def test_a_detector_is_saved_with_its_estimator(tmp_path):
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=200, noise_std=0.1, seed=1)
    for detector in (
        dw.PageHinkley(jump=(1.0, 0.5)),
        dw.detect.GLR(window=20),
        dw.detect.VarianceCUSUM(false_alarms=1e5),
    ):
        est = dw.Joint(2, 1, memory=dw.RestartOnChange(detector, settle=20))
        state = est.scan(y[:100], u[:100]).state
        dw.save_state(est, state, tmp_path / "state.json")
        other, back = dw.load_state(tmp_path / "state.json")
        assert np.array_equal(
            est.scan(y[100:], u[100:], state=state).table, other.scan(y[100:], u[100:], state=back).table
        )


@pytest.mark.parametrize(
    "detector",
    [dw.PageHinkley("1/200"), dw.detect.VarianceCUSUM(false_alarms="1/200"), dw.detect.GLR("1/200", window=20)],
    ids=repr,
)
def test_sample_by_sample_is_the_record(detector):
    z = np.random.default_rng(5).standard_normal(600)
    z[300:] += 1.0
    z[::17] = np.nan
    whole = detector.scan(2 * z + 3, mean=3.0, std=2.0)
    monitor = dw.detect.Monitor(detector, mean=3.0, std=2.0)
    state, alarms = monitor.start(), []
    for t, value in enumerate(2 * z + 3):
        before = state.copy()
        state, sign = monitor.update(state, value)
        assert np.isnan(z[t]) == np.isnan(sign.statistic)
        assert not np.isnan(z[t]) or np.array_equal(state, before)
        alarms += [(t, sign.alarm)] if sign.alarm else []
    assert alarms == list(zip(whole.samples, whole.directions))
    assert len(alarms) > 2
    assert np.array_equal(state, whole.state)


def test_a_monitor_takes_slopes_and_refuses_nonsense():
    rng = np.random.default_rng(6)
    slopes, z = rng.standard_normal((400, 2)), rng.standard_normal(400)
    z[200:] += 1.5 * slopes[200:, 1]
    found = dw.detect.ScoreCUSUM(jump=1.5).scan(z, slopes)
    monitor = dw.detect.Monitor(dw.detect.ScoreCUSUM(jump=1.5), parameters=2)
    state, alarms = monitor.start(), []
    for t in range(400):
        state, sign = monitor.update(state, z[t], slopes[t])
        alarms += [(t, sign.which)] if sign.alarm else []
    assert alarms == list(zip(found.samples, found.which))
    assert alarms[0][1] == 1
    with pytest.raises(dw.InputError, match="another detector's"):
        monitor.update(np.zeros(3), 0.0, [1.0, 1.0])
    with pytest.raises(dw.InputError, match="must be finite"):
        monitor.update(state, np.inf, [1.0, 1.0])
    with pytest.raises(dw.InputError, match="detector must be"):
        dw.detect.Monitor(12.0)


def test_what_changed_names_the_parameter():
    """ARX(2, 2), one parameter jumps by a little: at least 90 % of 80 runs name it and its direction (97 % do)."""
    right = 0
    for i, size in enumerate((0.03, -0.03, 0.05, -0.05)):
        theta = np.tile([-1.5, 0.7, 1.0, 0.5], (700, 1))
        theta[400:, i] += size
        for seed in range(20):
            y, u = dw.simulate(theta[:, :2], theta[:, 2:], samples=700, noise_std=0.1, seed=seed)
            told = dw.ARX(2, 2).scaled_to(y, u).scan(y, u).what_changed(400)
            right += told.which == i and told.direction == np.sign(size)
    assert right >= 72


def test_what_changed_needs_a_regression():
    y, u = dw.simulate([-0.8], [1.0], samples=50, seed=1)
    with pytest.raises(dw.InputError, match="ARX"):
        dw.Joint(1, 1).scan(y, u).what_changed(10)
    with pytest.raises(dw.InputError, match="ARX"):
        dw.ARX(1, 1, method="nlms").scan(y, u).what_changed(10)
