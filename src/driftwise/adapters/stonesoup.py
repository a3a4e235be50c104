"""`TrackEstimator` inside Stone Soup: its Predictor, Updater and Initiator, plots in and tracks out."""

from __future__ import annotations

from datetime import datetime, timedelta
from functools import lru_cache
from typing import Any

import numpy as np

try:
    from stonesoup.base import Property
    from stonesoup.initiator import Initiator
    from stonesoup.models.measurement import MeasurementModel
    from stonesoup.models.transition import TransitionModel
    from stonesoup.predictor import Predictor
    from stonesoup.types.detection import Detection, GaussianDetection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.prediction import GaussianMeasurementPrediction, Prediction
    from stonesoup.types.state import GaussianState, StateMutableSequence
    from stonesoup.types.track import Track
    from stonesoup.types.update import Update
    from stonesoup.updater import Updater
except ImportError:
    raise ImportError("driftwise.adapters.stonesoup needs Stone Soup: pip install driftwise[stonesoup]") from None

from ..errors import InputError
from ..tracking.plots import Plots, plots

STATE = [0, 1, 3, 4]  # [E, vE, N, vN] among [E, vE, aE, N, vN, aN]
POSITION = [0, 2]  # in [E, vE, N, vN]
KEPT = 128  # predictions: the one of a track is asked for again for each detection of a scan


def seconds(timestamp: datetime) -> float:
    """Return the time of a timestamp in s since 1970; one without a zone counts as UTC."""
    return (timestamp - datetime(1970, 1, 1, tzinfo=timestamp.tzinfo)).total_seconds()


def timestamp(time: float) -> datetime:
    """Return the timestamp, without a zone, of a time in s since 1970, to the microsecond."""
    return datetime(1970, 1, 1) + timedelta(seconds=float(time))


class TrackState(GaussianState):
    """Gaussian state [E, vE, N, vN] in m and m/s that carries what the estimator knows.

    ``row`` is the estimator's state after the last plot; ``step`` is what it said of this one (acceleration, turn
    rate, manoeuvre, log density, ...), or would say of a plot at this time.
    """

    row: Any = Property(default=None, doc="State of the estimator after the last plot")
    step: Any = Property(default=None, doc="Step of the estimator at this time")


class TrackPrediction(Prediction, TrackState):
    """`TrackState` predicted to a time."""

    estimator: Any = Property(default=None, doc="TrackEstimator that predicts")

    def log_density(self, detection) -> float:
        """Return the log density, per m^2, of a detection: of the estimator's mixture."""
        return float(self.estimator.density(self.row, seconds(detection.timestamp), position(detection)))


class TrackUpdate(Update, TrackState):
    """`TrackState` after a plot."""


class TrackPredictor(Predictor):
    """Stone Soup predictor that asks a `TrackEstimator`.

    Predictions are Gaussian, [E, vE, N, vN], matched to the first two moments of the estimator's mixture. A missed
    detection is a prediction like any other: the next one starts again from the last plot, however long ago.

    Parameters
    ----------
    estimator : TrackEstimator
    transition_model : ignored
        The estimator has its own.
    """

    transition_model: TransitionModel = Property(default=None, doc="Not used: the estimator has its own")
    estimator: Any = Property(default=None, doc="TrackEstimator")

    def predict(self, prior, timestamp=None, **kwargs):
        """Return the `TrackPrediction` of ``prior``, a `TrackState` or a track that ends with one, at a time."""
        if isinstance(prior, StateMutableSequence):
            prior = prior.state
        return _predict(self.estimator, prior, prior.timestamp if timestamp is None else timestamp)


@lru_cache(KEPT)
def _predict(estimator, prior, timestamp) -> TrackPrediction:
    _, step = estimator.update(_row(prior), seconds(timestamp), np.full(2, np.nan))
    known = dict(timestamp=timestamp, prior=prior, row=prior.row, step=step, estimator=estimator)
    return TrackPrediction(*_moments(step), **known)


class TrackUpdater(Updater):
    """Stone Soup updater that lets a `TrackEstimator` learn from the plot of a hypothesis.

    The noise of plots is learnt on-line. Detections that bring a covariance (`GaussianDetection`) or a linear
    measurement model, or a ``measurement_model`` here, tell the estimator what it is.

    Parameters
    ----------
    estimator : TrackEstimator
    measurement_model : LinearGaussian, optional
    """

    measurement_model: MeasurementModel = Property(default=None, doc="Linear model of positions, for its noise only")
    estimator: Any = Property(default=None, doc="TrackEstimator")

    def predict_measurement(self, predicted_state, measurement_model=None, measurement_noise=True, **kwargs):
        """Return the Gaussian of the next plot: the estimator's mean, and its innovation covariance (for gates)."""
        _row(predicted_state)
        step, P = predicted_state.step, predicted_state.covar
        covariance = step.covariance if measurement_noise else P[np.ix_(POSITION, POSITION)]
        return GaussianMeasurementPrediction(
            step.prediction, covariance, timestamp=predicted_state.timestamp, cross_covar=P[:, POSITION]
        )

    def update(self, hypothesis, **kwargs):
        """Return the `TrackUpdate` that the plot of a single hypothesis leads to."""
        if not isinstance(hypothesis, SingleHypothesis):
            raise InputError(
                f"hypothesis must have one detection, got {type(hypothesis).__name__}. "
                "Probabilistic association mixes states and has no place for the estimator's: use nearest neighbours"
            )
        return _update(self.estimator, _row(hypothesis.prediction), hypothesis, self.measurement_model)


def _update(estimator, row, hypothesis, measurement_model=None) -> TrackUpdate:
    detection = hypothesis.measurement
    model = detection.measurement_model or measurement_model
    if isinstance(detection, GaussianDetection):
        covariance = detection.covar
    else:
        covariance = None if model is None else model.covar()
    known = {} if covariance is None else {"covariance": np.array(covariance, float)}
    row, step = estimator.update(row, seconds(detection.timestamp), position(detection), **known)
    return TrackUpdate(*_moments(step), timestamp=detection.timestamp, hypothesis=hypothesis, row=row, step=step)


class TrackInitiator(Initiator):
    """Stone Soup initiator: a track starts from two plots of consecutive scans that a target can join.

    Plots that no track took are paired with those of the scan before, the nearest first, as far as twice the class's
    speed reaches; those left over wait for one scan. A new track has two states, one a plot.

    Parameters
    ----------
    estimator : TrackEstimator
    fastest : float, optional
        Largest speed between the two plots in m/s: twice the estimator's typical ``speed`` if omitted.
    """

    estimator: Any = Property(default=None, doc="TrackEstimator")
    fastest: float = Property(default=None, doc="Largest speed between the two plots, m/s")

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        if self.fastest is None:
            self.fastest = 2 * self.estimator.speed
        self._waiting: list[Detection] = []

    def initiate(self, detections, timestamp, **kwargs):
        """Return the tracks that start, from the plots of a scan that no track took."""
        new = sorted(detections, key=lambda one: tuple(position(one)))
        reach = sorted(
            (gap, i, j)
            for i, one in enumerate(new)
            for j, old in enumerate(self._waiting)
            for gap in [float(np.hypot(*(position(one) - position(old))))]
            if gap <= self.fastest * (one.timestamp - old.timestamp).total_seconds()
        )
        tracks, taken, joined = set(), set(), set()
        for _, i, j in reach:
            if i not in taken and j not in joined:
                taken.add(i)
                joined.add(j)
                tracks.add(Track(self.begin(self._waiting[j], new[i])))
        self._waiting = [one for i, one in enumerate(new) if i not in taken]
        return tracks

    def begin(self, first, second) -> list:
        """Return the states of a track that starts with two plots."""
        start = _update(self.estimator, self.estimator.start(), SingleHypothesis(None, first))
        prediction = _predict(self.estimator, start, second.timestamp)
        return [start, _update(self.estimator, start.row, SingleHypothesis(prediction, second))]


def position(detection) -> np.ndarray:
    """Return where a detection lies, (2,) m East and North."""
    z = np.array(detection.state_vector, float).ravel()
    if z.shape != (2,):
        raise InputError(f"detections must be positions (East, North) in m, got {z.size} numbers; convert them first")
    return z


def _row(state):
    """Return the estimator's state that a Stone Soup state carries."""
    row = getattr(state, "row", None)
    if row is None:
        raise InputError(
            f"the state must be a TrackState with the estimator's row, got {type(state).__name__}. Did another "
            "initiator start the track, or a mixture (PDA, JPDA) replace it? Use TrackInitiator and nearest neighbours"
        )
    return row


def _moments(step) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance of [E, vE, N, vN]."""
    x = np.stack([step.position, step.velocity], axis=-1).reshape(4, 1)
    return x, np.array(step.spread)[np.ix_(STATE, STATE)]


def detections(plots: Plots):
    """Yield (timestamp, set of detections) of `Plots`, those of one time together: a Stone Soup ``detector``.

    Plots with a covariance become `GaussianDetection`; altitude, key, name and sensor are metadata.

    Examples
    --------
    >>> import driftwise as dw
    >>> from driftwise.adapters.stonesoup import detections
    >>> from driftwise.tracking.plots import plots
    >>> for time, found in detections(plots([0.0, 0.0, 1.5], [[0, 0], [9, 9], [1, 1]])):
    ...     print(time.time(), len(found))
    00:00:00 2
    00:00:01.500000 1
    """
    starts = np.flatnonzero(np.diff(plots.time, prepend=-np.inf))
    for a, b in zip(starts, [*starts[1:], len(plots)]):
        time, found = timestamp(plots.time[a]), set()
        for k in range(a, b):
            known = {name: getattr(plots, name)[k] for name in ("altitude", "key", "name", "sensor")}
            given = dict(timestamp=time, metadata={name: value for name, value in known.items() if value == value})
            z, R = plots.position[k].reshape(2, 1), plots.covariance[k]
            found.add(GaussianDetection(z, R, **given) if np.isfinite(R).all() else Detection(z, **given))
        yield time, found


def tracks_from(tracks) -> list[dict]:
    """Return Stone Soup tracks of any Gaussian filter over [E, vE, N, vN] as columns, the earliest first.

    Each has ``id``, ``time`` (T,) s since 1970, ``position``, ``velocity`` (T, 2), ``covariance`` (T, 4, 4) of
    [E, vE, N, vN], ``seen`` (T,) (False where the detection was missed), ``plots`` (its `Plots`) and the track's
    ``metadata``.
    """
    return sorted((_columns(track) for track in tracks), key=lambda one: (one["time"][0], str(one["id"])))


def _columns(track) -> dict:
    states = list(track.states)
    x = np.array([np.array(s.state_vector, float).ravel() for s in states])
    updates = [s for s in states if isinstance(s, Update)]
    found = [s.hypothesis.measurement for s in updates]
    return dict(
        id=track.id,
        time=np.array([seconds(s.timestamp) for s in states]),
        position=x[:, [0, 2]],
        velocity=x[:, [1, 3]],
        covariance=np.array([np.array(s.covar, float) for s in states]),
        seen=np.array([isinstance(s, Update) for s in states]),
        plots=plots([seconds(d.timestamp) for d in found], [position(d) for d in found]),
        metadata=dict(track.metadata),
    )
