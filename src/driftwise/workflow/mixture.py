"""Bands of a mixture: quantiles, where a mean and a variance do not say enough."""

from __future__ import annotations

import numpy as np

NEWTON = 30


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
    for _ in range(NEWTON):
        up, down = (h[:, None] - offset) / scale, (-h[:, None] - offset) / scale
        excess = (weight * (below(up) - below(down))).sum(axis=1) - level
        slope = (weight * peak * (density(up) + density(down)) / scale).sum(axis=1)
        step = excess / np.maximum(slope, 1e-300)
        new = np.clip(h - step, h / 3, 3 * h)
        if np.all(np.abs(new - h) <= 1e-10 * h):
            return new
        h = new
    return h
