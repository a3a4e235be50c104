"""The loop of a run: batch, intake, fleet, counts, what is written, and a checkpoint now and then."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...estimators import door
from . import store
from .events import FleetEvents
from .fleet import Fleet
from .intake import Intake


class Estimates(NamedTuple):
    """What was estimated at some samples, in the units of the table."""

    at: np.ndarray  # (n,) rows of the fleet
    time: np.ndarray
    sample: np.ndarray  # number in its series, from 1
    source: np.ndarray  # row of the table
    y: np.ndarray  # (n, p)
    prediction: np.ndarray  # (n, p)
    innovation: np.ndarray  # (n, p)
    std: np.ndarray  # (n, p) of the prediction
    status: np.ndarray  # (n, p)
    parameters: np.ndarray  # (n, N)
    parameters_std: np.ndarray  # (n, N)


class FleetRun:
    """A fleet with all that its samples go through; one file keeps it whole between two batches.

    Parameters
    ----------
    fleet : Fleet
    sinks : takes what is to be written: ``take(estimates)``, ``happened(at, seen)``
    every : samples of a series from one row of estimates to the next; 0: none
    options : of the intake
    """

    def __init__(self, fleet: Fleet, sinks: Any, every: int = 100, **options):
        self.fleet, self.sinks, self.every = fleet, sinks, door.count("every", every)
        self.intake = Intake(fleet, **options)
        self.tally, self.events = self.intake.tally, FleetEvents(fleet)
        self.rows = 0
        est, p = fleet.estimators[0], fleet.crew.outputs
        self._head, self._n, self._N = est.columns * p, est.model.n, est.model.N
        self._columns = self._head + (2 * self._N if every else 0)

    def go(self, source, batch: int, after: Callable[[], None]) -> None:
        """Take what is left of a table, batch by batch; ``after`` is called behind each of them."""
        for rows in source.batches(batch, self.rows):
            for taken in self.intake.take(rows):
                self._take(taken)
            self.rows = rows.first + len(rows.codes)
            after()
        for taken in self.intake.rest():
            self._take(taken)

    def _take(self, taken) -> None:
        """Advance the fleet by some samples, count them, and hand on what is to be written."""
        outs = self.fleet.advance(taken.at, taken.ys, taken.us, self._columns)
        self.tally.grow(len(self.fleet))
        sample = _numbers(taken.at, self.tally["samples"])
        if self.every:
            chosen = np.flatnonzero(sample % self.every == 0)
            self.sinks.take(self._estimates(taken, outs, sample, chosen))
        self.sinks.happened(*self.events.take(taken, outs, sample))
        self.tally.add(taken, outs)

    def _estimates(self, taken, outs, sample, chosen) -> Estimates:
        """Return what was estimated at the chosen samples."""
        p, first = self.fleet.crew.outputs, self._head
        at, outs = taken.at[chosen], outs[chosen]
        level = self.intake.levels[0][at]
        prediction, innovation, variance, status = (outs[:, p * i : p * i + p] for i in range(4))
        theta, std = (outs[:, first + i * self._N + self._n : first + (i + 1) * self._N] for i in range(2))
        return Estimates(
            at, taken.time[chosen], sample[chosen], taken.source[chosen], taken.ys[chosen] + level, prediction + level,
            innovation, np.sqrt(variance), status.astype(np.int32), theta, std,
        )  # fmt: skip

    # --- keeping -------------------------------------------------------------------------------------------

    def keep(self, path, facts: dict[str, Any]) -> str:
        """Write all of it, and facts of the caller's; return the checksum."""
        arrays = {"tally": self.tally.table, "events": self.events.table} if len(self.fleet) else {}
        if arrays:
            arrays |= {f"intake.{name}": values for name, values in self.intake.snapshot().items()}
        return store.write(self.fleet, path, arrays, facts | {"rows": self.rows})

    def restore(self, kept: store.Kept) -> None:
        """Go on from what `keep` wrote; the fleet is the one that was kept."""
        self.rows = kept.facts["rows"]
        if kept.arrays:
            self.tally.restore(kept.arrays["tally"])
            self.events.table = kept.arrays["events"]
            marked = {name: values for name, values in kept.arrays.items() if name.startswith("intake.")}
            self.intake.restore({name.removeprefix("intake."): values for name, values in marked.items()})


def _numbers(at, before) -> np.ndarray:
    """Return the number of each sample in its series, from 1, ``at`` ascending, so many having come before."""
    if not len(at):
        return np.zeros(0, np.int64)
    start = np.flatnonzero(np.append(True, at[1:] != at[:-1]))
    shift = before[at[start]].astype(np.int64) + 1 - start
    return np.arange(len(at)) + np.repeat(shift, np.diff(np.append(start, len(at))))
