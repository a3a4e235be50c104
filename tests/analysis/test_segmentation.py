"""Jumps in hindsight: found where they are, with odds; none where there is none, or only drift, season, outliers."""

from functools import cache

import numpy as np
import pytest
from draws import draws, slow
from driftwise_studies.score.claims.drawing import draw
from driftwise_studies.score.claims.simulation import record
from driftwise_studies.score.claims.wander import WALK, wandering
from scipy.signal import lfilter

from driftwise.analysis import segmentation
from driftwise.analysis.change_effects import effects, scanner, share
from driftwise.analysis.change_log import ChangeLog, moved
from driftwise.analysis.change_places import place
from driftwise.analysis.noise_jumps import LEAST, SURE
from driftwise.analysis.response_orders import begin
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import GAIN, LEVEL, NOISE, Jump, hindsight


def plant(seed=0, samples=900, gain=1.0, level=0.0, noise=1.0, colour=0.0, at=400):
    """Return y, u of a plant of first order of which gain, level or noise is another from ``at`` on."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], samples // 10), 10)
    x, v, e = np.zeros(samples), np.zeros(samples), 0.1 * rng.standard_normal(samples)
    for t in range(1, samples):
        x[t] = 0.8 * x[t - 1] + 0.2 * (gain if t >= at else 1.0) * u[t - 1]
        v[t] = colour * v[t - 1] + (noise if t >= at else 1.0) * e[t]
    return 5 + x + v + level * (np.arange(samples) >= at), u[:, None]


def found(y, u):
    seen = hindsight(y, u)
    return seen.jumps() if seen else []


@pytest.mark.parametrize(
    ("what", "kind", "before", "after"),
    [({"gain": 2.0}, GAIN, 1.0, 2.0), ({"level": 0.8}, LEVEL, 0.0, 0.8), ({"noise": 3.0}, NOISE, 0.1, 0.3)],
)
@draws("seeds", range(1), range(3))
def test_what_jumps_is_found_once_named_and_dated(what, kind, before, after, seeds):
    for seed in seeds:
        (jump,) = found(*plant(seed, **what))
        assert jump.kind == kind and abs(jump.at - 400) < 20
        assert jump.interval[0] - 3 <= 400 <= jump.interval[1] + 3
        assert jump.before == pytest.approx(before, abs=0.2) and jump.after == pytest.approx(after, rel=0.3)


@draws("seeds", range(1), range(3))
def test_jumps_that_are_said_to_be_visible_are_told_and_a_fifth_of_them_are_not(seeds):
    for seed in seeds:
        seen = hindsight(*plant(seed)).visible()
        for size, is_told in ((1.5, True), (0.2, False)):
            level = found(*plant(seed, level=size * seen.level))
            gain = found(*plant(seed, gain=1 + size * seen.gains[0]))
            noise = found(*plant(seed, noise=1 + size * (seen.noise - 1)))
            assert sum(map(bool, (level, gain, noise))) == 3 if is_told else not level and not gain
    assert hindsight(*(part[:40] for part in plant())) is None


@draws("seeds", range(2), range(6))
def test_nothing_is_told_of_plants_that_stay(seeds):
    told = [found(*plant(seed, colour=colour)) for seed in seeds for colour in (0.0, 0.9)]
    assert sum(map(len, told)) <= len(seeds) // 6


def test_a_load_that_jumps_before_the_plant_is_no_jump_of_a_gain():
    """It moves the level as the plant does: what a gain moves besides what it multiplies."""
    for seed in range(2):
        (y, u), load = plant(seed), np.where(np.arange(900) >= 400, 0.08, 0.0)
        y = y + lfilter([1.0], [1.0, -0.8], load)
        assert all(jump.kind != GAIN for jump in found(y, u))


def test_numbers_before_and_after_a_jump_are_told_apart():
    jump = Jump(400, (390, 410), 20.0, GAIN, 0, 2.9901, 2.9884)
    assert moved(jump, ["valve"]) == "the gain from valve fell from 2.99 to 2.988"
    assert moved(jump._replace(before=3.0, after=1.5), ["valve"]) == "the gain from valve halved, from 3 to 1.5"


def test_drift_season_and_outliers_are_no_jumps():
    t, rng = np.arange(900), np.random.default_rng(3)
    y, u = plant()
    assert not found(y + 2 * t / 900, u) and not found(y + np.sin(2 * np.pi * t / 150), u)
    hit = rng.random(900) < 0.02
    assert not found(y + hit * rng.choice([-3.0, 3.0], 900), u)


def test_steps_of_the_input_are_no_jumps_and_rests_no_noise():
    _, u = plant()
    u[:300], u[300:] = 0.0, 1.0
    x = np.zeros(900)
    for t in range(1, 900):
        x[t] = 0.8 * x[t - 1] + 0.2 * u[t - 1, 0]
    assert not found(x + 0.02 * np.random.default_rng(1).standard_normal(900), u)
    assert not found(np.round(x, 2), u)


def test_too_little_to_judge_by_is_no_jump():
    y, u = plant()
    assert found(y[:40], u[:40]) == [] and found(np.where(np.arange(900) % 5, np.nan, y), u) == []
    assert hindsight(np.zeros(3), np.zeros((3, 1))) is None


def test_pieces_tell_each_jump_once():
    y, u = plant(gain=2.0, at=500)
    whole, pieces = ChangeLog(["valve"]), ChangeLog(["valve"])
    whole.add(y, u, np.arange(900.0))
    for part in (slice(0, 520), slice(520, 900)):
        pieces.add(y[part], u[part], np.arange(900.0)[part])
    (one,), (other,) = whole.changes, pieces.changes
    assert abs(one.since - 500) < 15 and abs(other.since - 500) < 15
    assert "the gain from valve doubled" in one.what and pieces.count == 1


@draws("lengths", range(2 * LEAST - 1, 2 * LEAST + 4), range(50, 110))
def test_a_record_of_any_length_is_looked_at(lengths):
    """One of exactly two margins had no place left to cut, and `identify` ended in a traceback."""
    y, u = plant()
    for samples in lengths:
        assert len(found(y[:samples], u[:samples])) <= 1


@pytest.mark.parametrize("seed", [0, slow(1)])
def test_a_level_beside_a_noise_as_slow_as_the_plant_is_the_only_jump(seed):
    rng, A = np.random.default_rng(seed), np.poly([0.95, 0.9])
    u = np.repeat(rng.choice([-3.0, 0.0, 3.0], 20), 20)
    y = lfilter([A.sum()], A, u) + lfilter([1.0], A, 0.01 * rng.standard_normal(400))
    y[250:] -= 0.3
    (jump,) = found(y, u[:, None])
    assert (jump.kind, jump.at) == (LEVEL, 250)


def test_a_level_without_an_input_is_told():
    for seed in range(4):
        y = np.random.default_rng(seed).standard_normal(300)
        y[160:] += 1.5
        (jump,) = found(y, np.zeros((300, 0)))
        assert jump.kind == LEVEL and abs(jump.at - 160) < 8 and jump.interval[0] <= 160 <= jump.interval[1]


def test_a_direction_that_is_not_free_has_no_share_and_warns_of_nothing():
    with np.errstate(all="raise"):
        assert share(np.array([1e10, 4.0]), np.array([0.0, 2.0]), 10).tolist() == [0.0, 2.0]


def test_a_start_beside_a_wrong_change_hides_no_right_one():
    """Beside a gain that was no gain, nothing was told of the level that jumped."""
    plant = draw(0, 217)
    (jump,) = (one for one in found(*(record(plant, 0).__dict__[name] for name in "yu")) if one.kind == LEVEL)
    assert plant.jumps[0].what == LEVEL and abs(jump.at - plant.jumps[0].at) < 10


def test_an_outlier_just_before_a_step_hides_it_no_more():
    """What whitens the onset is missing, then: the step was looked for after it, where a slow noise leaves nothing."""
    y, u = plant(samples=600, colour=0.9, level=1.5)
    y[399] -= 4.0
    (jump,) = found(y, u)
    assert (jump.kind, jump.at) == (LEVEL, 400) and jump.after == pytest.approx(1.5, abs=0.3)


def test_a_level_and_a_gain_that_jump_soon_after_each_other_are_both_told():
    y, u = plant(samples=600, gain=2.0, at=320)
    y[300:] -= 0.8
    assert [jump.kind for jump in found(y, u)] == [LEVEL, GAIN]


def test_what_jumped_while_nothing_was_measured_is_dated_between():
    y, u = plant(samples=600, level=1.0, at=300)
    y[280:330] = np.nan
    (jump,) = found(y, u)
    assert (jump.kind, jump.at) == (LEVEL, 305) and jump.interval[0] <= 280 and jump.interval[1] >= 330


@pytest.mark.parametrize("at", [430, slow(480)])
def test_a_gain_that_jumped_while_nothing_was_measured_is_dated_by_what_it_did_meanwhile(at):
    """The plant has not forgotten it when the sensor comes back."""
    rng = np.random.default_rng(3)
    u, x = np.repeat(rng.choice([-1.0, 1.0], 90), 10), np.zeros(900)
    for t in range(1, 900):
        x[t] = 0.95 * x[t - 1] + 0.05 * (2.0 if t >= at else 1.0) * u[t - 1]
    y = x + 0.005 * rng.standard_normal(900)
    y[400:490] = np.nan
    (jump,) = hindsight(y, u[:, None]).jumps()
    assert jump.kind == GAIN and jump.interval[0] <= at <= jump.interval[1]
    assert abs(jump.at - at) < 10


@cache
def stepped(colour, missing):
    """Return the response of a plant whose level steps half-way."""
    y, u = plant(seed=2, samples=300, colour=colour, level=1.0, at=150)
    y[list(missing)] = np.nan
    return hindsight(y, u).response


@pytest.mark.parametrize("kind, colour", [(LEVEL, 0.0), (LEVEL, 0.8), (GAIN, 0.0), (GAIN, 0.8)])
@pytest.mark.parametrize("missing", [[], [40, 41, 200]])
def test_what_a_change_takes_is_that_of_least_squares_with_it_at_every_place(kind, colour, missing):
    now = stepped(colour, tuple(missing)).without("levels", 0).refined()
    r, places = now.left * now.weight, np.array([35, 100, 149, 150, 151, 260])
    expected = []
    for k in range(len(places)):
        d = np.array([one[k] for one in effects(now, kind, 0, places)]).T * now.weight[:, None]
        left = [np.linalg.lstsq(X, r, rcond=None)[1].item() for X in (now.basis, np.hstack([now.basis, d]))]
        expected.append((left[0] - left[1]) / 2)
    np.testing.assert_allclose(scanner(now, kind, 0, r)(places), expected, rtol=1e-7)


def test_changes_between_scattered_samples_of_slow_noise_are_told_and_none_that_are_not_there():
    """One sample in four is seen: slow noise was taken for white, and told as changes of the level."""
    counts = []
    for seed, level in ((1, 0.0), (3, 3.0)):
        rng = np.random.default_rng(seed)
        noise = lfilter([0.2], [1.0, -0.97], rng.normal(size=2000))
        u = np.repeat(rng.choice([-1.0, 1.0], 50), 40)
        y = lfilter([0.0, 0.2], [1.0, -0.8], u) + noise + level * (np.arange(2000) >= 1100)
        y[rng.random(2000) > 0.25] = np.nan
        counts.append([jump.kind for jump in found(y, u[:, None])])
    assert counts == [[], [LEVEL]]


@pytest.mark.parametrize(("step", "shock", "kinds"), [(1.5, 0.0, [LEVEL]), (0.0, 1.5, [])])
def test_a_step_beside_noise_as_slow_is_told_and_a_shock_of_that_noise_is_not(step, shock, kinds):
    """Whitened, both are one sample that stands out; but a step stays."""
    rng = np.random.default_rng(4)
    e = 0.1 * rng.standard_normal(700) + shock * (np.arange(700) == 300)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 70), 10)
    y = lfilter([0.0, 0.2], [1.0, -0.8], u) + lfilter([1.0], [1.0, -0.93], e) + step * (np.arange(700) >= 300)
    assert [jump.kind for jump in found(y, u[:, None])] == kinds


def test_a_step_between_missing_samples_of_slow_noise_is_told_by_those_that_are_there():
    """No sample about it had all those before it by which the noise is whitened, and so none counted."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 50), 10)
    noise = lfilter([0.03], [1.0, -1.3, 0.32], rng.standard_normal(500))
    y = lfilter([0.0, 0.2], [1.0, -0.8], u) + noise + 1.0 * (np.arange(500) >= 300)
    y[[298, 300, 302, 303]] = np.nan
    (jump,) = found(y, u[:, None])
    assert jump.kind == LEVEL and 299 <= jump.at <= 301 and jump.after == pytest.approx(1.0, abs=0.2)


def test_outliers_in_a_row_are_no_step_and_hide_none():
    """Together they look like the onset of one, more than the step does that is there."""
    rng = np.random.default_rng(6)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 60), 10)
    noise = lfilter([0.02], [1.0, -1.7, 0.73], rng.standard_normal(600))
    y = lfilter([0.0, 0.2], [1.0, -0.8], u) + noise + 0.4 * (np.arange(600) >= 300)
    y[100:103] += 3.0
    (jump,) = found(y, u[:, None])
    assert (jump.kind, jump.at) == (LEVEL, 300)


def test_a_short_record_has_short_ends_in_which_nothing_is_told():
    y, u = plant(samples=110, level=1.0, at=20)
    (jump,) = found(y, u)
    assert jump.kind == LEVEL and abs(jump.at - 20) < 3


@pytest.mark.parametrize("seed", [0, *map(slow, (1, 2, 3))])
def test_the_noise_of_a_short_record_is_told_and_dated_near_its_end(seed):
    """With 30 samples at each end it was dated before 70, by an interval that did not reach 84, or not told."""
    rng = np.random.default_rng(seed)
    u, e = rng.standard_normal(100), rng.standard_normal(100) * np.where(np.arange(100) >= 84, 0.4, 0.1)
    (jump,) = found(lfilter([0.0, 0.5], [1.0, -0.5], u) + e, u[:, None])
    assert jump.kind == NOISE and abs(jump.at - 84) < 5 and jump.interval[0] - 1 <= 84 <= jump.interval[1] + 1


@pytest.mark.parametrize("seed", [0, slow(1), slow(2)])
def test_a_sensor_that_sticks_while_the_input_rests_is_no_change(seed):
    """No other column moves meanwhile, so the table does not call it stuck; its end seemed a step of the level."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0, 2.0], 16), 50)
    u[350:450] = np.repeat([-1.0, 2.0], 50)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.05 * rng.standard_normal(800)
    y[402:440] = y[402]
    assert found(y, u[:, None]) == []


def resting(at: int, seed: int, level=0.0):
    """Return y, u of a plant whose gain doubles, and 14 samples before whose level jumps; u rests from 600 to 639."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.5, 0.0, 1.0, 1.5], 60), 20)
    u[580:660] = np.repeat([1.0, 0.0, 0.0, 1.0], 20)
    x = lfilter([0.0, 0.12], [1, -0.88], u * np.where(np.arange(1200) >= at, 2.0, 1.0))
    return 5 + x + level * (np.arange(1200) >= at - 14) + 0.15 * rng.standard_normal(1200), u[:, None]


def test_a_gain_that_changed_while_its_input_rested_is_dated_in_the_middle_of_the_rest():
    (jump,) = found(*resting(620, 1))
    assert jump.kind == GAIN and abs(jump.at - 620) < 12 and jump.interval[0] <= 612 and jump.interval[1] >= 630


@pytest.mark.parametrize("seed", [2, slow(3)])
def test_a_gain_just_after_a_level_is_told_beside_it_where_it_was(seed):
    told = {jump.kind: jump for jump in found(*resting(654, seed, level=-1.2))}
    assert {LEVEL, GAIN} == set(told)
    assert abs(told[LEVEL].at - 640) < 3 and abs(told[GAIN].at - 654) < 10


def test_places_that_are_left_early_have_no_odds():
    for seed in range(6):
        now = begin(recorded(*plant(seed, samples=300, level=0.02 * seed, at=150))[0])
        for kind in (LEVEL, GAIN):
            whole = place(now, kind, 0)
            assert place(now, kind, 0, least=whole.log_odds) == whole
            early = place(now, kind, 0, least=SURE)
            assert early == whole if whole.log_odds > SURE else early in (None, whole)


def test_a_gain_that_stands_for_a_level_just_before_as_well_is_told_as_both():
    plant = draw(0, 463)
    told = {jump.kind: jump for jump in found(record(plant, 0).y, record(plant, 0).u)}
    assert {LEVEL, GAIN} <= set(told)
    assert abs(told[LEVEL].at - plant.jumps[0].at) < 3 and abs(told[GAIN].at - plant.jumps[1].at) < 12


@pytest.mark.parametrize("number", [3, slow(17)])
def test_a_gain_that_wanders_is_not_told_to_have_jumped(number, monkeypatch):
    seen = hindsight(*wandering(0, number, "gain"))
    assert not seen.jumps()
    monkeypatch.setattr(segmentation, "is_sudden", lambda *_: True)
    assert seen.jumps()  # by their odds alone


def test_a_gain_that_jumps_is_no_line():
    """A line has most of the jump and a number less; it hides what is left."""
    data = record(draw(230005, 1147), 230005)
    told = found(data.y, data.u)
    assert [jump.kind for jump in told] == [GAIN]
    low, high = told[0].interval
    assert low <= 263 <= high and told[0].after / told[0].before == pytest.approx(2, rel=0.3)


@pytest.mark.parametrize("number", [15, slow(154), slow(236)])
def test_a_walk_beside_white_noise_is_no_step_where_even_odds_tell_one(number, monkeypatch):
    seen = hindsight(*wandering(621, number, WALK))
    assert not seen.jumps()
    monkeypatch.setitem(segmentation.AT_ONCE, LEVEL, 0.0)
    assert [jump.kind for jump in seen.jumps()] == [LEVEL]


def test_a_level_that_is_said_to_be_visible_beside_noise_alone_is_told():
    told, places = 0, (0.2, 0.5, 0.8)
    for seed in range(10):
        y, u = np.random.default_rng([992, seed]).standard_normal(800), np.zeros((800, 0))
        size = hindsight(y, u).visible().level
        told += sum(bool(found(y + size * (np.arange(800) >= 800 * at), u)) for at in places)
    assert told >= 20  # of 30; of steps as large as no walk was asked for, half
