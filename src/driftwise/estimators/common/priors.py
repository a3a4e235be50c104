"""Priors, as estimators take them: a mean and a covariance in the user's order, checked, factored for the kernel."""

from __future__ import annotations

import numpy as np

from ...engine import ud, validation
from ...engine.errors import InputError

# Default prior variance in units of the data: a ridge of 1e-4. Much wider priors let directions that the inputs do
# not excite run away on measured records, and spoil a learnt scale while the first samples stand still.
WIDTH = 1e4


def mean_of(name: str, given, order) -> np.ndarray:
    """Return a prior mean, zero where none is given; ``order`` takes the user's order to the kernel's."""
    N = len(order)
    return (np.zeros(N) if given is None else validation.vector(name, given, N))[order]


def covariance_of(P0, order, units) -> np.ndarray:
    """Return a prior covariance; where none is given a wide one, ``units`` being its squared units."""
    return WIDTH * np.diag(units) if P0 is None else validation.covariance("P0", P0, len(order))[np.ix_(order, order)]


def factors_of(P) -> tuple[np.ndarray, np.ndarray]:
    """Return U, as the kernel packs it, and D of P = U D U'."""
    try:
        U, D = ud.factor(P)
    except ValueError:
        raise InputError("P0 must be a covariance: it has a negative eigenvalue. Was a precision given?") from None
    return U[ud.packed_indices(len(D))], D
