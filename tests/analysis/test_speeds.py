"""A plant that becomes faster or slower: its slopes, what is told of it, and that a gain stays a gain."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws, slow
from driftwise_studies.score.claims.lags import changing, plain
from driftwise_studies.score.claims.simulation import record
from slopes import check_slopes

import driftwise as dw
from driftwise.analysis.answer_times import slowed_by
from driftwise.analysis.change_effects import GAIN, SPEED, effects, scanner
from driftwise.analysis.change_log import ChangeLog, moved
from driftwise.analysis.change_places import beside_all, place, standing
from driftwise.analysis.readings import other_reading
from driftwise.analysis.response_orders import begin, linear, plainest
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import Jump as Told
from driftwise.analysis.segmentation import hindsight
from driftwise.analysis.speeds import Piece, passed, pieces, slowed


def lagging(seed=0, samples=900, factor=1.5, gain=1.0, at=400, noise=0.05):
    """Return y, u of a plant of first order that takes ``factor`` times as long to answer from ``at`` on."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], samples // 10), 10)
    x = np.zeros(samples)
    for t in range(1, samples):
        a = 0.8 ** (1 / factor) if t >= at else 0.8
        x[t] = a * x[t - 1] + (1 - a) * (gain if t >= at else 1.0) * u[t - 1]
    return 5 + x + noise * rng.standard_normal(samples), u[:, None]


def told(y, u):
    seen = hindsight(y, u)
    return seen.jumps() if seen else []


@pytest.mark.parametrize("factor", [1.3, 0.7, 2.5])
@draws("seeds", range(1), range(3))
def test_a_lag_that_jumps_is_a_speed_and_no_gain(factor, seeds):
    for seed in seeds:
        (jump,) = told(*lagging(seed, factor=factor))
        assert jump.kind == SPEED and jump.rival is None
        assert jump.interval[0] - 3 <= 400 <= jump.interval[1] + 3
        assert jump.after == pytest.approx(factor, rel=0.12)


@draws("seeds", range(1), range(3))
def test_a_gain_that_jumps_stays_one_and_both_are_both(seeds):
    for seed in seeds:
        assert {jump.kind for jump in told(*lagging(seed, factor=1.0, gain=1.5))} == {GAIN}
        assert {jump.kind for jump in told(*lagging(seed, factor=0.6, gain=1.5))} == {GAIN, SPEED}


@pytest.mark.parametrize("number", [32, slow(43)])
def test_pairs_beside_a_pole_that_becomes_faster_are_found_beside_it(number):
    y, u, at, factor, _ = changing(41, number, "lag")  # one pole has most of it, before the change is known
    seen = hindsight(y, u)
    jump = next(jump for jump in seen.jumps() if jump.kind == SPEED)
    assert len(seen.response.a) > 1 and abs(jump.at - at) < 30
    assert jump.after == pytest.approx(factor, rel=0.25)


def test_all_but_the_poles_of_a_plant_that_became_faster_follows_by_least_squares():
    y, u = lagging(2, factor=2.0, noise=0.0)
    plain = plainest(recorded(y, u)[0]).with_speed(400, -np.log(2.0))
    found = linear(replace(plain, sigma=np.full(900, 1e-3)), np.array([-np.sqrt(0.8)]), (1,), 2)
    again = replace(found, cache={})
    assert abs(again.unscaled).max() < 1e-9
    np.testing.assert_allclose(found.left, again.left, atol=1e-6)


@draws("numbers", range(1), range(2))
def test_nothing_becomes_faster_where_nothing_changes_or_a_static_curve_bends(numbers):
    kinds = "steady", "square", "saturation"
    assert not [jump for kind in kinds for k in numbers for jump in told(*changing(2, k, kind)[:2])]


def test_times_before_and_after_are_told_with_intervals_that_hold_them():
    seen = hindsight(*lagging(1, factor=1.5))
    found = slowed_by(seen.response, 0)
    for span, tau in ((found.before, -1 / np.log(0.8)), (found.after, -1.5 / np.log(0.8))):
        assert span.low < span.time < span.high and abs(span.time - tau) < 1.0  # from sample to sample a straight line
    assert found.interval[0] < 1.5 < found.interval[1] and found.input == 0
    log = ChangeLog(["valve"])
    y, u = lagging(1, factor=1.5)
    log.add(y, u, np.arange(900.0))
    assert log.changes[0].moved.startswith("the plant became slower: 63 % of the answer to a step of valve took ")


def test_the_words_of_a_file_name_the_time_constant_and_end_with_it():
    y, u = lagging(3, factor=2.0)
    found = dw.identify({"valve": u[:, 0], "level": y}, output="level", input=["valve"])
    (change,) = [claim.text for claim in found.claims if claim.kind == "change"]
    assert "the plant became slower: 63 % of the answer to a step of valve took" in change
    (time,) = [claim.value for claim in found.claims if claim.kind == "time constant"]
    assert time == pytest.approx(-2 / np.log(0.8), rel=0.1)


def test_where_both_readings_are_as_likely_both_are_told():
    jump = Told(400, (390, 410), 20.0, GAIN, 0, 2.0, 3.0, rival=Told(400, (390, 410), 20.0, SPEED, 0, 1.0, 1.4))
    words = "the plant's response changed: the gain from valve rose from 2 to 3, or the plant became slower"
    assert ChangeLog(["valve"])._moved(jump).startswith(words)
    assert moved(jump.rival, ["valve"]) == "the plant became slower, its time constants 1.4 times as long"
    seen = hindsight(*lagging(0, factor=1.5))
    (jump,) = seen.jumps()
    assert other_reading(seen.response, SPEED, 0, standing(seen.response, "speeds", 0)) is None  # clearly a speed


def test_slopes_are_those_of_differences():
    plant = plain(5, 4)
    data = record(plant, 5)
    now = begin(recorded(data.y, data.u)[0]).with_speed(200, 0.3).with_gain(0, 250, 0.2).with_speed(300, -0.2)
    check_slopes(now)


def test_the_scan_of_all_places_is_that_of_each():
    data = record(plain(5, 8), 5)
    now = begin(recorded(data.y, data.u)[0])
    r, places = beside_all(now), np.array([150, 320, 500])
    taken = scanner(now, SPEED, 0, r)(places)
    for at, value in zip(places, taken):
        d = effects(now, SPEED, 0, [at])[0][0] * now.weight
        d -= now.basis @ (now.basis.T @ d)
        assert value == pytest.approx(0.5 * (d @ r) ** 2 / (d @ d), rel=1e-6)
    assert place(now, SPEED, 0) is not None


def test_what_passes_goes_on_where_the_plant_changes():
    x = np.random.default_rng(0).standard_normal(60)
    a = np.real(np.poly([0.8, 0.5]))
    same = [Piece(0, a, 1.0), Piece(30, a, 1.0)]
    assert np.allclose(passed(same, x), passed(same[:1], x))
    (first, last) = pieces(a, [30], [np.log(2.0)])
    assert np.allclose(np.sort(np.roots(first.a)), np.sort(np.sqrt([0.8, 0.5]))) and last.hold == 1.0
    steady = passed([first, last], np.ones(4000) * a.sum())
    assert steady[-1] == pytest.approx(1.0)
    pair = slowed(np.real(np.poly([0.9 * np.exp(0.3j), 0.9 * np.exp(-0.3j)])), np.log(2.0))
    assert abs(np.roots(pair)) == pytest.approx(np.sqrt(0.9)) and abs(np.angle(np.roots(pair))) == pytest.approx(0.15)
