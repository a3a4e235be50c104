"""Print the table of docs/stonesoup.md on association: nearest neighbours, JPDA, the Tracker on two boats in clutter.

The recordings of `autoferry.py`, and its association by nearest neighbours. JPDA is Stone Soup's, with the same
constant-velocity filter, gate and starts (P_D = 0.9, the clutter's density as counted), confirmed by 5 updates: a track
score is one of single plots. The `Tracker` of driftwise is given plots without keys.

False: confirmed tracks that are beside a boat (25 m) in less than half of their scans. Breaks: how often the track next
to a boat is another one. Swaps: how often the boat next to a track is another one.

Run: python scripts/association.py [SCENARIO ..]
"""

import sys
from itertools import pairwise

import autoferry
import numpy as np
from stonesoup.dataassociator.probability import JPDA
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.tracker.simple import MultiTargetMixtureTracker
from stonesoup.types.update import Update
from stonesoup.updater.kalman import KalmanUpdater

import driftwise as dw
from driftwise.adapters.stonesoup import timestamp
from driftwise.tracking.plots import plots

DETECTED, GATED = 0.9, 0.998  # probabilities: of a plot, and of one in a gate of 3.5 deviations


def jpda(scans) -> list[dict]:
    """Return the paths of confirmed tracks: positions by timestamp."""
    every_plot = np.concatenate([scan.plots for scan in scans])
    area = float(np.prod(np.ptp(every_plot, axis=0)))
    density = max(np.mean([len(scan.plots) for scan in scans]) - DETECTED * len(scans[0].boats), 0.1) / area
    predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([ConstantVelocity(autoferry.Q)] * 2))
    updater = KalmanUpdater(autoferry.NOISE)
    hypothesiser = PDAHypothesiser(predictor, updater, density, prob_detect=DETECTED, prob_gate=GATED)
    tracker = MultiTargetMixtureTracker(
        autoferry.TwoPoint(fastest=16.0), UpdateTimeStepsDeleter(autoferry.MISSES), autoferry.detections(scans),
        JPDA(hypothesiser), updater,
    )  # fmt: skip
    every = set()
    for _, tracks in tracker:
        every |= tracks
    return [path(t) for t in every if sum(isinstance(s, Update) for s in t[1:]) >= autoferry.UPDATES]


def path(track) -> dict:
    """Return the positions of a track of Stone Soup by timestamp."""
    return {s.timestamp: np.ravel(s.state_vector)[[0, 2]].astype(float) for s in track[1:]}


def nearest(scans, estimator, scored) -> list[dict]:
    """Return the paths that global nearest neighbours find."""
    return [path(track) for track in autoferry.follow(scans, estimator, scored).tracks]


def own(scans) -> list[dict]:
    """Return the paths of the `Tracker`; between plots a track is where it is expected."""
    time = np.repeat([scan.time for scan in scans], [len(scan.plots) for scan in scans])
    found = dw.track(plots(time, np.concatenate([scan.plots for scan in scans])), "boat")
    stamps = [scan.time for scan in scans]
    made = []
    for track in found:
        inside = [t for t in stamps if track.plots.time[1] <= t <= track.plots.time[-1]]
        columns = [np.interp(inside, track.plots.time, x) for x in track.trace.position.T]
        made.append({timestamp(t): np.array(xy) for t, xy in zip(inside, zip(*columns))})
    return made


def score(scans, paths) -> np.ndarray:
    """Return (scans of boats with a track, of how many, false tracks, breaks, swaps)."""
    near: list[dict] = [{} for _ in paths]  # of each track the boat beside it, by scan
    covered = breaks = 0
    for boat in scans[0].boats:
        last = None
        for scan in scans:
            now = timestamp(scan.time)
            off = [(np.hypot(*(p[now] - scan.boats[boat])), k) for k, p in enumerate(paths) if now in p]
            for distance, k in off:
                if distance < min(autoferry.NEAR, near[k].get(now, (np.inf, None))[0]):
                    near[k][now] = distance, boat
            error, which = min(off, default=(np.inf, None))
            if error < autoferry.NEAR:
                covered += 1
                breaks += last not in (None, which)
                last = which
    false = sum(2 * len(beside) < len(p) for beside, p in zip(near, paths))
    boats = [[beside[now][1] for now in sorted(beside)] for beside in near]
    swaps = sum(a != b for one in boats for a, b in pairwise(one))
    return np.array([covered, len(scans) * len(scans[0].boats), false, breaks, swaps, len(paths)])


def main():
    scenarios = [int(n) for n in sys.argv[1:]] or autoferry.SCENARIOS
    records = [autoferry.read(n) for n in scenarios]
    if None in records:
        raise SystemExit("the recordings are not there; set DRIFTWISE_DATA to the folder of recordings")
    boat = dw.TrackEstimator("boat")
    rows = {
        "constant velocity, nearest neighbours, 5 updates": lambda scans: nearest(scans, None, False),
        "constant velocity, JPDA, 5 updates": jpda,
        "constant velocity, nearest neighbours, track score": lambda scans: nearest(scans, None, True),
        "TrackEstimator, nearest neighbours, track score": lambda scans: nearest(scans, boat, True),
        "Tracker, plots without keys": own,
    }
    print("| association | coverage | confirmed tracks | of them false | breaks | swaps |\n|---|---|---|---|---|---|")
    for name, follow in rows.items():
        total = sum(score(scans, follow(scans)) for scans in records)
        covered, of, false, breaks, swaps, tracks = total.tolist()
        print(f"| {name} | {covered / of:.3f} | {tracks} | {false} | {breaks} | {swaps} |", flush=True)


if __name__ == "__main__":
    main()
