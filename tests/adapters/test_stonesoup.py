"""TrackEstimator inside Stone Soup: the same numbers, gates, track scores, and boats among real clutter."""

import importlib.util
import pickle
from pathlib import Path

import numpy as np
import pytest
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.measures import Mahalanobis
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.tracker.simple import MultiTargetTracker
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.multihypothesis import MultipleHypothesis
from stonesoup.types.state import GaussianState
from stonesoup.types.track import Track
from stonesoup.updater.kalman import KalmanUpdater

import driftwise as dw
from driftwise.adapters.stonesoup import TrackInitiator, TrackPredictor, TrackUpdater, seconds, timestamp, widest
from driftwise.adapters.stonesoup_io import detections, tracks_from
from driftwise.adapters.track_score import TrackScore
from driftwise.engine.errors import InputError
from driftwise.tracking.plots import plots

path = Path(__file__).parents[2] / "scripts" / "autoferry.py"
spec = importlib.util.spec_from_file_location("autoferry", path)
assert spec and spec.loader
autoferry = importlib.util.module_from_spec(spec)
spec.loader.exec_module(autoferry)

BOAT = dw.TrackEstimator("boat")
R = np.array([[2.0, 0.3], [0.3, 1.0]])


def associator(gate=5.0):
    return GNNWith2DAssignment(
        DistanceHypothesiser(TrackPredictor(estimator=BOAT), TrackUpdater(estimator=BOAT), Mahalanobis(), gate)
    )


def tracked(feed, score):
    """Return all tracks that ever were."""
    tracker = MultiTargetTracker(TrackInitiator(BOAT), score, feed, score, TrackUpdater(estimator=BOAT))
    return set().union(*(set(tracks) for _, tracks in tracker))


@pytest.fixture(scope="module")
def clean():
    """One boat that turns, plots with and without a stated noise, two scans missed."""
    rng, t = np.random.default_rng(3), np.delete(np.arange(60) * 1.75, [20, 21])  # fractions that a timestamp keeps
    z = np.stack([3 * t, 40 * np.sin(t / 20)], axis=1) + rng.standard_normal((len(t), 2))
    covariance = np.where(np.arange(len(t))[:, None, None] % 3 > 0, R, np.nan)
    return plots(t, z, covariance=covariance, key="257012340", altitude=2.0)


def test_a_track_has_the_numbers_of_the_estimator_bit_for_bit(clean):
    (track,) = tracked(detections(clean), TrackScore(associator()))
    trace = BOAT.scan(clean.time, clean.position, clean.covariance)
    assert len(track) == len(clean)  # a scan without any plot is no scan here
    assert np.array_equal([state.step.prediction for state in track[1:]], trace.prediction[1:])
    assert np.array_equal([state.step.position for state in track], trace.position)
    assert np.array_equal([np.ravel(state.state_vector)[[1, 3]] for state in track], trace.velocity)
    assert np.array_equal([np.sqrt(state.covar[0, 0]) for state in track], trace.position_sd[:, 0])
    assert track.state.row.tobytes() == trace.state.tobytes()

    (ours,) = tracks_from([track], BOAT, origin=(63.4, 10.4))
    assert np.array_equal(ours.trace.innovation, trace.innovation, equal_nan=True)
    assert ours.key == "257012340" and ours.origin == (63.4, 10.4) and (ours.altitude == 2).all()


def test_a_missed_detection_changes_nothing_but_time(clean):
    fed = clean[:12]
    (track,) = tracked(detections(fed), TrackScore(associator()))
    predict = TrackPredictor(estimator=BOAT).predict
    at = [timestamp(fed.time[-1] + d) for d in (1.75, 3.5)]
    missed, later = predict(track, at[0]), predict(track, at[1])
    track.append(missed)
    again = predict(track, at[1])
    assert np.array_equal(again.state_vector, later.state_vector) and np.array_equal(again.covar, later.covar)
    mean, covariance = BOAT.predict(track.state.row, seconds(at[1]))
    forecast = TrackUpdater(estimator=BOAT).predict_measurement(again)
    assert np.array_equal(np.ravel(forecast.state_vector), mean) and np.array_equal(forecast.covar, covariance)
    copy = pickle.loads(pickle.dumps(again))
    assert np.array_equal(copy.step.prediction, again.step.prediction) and copy.row.tobytes() == again.row.tobytes()


def test_gates_of_known_noise_are_no_wider_than_a_line_through_two_plots():
    model, ahead = autoferry.NOISE, 2.5
    one, two = (Detection(np.array(z), timestamp=timestamp(t)) for t, z in ((0.0, [0.0, 0.0]), (1.5, [4.0, 3.0])))
    start = autoferry.TwoPoint(fastest=16.0).begin(one, two)[-1]
    still = KalmanPredictor(CombinedLinearGaussianTransitionModel([ConstantVelocity(0.0)] * 2))
    line = KalmanUpdater(model).predict_measurement(still.predict(start, timestamp=timestamp(1.5 + ahead))).covar
    assert np.allclose(widest(model.covar(), 1.5 + ahead, (0.0, 1.5), speed=0.0), line, rtol=1e-12)

    start = TrackInitiator(BOAT, measurement_model=model).begin(one, two)
    for state, latest in ((start[0], 1.5), (start[1], 1.5 + ahead)):
        prediction = TrackPredictor(estimator=BOAT).predict(state, timestamp(latest))
        S, free = (TrackUpdater(told, BOAT).predict_measurement(prediction).covar for told in (model, None))
        if len(state.times) == 2 and np.isfinite(state.times).all():
            edge = (BOAT.speed * ahead / 2 / 3.5) ** 2  # variance whose gate is half the class's speed wide
            assert np.trace(S) <= np.trace(line) + 2 * edge + 1e-9 < np.trace(free)
        else:
            assert np.array_equal(S, free)  # a track of one plot goes as far as its class


def crowd(rng, scans, boats, clutter=4, side=1000.0, P_D=0.9):
    """Yield scans of boats that sail East, some missed, among clutter that is uniform over a square."""
    for k in range(scans):
        now = timestamp(1.75 * k)
        z = [rng.uniform(0, side, (rng.poisson(clutter), 2))]
        z += [[[100 + 3 * 1.75 * k, y] + rng.standard_normal(2)] for y in boats if rng.random() < P_D]
        yield now, {Detection(np.reshape(p, (2, 1)), timestamp=now) for p in np.concatenate(z)}


def test_scores_confirm_boats_and_not_clutter():
    rng = np.random.default_rng(5)
    score = TrackScore(associator(3.5))
    found = tracked(crowd(rng, 80, boats=(300.0, 700.0)), score)
    sure = {track.id: np.array([np.ravel(state.state_vector)[2] for state in track]) for track in found}
    sure = [north for id, north in sure.items() if id in score.confirmed]
    assert len(found) > len(sure)  # clutter starts tracks as well
    for y in (300.0, 700.0):
        assert sum(len(north) for north in sure if np.all(np.abs(north - y) < 6)) >= 70
    assert sum(map(len, sure)) <= 2 * 80  # no more than the boats
    assert 0.8 < score.detection_probability < 0.95
    empty = TrackScore(associator(3.5))
    assert len(tracked(crowd(rng, 80, boats=()), empty)) > 0
    assert not empty.confirmed


class Told:
    """An associator that says what it was told."""

    def __init__(self):
        self.says = {}

    def associate(self, tracks, detections, timestamp, **kwargs):
        return self.says


def test_the_score_is_the_log_likelihood_ratio():
    told = Told()
    score = TrackScore(told, false=0.01, missed=0.1, area=1e4)
    z = Detection(np.array([[1.0], [0.0]]), timestamp=timestamp(0.0))
    start = GaussianState(np.zeros((4, 1)), np.eye(4), timestamp=timestamp(0.0))
    track, forecast = Track([start]), GaussianState(np.zeros((2, 1)), 4 * np.eye(2))
    seen, missed = SingleHypothesis(start, z, forecast), SingleHypothesis(start, None)

    told.says = {track: seen}
    score.associate({track}, {z}, timestamp(0.0))
    gain = np.log(0.9 * np.exp(-0.125) / (8 * np.pi) * 1e4)  # nothing seen before: one false plot in the area
    assert np.isclose(score.score[track.id], gain, rtol=1e-12) and track.id in score.confirmed  # > log 90
    told.says = {track: missed}
    score.associate({track}, set(), timestamp(1.0))
    assert np.isclose(score.detection_probability, 9 / 11)  # one chance, missed
    assert np.isclose(score.score[track.id], gain + np.log(2 / 11), rtol=1e-12)
    assert len(score.delete_tracks({track})) == 0  # fallen by 1.7 of log 9.9 = 2.3
    score.associate({track}, set(), timestamp(2.0))
    assert len(score.delete_tracks({track})) == 1
    assert not score.score


def test_what_does_not_fit_is_refused_with_the_likely_cause():
    initiator, now = TrackInitiator(BOAT), timestamp(0.0)
    with pytest.raises(InputError, match=r"East, North.*got 3 numbers"):
        initiator.initiate({Detection(np.zeros((3, 1)), timestamp=now)}, now)
    foreign = GaussianState(np.zeros((4, 1)), np.eye(4), timestamp=now)
    with pytest.raises(InputError, match=r"got GaussianState.*TrackInitiator"):
        TrackPredictor(estimator=BOAT).predict(foreign, timestamp(1.0))
    with pytest.raises(InputError, match="nearest neighbours"):
        TrackUpdater(estimator=BOAT).update(MultipleHypothesis([]))
    with pytest.raises(InputError, match="false must be a probability"):
        TrackScore(associator(), false=0.0)


def test_tracks_of_another_filter_are_followed_anew(clean):
    score = autoferry.follow([autoferry.Scan(p, z[None], {}) for p, z in zip(clean.time, clean.position)])
    (track,) = score.tracks
    assert type(track[-1]).__name__ == "GaussianStateUpdate"
    (ours,) = tracks_from([track], BOAT)
    trace = BOAT.scan(clean.time, clean.position)
    assert np.array_equal(ours.trace.position, trace.position)


def test_boats_among_real_clutter():
    """Coverage of the truth as with the constant-velocity filter that has the same association, fewer false tracks."""
    records = [autoferry.read(n) for n in autoferry.SCENARIOS]
    if None in records:
        pytest.skip("the Autoferry recordings are not there; set DRIFTWISE_DATA to the folder of recordings")
    known, ours = (
        [autoferry.score(scans, autoferry.follow(scans, *how).tracks) for scans in records]
        for how in ((None, False), (BOAT, True))
    )
    total = [sum(s.tracks for s in scores) for scores in (known, ours)]
    assert total[0] == 25 and sum(s.switches for s in known) == 6  # what it is measured against has not moved
    assert all(a.coverage >= b.coverage for a, b in zip(ours, known))
    assert np.mean([s.coverage for s in ours]) >= 0.90
    assert total[1] <= total[0] and sum(s.switches for s in ours) <= 7
