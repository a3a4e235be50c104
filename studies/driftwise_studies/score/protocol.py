"""How a forecast is judged: one step ahead, one pass, the second half scored."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from driftwise.models.quantities import NORMAL_95


class Score(NamedTuple):
    """What a forecast is worth; NaN where it claims no variance."""

    fit: float  # 100 (1 - ||y - prediction|| / ||y - mean||), %
    nis: float  # mean e^2 / variance: 1 is right
    share: float  # % of the samples inside their 95 % bands
    log_score: float  # mean log predictive density in units of y, higher is better


def second_half(y) -> np.ndarray:
    """Return which samples are scored: those of the second half where y is known, (T,)."""
    return (np.arange(len(y)) >= len(y) // 2) & np.isfinite(y)


def fit(y, prediction, used=None) -> float:
    """Return 100 (1 - ||y - prediction|| / ||y - mean y||) of the samples used (the second half)."""
    used = second_half(y) if used is None else used
    y, prediction = y[used], prediction[used]
    return float(100 * (1 - np.linalg.norm(y - prediction) / np.linalg.norm(y - y.mean())))


def inside_and_density(e, variance, inside=None, log_score=None):
    """Return whether errors (T,) lie in their 95 % bands and their log densities: Gaussian where not given."""
    S = np.asarray(variance, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        if inside is None:
            inside = np.where(np.isnan(S), np.nan, np.abs(e) <= NORMAL_95 * np.sqrt(S))
        if log_score is None:
            log_score = -0.5 * np.log(2 * np.pi * S) - 0.5 * e**2 / S
    return np.asarray(inside, float), np.asarray(log_score, float)


def judge(y, prediction, variance, inside=None, log_score=None) -> Score:
    """Return the `ScoreCUSUM` of a forecast of y (T,); Gaussian where ``inside`` and ``log_score`` (T,) are not given.

    A prediction that is not finite makes the score so: it must show.

    Examples
    --------
    >>> import numpy as np
    >>> y, half = np.array([9.0, 9.0, 0.0, 2.0]), np.array([0.0, 0.0, 0.5, 1.5])
    >>> judge(y, half, np.full(4, 0.25))
    ScoreCUSUM(fit=50.0, nis=1.0, share=100.0, log_score=-0.7257913526447274)
    """
    used, e = second_half(y), y - prediction
    inside, log_score = inside_and_density(e, variance, inside, log_score)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        nis = np.mean((e**2 / variance)[used])
    return Score(fit(y, prediction), float(nis), float(100 * np.mean(inside[used])), float(np.mean(log_score[used])))
