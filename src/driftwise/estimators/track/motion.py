"""Speed, course and turn rate of a mean and covariance of [E, vE, aE, N, vN, aN], by the delta method."""

from __future__ import annotations

import numpy as np

from . import bank


def unpacked(outs, C):
    """Return mean (.., 3C) and covariance (.., 3C, 3C) of the state in rows of a trace."""
    n, at = 3 * C, bank.at_covariance(C)
    i, j = np.triu_indices(n)
    V = np.empty((*outs.shape[:-1], n, n))
    V[..., i, j] = V[..., j, i] = outs[..., at : at + len(i)]
    return outs[..., bank.at_state(C) : bank.at_state(C) + n], V


def _along(gradient, V):
    """Return the standard deviation of a function with this gradient."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.maximum(np.einsum("...i,...ij,...j->...", gradient, V, gradient), 0.0))


def turning(x, V):
    """Return the turn rate, rad/s, positive to the right, and its standard deviation; NaN at rest."""
    vE, aE, vN, aN = x[..., 1], x[..., 2], x[..., 4], x[..., 5]
    with np.errstate(invalid="ignore", divide="ignore"):
        v2 = vE * vE + vN * vN
        omega = (aE * vN - aN * vE) / v2
        zero = np.zeros_like(omega)
        slope = np.stack(
            [zero, (-aN - 2 * omega * vE) / v2, vN / v2, zero, (aE - 2 * omega * vN) / v2, -vE / v2], axis=-1
        )
        return omega, _along(slope, V)


def moving(x, V):
    """Return speed and course (rad clockwise from North) with their standard deviations: (s, sd, course, sd)."""
    vE, vN = x[..., 1], x[..., 4]
    speed = np.hypot(vE, vN)
    zero = np.zeros_like(speed)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.stack([zero, vE / speed, zero, zero, vN / speed, zero], axis=-1)
        across = np.stack([zero, vN, zero, zero, -vE, zero], axis=-1) / (speed * speed)[..., None]
        return speed, _along(along, V), np.arctan2(vE, vN), _along(across, V)
