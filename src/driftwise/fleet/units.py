"""The units of a series: levels and typical sizes of its first rows, for many series at once."""

from __future__ import annotations

from typing import Any

import numpy as np

LEAST, LARGEST = 1e-100, 1e100  # sizes of data that have a square


def levels(values, center: bool) -> np.ndarray:
    """Return the mean of the finite entries of (R, m, c) along m, (R, c); 0 where there are none, or not centred.

    Sums run from the first entry to the last, so that it does not matter which series are taken together.
    """
    if not center or not values.shape[1]:
        return np.zeros((len(values), values.shape[2]))
    is_there = np.isfinite(values)
    total = np.cumsum(np.where(is_there, values, 0.0), axis=1)[:, -1]
    mean = total / np.maximum(is_there.sum(axis=1), 1)
    low = np.min(np.where(is_there, values, np.inf), axis=1)
    high = np.max(np.where(is_there, values, -np.inf), axis=1)
    return np.where(low == high, np.where(np.isfinite(low), low, 0.0), mean)  # a constant is its own mean, to the bit


def sizes(values, level) -> np.ndarray:
    """Return the power of two nearest to the root mean square of (R, m, c) less (R, c), (R, c).

    Of a constant it is the size of the constant; 1 where it is zero, or nothing was measured.
    """
    centred = _sizes(values - level[:, None])
    return np.where(np.isnan(centred), np.nan_to_num(_sizes(level[:, None]), nan=1.0), centred)


def _sizes(values):
    """Return the same of the values as they are, NaN where all are zero, missing or absurd."""
    values = np.abs(values)
    counts = (values > LEAST) & (values < LARGEST)
    values = np.where(counts, values, 0.0)
    exponent = np.frexp(values.max(axis=1, initial=0.0))[1]
    squares = np.cumsum(np.ldexp(values, -exponent[:, None]) ** 2, axis=1)[:, -1]
    number = counts.sum(axis=1)
    rms = np.sqrt(squares / np.maximum(number, 1))
    power = np.round(np.log2(np.where(number > 0, rms, 1.0))).astype(int)
    return np.where(number > 0, np.ldexp(1.0, exponent + power), np.nan)


class Settings:
    """The estimator of a fleet in units of so many outputs and inputs; one object for equal units."""

    def __init__(self, fleet):
        self.fleet = fleet
        self._known: dict[tuple, Any] = {}

    def of(self, sizes) -> Any:
        """Return the one in these sizes (p + k,) of data; the fleet's own where it has no units."""
        base, p = self.fleet.estimators[0], self.fleet.crew.outputs
        if not {"y_scale", "u_scale"} <= set(base.options):
            return base
        if tuple(sizes) not in self._known:
            like = np.tile(sizes, (2, 1))  # data of these very sizes
            y = like[:, :p] if base.outputs is not None else like[:, 0]
            found = base.scaled_to(y, like[:, p:] if len(sizes) > p else None)
            same = [one for one in self.fleet.estimators if _scales(one) == _scales(found)]  # one that was loaded
            self._known[tuple(sizes)] = same[0] if same else found
        return self._known[tuple(sizes)]


def _scales(estimator) -> str:
    return repr([estimator.options[name] for name in ("y_scale", "u_scale")])
