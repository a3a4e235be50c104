"""What driftwise says of a record, with no setting of its own: the one place where the scoreboard meets the product."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import driftwise as dw

from .opponents import by_bic, first_half


class Ours(NamedTuple):
    """The forecast of one record, one step ahead, in units of the data, and the jumps that were told."""

    prediction: np.ndarray  # (T,)
    variance: np.ndarray
    inside: np.ndarray  # 1 where y lies in its 95 % band, NaN where it is missing
    log_score: np.ndarray  # log predictive density
    alarms: np.ndarray  # samples at which a jump was told
    steady: Any = None  # steady(at) -> Steady of the model's trace, or None where it has no input


class Steady(NamedTuple):
    """Gain of the first input and the level at an input held there, with standard deviations, all (T,)."""

    gain: np.ndarray
    gain_std: np.ndarray
    level: np.ndarray
    level_std: np.ndarray


def ours(y, u, time=None) -> Ours:
    """Return what driftwise says of y (T,), u (T, m) and the times of the samples."""
    scale = first_half(y, u)
    Y, U = scale.apply(y, u)
    s, m = by_bic(Y, U), u.shape[1]
    est = dw.ARX(s.na, (s.nb,) * m, (s.nk,) * m, memory=dw.Auto(), offset=True)
    trace = est.scan(Y, U if m else None, keep="covariance" if m and len(y) * est.model.N**2 < 2e7 else "means")
    e, band = trace.innovation, trace.band()
    inside = np.where(np.isnan(e), np.nan, np.abs(e) <= band)
    variance, density = _mixture(trace, e)
    return Ours(
        scale.y + scale.sd * trace.prediction,
        scale.sd**2 * variance,
        inside,
        density - np.log(scale.sd),
        np.array([event.sample for event in trace.jumps()], int),
        (lambda at: _steady(trace, scale, at)) if trace.keep == "covariance" else None,
    )


def _mixture(trace, e):
    """Return variance and log density of a mixture of Student-t predictions."""
    from scipy.stats import t

    w, offset, sd, dof = trace.mixture()
    dof = dof[:, None]
    heavy = np.where(dof > 2, dof / np.maximum(dof - 2, 1e-9), np.inf)
    variance = np.sum(w * (sd**2 * heavy + offset**2), axis=1)
    with np.errstate(divide="ignore"):
        return variance, np.log(np.sum(w * t.pdf((e[:, None] - offset) / sd, dof) / sd, axis=1))


def _steady(trace, scale, at) -> Steady:
    """Return gain and level of an ARX over time by the delta method; other inputs at their mean of the first half."""
    form = trace.estimator.model
    na, nb = form.na, form.nb[0]
    theta, P = trace.parameters, trace.covariance
    v = (at - scale.u[0]) / scale.u_sd[0]
    A = 1 + theta[:, :na].sum(axis=1)
    B = theta[:, na : na + nb].sum(axis=1)
    K, L = B / A, (theta[:, -1] + B * v) / A
    dK, dL = np.zeros_like(theta), np.zeros_like(theta)
    dK[:, :na], dL[:, :na] = -(K / A)[:, None], -(L / A)[:, None]
    dK[:, na : na + nb], dL[:, na : na + nb] = (1 / A)[:, None], (v / A)[:, None]
    dL[:, -1] = 1 / A
    sd = [np.sqrt(np.einsum("ti,tij,tj->t", d, P, d).clip(0)) for d in (dK, dL)]
    unit = scale.sd / scale.u_sd[0]
    return Steady(unit * K, unit * sd[0], scale.y + scale.sd * L, scale.sd * sd[1])
