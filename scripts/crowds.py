"""Print the table of docs/motions.md on association: nearest neighbours, JPDA and the Tracker in drawn crowds.

Stone Soup's associations stand beside a constant-velocity filter that is told what nobody knows: the errors of plots,
the detection probability, the density of clutter, and the white acceleration that was best of `Q` over all crowds.
Tracks start from two plots within reach of the class; they are confirmed by 5 updates and end after `MISSES` scans
without a plot, or both by track score (the adapter's). The `Tracker` is told the class. A plot of JPDA is of the track
in which it weighs most.

Run: python scripts/crowds.py [--seed 0] [--scenes 20]
"""

import argparse

import autoferry
import numpy as np
from driftwise_studies.score.motions import crowd
from driftwise_studies.score.motions.scene import KINDS
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import JPDA
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.tracker.simple import MultiTargetMixtureTracker, MultiTargetTracker
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.update import GaussianStateUpdate, Update
from stonesoup.updater.kalman import KalmanUpdater

from driftwise.adapters.stonesoup import TrackInitiator, position
from driftwise.adapters.track_score import TrackScore

Q = (0.01, 0.1, 0.5)  # change of velocity in a scan, of what is fast for the class
MISSES, UPDATES, GATE, GATED = 5, 5, 3.5, 0.998


class TwoPoint(TrackInitiator):
    """Tracks of a constant-velocity filter start from pairs of plots of consecutive scans."""

    def begin(self, first, second):
        """Return the two states of a new track."""
        a, b, r = position(first), position(second), self.measurement_model.covar()[0, 0]
        T = (second.timestamp - first.timestamp).total_seconds()
        v, P = (b - a) / T, np.kron(np.eye(2), r * np.array([[1, 1 / T], [1 / T, 2 / T**2]]))
        return [
            GaussianStateUpdate(np.ravel([z, v], order="F"), P, SingleHypothesis(None, one), one.timestamp)
            for z, one in ((a, first), (b, second))
        ]


def follow(scene: crowd.Crowd, seen: crowd.Gathered, how: str, share: float) -> crowd.Counted:
    """Return the counts of an association with a constant-velocity filter."""
    kind, noise = KINDS[scene.name], LinearGaussian(4, (0, 2), scene.deviation**2 * np.eye(2))
    q = (share * kind.told) ** 2 / scene.scan
    predictor = KalmanPredictor(CombinedLinearGaussianTransitionModel([ConstantVelocity(q)] * 2))
    updater, reach = KalmanUpdater(noise), kind.told + 6 * scene.deviation / scene.scan
    initiator = TwoPoint(fastest=reach, measurement_model=noise)
    clock = scene.scan * np.arange(scene.scans)
    scans = [autoferry.Scan(float(t), seen.plots.position[seen.plots.time == t], {}) for t in clock]
    deleter = UpdateTimeStepsDeleter(MISSES)
    if how == "JPDA":
        density = max(scene.clutter_rate, 0.01) / scene.side**2
        chances = dict(prob_detect=scene.detection_probability, prob_gate=GATED)
        associator = JPDA(PDAHypothesiser(predictor, updater, density, **chances))
        tracker = MultiTargetMixtureTracker(initiator, deleter, autoferry.detections(scans), associator, updater)
    else:
        gate = DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=GATE)
        associator = GNNWith2DAssignment(gate)
        if how == "score":
            deleter = associator = TrackScore(associator, area=scene.side**2)
        tracker = MultiTargetTracker(initiator, deleter, autoferry.detections(scans), associator, updater)
    every = set()
    for _, tracks in tracker:
        every |= tracks
    confirmed = [
        t for t in every
        if (t.id in associator.confirmed if how == "score" else sum(isinstance(s, Update) for s in t[1:]) >= UPDATES)
    ]  # fmt: skip
    whose = {tuple(p): o for p, o in zip(seen.plots.position.tolist(), seen.object)}
    return crowd.tally(seen.object, [np.array([whose[k] for k in plots_of(track)]) for track in confirmed])


def plots_of(track) -> list[tuple[float, ...]]:
    """Return the places of the plots of a track of Stone Soup, of several at once the one that weighs most."""
    found = []
    for state in track:
        if isinstance(state, Update):
            some = state.hypothesis
            one = some if isinstance(some, SingleHypothesis) else max(some, key=lambda h: float(h.probability))
            if one:
                found.append(tuple(position(one.measurement).tolist()))
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scenes", type=int, default=20)
    asked = parser.parse_args()
    scenes = [crowd.draw(asked.seed, k) for k in range(asked.scenes)]
    seen = [crowd.simulate(scene) for scene in scenes]
    print("| association | seen by its track | in one piece | confirmed tracks | of them false | breaks | swaps |")
    print("|---|---|---|---|---|---|---|")
    ways = {
        "nearest neighbours, 5 updates": "GNN",
        "nearest neighbours, track score": "score",
        "JPDA, 5 updates": "JPDA",
    }
    for name, how in ways.items():
        tries = [np.array([follow(s, g, how, q) for s, g in zip(scenes, seen)]).sum(axis=0) for q in Q]
        tell(f"constant velocity, {name}", max((crowd.Counted(*t) for t in tries), key=lambda t: t.whole - t.false))
    tell("Tracker", crowd.Counted(*np.array([crowd.count(s) for s in scenes]).sum(axis=0)))


def tell(name: str, t: crowd.Counted) -> None:
    """Print a row."""
    shares = f"{t.held / t.plots:.3f} | {t.whole / t.objects:.3f}"
    print(f"| {name} | {shares} | {t.tracks} | {t.false} | {t.breaks} | {t.swaps} |", flush=True)


if __name__ == "__main__":
    main()
