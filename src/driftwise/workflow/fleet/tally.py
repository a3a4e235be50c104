"""`Tally`: what a fleet's samples amount to, series by series, in memory that does not grow with their number."""

from __future__ import annotations

import numpy as np

from ...kernel.status import Status
from .columns import Columns
from .samples import starts_of

COUNTED = {  # status bits that are counted as they are
    "missing": Status.MISSING_OUTPUT,
    "rejected": Status.REJECTED,
    "outliers": Status.OUTLIER,
    "jumps": Status.JUMP,
    "noise": Status.NOISE,
    "lost": Status.LOST,
}
UNUSED = ("late", "duplicate", "timeless", "early")  # rows of the table that are no samples, by the reason why
SUMS = ("scored", "z2", "inside", "compared", "e2", "dy2", "y1", "y2")
LAST = ("first_time", "last_time", "last_jump", "last_y")
COLUMNS = ("samples", "measured", "bad", "filled", "jumped", *UNUSED, *COUNTED, *SUMS, *LAST)
STRETCH = 1 << 15  # samples at once: what is worked on stays in the cache
BAND = 1.96  # deviations that hold 95 % of a normal variable
SET_ASIDE = int(Status.REJECTED | Status.OUTLIER)


class Tally(Columns):
    """Counts and sums of each series of a fleet, in the order of ``fleet.keys``: ``tally["late"]`` is (S,).

    | column | is |
    |---|---|
    | samples | taken, gaps that were filled included |
    | measured | of them, with an output that could be compared to its prediction |
    | missing, rejected, outliers, jumps, noise, lost | outputs whose status says so |
    | bad | samples with a cell that could not be read |
    | filled, jumped | ticks without a row taken as samples without values; ticks beyond the longest gap, left out |
    | late, duplicate | rows not used: before the last sample taken, and at its very instant |
    | timeless, early | rows not used: without a time, and before the first measured output |
    | scored, z2, inside | outputs by which error bars are judged, their sum of e^2/variance, how many within 1.96 std |
    | compared, e2, dy2 | outputs by which forecasts are judged, sum of e^2, the same were the last value the forecast |
    | y1, y2 | sum of those compared (less the level of the series), and of their squares |
    | first_time, last_time, last_jump | instants, NaN where there is none |
    | last_y | the last measured output less its level (those of further outputs: last_y2, ...) |

    The first ``settle`` measured samples of a series (2 N + 10 if omitted) are neither scored nor compared: there the
    prior speaks. The numbers do not depend, bit for bit, on how samples were cut into stretches.

    Bad at: the tails of a learnt scale and of mixtures, whose 95 % band is not 1.96 deviations wide; `Summary`, which
    has one series, knows better.
    """

    def __init__(self, fleet, settle: int | None = None):
        self.outputs = fleet.crew.outputs
        self.settle = 2 * fleet.estimators[0].model.N + 10 if settle is None else settle
        more = [f"last_y{j}" for j in range(2, self.outputs + 1)]
        super().__init__(dict.fromkeys(COLUMNS, 0.0) | dict.fromkeys([*LAST, *more], np.nan), len(fleet))
        self._last_y = ["last_y", *more]

    def count(self, name: str, at, numbers=1.0) -> None:
        """Add numbers to the series they belong to, one after the other."""
        np.add.at(self[name], at, numbers)

    def add(self, taken, outs) -> None:
        """Take in what samples (a `Taken`) showed: ``outs`` (n, 4 p or more) of `Fleet.advance`."""
        for start in range(0, len(outs), STRETCH):
            stop = start + STRETCH
            self._add(type(taken)(*(column[start:stop] for column in taken)), outs[start:stop])

    def _add(self, taken, outs) -> None:
        self.grow(int(taken.at[-1]) + 1)
        starts, p = starts_of(taken.at), self.outputs
        series, lengths = taken.at[starts[:-1]], np.diff(starts)
        self["samples"][series] += lengths
        for name, flags in (("bad", taken.bad), ("filled", taken.filled)):
            if flags.any():
                self.count(name, taken.at[flags])
        first = self["first_time"][series]
        self["first_time"][series] = np.where(np.isnan(first), taken.time[starts[:-1]], first)
        self["last_time"][series] = taken.time[starts[1:] - 1]

        is_measured = np.isfinite(outs[:, p : 2 * p]).any(axis=1)
        is_settled = self._settled(is_measured, taken.at, starts)
        for j in range(p):
            self._output(j, taken, outs[:, j::p], is_settled, starts)

    def _settled(self, is_measured, at, starts):
        """Return which samples come after the first ``settle`` measured ones; count those measured."""
        series = at[starts[:-1]]
        before = self["measured"][series]
        self["measured"][series] += np.add.reduceat(is_measured, starts[:-1], dtype=np.int64)
        if before.min() >= self.settle:
            return np.ones(len(at), bool)
        so_far = np.cumsum(is_measured)
        so_far -= np.repeat(so_far[starts[:-1]] - is_measured[starts[:-1]] - before.astype(np.int64), np.diff(starts))
        return so_far > self.settle

    def _output(self, j, taken, outs, is_settled, starts) -> None:
        """Take in one output: its prediction, innovation, variance and status are columns of ``outs``."""
        at, y, e, variance = taken.at, taken.ys[:, j], outs[:, 1].copy(), outs[:, 2].copy()
        status = outs[:, 3].astype(np.int64)
        met = int(np.bitwise_or.reduce(status))
        for name, bit in COUNTED.items():
            if met & bit:
                self.count(name, at[status & int(bit) != 0])
        if met & Status.JUMP:
            jumped = status & int(Status.JUMP) != 0
            self["last_jump"][at[jumped]] = taken.time[jumped]  # the last of a series stays

        naive = self._naive(self._last_y[j], at, y)
        is_there = is_settled & np.isfinite(e)
        compared, scored = is_there & np.isfinite(naive), is_there & (variance > 0)
        if met & SET_ASIDE:
            compared &= status & int(Status.REJECTED) == 0
            scored &= status & SET_ASIDE == 0
        self._sums(at, starts, compared, "compared", e2=e * e, dy2=naive * naive, y1=y, y2=y * y)
        with np.errstate(divide="ignore", invalid="ignore"):
            z2 = e * e / variance
        self._sums(at, starts, scored, "scored", z2=z2, inside=z2 <= BAND**2)

    def _sums(self, at, starts, where, count, **columns) -> None:
        """Add up columns where they count, sample by sample, and how many those are."""
        if not where.all():
            at, columns = at[where], {name: column[where] for name, column in columns.items()}
            starts = starts_of(at)
        begins, lengths = starts[:-1], np.diff(starts)
        if not len(begins):
            return
        series = at[begins]
        self[count][series] += lengths
        exact = [name for name, column in columns.items() if column.dtype == bool]
        for name in exact:
            self[name][series] += np.add.reduceat(columns.pop(name), begins, dtype=np.int64)
        which, names = np.repeat(np.arange(len(series)), lengths), list(columns)
        for pair in (names[i : i + 2] for i in range(0, len(names), 2)):  # two at once, as complex numbers
            total, more = np.empty(len(series), complex), np.empty(len(at), complex)
            total.real, total.imag = self[pair[0]][series], self[pair[-1]][series]
            more.real, more.imag = columns[pair[0]], columns[pair[-1]]
            np.add.at(total, which, more)
            self[pair[0]][series], self[pair[-1]][series] = total.real, total.imag

    def _naive(self, name, at, y):
        """Return each output less the last one measured before it in its series, NaN where there is none."""
        is_there = np.isfinite(y)
        everything = is_there.all()
        where = slice(None) if everything else np.flatnonzero(is_there)
        at, known = at[where], y[where]
        if not len(known):
            return np.full(len(y), np.nan)
        starts, step = starts_of(at), np.empty(len(known))
        step[1:] = known[1:] - known[:-1]
        series = at[starts[:-1]]
        step[starts[:-1]] = known[starts[:-1]] - self[name][series]
        self[name][series] = known[starts[1:] - 1]
        if everything:
            return step
        full = np.full(len(y), np.nan)
        full[where] = step
        return full
