"""Print the table of docs/stonesoup.md: two boats among clutter, followed with Stone Soup, with and without driftwise.

The five radar recordings of the Autoferry set (Helgesen et al., Ocean Engineering 252 (2022) 111168) below
``DRIFTWISE_DATA``, all plots. Association is the same for all: global nearest neighbours, a gate of 3.5 standard
deviations, two-point starts within 16 m/s. All are told r = 2 m^2; the constant-velocity filter has q = 0.05 m^2/s^3.

Coverage: share of scans in which a confirmed track is within 25 m of a boat, per boat. A track exists from its second
plot on, and all of it counts once it is confirmed. Switches: how often the track next to a boat is another one.

Run: python scripts/autoferry.py
"""

import json
import os
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.tracker.simple import MultiTargetTracker
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.update import GaussianStateUpdate, Update
from stonesoup.updater.kalman import KalmanUpdater

import driftwise as dw
from driftwise.adapters.stonesoup import TrackInitiator, TrackPredictor, TrackUpdater, position, timestamp
from driftwise.adapters.track_score import TrackScore

SCENARIOS = (2, 4, 5, 13, 16)
GATE, NEAR, UPDATES, MISSES = 3.5, 25.0, 5, 2
Q, NOISE = 0.05, LinearGaussian(4, (0, 2), 2.0 * np.eye(2))  # m^2/s^3; m^2


class Scan(NamedTuple):
    """One turn of the antenna: when (s), its plots (n, 2) and where the boats are, m East and North."""

    time: float
    plots: np.ndarray
    boats: dict


def read(scenario):
    """Return the scans of a scenario, None where the recording is not there."""
    folder = Path(os.environ.get("DRIFTWISE_DATA", "data")) / "tracking" / "autoferry"
    if not folder.is_dir():
        return None
    found, truth = (
        json.loads((folder / f"scenario{scenario}_{kind}.json").read_text()) for kind in ("detections", "groundTruth")
    )
    scans = []
    for one, boats in zip(found, truth):
        if one["sensorID"] == 2:  # radar, relative to own ship, North first
            plots = np.array(one["measurement"], float).reshape(2, -1).T + one["ownshipPosition"]
            boats = {boat["targetID"]: np.array(boat["position"][1::-1]) for boat in boats}
            scans.append(Scan(one["time"], plots[:, ::-1], boats))
    return scans


class TwoPoint(TrackInitiator):
    """Tracks of a constant-velocity filter start from the same pairs of plots."""

    def begin(self, first, second):
        a, b, r = position(first), position(second), NOISE.covar()[0, 0]
        T = (second.timestamp - first.timestamp).total_seconds()
        v, P = (b - a) / T, np.kron(np.eye(2), r * np.array([[1, 1 / T], [1 / T, 2 / T**2]]))
        return [
            GaussianStateUpdate(np.ravel([z, v], order="F"), P, SingleHypothesis(None, one), one.timestamp)
            for z, one in ((a, first), (b, second))
        ]


class Run(NamedTuple):
    """The confirmed tracks of a scenario, and ms a scan."""

    tracks: list
    ms: float


def follow(scans, estimator=None, scored=False, noise=NOISE) -> Run:
    """Follow the boats of a scenario with an estimator, or with the constant-velocity filter if there is none.

    Confirmation is by track score, or else 5 updates after the start; tracks end by score, or else by 2 misses.
    """
    if estimator is None:
        predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([ConstantVelocity(Q)] * 2))
        updater, initiator = KalmanUpdater(noise), TwoPoint(fastest=16.0)
    else:
        predictor, updater = TrackPredictor(estimator=estimator), TrackUpdater(noise, estimator)
        initiator = TrackInitiator(estimator, measurement_model=noise)
    associator = GNNWith2DAssignment(DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=GATE))
    deleter = associator = TrackScore(associator) if scored else associator
    if not scored:
        deleter = UpdateTimeStepsDeleter(MISSES)
    tracker = MultiTargetTracker(initiator, deleter, detections(scans), associator, updater)
    start, every = time.perf_counter(), set()
    for _, tracks in tracker:
        every |= tracks
    ms = 1e3 * (time.perf_counter() - start) / len(scans)
    if scored:
        return Run([track for track in every if track.id in associator.confirmed], ms)
    return Run([t for t in every if sum(isinstance(state, Update) for state in t[1:]) >= UPDATES], ms)


def detections(scans):
    """Yield the detections of each scan, those without a plot as well."""
    for scan in scans:
        now = timestamp(scan.time)
        yield now, {Detection(z[:, None], timestamp=now) for z in scan.plots}


class Score(NamedTuple):
    """How well the boats of a scenario were followed."""

    coverage: float
    errors: list  # m
    switches: int
    tracks: int


def score(scans, tracks) -> Score:
    """Compare confirmed tracks with where the boats were."""
    paths = [{state.timestamp: np.ravel(state.state_vector)[[0, 2]].astype(float) for state in t[1:]} for t in tracks]
    errors, switches = [], 0
    for boat in scans[0].boats:
        last = None
        for scan in scans:
            now = timestamp(scan.time)
            off = [(np.hypot(*(path[now] - scan.boats[boat])), k) for k, path in enumerate(paths) if now in path]
            error, nearest = min(off, default=(np.inf, None))
            if error < NEAR:
                errors.append(error)
                switches += last not in (None, nearest)
                last = nearest
    return Score(len(errors) / len(scans) / len(scans[0].boats), errors, switches, len(tracks))


def filters():
    """Return the filters of the table: name, estimator, whether scored, noise told."""
    boat = dw.TrackEstimator("boat")
    return (
        ("constant velocity, 5 updates", None, False, NOISE),
        ("constant velocity, track score", None, True, NOISE),
        ("TrackEstimator, 5 updates", boat, False, NOISE),
        ("TrackEstimator, track score", boat, True, NOISE),
        ("TrackEstimator, track score, noise not told", boat, True, None),
    )


def main():
    records = {n: read(n) for n in SCENARIOS}
    if None in records.values():
        raise SystemExit("the recordings are not there; set DRIFTWISE_DATA to the folder of recordings")
    print(f"| filter, confirmed by | coverage {' '.join(map(str, SCENARIOS))} | mean | error, m | switches ", end="")
    print("| confirmed tracks | ms a scan |\n|---|---|---|---|---|---|---|")
    for name, estimator, scored, noise in filters():
        runs = [follow(scans, estimator, scored, noise) for scans in records.values()]
        scores = [score(scans, run.tracks) for scans, run in zip(records.values(), runs)]
        coverage, error = [s.coverage for s in scores], np.mean(np.concatenate([s.errors for s in scores]))
        counts = " ".join(str(s.tracks) for s in scores)
        print(
            f"| {name} | {' '.join(f'{c:.3f}' for c in coverage)} | {np.mean(coverage):.3f} | {error:.2f} "
            f"| {' '.join(str(s.switches) for s in scores)} = {sum(s.switches for s in scores)} "
            f"| {counts} = {sum(s.tracks for s in scores)} | {np.median([run.ms for run in runs]):.1f} |"
        )


if __name__ == "__main__":
    main()
