"""What driftwise says of a record, with no setting of its own: the one place where the scoreboard meets the product."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import driftwise as dw
from driftwise.analysis.identification import Finder
from driftwise.analysis.identifier import PILOT
from driftwise.models.quantities import NORMAL_95
from driftwise.tables.recognise import recognise

from ..papers.recordings import Series

FALSE, SAME = 1000, 30  # samples in which one false alarm is allowed; within which alarms are about one change


class Ours(NamedTuple):
    """The forecast of one record, one step ahead, in units of the data, and the changes that were told."""

    prediction: np.ndarray  # (T,)
    variance: np.ndarray
    inside: np.ndarray  # 1 where y lies in its 95 % band, NaN where it is missing
    log_score: np.ndarray  # log predictive density
    alarms: np.ndarray  # samples at which a change was told


class Steady(NamedTuple):
    """Gain of the first input and the level at an input held there, with standard deviations, all (T,)."""

    gain: np.ndarray
    gain_std: np.ndarray
    level: np.ndarray
    level_std: np.ndarray


def ours(y, u, time=None) -> Ours:
    """Return what `identify` says of y (T,) and u (T, m), the columns named, samples taken as equidistant."""
    y, u = np.asarray(y, float), np.asarray(u, float).reshape(len(y), -1)
    names = tuple(f"u{i + 1}" for i in range(u.shape[1]))
    columns = {"y": y, **dict(zip(names, u.T))}
    finder = Finder(recognise(columns, output="y", inputs=names))
    forecast, _ = finder.add(np.arange(len(y), dtype=float), y, u)
    z = forecast.normal_score
    inside = np.where(np.isfinite(z), np.abs(z) <= NORMAL_95, np.nan)
    return Ours(forecast.prediction, forecast.variance, inside, forecast.log_score, told(z))


def told(z) -> np.ndarray:
    """Return where the forecast stops to fit, as it is noticed, once each; what `identify` dates is hindsight."""
    found: list[int] = []
    for k in dw.detect.SelfStarting(FALSE).scan(z).samples.tolist():
        if k > (found[-1] if found else -SAME) + SAME:
            found.append(k)
    return np.array(found, int)


def tracked(east: Series, north: Series, speed: float) -> list[Ours]:
    """Return what `TrackEstimator` says of both coordinates of a track, told the speed of the class."""
    trace = dw.TrackEstimator(speed).scan(east.time, np.stack([east.y, north.y], axis=1))
    z = trace.normal_score
    inside = np.where(np.isfinite(z), np.abs(z) <= NORMAL_95, np.nan)
    none = np.zeros(0, int)
    return [
        Ours(trace.prediction[:, i], trace.variance[:, i], inside[:, i], trace.log_score[:, i], none) for i in (0, 1)
    ]


def between_jumps(y, u, nk: int, at: float) -> Steady:
    """Return gain and level, at an input held at ``at``, of the first-order model that the truths are those of.

    Its parameters are constant until they jump; the record is taken about its medians at the start.
    """
    pilot = slice(PILOT)
    middle, rest = float(np.median(y[pilot])), np.median(u[pilot], axis=0)
    est = dw.ARX(1, 1, nk, memory=dw.RestartOnChange(dw.detect.SelfStarting()), offset=True)
    est = est.scaled_to(y[pilot] - middle, u[pilot] - rest)
    found = _steady(est, y - middle, u - rest, at - rest[0])
    return found._replace(level=found.level + middle)


def _steady(estimator, y, u, at) -> Steady:
    """Return gain and level of an ARX with one input over time by the delta method."""
    trace = estimator.scan(y, u, keep="covariance")
    form = estimator.model
    na, nb = form.na, form.nb[0]
    theta, P = trace.parameters, trace.covariance
    A = 1 + theta[:, :na].sum(axis=1)
    B = theta[:, na : na + nb].sum(axis=1)
    weights = np.append(np.concatenate([np.zeros(na), np.full(nb, at)]), 1.0)
    K, L = B / A, theta @ weights / A
    dK, dL = np.zeros_like(theta), np.tile(weights, (len(theta), 1)) / A[:, None]
    dK[:, :na], dL[:, :na] = -(K / A)[:, None], -(L / A)[:, None]
    dK[:, na : na + nb] = (1 / A)[:, None]
    sd = [np.sqrt(np.einsum("ti,tij,tj->t", d, P, d).clip(0)) for d in (dK, dL)]
    return Steady(K, sd[0], L, sd[1])
