"""What inputs did between the rows of an irregular clock, as far as their own correlation tells."""

from __future__ import annotations

import math

import numpy as np

from .scattered_noise import FEW, scattered


def expected(u, rows) -> np.ndarray:
    """Return an input (T,) that is known at ``rows`` alone, elsewhere as expected: a process of the first order.

    Between two rows it is (sinh(b) x + sinh(a) x') / sinh(a + b), with a and b the times to these in units of its own
    time constant: a straight line where that is long, the mean where that is short. Before the first row and after the
    last it keeps their values.

    Examples
    --------
    >>> expected(np.array([0.0, 0.0, 0.0, 3.0]), np.array([0, 3])).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    t, x = np.arange(len(u)), u[rows]
    if len(rows) < FEW:
        return np.interp(t, rows, x) if len(rows) else u
    middle = float(x.mean())
    phi = (*scattered(x - middle, rows), 0.0)[0]
    k = np.clip(np.searchsorted(rows, t, side="right") - 1, 0, len(rows) - 2)
    at = np.clip(t, rows[0], rows[-1])
    a, b = at - rows[k], rows[k + 1] - at
    return middle + _share(phi, a, b) * (x[k] - middle) + _share(phi, b, a) * (x[k + 1] - middle)


def _share(phi: float, a, b) -> np.ndarray:
    """Return the weight of the row that is ``a`` away, where the other one is ``b`` away."""
    if phi <= 0.0:
        return (a == 0).astype(float)
    pace = -math.log(phi)
    return np.exp(-pace * a) * np.expm1(-2 * pace * b) / np.expm1(-2 * pace * (a + b))
