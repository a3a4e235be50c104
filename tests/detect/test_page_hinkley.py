"""Page and Hinkley: golden records, batch formulas, run lengths, delays."""

import json
from pathlib import Path

import numpy as np
import pytest
from alarms_counted import run_length
from draws import slow

import driftwise as dw
from driftwise.detect.alarms import simulated_delay
from driftwise.detect.watch import OWN

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "perriot.json").read_text())


def golden(name):
    return next(case for case in GOLDEN["cases"] if case["name"] == name)


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


@pytest.mark.parametrize("seed", [0, 1, *map(slow, range(2, 20))])
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


@pytest.mark.parametrize("runs", [4000, slow(40_000)])
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
