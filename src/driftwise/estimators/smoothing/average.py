"""The parameters given a record, averaged over the drifts it leaves open.

Where a record hardly tells how fast a parameter drifts, the most likely drift is often none, and bars that take it for
known are too short. The posterior of z = log NVR is taken for Gaussian about its mode, with Fisher's information and a
prior that pulls every z towards their mean (deviation 1.5) and that mean towards a middling drift (deviation 4); the
moments are averaged over 2 p points, at sqrt(p) deviations either way along the axes of that Gaussian, which have its
mean and covariance (the cubature rule of Arasaratnam and Haykin 2009).
"""

from __future__ import annotations

import numpy as np

from .fit import BOUNDS, STARTS, Fit, Unknowns, highest

MIDDLE = {"walk": 1e-3, "integrated": 1e-7}
COMMON, APART_BY = 4.0, 1.5  # deviations of the mean of log NVR, and of each one from it


def points(fit: Fit, shared=False) -> list[np.ndarray]:
    """Return the NVRs (n,) to average over, of equal weight."""
    unknowns, drift = Unknowns(fit.likelihood, shared), fit.likelihood.drift
    p, middle = unknowns.size, np.log(MIDDLE[drift])
    mean = np.full((p, p), 1 / p)
    prior = (np.eye(p) - mean) / APART_BY**2 + mean / (p * COMMON**2)

    def at(z):
        point = unknowns.at(z)
        pull = prior @ (z - middle)
        return point._replace(loglik=point.loglik - 0.5 * (z - middle) @ pull, gradient=point.gradient - pull)

    def curvature(z, s2):
        return unknowns.curvature(z, s2) + prior

    least, most = np.log(BOUNDS[drift])
    z = highest(at, curvature, STARTS[drift], p, (least, most))
    variances, axes = np.linalg.eigh(np.linalg.inv(curvature(z, at(z).s2)))
    steps = np.sqrt(p * np.maximum(variances, 0.0)) * axes
    return [unknowns.nvr(np.clip(z + sign * step, 2 * least, most)) for step in steps.T for sign in (1, -1)]


def average(moments: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Return mean (T, n) and covariance (T, upper triangle by columns) of a mixture of equal parts."""
    first = moments[0][0]
    j, i = np.tril_indices(first.shape[1])
    away = np.mean([mean - first for mean, _ in moments], axis=0)
    spread = np.mean([P + (mean - first)[:, i] * (mean - first)[:, j] for mean, P in moments], axis=0)
    return first + away, spread - away[:, i] * away[:, j]
