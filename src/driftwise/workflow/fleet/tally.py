"""`Tally`: what a fleet's samples amount to, series by series, in memory that does not grow with their number."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ...kernel.status import Status

COUNTED = {  # status bits that are counted as they are
    "missing": Status.MISSING_OUTPUT,
    "rejected": Status.REJECTED,
    "outliers": Status.OUTLIER,
    "jumps": Status.JUMP,
    "noise": Status.NOISE,
    "lost": Status.LOST,
}
UNUSED = ("late", "duplicate", "timeless", "early")  # rows of the table that were not used, by the reason why
INSTANTS = ("first_time", "last_time", "last_jump")
COLUMNS = (
    *("samples", "measured", "bad", "filled", "jumped", *UNUSED, *COUNTED),
    *("scored", "z2", "inside", "compared", "e2", "dy2", "y1", "y2", *INSTANTS, "last_y"),
)
_AT = {name: i for i, name in enumerate(COLUMNS)}
_NAN = [_AT[name] for name in (*INSTANTS, "last_y")]  # none yet
BAND = 1.96  # deviations that hold 95 % of a normal variable
SET_ASIDE = int(Status.REJECTED | Status.OUTLIER)


class Tally:
    """Counts and sums of each series of a fleet, in the order of ``fleet.keys``.

    | column | is |
    |---|---|
    | samples | taken, gaps that were filled included |
    | measured | of them, with an output (and a prediction of it) |
    | missing, rejected, outliers, jumps, noise, lost | samples whose status says so |
    | bad | rows with a cell that could not be read |
    | filled, jumped | missing ticks that were taken as samples without values; ticks beyond the longest gap, left out |
    | late, duplicate, timeless, early | rows not used: before the last one taken, at the same time as that, without a time, before the first measured output |
    | scored, z2, inside | samples on which the error bars are judged, their sum of z^2, how many within 1.96 deviations |
    | compared, e2, dy2 | samples on which forecasts are compared, the sum of e^2, the same had the last value been the forecast |
    | y1, y2 | over those compared, sum of y (less its level) and of its square |
    | first_time, last_time, last_jump | instants, NaN where there is none |
    | last_y | the last measured output, less its level |

    The first ``settle`` measured samples of a series (2 N + 10 if omitted) are neither scored nor compared: there the
    prior speaks. The numbers do not depend on how the samples were cut into stretches, bit for bit. With several outputs the
    counts are those of values, not of samples, except for samples, bad and filled.
    """  # noqa: E501

    def __init__(self, fleet, settle: int | None = None):
        estimator = fleet.estimators[0]
        self.outputs = fleet.crew.outputs
        self.settle = 2 * estimator.model.N + 10 if settle is None else settle
        self._columns = np.empty((len(COLUMNS), 0))
        self._size = 0
        self.grow(len(fleet))

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, name: str) -> np.ndarray:
        """The column of that name, (S,): a view, good until the tally grows."""
        if name not in _AT:
            raise InputError(f"a tally has no column {name!r}; it has {', '.join(COLUMNS)}")
        return self._columns[_AT[name], : self._size]

    @property
    def table(self) -> np.ndarray:
        """All of it, (S, columns): a view; columns are those of `COLUMNS`."""
        return self._columns[:, : self._size].T

    def restore(self, table) -> None:
        """Go on from a table that was kept."""
        self._size = 0
        self.grow(len(table))
        self._columns[:, : self._size] = np.asarray(table).T

    def grow(self, size: int) -> None:
        """Make room for so many series; new ones begin with nothing."""
        if size > self._columns.shape[1]:
            wider = np.empty((len(COLUMNS), max(size, self._columns.shape[1] * 5 // 4)))
            wider[:, : self._size] = self._columns[:, : self._size]
            self._columns = wider
        self._columns[:, self._size : size] = 0.0
        self._columns[_NAN, self._size : size] = np.nan
        self._size = max(size, self._size)

    def count(self, name: str, at, numbers=1) -> None:
        """Add to a column, for each series as often as it is named."""
        np.add.at(self[name], at, numbers)

    def add(self, taken, outs) -> None:
        """Take in what samples (a `Taken`) showed: ``outs`` (n, >= 4 p) of `Fleet.advance`."""
        raise NotImplementedError
