"""The smoothed record of a grey box: state and physical parameters in their units, given all samples."""

from __future__ import annotations

import numpy as np

from ...results.smoothed import Smoothed
from .transform import to_units

CALM = 0.1  # deviations that a path moved by at last, from which its bars are not to be believed


class GreyBoxSmoothed(Smoothed):
    """Columns of a smoothed record, time first; ``moved``: deviations by which it moved at last, 0.001 where settled.

    Deviations and covariances of parameters are by slopes, as wide as residuals that are not white make them.
    """

    def __init__(self, estimator, y, u, table, keep, state, moved, time):
        with np.errstate(over="ignore"):
            table = _in_units(estimator, table, state["wide"], keep)
        super().__init__(estimator, y, u, table, keep, state, None, time)
        self.moved = moved

    def __repr__(self):
        said = "" if self.moved < CALM else f", not settled: it moved by {self.moved:.2g} deviations at last"
        return super().__repr__()[:-1] + said + ")"


def _in_units(est, table, wide, keep: str) -> np.ndarray:
    """Return rows with the transformed parameters in their units."""
    n, N = est.model.n, est.model.N
    table = table.copy()
    table[:, n:N], rates = to_units(est.formulas.free, table[:, n:N])
    by = np.concatenate([np.ones((len(table), n)), rates * np.sqrt(wide)], axis=1)
    if keep == "std":
        table[:, N:] *= by
    elif keep == "covariance":
        j, i = np.tril_indices(N)  # the upper triangle, column by column
        table[:, N:] *= by[:, i] * by[:, j]
    return table
