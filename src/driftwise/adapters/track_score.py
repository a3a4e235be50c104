"""Which tracks of Stone Soup are real: the log-likelihood ratio of a target against clutter."""

from __future__ import annotations

from collections import deque
from math import ceil, log, pi, sqrt
from typing import Any

import numpy as np
from scipy.stats import multivariate_normal

try:
    from stonesoup.base import Property
    from stonesoup.dataassociator import DataAssociator
    from stonesoup.deleter import Deleter
except ImportError:
    raise ImportError("driftwise.adapters.track_score needs Stone Soup: pip install driftwise[stonesoup]") from None

from ..engine.errors import InputError
from .stonesoup import TrackPrediction, position

PRIOR_DETECTION, PRIOR_SCANS = 0.9, 10.0  # what is assumed of P_D, and how many scans that counts for
MEMORY = 10  # scans of which clutter is remembered: it comes and goes
SMALLEST = 1.0  # m^2, of the neighbourhood that clutter is counted in


class TrackScore(DataAssociator, Deleter):
    """Track score of Sittler (1964): confirms and deletes tracks by the evidence for a target against clutter.

    Wraps a data associator and is a deleter as well, so that it stands in both places of a tracker:

        L += log(P_D p(z) / beta(z))  for a plot z of predictive density p,      L += log(1 - P_D)  for a miss

    A track starts with L = 0, is confirmed where L > log((1 - missed) / false), and deleted where L has fallen by more
    than log((1 - false) / missed) below its highest value [1]_. Both P_D and the density of clutter are learnt: P_D
    from confirmed tracks; beta(z), per scan and m^2, from the plots of the last ten scans that belong to no confirmed
    track nor to this one: the nearest sqrt(n) of those n, and not less than their average over the scanned area.

    Parameters
    ----------
    associator : DataAssociator
        Of single hypotheses, such as ``GNNWith2DAssignment``; any Gaussian filter.
    false, missed : float
        Accepted probabilities that clutter is confirmed, and that a target is dropped. Clutter comes in clusters that
        move like targets for a while: the first should be tiny.
    area : float, optional
        Scanned area in m^2; if omitted, the rectangle that plots so far span.

    Attributes
    ----------
    confirmed : set of str
        ``id`` of all tracks that were ever confirmed.
    score : dict
        L of the tracks that live, by ``id``.
    detection_probability : float

    Notes
    -----
    Bad at: targets that hardly move where earlier tracks came and went: plots of those count as clutter.

    The page on Stone Soup in the documentation has an example.

    References
    ----------
    .. [1] S. Blackman, R. Popoli, Design and Analysis of Modern Tracking Systems, Artech House 1999, section 6.2.
    """

    associator: DataAssociator = Property(doc="Data associator of single hypotheses")
    false: float = Property(default=1e-8, doc="Accepted probability that clutter is confirmed")
    missed: float = Property(default=1e-2, doc="Accepted probability that a target is dropped")
    area: float = Property(default=None, doc="Scanned area, m^2; what plots span if omitted")
    hypothesiser: Any = Property(default=None, doc="Not used: the associator has its own")

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        for name in ("false", "missed"):
            if not 0 < getattr(self, name) < 0.5:
                raise InputError(f"{name} must be a probability, above 0 and below 1/2, got {getattr(self, name)!r}")
        self.score: dict[str, float] = {}
        self.confirmed: set[str] = set()
        self._peak: dict[str, float] = {}
        self._hits = self._chances = 0
        self._scans: deque[list] = deque(maxlen=MEMORY)  # of each: (position, id of the track that took it)
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)

    @property
    def detection_probability(self) -> float:
        """P_D learnt from confirmed tracks."""
        return (PRIOR_SCANS * PRIOR_DETECTION + self._hits) / (PRIOR_SCANS + self._chances)

    def associate(self, tracks, detections, timestamp, **kwargs):
        """Return what the associator says, and score it."""
        associations = self.associator.associate(tracks, detections, timestamp, **kwargs)
        for detection in detections:
            self._low = np.minimum(self._low, position(detection))
            self._high = np.maximum(self._high, position(detection))
        sure = [bool(hypothesis) for track, hypothesis in associations.items() if track.id in self.confirmed]
        self._chances, self._hits = self._chances + len(sure), self._hits + sum(sure)
        P_D, false = self.detection_probability, self._false_plots()
        for track, hypothesis in associations.items():
            gain = log(1 - P_D)
            if hypothesis:
                beta = self._clutter(false, position(hypothesis.measurement), track.id)
                gain = log(P_D) + log_density(hypothesis) - log(beta) if beta < np.inf else 0.0
            score = self.score.get(track.id, 0.0) + gain
            self.score[track.id], self._peak[track.id] = score, max(score, self._peak.get(track.id, 0.0))
            if score > log((1 - self.missed) / self.false):
                self.confirmed.add(track.id)
        owner = {hypothesis.measurement: track.id for track, hypothesis in associations.items() if hypothesis}
        self._scans.append([(position(detection), owner.get(detection)) for detection in detections])
        return associations

    def check_for_deletion(self, track, **kwargs) -> bool:
        """Return whether the score has fallen too far below its highest value."""
        fallen = self._peak.get(track.id, 0.0) - self.score.get(track.id, 0.0)
        return fallen > log((1 - self.false) / self.missed)

    def delete_tracks(self, tracks, **kwargs):
        """Return the tracks to delete, and forget their scores."""
        gone = super().delete_tracks(tracks, **kwargs)
        for track in gone:
            self.score.pop(track.id, None)
            self._peak.pop(track.id, None)
        return gone

    def _false_plots(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the remembered plots (n, 2) that belong to no confirmed track, and whose they are."""
        found = [(z, owner) for scan in self._scans for z, owner in scan if owner not in self.confirmed]
        where = np.array([z for z, _ in found]).reshape(-1, 2)
        return where, np.array([owner for _, owner in found], dtype=object)

    def _clutter(self, false, where, track) -> float:
        """Return the density of clutter, per scan and m^2, at a place; infinite while plots span no area."""
        plots, owner = false
        area = float(np.prod(self._high - self._low)) if self.area is None else self.area
        square = np.sum((plots[owner != track] - where) ** 2, axis=1)
        n, scans = len(square), max(len(self._scans), 1)
        if not area > 0:
            return np.inf
        if n == 0:
            return 1 / (scans * area)
        k = ceil(sqrt(n))
        near = k / max(pi * np.partition(square, k - 1)[k - 1], SMALLEST)
        return max(near, n / area) / scans


def log_density(hypothesis) -> float:
    """Return the log density, per m^2, that a track predicted for its plot."""
    if isinstance(hypothesis.prediction, TrackPrediction):
        return hypothesis.prediction.log_density(hypothesis.measurement)
    predicted = hypothesis.measurement_prediction
    mean, covariance = np.array(predicted.state_vector, float).ravel(), np.array(predicted.covar, float)
    return float(multivariate_normal.logpdf(position(hypothesis.measurement), mean, covariance))
