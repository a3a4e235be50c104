"""Bands of predictions: quantiles of Student's law, and of mixtures, where mean and variance do not say enough."""

from __future__ import annotations

import math

import numpy as np

STEPS = 200
CLOSE = 1e-7  # relative, of a half-width


def quantile(level, dof):
    """Return the quantile of Student's t, of the normal law where ``dof`` is infinite."""
    from scipy.special import ndtri, stdtrit

    dof = np.asarray(dof, float)
    if np.all(np.isinf(dof)):
        return np.full(dof.shape, ndtri(level))
    # one per distinct value: a long record has few (and large ones are normal to five digits)
    values, back = np.unique(np.where(dof > 1e5, math.inf, dof), return_inverse=True)
    return np.where(np.isinf(values), ndtri(level), stdtrit(np.where(np.isinf(values), 1, values), level))[back]


def normal_score(lower, upper) -> np.ndarray:
    """Return the deviate of N(0, 1) with these probabilities below and above it; NaN where they are."""
    from scipy.special import ndtri

    return np.where(lower < upper, ndtri(np.maximum(lower, 1e-300)), -ndtri(np.maximum(upper, 1e-300)))


def sides(e, weight, offset, scale, dof) -> list[np.ndarray]:
    """Return the probability of a mixture below and above e (T,) from its mean, [(T,), (T,)]; see `half_width`."""
    from scipy.special import ndtr, stdtr

    z = (e[:, None] - offset) / scale
    far = ndtr(-abs(z)) if np.isinf(dof).all() else stdtr(np.minimum(dof, 1e8)[:, None], -abs(z))
    return [(weight * np.where(side * z < 0, far, 1 - far)).sum(axis=1) for side in (1, -1)]


def share_within(h, weight, offset, scale, dof) -> np.ndarray:
    """Return with what probability the mixture lies within its mean -h .. +h, (T,); arguments as in `half_width`."""
    from scipy.special import ndtr, stdtr

    up, down = (h[:, None] - offset) / scale, (-h[:, None] - offset) / scale
    if np.isinf(dof).all():
        return (weight * (ndtr(up) - ndtr(down))).sum(axis=1)
    nu = np.minimum(dof, 1e8)[:, None]
    return (weight * (stdtr(nu, up) - stdtr(nu, down))).sum(axis=1)


def half_width(level, weight, offset, scale, dof) -> np.ndarray:
    """Return h such that the mixture lies within its mean -h .. +h with probability ``level``, (T,).

    Parameters
    ----------
    level : float
    weight, offset, scale : (T, M)
        Of each component: its weight, its mean less that of the whole, its scale.
    dof : (T,)
        Degrees of freedom of all components at a sample (Student-t; infinite: normal).
    """
    from scipy.special import stdtrit

    found = stdtrit(np.minimum(dof, 1e8), 0.5 + level / 2)
    found = found * np.sqrt((weight * (scale**2 + offset**2)).sum(axis=1))
    low, high, last = np.zeros_like(found), np.full_like(found, np.inf), np.full_like(found, np.inf)
    open_ = np.arange(len(found))  # samples not yet settled
    for _ in range(STEPS):  # Newton, within a bracket that closes by bisection where it does not help
        if not len(open_):
            break
        h, parts = found[open_], (weight[open_], offset[open_], scale[open_], dof[open_])
        excess = share_within(h, *parts) - level
        low[open_] = np.where(excess < 0, h, low[open_])
        high[open_] = np.where(excess < 0, high[open_], h)
        new = h - excess / np.maximum(density_at(h, *parts), 1e-300)
        is_good = (new > low[open_]) & (new < high[open_]) & (np.abs(excess) < 0.5 * last[open_])
        middle = np.where(np.isinf(high[open_]), 3 * h, 0.5 * (low[open_] + high[open_]))
        new = np.where(excess == 0, h, np.where(is_good, new, middle))
        found[open_], last[open_] = new, np.abs(excess)
        open_ = open_[np.abs(new - h) > CLOSE * h]
    return found


def density_at(h, weight, offset, scale, dof) -> np.ndarray:
    """Return the derivative of `share_within` by h."""
    from scipy.special import gammaln

    up, down = (h[:, None] - offset) / scale, (-h[:, None] - offset) / scale
    if np.isinf(dof).all():
        return (weight / scale * (np.exp(-0.5 * up * up) + np.exp(-0.5 * down * down))).sum(axis=1) / np.sqrt(2 * np.pi)
    nu = np.minimum(dof, 1e8)[:, None]
    tails = (1 + up * up / nu) ** (-(nu + 1) / 2) + (1 + down * down / nu) ** (-(nu + 1) / 2)
    peak = np.exp(gammaln((nu + 1) / 2) - gammaln(nu / 2)) / np.sqrt(nu * np.pi)
    return (weight * peak / scale * tails).sum(axis=1)


def unpack(packed, N) -> np.ndarray:
    """Return full covariances (T, N, N) of rows that list their upper triangles by columns."""
    full = np.empty((len(packed), N, N))
    j, i = np.tril_indices(N)
    full[:, i, j] = full[:, j, i] = packed
    return full
