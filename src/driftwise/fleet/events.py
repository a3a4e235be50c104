"""What happened in a fleet, as it passes by: one entry an event, whatever the length of the run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..engine.status import MEANING, Status
from ..results.events import jump

MOST = 1000  # events of a series that are told; all are counted
RUNS = {  # what is told when it has lasted so many samples of a series
    "NOISE": (int(Status.NOISE), 1),
    "LOST": (int(Status.LOST), 1),
    "OUTLIERS": (int(Status.OUTLIER | Status.REJECTED), 5),
    "SILENT": (int(Status.MISSING_OUTPUT), 100),
}
TEXTS = {
    "NOISE": MEANING[Status.NOISE],
    "LOST": MEANING[Status.LOST],
    "OUTLIERS": f"{RUNS['OUTLIERS'][1]} outliers in a row",
    "SILENT": f"{RUNS['SILENT'][1]} samples in a row without an output",
}
KINDS = "JUMP", *RUNS


class Seen(NamedTuple):
    """Events, in the order of their samples."""

    time: np.ndarray
    sample: np.ndarray  # number in its series, from 1
    row: np.ndarray  # of the table
    kind: list[str]  # JUMP, or one of `RUNS`
    text: list[str]
    statistic: np.ndarray  # the detector's over its threshold, NaN where there is none
    since: np.ndarray  # samples ago that it began, by the detector, NaN where it does not say
    parameter: list[str | None]


def nothing() -> tuple[np.ndarray, Seen]:
    """Return no events, of no rows."""
    none, numbers = np.zeros(0), np.zeros(0, np.int64)
    return numbers, Seen(none, numbers, numbers, [], [], none, none, [])


class FleetEvents:
    """Finds the events of a fleet's samples, stretch by stretch: the same whatever the stretches.

    A jump is an event; a run of samples with the same trouble is one, told when it has lasted (`RUNS`). Of one series
    at most 1000 are told, or ``most`` (None: all). ``table`` (S, 5) is all it remembers: the length of the run of each
    trouble, and events told.
    """

    def __init__(self, fleet, most: int | None = MOST):
        self.fleet, self.estimator = fleet, fleet.estimators[0]
        self.most = float("inf") if most is None else most
        self.table = np.zeros((0, len(RUNS) + 1))

    @property
    def reported(self) -> int:
        """How many were told."""
        return int(np.minimum(self.table[:, -1], self.most).sum())

    def grow(self) -> None:
        """Make room for the series that the fleet has now."""
        if len(self.table) < len(self.fleet):
            more = np.zeros((len(self.fleet) - len(self.table), self.table.shape[1]))
            self.table = np.concatenate([self.table, more])

    def take(self, taken, outs, sample) -> tuple[np.ndarray, Seen]:
        """Return rows of the fleet and events of samples taken, whose numbers in their series are ``sample``."""
        at = taken.at
        self.grow()
        p = self.fleet.crew.outputs
        status = outs[:, 3 * p].astype(np.int64)
        for i in range(1, p):
            status |= outs[:, 3 * p + i].astype(np.int64)
        found = [np.flatnonzero(status & int(Status.JUMP))]
        start = np.flatnonzero(np.append(True, at[1:] != at[:-1])) if len(at) else np.zeros(0, np.int64)
        for i, (bits, least) in enumerate(RUNS.values()):
            found.append(self._lasting((status & bits) != 0, at, start, i, least))
        which, kind = np.concatenate(found), np.repeat(np.arange(len(found)), [len(f) for f in found])
        order = np.lexsort([kind, which])
        which, kind = which[order], kind[order]
        if not len(which):
            return nothing()
        is_first = self._first(at[which])
        which, kind = which[is_first], kind[is_first].tolist()
        return at[which], self._described(which, kind, taken, outs[which], sample[which])

    def _lasting(self, on, at, start, i: int, least: int) -> np.ndarray:
        """Return the samples at which a run of trouble ``i`` has lasted ``least`` samples; remember runs under way."""
        carried, rows = self.table[:, i], at[start]
        if not on.any():
            carried[rows] = 0
            return np.zeros(0, np.int64)
        number = np.arange(len(on))
        before = np.where(on, -1, number)  # the last sample without it
        before[start] = np.where(on[start], start - 1, start)
        before = np.maximum.accumulate(before)
        length = (number - before).astype(float)
        first = np.repeat(start, np.diff(np.append(start, len(on))))
        goes_on = before < first
        length[goes_on] += carried[at[goes_on]]
        carried[rows] = length[np.append(start[1:], len(on)) - 1]
        return np.flatnonzero(on & (length == least))

    def runs(self, row) -> list[tuple[str, float, int]]:
        """Return kind, length and the length that is told of each run under way in a row of the ``table``."""
        return [(kind, float(length), least) for (kind, (_, least)), length in zip(RUNS.items(), row)]

    def _first(self, at) -> np.ndarray:
        """Say which of these events, of the rows ``at`` in ascending order, are told; count them."""
        reported = self.table[:, -1]
        start = np.flatnonzero(np.append(True, at[1:] != at[:-1])) if len(at) else np.zeros(0, np.int64)
        counts = np.diff(np.append(start, len(at)))
        rank = np.arange(len(at)) - np.repeat(start, counts) + reported[at]
        reported[at[start]] += counts
        return rank < self.most

    def _described(self, which, kind, taken, outs, sample) -> Seen:
        """Return what is known of the events of these kinds."""
        est = self.estimator
        names, watches = est.names, est.watches
        has_alarm = "which" in est.columns and self.fleet.crew.outputs == 1
        alarms = outs[:, 5:8].copy() if has_alarm else np.full((len(which), 3), np.nan)
        alarms[np.array(kind) > 0] = np.nan
        jumps = {
            i: jump(int(sample[i]), 0.0, names, alarms[i] if has_alarm else None, watches)
            for i, k in enumerate(kind)
            if k == 0
        }
        texts = [jumps[i].text if i in jumps else TEXTS[KINDS[k]] for i, k in enumerate(kind)]
        parameters = [jumps[i].parameter if i in jumps else None for i in range(len(kind))]
        since = np.abs(alarms[:, 1])
        words = [KINDS[k] for k in kind]
        return Seen(taken.time[which], sample, taken.source[which], words, texts, alarms[:, 0], since, parameters)
