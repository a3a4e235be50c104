"""Plots without keys: shared out at once, weighed against clutter, and the same however they come."""

import math
from itertools import pairwise

import numpy as np
import pytest
from driftwise_studies.score.motions import crowd
from driftwise_studies.score.motions.scene import KINDS
from scipy.stats import multivariate_normal

from driftwise.estimators.track.estimator import TrackEstimator
from driftwise.tracking.association import MANOEUVRES, Forecast, Pair, best_pairs
from driftwise.tracking.existence import STAYS, SURE, Existence, chance
from driftwise.tracking.live import CONFIRMED, TENTATIVE, Live, Plot
from driftwise.tracking.tracker import Tracker


def track(id, status=CONFIRMED, odds=SURE):
    made = Live(id, "", np.zeros(1), None, {})
    made.status, made.odds = status, odds
    return made


def at(time, east=0.0, north=0.0):
    return Plot(time, east, north, (math.nan,) * 4, math.nan, "", "", "")


def test_the_sum_of_all_gains_counts_and_not_the_first_plot():
    a, b, c = (track(k) for k in (1, 2, 3))
    pairs = [
        Pair(gain, plot, t, 0.0, 0.0, 0.0) for gain, plot, t in ((5.0, 0, a), (4.5, 0, b), (4.0, 1, a), (1.0, 3, c))
    ]
    made = best_pairs(pairs, 4)
    assert [pair and pair.track.id for pair in made] == [2, 1, None, 3]
    alone = best_pairs([Pair(gain, 0, t, 0.0, 0.0, 0.0) for gain, t in ((1.0, a), (3.0, b), (2.0, c))], 1)
    assert alone[0] is not None and alone[0].track.id == 2


def test_the_density_of_a_forecast_is_the_estimators():
    estimator, rng = TrackEstimator("boat"), np.random.default_rng(3)
    time = 3.0 * np.arange(20)
    state = estimator.scan(time, np.stack([4 * time, time], axis=1) + rng.standard_normal((20, 2))).state
    one = track(1)
    one.state, one.last = state.reshape(-1).view(float), at(time[-1], 228.0, 57.0)
    forecast = Forecast(estimator, one, 60.0)
    mean, covariance = estimator.predict(state, 60.0)
    missing = np.full((1, 2), np.nan)
    base = estimator.run(one.state.copy(), np.array([60.0]), missing, missing)[0, estimator.columns["base"]]
    far = (MANOEUVRES[1] * estimator.speed * 3.0) ** 2
    for off in ((0.0, 0.0), (1.5, -2.0), (9.0, 3.0), (25.0, 0.0)):
        turned = multivariate_normal([0, 0], np.diag(base) + far * np.eye(2)).pdf(off)
        straight = math.exp(estimator.density(state, 60.0, mean + off))
        plot = at(60.0, *(mean + off))
        expected = math.log(MANOEUVRES[0] * turned + (1 - MANOEUVRES[0]) * straight)
        assert forecast.log_density(plot) == pytest.approx(expected, abs=1e-9)
        assert forecast.deviations(plot) == pytest.approx(math.sqrt(np.sum(np.square(off) / np.diag(covariance))))


def test_misses_make_an_object_doubtful_and_a_pause_of_all_does_not():
    known, one = Existence(), track(1)
    one.last = at(0.0)
    known.note(at(0.0), math.inf, 0.0)
    odds = [known.odds(one, missed) for missed in (0.0, 1.0, 2.0, 5.0, 1e6)]
    assert odds[0] > 2.9 and all(a > b for a, b in pairwise(odds)) and math.isfinite(odds[-1])
    assert known.missed(one, 20.0, 4.0) == 4.0
    for missed in (0, 1, 4):  # scan by scan: it left, or was there and was not seen
        here, gone = chance(SURE), 1.0 - chance(SURE)
        for _ in range(missed):
            here, gone = here * STAYS, gone + here * (1 - STAYS)
            here *= 1 - known.detection
        here, gone = here * STAYS, gone + here * (1 - STAYS)
        assert known.odds(one, missed) == pytest.approx(math.log(here / gone), abs=1e-9)
    known.note(at(20.0), 20.0, 4.0)  # nobody was seen for 20 s
    assert known.missed(one, 20.0, 4.0) == 0.0


def test_the_detection_probability_is_learnt_of_plots_that_are_surely_of_a_track():
    rng, known, one, vague = np.random.default_rng(1), Existence(), track(1), Existence()
    for _ in range(400):
        missed = rng.geometric(0.6) - 1.0
        known.scored(one, SURE, 9.0, missed)
        vague.scored(one, SURE, 0.0, missed)  # as likely of nobody
    assert known.detection == pytest.approx(0.6, abs=0.05) and vague.detection < 0.36


def test_the_density_of_nobody_is_that_of_the_plots_and_not_of_a_tracks_own():
    known, rng = Existence(), np.random.default_rng(2)
    for time in np.arange(200.0):
        for east, north in rng.uniform(0, 1000, (3, 2)):
            known.note(at(time, east, north), 1.0, 1.0)
            known.clutter.append(at(time, east, north), track(int(1e6 * time + east), TENTATIVE, -SURE))
    found = known.density(199.0, 1.0, 10.0).at(at(199.0, 500.0, 500.0)).all
    assert found == pytest.approx(math.log(3e-6), abs=0.7)
    mine = track(7, TENTATIVE, -SURE)
    for time in np.arange(180.0, 200.0):
        known.clutter.append(at(time, 20.0, 20.0), mine)
    around = known.density(199.0, 1.0, 10.0).at(at(199.0, 20.0, 20.0))
    assert around.beside(mine) < around.all - 1.0
    known.is_somebody(mine, True)
    assert known.density(199.0, 1.0, 10.0).at(at(199.0, 20.0, 20.0)).all < around.all - 1.0 and known.born == 1


def test_plots_of_one_instant_give_the_same_tracks_however_they_come(tmp_path):
    scene = crowd.draw(0, 12)
    seen = crowd.simulate(scene).plots
    record = Tracker(KINDS[scene.name].told)
    record.feed(seen)
    stream = Tracker(KINDS[scene.name].told)
    for k in range(len(seen)):
        stream.feed(seen[k : k + 1])
        if k % 23 == 5:
            before = len(stream.tracks), len(stream.now())  # as if no other plot came: nothing changes by it
            stream.save(tmp_path / "tracker.npz")
            stream = Tracker.load(tmp_path / "tracker.npz")
            assert before == (len(stream.tracks), len(stream.now()))
    for one in (record, stream):
        one.finish()
    assert record.events == stream.events and record.counts == stream.counts
    assert [t.table.tobytes() for t in record.tracks] == [t.table.tobytes() for t in stream.tracks]


@pytest.mark.parametrize("number, rate", [(9, 9.3), (30, 0.0)])
def test_objects_among_clutter_keep_their_tracks_and_clutter_has_hardly_any(number, rate):
    scene = crowd.draw(0, number)
    assert scene.clutter_rate == pytest.approx(rate, abs=0.05)
    found = crowd.count(scene)  # of plots of nobody there are none, or 1600
    assert found.whole == found.objects == 4 and found.swaps == 0 and found.false <= (rate > 0)
