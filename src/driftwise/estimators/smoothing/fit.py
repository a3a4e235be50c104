"""The drift a record is most likely under: noise-to-variance ratios by maximum likelihood."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .likelihood import Likelihood, Unknowns

STARTS = {"walk": (1e-2, 1e-4), "integrated": (1e-6,)}
BOUNDS = {"walk": (1e-9, 10.0), "integrated": (1e-12, 0.1)}
STRIDE = 3.0  # longest step in the logarithm of an NVR
NEWTON = 1.0  # a longer one finds other information than it had
NEAR = 1e-7  # of the log-likelihood: this much better is no better


class Fit(NamedTuple):
    """The most likely drift: NVRs (0 where none was found), and the likelihood there."""

    likelihood: Likelihood
    nvr: np.ndarray
    loglik: float
    s2: float


def given(likelihood: Likelihood, nvr) -> Fit:
    """Return the fit where the drift is known."""
    point = likelihood.at(nvr, with_gradient=False)
    return Fit(likelihood, nvr, point.loglik, point.s2)


def most_likely(likelihood: Likelihood, shared=False, starts=None, constant=()) -> Fit:
    """Return the drift of highest likelihood, one NVR for each parameter or one for all, climbing from each start.

    A drift at its lower bound is none: 0. The parameters of the indices ``constant`` have none.
    """
    unknowns, bounds = Unknowns(likelihood, shared, constant), np.log(BOUNDS[likelihood.drift])
    z = highest(unknowns.at, unknowns.curvature, starts or STARTS[likelihood.drift], unknowns.size, bounds)
    return given(likelihood, np.where(unknowns.groups @ z > bounds[0] + 1e-6, unknowns.nvr(z), 0.0))


def highest(at, curvature, starts, size, bounds) -> np.ndarray:
    """Return the best of what is found from each start (NVRs)."""
    begin = [np.broadcast_to(np.log(start), size) for start in starts]
    return max((climb(at, curvature, start, bounds) for start in begin), key=lambda found: found[1])[0]


def climb(at, curvature, z, bounds, most=80) -> tuple[np.ndarray, float]:
    """Return where ``at(z)`` = (value, gradient, ..) is highest, and how high: a damped Newton method in a box.

    The step is (B + damping)^-1 g for the coordinates that no bound holds back, and the damping grows until the value
    does (Levenberg 1944). B is Fisher's information while steps are long, then follows the gradient (BFGS).
    L-BFGS-B finds the same place, and spends ten times as long waiting for the threads of its linear algebra.
    """
    z, damping = np.array(z, float), 1e-3
    value, gradient, s2 = at(z)
    B = curvature(z, s2)
    for _ in range(most):
        is_free = ~(((z <= bounds[0]) & (gradient <= 0)) | ((z >= bounds[1]) & (gradient >= 0)))
        if not is_free.any():
            break
        step = np.zeros(len(z))
        step[is_free] = np.linalg.solve((B + damping * np.eye(len(z)))[is_free][:, is_free], gradient[is_free])
        to = np.clip(z + np.clip(step, -STRIDE, STRIDE), *bounds)
        if abs(gradient @ (to - z)) < NEAR:
            break
        found = at(to)
        if not found[0] > value:
            damping *= 10
            continue
        step, turn, gain = to - z, gradient - found[1], found[0] - value
        z, (value, gradient, s2), damping = to, found, max(damping / 10, 1e-6)
        if gain < NEAR:
            break
        Bs = B @ step
        if np.abs(step).max() > NEWTON:
            B = curvature(z, s2)
        elif turn @ step > 1e-2 * (step @ Bs):  # concave here (Broyden, Fletcher, Goldfarb and Shanno 1970)
            B = B - np.outer(Bs, Bs) / (step @ Bs) + np.outer(turn, turn) / (turn @ step)
    return z, value
