"""`TrackEstimator` inside Stone Soup: its Predictor, Updater and Initiator."""

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
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.prediction import GaussianMeasurementPrediction, Prediction
    from stonesoup.types.state import GaussianState, StateMutableSequence
    from stonesoup.types.track import Track
    from stonesoup.types.update import Update
    from stonesoup.updater import Updater
except ImportError:
    raise ImportError("driftwise.adapters.stonesoup needs Stone Soup: pip install driftwise[stonesoup]") from None

from ..engine.errors import InputError

STATE = [0, 1, 3, 4]  # [E, vE, N, vN] among [E, vE, aE, N, vN, aN]
POSITION = [0, 2]  # in [E, vE, N, vN]
GATE = 3.5  # standard deviations that the usual gate has
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
    rate, manoeuvre, log density, ...), or would say of a plot at this time; ``times`` are those of the last two plots.
    """

    row: Any = Property(default=None, doc="State of the estimator after the last plot")
    step: Any = Property(default=None, doc="Step of the estimator at this time")
    times: tuple = Property(default=(), doc="Times of the last plot but one and of the last, s")


class TrackPrediction(Prediction, TrackState):
    """`TrackState` predicted to a time."""

    estimator: Any = Property(default=None, doc="TrackEstimator that predicts")

    def log_density(self, detection) -> float:
        """Return the log density, per m^2, of a detection: of the estimator's mixture."""
        return float(self.estimator.density(self.row, seconds(detection.timestamp), position(detection)))


class TrackUpdate(Update, TrackState):
    """`TrackState` after a plot, of whose errors ``noise`` is what the estimator was told."""

    noise: Any = Property(default=None, doc="Covariance (2, 2) that the estimator was told, None if nothing")


class TrackPredictor(Predictor):
    """Stone Soup predictor that asks a `TrackEstimator`.

    Predictions are Gaussian, [E, vE, N, vN], matched to the first two moments of the estimator's mixture. A missed
    detection is a prediction like any other: the next one starts again from the last plot, however long ago.

    Parameters
    ----------
    estimator : TrackEstimator
    transition_model : ignored
        The estimator has its own.

    Notes
    -----
    Bad at: times that do not increase. A scan of a second radar at the very time of the last plot is refused.

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.adapters.stonesoup import TrackInitiator, TrackPredictor, timestamp
    >>> from stonesoup.types.detection import Detection
    >>> est = dw.TrackEstimator("boat")
    >>> one, two = (Detection(np.array([4.0, 3.0]) * t, timestamp=timestamp(t)) for t in (0.0, 2.0))
    >>> states = TrackInitiator(est).begin(one, two)
    >>> prediction = TrackPredictor(estimator=est).predict(states[-1], timestamp=timestamp(5.0))
    >>> print([round(float(x)) for x in prediction.state_vector])  # [E, vE, N, vN]; two plots, and what boats do
    [18, 3, 14, 3]
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
    kept = dict(row=prior.row, times=prior.times)
    return TrackPrediction(*_moments(step), timestamp=timestamp, prior=prior, step=step, estimator=estimator, **kept)


class TrackUpdater(Updater):
    """Stone Soup updater that lets a `TrackEstimator` learn from the plot of a hypothesis.

    The estimator learns the noise of plots. A measurement model, of the detections or here, says what it is about:
    the estimator starts from that, and gates stay as narrow as it allows. Say it where there is clutter: an
    estimator that follows clutter learns that plots are wild, and its gate takes in more clutter.

    Parameters
    ----------
    measurement_model : LinearGaussian, optional
        Of positions, for its noise only, where detections have none.
    estimator : TrackEstimator
    """

    measurement_model: MeasurementModel = Property(default=None, doc="Linear model of positions, for its noise only")
    estimator: Any = Property(default=None, doc="TrackEstimator")

    def predict_measurement(self, predicted_state, measurement_model=None, measurement_noise=True, **kwargs):
        """Return the Gaussian of the next plot: the estimator's, no wider than `widest` where the noise is known."""
        _row(predicted_state)
        step, P = predicted_state.step, predicted_state.covar
        S = step.covariance if measurement_noise else P[np.ix_(POSITION, POSITION)]
        R = noise_of(measurement_model or self.measurement_model)
        if R is not None and np.isfinite(predicted_state.times).all():
            limit = widest(R, seconds(predicted_state.timestamp), predicted_state.times, self.estimator.speed)
            S = S * min(1.0, np.trace(limit) / np.trace(S))
        return GaussianMeasurementPrediction(
            step.prediction, S, timestamp=predicted_state.timestamp, cross_covar=P[:, POSITION]
        )

    def update(self, hypothesis, **kwargs):
        """Return the `TrackUpdate` that the plot of a single hypothesis leads to."""
        if not isinstance(hypothesis, SingleHypothesis):
            raise InputError(
                f"hypothesis must have one detection, got {type(hypothesis).__name__}. "
                "Probabilistic association mixes states and has no place for the estimator's: use nearest neighbours"
            )
        before = hypothesis.prediction
        return _update(self.estimator, _row(before), before.times, hypothesis, self.measurement_model)


def widest(R, time, times, speed) -> np.ndarray:
    """Return the covariance (2, 2) that gates are limited to, of a plot at ``time``.

    That of a line through the last two plots, of noise R, at ``times``; and at the edge of a gate of 3.5 standard
    deviations a change of velocity, on the way, as large as the ``speed`` of the class.
    """
    before, last = times
    ratio = (time - last) / (last - before)
    return R * (1 + (1 + ratio) ** 2 + ratio**2) + (speed * (time - last) / 2 / GATE) ** 2 * np.eye(2)


def noise_of(model):
    """Return the covariance (2, 2) of a measurement model, None where there is none."""
    return None if model is None else np.array(model.covar(), float)


def _update(estimator, row, times, hypothesis, measurement_model) -> TrackUpdate:
    detection = hypothesis.measurement
    time = seconds(detection.timestamp)
    R = noise_of(detection.measurement_model or measurement_model)
    row, step = estimator.update(row, time, position(detection), R)
    kept = dict(row=row, times=(times[-1], time), noise=R)
    return TrackUpdate(*_moments(step), timestamp=detection.timestamp, hypothesis=hypothesis, step=step, **kept)


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
    measurement_model: MeasurementModel = Property(default=None, doc="As that of the updater")

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
        est, model = self.estimator, self.measurement_model
        start = _update(est, est.start(), (np.nan,), SingleHypothesis(None, first), model)
        hypothesis = SingleHypothesis(_predict(est, start, second.timestamp), second)
        return [start, _update(est, start.row, start.times, hypothesis, model)]


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
