"""What a trace forecast of each output: the error, how likely it was, whether the 95 % band held it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..models.quantities import NORMAL_95
from ..results.bands import share_within
from ..results.summary import is_inside
from .forecast_verdicts import BAND


class Forecast(NamedTuple):
    """Columns, (T,): NaN, and not inside, where y is missing or there was no forecast."""

    innovation: np.ndarray
    variance: np.ndarray  # squared scale where ``dof`` is finite
    dof: np.ndarray
    log_density: np.ndarray  # of y(t), given the samples before it
    is_inside: np.ndarray  # the 95 % band


def forecast(trace) -> Forecast:
    """Return what a trace of one output forecast; an average tells its own density."""
    e, T = np.asarray(trace.innovation), np.asarray(trace.variance)
    if hasattr(trace, "log_score"):
        inside = np.abs(trace.normal_score) <= NORMAL_95
        return Forecast(e, T, np.full(len(e), np.inf), trace.log_score, inside)
    is_there = np.isfinite(e) & np.isfinite(T) & (T > 0)
    dof = np.asarray(trace.dof)
    log, held = np.full(len(e), np.nan), np.zeros(len(e), bool)
    if is_there.any():
        if trace.is_mixture:
            parts = [part[is_there] for part in trace.mixture()]
            log[is_there] = mixture_density(e[is_there], *parts)
            held[is_there] = share_within(np.abs(e[is_there]), *parts) <= BAND
        else:
            z = np.abs(e[is_there]) / np.sqrt(T[is_there])
            log[is_there] = student(z, dof[is_there]) - 0.5 * np.log(T[is_there])
            held[is_there] = is_inside(z, dof[is_there])
    return Forecast(e, T, dof, log, held)


def student(z, dof) -> np.ndarray:
    """Return the log density of Student's t at z, of the normal law where ``dof`` is infinite."""
    from scipy.special import gammaln

    nu = np.where(np.isinf(dof), 1.0, dof)
    tails = gammaln((nu + 1) / 2) - gammaln(nu / 2) - 0.5 * np.log(nu * np.pi) - (nu + 1) / 2 * np.log1p(z * z / nu)
    return np.where(np.isinf(dof), -0.5 * z * z - 0.5 * np.log(2 * np.pi), tails)


def mixture_density(e, weight, offset, scale, dof) -> np.ndarray:
    """Return the log density of a mixture, arguments as in `half_width`, at its mean plus e."""
    parts = student((e[:, None] - offset) / scale, dof[:, None]) - np.log(scale)
    with np.errstate(divide="ignore"):
        parts = parts + np.log(weight)
    top = parts.max(axis=1)
    return top + np.log(np.exp(parts - top[:, None]).sum(axis=1))
