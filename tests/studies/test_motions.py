"""Drawn motions: the truth is a motion, the troubles are what they say, and the judge finds what is put there."""

import math

import numpy as np
import pytest
import scipy.stats
from draws import draws
from driftwise_studies.score.motions import crowd, draw, drawing, patches, resampled, simulate, wild_starts
from driftwise_studies.score.motions.errors import cell, scales
from driftwise_studies.score.motions.exact import Found, exact, filtered, report
from driftwise_studies.score.motions.field import Total, by_kind, by_trouble, told_by
from driftwise_studies.score.motions.jets import alone, imm
from driftwise_studies.score.motions.laws import ACROSS, ALONG, STRAIGHT, Forgetful, Law, Legs, Stranger, move
from driftwise_studies.score.motions.measured import one, onsets, play, runs, within
from driftwise_studies.score.motions.scene import ALONE, KINDS, Scene, Sensor
from driftwise_studies.score.motions.simulation import Path
from driftwise_studies.score.motions.smoothing import Smoothed, uncertainty


def scene(name="flight", troubles=(), **what):
    kind = KINDS[name]
    sensors = what.pop("sensors", (Sensor("A", 4.0, 20.0),))
    return Scene(0, (7, 0), name, kind, troubles, what.pop("plots", 200), sensors, **what)


def test_a_scene_depends_on_its_number_alone():
    a, b = simulate(draw(5, 17)), simulate(draw(5, 17))
    assert np.array_equal(a.plots.position, b.plots.position) and np.array_equal(a.truth, b.truth)
    assert not np.array_equal(a.plots.position[:30], simulate(draw(6, 17)).plots.position[:30])


def test_every_trouble_is_drawn_alone_and_with_others():
    scenes = [draw(0, k) for k in range(150)]
    assert {s.troubles for s in scenes} >= {(name,) for name in ALONE[2:]} | {()}
    assert {name for s in scenes if len(s.troubles) > 1 for name in s.troubles} == set(ALONE[1:])


@pytest.mark.parametrize("name", KINDS)
def test_velocity_is_that_of_the_positions_and_no_faster_than_the_class(name):
    kind = KINDS[name]
    made = simulate(scene(name, ("rests",), sensors=(Sensor("A", kind.scan[0], kind.deviation[0]),), plots=400))
    step = np.diff(made.truth, axis=0) / np.diff(made.plots.time)[:, None]
    middle = 0.5 * (made.velocity[1:] + made.velocity[:-1])
    most = kind.acceleration[1] * kind.scan[0]
    assert np.abs(step - middle).max() <= most + 0.02 * kind.speed[1]
    assert np.hypot(*made.velocity.T).max() <= kind.speed[1] * 1.001


def test_errors_are_as_large_as_the_sensor_says():
    made = simulate(scene(plots=500))
    assert np.std(made.plots.position - made.truth) == pytest.approx(20.0, rel=0.08)


def test_lattice_wild_and_precise_plots():
    made = simulate(scene(troubles=("lattice",), lattice=90.0))
    assert np.allclose(made.plots.position / 90 - np.round(made.plots.position / 90), 0, atol=1e-6)
    made = simulate(scene(troubles=("wild",), wild=0.05, plots=500))
    error = np.hypot(*(made.plots.position - made.truth).T)
    assert 10 <= made.wild.sum() <= 45 and error[made.wild].min() > 80 > error[~made.wild].max() * 0.8
    made = simulate(scene(troubles=("precise start",), precise=(10, 1e-3)))
    assert np.abs(made.plots.position - made.truth)[:10].max() < 0.1


def test_a_resampled_record_lies_on_lines_between_what_was_seen():
    scenes = [resampled.draw(0, k) for k in range(60)]
    assert [k for k, one in enumerate(scenes) if one is None] == [k for k in range(60) if draw(0, k).name == "animal"]
    assert all(one.troubles[-1] == "resampled" and not one.wild + one.lattice for one in scenes if one)
    y = simulate(scene(plots=300, resampled=0.5)).plots.position
    bend = np.hypot(*np.diff(y, n=2, axis=0).T) / np.hypot(*np.diff(y, axis=0)[1:].T)
    assert 0.2 < np.mean(bend < 1e-3) < 0.5  # both neighbours were drawn with it: some half squared, and a pause


def test_a_wild_start_has_its_wild_plots_among_the_first_and_nowhere_else():
    for number in range(6):
        one = wild_starts.draw(0, number)._replace(missing=0.0)
        made, usual = simulate(one), simulate(one._replace(early=0))
        assert 1 <= made.wild.sum() == one.early <= wild_starts.MOST and not made.wild[10:].any()
        assert np.array_equal(made.plots.position[~made.wild], usual.plots.position[~made.wild])
        off = np.hypot(*(made.plots.position - usual.plots.position)[made.wild].T)
        assert off.min() > 7.9 * one.sensors[0].deviation


def test_a_second_sensor_is_off_by_its_offset():
    sensors = Sensor("A", 4.0, 5.0), Sensor("B", 5.0, 5.0, 1.0, (100.0, -50.0))
    made = simulate(scene(troubles=("second sensor",), sensors=sensors, plots=400))
    off = (made.plots.position - made.truth)[made.plots.sensor == "B"].mean(axis=0)
    assert off == pytest.approx([100.0, -50.0], abs=2.0)


def test_onsets_are_true_while_a_manoeuvre_lasts_and_false_far_from_any():
    time = 4.0 * np.arange(100)
    path = Path(None, None, np.array([[100.0, 140.0], [300.0, 302.0]]), np.array([5000.0, 5000.0]))
    onset = np.zeros(100, bool)
    onset[[10, 27]] = True  # 40 s: quiet; 108 s: told after 8 s. The second one is too short to be told
    quiet, false, delays = onsets(scene(), time, onset, path, 4.0)
    assert (false, delays) == (1, (8.0,)) and 40 < quiet < 70
    assert runs(np.array([1, 1, 1, 0, 1, 1]) > 0, 2) == 2


def test_a_plain_flight_is_followed_and_tables_say_so():
    found = [one(scene(plots=150)), *play(0, [3])]
    assert found[0].pieces == (1,) and 0.5 < found[0].tracks[0].nis < 1.5
    assert found[0].tracks[0].velocity[0] > 0.85
    total = Total(found)
    assert total.whole == 1.0 and total.lost == 0.0
    assert by_trouble(found).count("\n") >= 4 and "flight" in by_kind(found)


def test_three_filters_of_one_line_forecast_the_line_through_all_plots():
    """Where no model moves, what interacts is least squares, whatever the probabilities of a change."""
    t = np.cumsum(np.random.default_rng(1).uniform(1.0, 5.0, 40))
    plots = np.stack([100.0 * t, 30.0 - 50.0 * t], axis=1) + 20.0 * np.random.default_rng(2).standard_normal((40, 2))
    said = imm(t, plots, 20.0, 1e6, grid=((1e-9, 1e-9, 1e-9, 5.0, 0.9), (1e-9, 1e-9, 1e-9, 5.0, 0.5)))
    line = [np.polyval(np.polyfit(t[:30], x[:30], 1), t[30]) for x in plots.T]
    np.testing.assert_allclose(said[30], [line, line], atol=1e-4)


def test_three_filters_tuned_for_a_turn_follow_it_better_than_one_of_constant_velocity():
    seen = simulate(alone(scene("jet", plots=300)))
    straight = (0.3,) * 3 + (4.0, 0.97)
    said = imm(seen.plots.time, seen.plots.position, 20.0, 250.0, grid=(straight, (0.3, 15.0, 25.0, 4.0, 0.97)))
    error = np.sqrt(np.mean((said[10:] - seen.truth[10:, None]) ** 2, axis=(0, 2)))
    assert error[1] < 0.7 * error[0]


def test_a_command_line_says_seed_scenes_and_switches():
    assert drawing.asked("About.", [], scenes=40) == (0, 40)
    assert drawing.asked("About.", ["--seed", "3", "--patchy"], patchy="dense") == (3, 150, True)
    assert drawing.asked("About.", [], patchy="dense", far="away") == (0, 150, False, False)


def test_a_crowd_has_the_births_the_detections_and_the_clutter_that_it_says():
    made = crowd.Crowd((3, 0), "boat", 300, 3.0, 2.0, 1e5, 0.1, 0.02, 0.8, 2.0)
    seen = crowd.simulate(made)
    assert np.sum(seen.object == crowd.NOBODY) == pytest.approx(600, abs=75)
    lives = [seen.plots.time[seen.object == k] for k in range(seen.object.max() + 1)]
    spans = np.array([np.ptp(t) / 3.0 + 1 for t in lives if len(t) > 5])
    counts = np.array([len(t) for t in lives if len(t) > 5])
    assert len(lives) > 20 and counts.sum() / spans.sum() == pytest.approx(0.8, abs=0.06)
    error = (seen.plots.position - seen.truth)[seen.object >= 0]
    assert np.std(error) == pytest.approx(2.0, rel=0.1) and np.all(np.diff(seen.plots.time) >= 0)


def test_false_tracks_breaks_and_swaps_are_counted():
    nobody, a, b = [-1] * 8, [0] * 9, [1] * 8
    tracks = [np.array(t) for t in (a[:6], a[6:] + b[:2], b[2:], nobody[:3] + b[:1])]
    assert crowd.tally(np.array(nobody + a + b), tracks) == (2, 1, 17, 15, 4, 1, 1, 1)


def test_patches_return_what_they_say():
    rng = np.random.default_rng(4)
    thing, strip = (
        patches.Patch((5.0, 5.0), (5.0, 5.0), 2.0, 0.3, True),
        patches.Patch((0.0, 0.0), (90.0, 0.0), 1.0, 2.5),
    )
    scans, places = patches.returns(rng, thing, 2000)
    assert len(np.unique(scans)) == len(scans) == pytest.approx(600, abs=70)
    assert places.mean() == pytest.approx(5.0, abs=0.3) and places.std() == pytest.approx(2.0, abs=0.2)
    scans, places = patches.returns(rng, strip, 2000)
    assert len(scans) == pytest.approx(5000, abs=250) and places[:, 1].std() == pytest.approx(1.0, abs=0.1)
    assert places[:, 0].std() == pytest.approx(90 / math.sqrt(12), rel=0.05)


@pytest.mark.parametrize("mode", [STRAIGHT, ALONG, ACROSS])
@pytest.mark.parametrize(("knows", "d"), [(Law, 2.5), (Forgetful, 2.5), (Stranger, 10.0)])
def test_legs_end_within_a_time_as_often_as_the_law_says(knows, d, mode):
    n, rng, law = 20_000, np.random.default_rng(3), knows(KINDS["glider"], 4.0)
    sign = np.where(np.arange(n) % 2, 1.0, -1.0)
    legs = Legs(
        np.full(n, mode), np.full(n, 40.0 if mode == STRAIGHT else 0.7), sign, np.ones(n, int), np.zeros(n, bool)
    )
    x = np.tile([0.0, 20.0, 0.0, 15.0, math.log(3.0)], (n, 1))
    share = law.share_ending(legs, x, d)
    ended = law.remaining(legs, x, rng.random(n)) < d
    assert 0.02 < share.mean() < 0.98
    assert [ended[sign > 0].mean(), ended[sign < 0].mean()] == pytest.approx([share[1], share[0]], abs=0.015)


def test_a_turn_is_a_circle_and_hurry_is_along_the_way():
    legs = Legs(np.array([ACROSS, ALONG]), np.zeros(2), np.array([1.0, -1.0]), np.ones(2, int), np.zeros(2, bool))
    at = move(
        legs,
        np.array([[0.0, 0.0, 0.0, 20.0, math.log(2.0)], [0.0, 16.0, 0.0, 12.0, math.log(2.0)]]),
        np.array([5.0, 5.0]),
    )
    turned = 2.0 / 20.0 * 5.0
    assert at[0, :4] == pytest.approx(
        [200 * (1 - math.cos(turned)), 20 * math.sin(turned), 200 * math.sin(turned), 20 * math.cos(turned)]
    )
    assert at[1, :4] == pytest.approx([60.0, 8.0, 45.0, 6.0])  # 75 m, from 20 to 10 m/s


def test_who_knows_the_laws_of_a_motion_knows_where_plots_lie():
    scores = []
    for k in (1, 2, 4):  # a flight and two drones
        drawn = alone(draw(0, k))
        seen = simulate(drawn).plots
        said = exact(drawn, seen.time, seen.position, 300)
        scores.append(np.mean(said.normal_score[3:] ** 2))
    assert np.mean(scores) == pytest.approx(1.0, abs=0.12)
    tracks = [
        Found(draw(0, 1), 40, (1.0, 1.0, 0.4, 1.0, 2.0, 1.0)),
        Found(draw(0, 4), 60, (9.0, 3.0, 1.0, 1.0, 0.7, 1.0)),
    ]
    words = report(tracks)
    assert words.splitlines()[2] == (
        "| all | 2 | 1 | 0.500 | 0.500 | 5.00 | 0.500 | 0.500 | 0.500 | 1.000 | 0.500 | 0.000 | 1.000 |"
    )


def test_who_knows_the_laws_of_a_motion_sees_manoeuvres_while_they_last():
    """Its probability is calibrated: where it says one in five or four in five, so many plots are in one."""
    believed, lasts = [], []
    for k in (1, 2, 4, 5, 7):
        drawn = alone(draw(0, k))
        seen = simulate(drawn)
        believed.append(exact(drawn, seen.plots.time, seen.plots.position, 300).moving[3:])
        lasts.append(within(seen.plots.time, seen.paths[0].manoeuvres)[3:])
    p, truth = np.concatenate(believed), np.concatenate(lasts)
    assert np.mean(p) == pytest.approx(np.mean(truth), abs=0.08)
    assert np.mean(truth[p < 0.2]) < 0.2 < 0.8 < np.mean(truth[p > 0.8])


def test_who_knows_less_of_motions_foresees_less():
    scores = []
    for k in (1, 2, 4):
        drawn = alone(draw(0, k))
        seen = simulate(drawn).plots
        said = [exact(drawn, seen.time, seen.position, 300, None, one) for one in (Law, Forgetful, Stranger)]
        scores.append([np.mean(s.log_score[3:]) for s in said])
    knows, forgets, strange = np.mean(scores, axis=0)
    assert knows > forgets - 0.02 and forgets > strange + 0.02


@draws("seeds", range(2), range(4))
def test_who_knows_how_plots_err_knows_where_they_lie(seeds):
    """Rests, wild plots, heavy tails, a lattice and a second sensor, all at once: forecasts are calibrated."""
    troubles, sensors = (
        ("rests", "wild", "heavy"),
        (Sensor("A", 4.0, 20.0), Sensor("B", 5.3137, 30.0, 1.07, (25.0, 9.0), 0.4)),
    )
    scores = []
    for seed in seeds:
        drawn = scene(
            "helicopter", troubles, plots=60, sensors=sensors, wild=0.05, heavy=True, lattice=30.0, precise=(10, 0.1)
        )._replace(seed=(seed, 3))
        scores.append(filtered(drawn, simulate(drawn, stated=True), 0, 60_000).means[1])
    assert np.mean(scores) == pytest.approx(1.0, abs=0.15)


def test_a_plot_on_a_lattice_is_a_piece_of_a_normal():
    e, s = np.array([0.0, 3.0, -40.0]), np.array([1.0, 2.0, 9.0])
    p, mean, variance, below, above = cell(e, s, 3.0, 0.25)
    for k in range(3):
        a, b = (e[k] - 1.5) / s[k], (e[k] + 1.5) / s[k]
        piece = scipy.stats.truncnorm(a, b, scale=s[k])
        assert p[k] == pytest.approx(np.diff(scipy.stats.norm.cdf([a, b]))[0], rel=1e-9)
        assert mean[k] == pytest.approx(piece.mean(), rel=1e-6, abs=1e-12)
        assert variance[k] == pytest.approx(piece.var(), rel=1e-5)
        assert below[k] == pytest.approx(scipy.stats.norm.cdf(a) + 0.25 * p[k], rel=1e-9)
    assert np.allclose(below + above, 1.0)
    share, variances = scales(True)
    assert share.sum() == pytest.approx(1.0) and np.all(np.diff(variances) < 0)


def test_how_soon_is_of_all_manoeuvres_told_or_not():
    delays = np.array([np.inf, 2.0, 9.0, 5.0, np.inf, 6.0, 7.0, np.inf, 30.0, 4.0])
    assert told_by(delays) == ["0.40", "2.0", "5.0", "7.0", "30.0"]
    found = play(29, range(4))
    track = found[0].tracks[0]._replace(scan=2.0, delays=tuple(delays))
    far = track._replace(scan=5.0, delays=(1.0,))
    total = Total([found[0]._replace(tracks=(track, far))])
    assert total.soon == pytest.approx(0.4) and len(total.seconds) == 10


def test_how_sure_a_share_of_bands_is_goes_by_how_much_tracks_differ():
    def track(inside, size=200):
        return Smoothed("flight", 1.0, 1.0, (inside, size), (0, 1), (0, 1), 0, 0, 0, size)

    assert uncertainty([track(190)] * 20) == 0.0
    rng = np.random.default_rng(3)
    drawn = [[track(int(200 * share)) for share in rng.uniform(0.9, 1.0, 25)] for _ in range(400)]
    spread = np.std([np.mean([t.held[0] / 200 for t in some]) for some in drawn])
    assert np.mean([uncertainty(some) for some in drawn]) == pytest.approx(spread, rel=0.1)
