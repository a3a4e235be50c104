"""Bands of a mixture: quantiles, where a mean and a variance do not say enough."""

from __future__ import annotations

import numpy as np

STEPS = 200


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
    from scipy.special import ndtr, stdtr, stdtrit

    nu = np.minimum(dof, 1e8)[:, None]
    h = stdtrit(nu[:, 0], 0.5 + level / 2) * np.sqrt((weight * (scale**2 + offset**2)).sum(axis=1))
    is_normal = bool(np.isinf(dof).all())

    def below(z):
        return ndtr(z) if is_normal else stdtr(nu, z)

    def density(z):  # up to the constant of Student's t, which a step of Newton needs
        return np.exp(-0.5 * z * z) if is_normal else (1 + z * z / nu) ** (-(nu + 1) / 2)

    from scipy.special import gammaln

    peak = (
        1 / np.sqrt(2 * np.pi) if is_normal else np.exp(gammaln((nu + 1) / 2) - gammaln(nu / 2)) / np.sqrt(nu * np.pi)
    )
    low, high, last = np.zeros_like(h), np.full_like(h, np.inf), np.full_like(h, np.inf)
    for _ in range(STEPS):  # Newton, within a bracket that closes by bisection where it does not help
        up, down = (h[:, None] - offset) / scale, (-h[:, None] - offset) / scale
        excess = (weight * (below(up) - below(down))).sum(axis=1) - level
        slope = (weight * peak * (density(up) + density(down)) / scale).sum(axis=1)
        low, high = np.where(excess < 0, h, low), np.where(excess < 0, high, h)
        new = h - excess / np.maximum(slope, 1e-300)
        is_good = (new > low) & (new < high) & (np.abs(excess) < 0.5 * last)
        new = np.where(is_good, new, np.where(np.isinf(high), 3 * h, 0.5 * (low + high)))
        if np.all((np.abs(new - h) <= 1e-10 * h) | (excess == 0)):
            return new
        h, last = np.where(excess == 0, h, new), np.abs(excess)
    return h
