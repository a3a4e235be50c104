"""Frequency response and steady-state gain with what is known of them; a ratio near a zero denominator has no std."""

from __future__ import annotations

import numpy as np

from .canonical import Canonical
from .roots import CLEAR, SMALL


def _parts(form: Canonical, theta, z):
    """Return numerators (..., k, F) and denominator (..., F) at the points z for parameters theta (..., m)."""
    n, k = form.n, form.inputs
    lags = z[:, None] ** -np.arange(n + 1.0)
    theta = np.asarray(theta)
    den = 1 + theta[..., :n] @ lags[:, 1:].T
    b = theta[..., n : n * (k + 1)].reshape(*theta.shape[:-1], k, n)
    num = b @ lags[:, 1:].T
    if form.direct:
        num = num + theta[..., form.direct_at :, None]
    return num, den, lags


def ratio(num, den):
    """Return num / den; infinite where the denominator is zero."""
    safe = np.where(den == 0, 1, den)
    return np.where(den == 0, np.inf, num / safe)


def denominator_std(form: Canonical, covariance, z):
    """Return the root mean square radius of uncertainty of the denominator at the points z, (F,)."""
    if not np.isfinite(covariance).all():
        return np.full(len(z), np.inf)
    lags = z[:, None] ** -np.arange(1.0, form.n + 1)
    P = covariance[: form.n, : form.n]
    return np.sqrt(np.einsum("fi,ij,fj->f", lags, P, lags.conj()).real.clip(0))


def response(form: Canonical, theta, covariance, draws, z):
    """Return G (k, F) at the points z, and the covariance (k, F, 2, 2) of its (real, imaginary) part.

    First order while the denominator is clear of zero, sampled where it is less so, infinite within CLEAR std of zero.
    """
    n, k, m = form.n, form.inputs, len(theta)
    num, den, lags = _parts(form, theta, z)
    G = ratio(num, den)
    if not np.isfinite(covariance).all():
        return G, np.broadcast_to(np.diag([np.inf, np.inf]), (k, len(z), 2, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        J = np.zeros((k, len(z), m), complex)
        for i in range(k):
            J[i, :, :n] = -(G[i] / den)[:, None] * lags[:, 1:]
            J[i, :, n * (i + 1) : n * (i + 2)] = lags[:, 1:] / den[:, None]
            if form.direct:
                J[i, :, form.direct_at + i] = 1 / den
        J = np.stack([J.real, J.imag], axis=2)
        C = J @ covariance @ J.swapaxes(-1, -2)
    std = denominator_std(form, covariance, z)
    for f in np.flatnonzero((std > SMALL * abs(den)) & (CLEAR * std < abs(den))):
        top, bottom, _ = _parts(form, draws(), z[f : f + 1])
        e = (top[..., 0] / bottom) - G[:, f]
        e = np.stack([e.real, e.imag], axis=-1)
        C[:, f] = np.einsum("ska,skb->kab", e, e) / len(e)
    C[:, (den == 0) | (CLEAR * std >= abs(den)) & (std > 0)] = np.diag([np.inf, np.inf])
    return G, C


def gain_interval(form: Canonical, theta, covariance, level):
    """Return the interval (k, 2) of the steady-state gains after Fieller (1954): exact for a ratio of Gaussians.

    The gains g with (num - g den)^2 <= q^2 var(num - g den); the whole line where the denominator may be zero.
    """
    from scipy.special import ndtri

    n, k = form.n, form.inputs
    if not np.isfinite(covariance).all():
        return np.tile([-np.inf, np.inf], (k, 1))
    q2 = ndtri(0.5 + level / 2) ** 2
    num, den, _ = _parts(form, theta, np.ones(1))
    h = np.zeros((k + 1, len(theta)))  # rows: den, then every num
    h[0, :n] = 1
    for i in range(k):
        h[i + 1, n * (i + 1) : n * (i + 2)] = 1
        if form.direct:
            h[i + 1, form.direct_at + i] = 1
    V = h @ covariance @ h.T
    found = np.empty((k, 2))
    for i in range(k):
        a = den[0] ** 2 - q2 * V[0, 0]
        b = num[i, 0] * den[0] - q2 * V[0, i + 1]
        c = num[i, 0] ** 2 - q2 * V[i + 1, i + 1]
        is_bounded = a > 0 and den[0] != 0
        half = np.sqrt(max(b * b - a * c, 0.0)) if is_bounded else 0.0
        found[i] = ((b - half) / a, (b + half) / a) if is_bounded else (-np.inf, np.inf)
    return found
