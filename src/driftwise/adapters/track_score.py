"""Which tracks of Stone Soup are real: the log-likelihood ratio of a target against clutter."""

from __future__ import annotations

from math import log
from typing import Any

import numpy as np
from scipy.stats import multivariate_normal

try:
    from stonesoup.base import Property
    from stonesoup.dataassociator import DataAssociator
    from stonesoup.deleter import Deleter
except ImportError:
    raise ImportError("driftwise.adapters.track_score needs Stone Soup: pip install driftwise[stonesoup]") from None

from .stonesoup import TrackPrediction, position

PRIOR_DETECTION, PRIOR_SCANS = 0.9, 10.0  # what is assumed of P_D, and how many scans that counts for


class TrackScore(DataAssociator, Deleter):
    """Track score of Sittler (1964): confirms and deletes tracks by the evidence for a target against clutter.

    Wraps a data associator and is a deleter as well, so that it stands in both places of a tracker:

        L += log(P_D p(z) / beta)  for a plot z of predictive density p,      L += log(1 - P_D)  for a miss

    A track is confirmed where L > log((1 - missed) / false) [1]_, and deleted where L has fallen by
    log((1 - false) / missed) below its highest value. Clutter density beta (plots of no confirmed track per scan and
    area) and detection probability P_D (of confirmed tracks) are learnt on-line.

    Parameters
    ----------
    associator : DataAssociator
        Such as ``GNNWith2DAssignment``.
    false, missed : float
        Accepted probabilities that clutter is confirmed, and that a target is dropped.
    area : float, optional
        Scanned area in m^2; if omitted, the area that plots so far span.

    References
    ----------
    .. [1] S. Blackman, R. Popoli, Design and Analysis of Modern Tracking Systems, Artech House 1999, section 6.2.
    """

    associator: DataAssociator = Property(doc="Data associator of single hypotheses")
    false: float = Property(default=1e-4, doc="Accepted probability that clutter is confirmed")
    missed: float = Property(default=1e-2, doc="Accepted probability that a target is dropped")
    area: float = Property(default=None, doc="Scanned area, m^2; what plots span if omitted")
    hypothesiser: Any = Property(default=None, doc="Not used: the associator has its own")

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.score: dict[str, float] = {}  # of the tracks alive, by id
        self.confirmed: set[str] = set()  # ids of the tracks ever confirmed
        self._peak: dict[str, float] = {}
        self._scans = self._clutter = self._hits = self._chances = 0
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)

    @property
    def detection_probability(self) -> float:
        """P_D learnt from confirmed tracks."""
        return (PRIOR_SCANS * PRIOR_DETECTION + self._hits) / (PRIOR_SCANS + self._chances)

    @property
    def clutter_density(self) -> float:
        """Plots of no confirmed track, per scan and m^2; at least one in all scans so far."""
        area = float(np.prod(self._high - self._low)) if self.area is None else self.area
        return max(self._clutter, 1) / (max(self._scans, 1) * area) if area > 0 else np.inf

    def associate(self, tracks, detections, timestamp, **kwargs):
        """Return what the associator says, and score it."""
        associations = self.associator.associate(tracks, detections, timestamp, **kwargs)
        self._learn(associations, detections)
        P_D, beta = self.detection_probability, self.clutter_density
        if beta == np.inf:  # all plots so far lie on a line: there is no area yet
            return associations
        hit, miss = log(P_D / beta), log(1 - P_D)
        for track, hypothesis in associations.items():
            score = self.score.get(track.id, 0.0) + (hit + log_density(hypothesis) if hypothesis else miss)
            self.score[track.id], self._peak[track.id] = score, max(score, self._peak.get(track.id, 0.0))
            if score > log((1 - self.missed) / self.false):
                self.confirmed.add(track.id)
        return associations

    def check_for_deletion(self, track, **kwargs) -> bool:
        """Return whether the score has fallen too far below its highest value."""
        fallen = self._peak.get(track.id, 0.0) - self.score.get(track.id, 0.0)
        return fallen > log((1 - self.false) / self.missed)

    def delete_tracks(self, tracks, **kwargs):
        """Return the tracks to delete, and forget their scores."""
        gone = super().delete_tracks(tracks, **kwargs)
        for track in gone:
            self.score.pop(track.id, None), self._peak.pop(track.id, None)
        return gone

    def _learn(self, associations, detections):
        """Count the clutter of a scan, and how many confirmed tracks were seen."""
        sure = {track: hypothesis for track, hypothesis in associations.items() if track.id in self.confirmed}
        self._chances += len(sure)
        self._hits += sum(map(bool, sure.values()))
        self._scans += 1
        self._clutter += len(detections) - sum(map(bool, sure.values()))
        for detection in detections:
            self._low = np.minimum(self._low, position(detection))
            self._high = np.maximum(self._high, position(detection))


def log_density(hypothesis) -> float:
    """Return the log density, per m^2, that a track predicted for its plot."""
    if isinstance(hypothesis.prediction, TrackPrediction):
        return hypothesis.prediction.log_density(hypothesis.measurement)
    predicted = hypothesis.measurement_prediction
    mean, covariance = np.array(predicted.state_vector, float).ravel(), np.array(predicted.covar, float)
    return float(multivariate_normal.logpdf(position(hypothesis.measurement), mean, covariance))
