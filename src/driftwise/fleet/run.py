"""The loop of a run: batch, intake, fleet, counts, what is written, and a checkpoint now and then."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from . import store
from .events import FleetEvents
from .fleet import Fleet
from .grouping import stable_order
from .intake import Intake
from .samples import rank_of, starts_of

TURNS = 32  # in which the samples that are told are taken apart from the others; more are not worth it


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
        self.fleet, self.sinks, self.every = fleet, sinks, validation.count("every", every)
        self.intake = Intake(fleet, **options)
        self.tally, self.events = self.intake.tally, FleetEvents(fleet)
        self.rows = 0
        est = fleet.estimators[0]
        self._head, self._n, self._N = est.n_columns, est.model.n, est.model.N

    def go(self, source, batch: int, after: Callable[[], None]) -> None:
        """Take what is left of a table, batch by batch; ``after`` is called behind each of them."""
        for rows in source.batches(batch, self.rows):
            self.take(rows)
            after()
        self.end()

    def take(self, rows) -> None:
        """Take a batch of a table."""
        for taken in self.intake.take(rows):
            self._take(taken)
        self.rows = rows.first + len(rows.codes)

    def end(self) -> None:
        """Take what the intake has held back."""
        for taken in self.intake.rest():
            self._take(taken)

    def _take(self, taken) -> None:
        """Advance the fleet by some samples, count them, and hand on what is to be written."""
        self.tally.grow(len(self.fleet))
        starts = starts_of(taken.at)
        before = self.tally["samples"][taken.at[starts[:-1]]].astype(np.int64)
        sample = rank_of(starts) + np.repeat(before + 1, np.diff(starts))
        shown = np.flatnonzero(sample % self.every == 0) if self.every else np.zeros(0, np.int64)
        outs, learnt = self._advance(taken, shown, starts)
        if len(shown):
            self.sinks.take(self._estimates(taken, shown, sample, outs, learnt))
        self.sinks.happened(*self.events.take(taken, outs, sample))
        self.tally.add(taken, outs)

    def _advance(self, taken, shown, starts) -> tuple[np.ndarray, np.ndarray]:
        """Return what samples showed, and what was learnt (n, 2 N) from those that are told.

        Means and deviations of all samples would take as long as the samples themselves, so those told are taken apart:
        first all samples before the first of them in each series, then that, and so on. The numbers are the same.
        """
        head, wide = self._head, self._head + 2 * self._N
        if not len(shown):
            return self.fleet.advance(taken.at, taken.ys, taken.us, head), np.empty((0, 2 * self._N))
        is_shown = np.zeros(len(taken.at), bool)
        is_shown[shown] = True
        so_far = np.cumsum(is_shown) - is_shown
        turn = 2 * (so_far - np.repeat(so_far[starts[:-1]], np.diff(starts))) + is_shown
        turns = int(turn.max()) + 1
        if turns > TURNS:
            outs = self.fleet.advance(taken.at, taken.ys, taken.us, wide)
            return outs[:, :head], outs[shown, head:]
        outs, learnt = np.empty((len(turn), head)), np.empty((len(turn), 2 * self._N))
        order = stable_order(turn, turns)
        for i, part in enumerate(np.split(order, np.searchsorted(turn[order], np.arange(1, turns)))):
            found = self.fleet.advance(taken.at[part], taken.ys[part], taken.us[part], wide if i % 2 else head)
            outs[part] = found[:, :head]
            if i % 2:
                learnt[part] = found[:, head:]
        return outs, learnt[shown]

    def _estimates(self, taken, shown, sample, outs, learnt) -> Estimates:
        """Return what was estimated at the samples that are told."""
        p, n = self.fleet.crew.outputs, self._n
        at = taken.at[shown]
        level = self.intake.levels[0][at]
        prediction, innovation, variance, status = (outs[shown, p * i : p * i + p] for i in range(4))
        return Estimates(
            at, taken.time[shown], sample[shown], taken.source[shown], taken.ys[shown] + level, prediction + level,
            innovation, np.sqrt(variance), status.astype(np.int32), learnt[:, n : self._N], learnt[:, self._N + n :],
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
