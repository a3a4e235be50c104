"""What inputs that nobody wrote do to y: those between the rows of an irregular clock, as a noise of known covariance.

Coloured and white inputs are Gaussian, and known at the rows. Of steps one knows before and after: when it came within
a gap is even. A loop counts as open, a bend as its mean slope. What is known of them is their mean, `expected`.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from .plant import Plant
from .simulation import COLOUR, Record, gain_factor, numerator, slope


def expected(plant: Plant, record: Record) -> np.ndarray:
    """Return the inputs (T, k) as they are expected by who knows the rows alone."""
    return np.column_stack([mean(plant.excitation, u, record.rows) for u in record.u.T])


def mean(excitation: str, u, rows) -> np.ndarray:
    """Return an input (T,) as it is expected, given its values at the rows; before and after all of them as these."""
    T = len(u)
    if excitation == "steps":
        return np.interp(np.arange(T), rows, u[rows])
    whole = law(excitation, T)
    return whole[:, rows] @ np.linalg.solve(whole[np.ix_(rows, rows)], u[rows])


def law(excitation: str, T: int) -> np.ndarray:
    """Return the covariance of a Gaussian input, (T, T)."""
    return toeplitz((COLOUR if excitation == "coloured" else 0.0) ** np.arange(T))


def spread(plant: Plant, record: Record, at) -> np.ndarray:
    """Return the covariance of y at the samples that are seen, (n, n) of ``at`` (T,), of all inputs."""
    T, found = plant.samples, np.zeros((int(at.sum()),) * 2)
    for i in range(len(plant.gains)):
        answer = lfilter(numerator(plant, i), plant.a, np.eye(1, T)[0])
        way = toeplitz(answer, np.zeros(T))[at] * gain_factor(plant, i) * slope(plant, record.u[:, i]).mean()
        found += way @ hidden(plant.excitation, record.u[:, i], record.rows) @ way.T
    return found


def hidden(excitation: str, u, rows) -> np.ndarray:
    """Return the covariance of an input (T, T), given its values at the rows."""
    T = len(u)
    if excitation == "steps":
        found = np.zeros((T, T))
        for a, b in pairwise(rows):
            share = np.arange(1, b - a) / (b - a)  # of the steps that came before
            found[a + 1 : b, a + 1 : b] = (u[b] - u[a]) ** 2 * (np.minimum.outer(share, share) - np.outer(share, share))
        return found
    whole = law(excitation, T)
    return whole - whole[:, rows] @ np.linalg.solve(whole[np.ix_(rows, rows)], whole[rows])
