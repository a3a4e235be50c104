"""`Rows`: series of one model, advanced together as a `Fleet`, and each of them as one row of numbers to be kept."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from ..fleet.crew import Crew
from ..fleet.events import FleetEvents, Seen
from ..fleet.fleet import Fleet
from ..fleet.intake import Intake, Taken
from ..fleet.samples import rank_of, starts_of
from ..fleet.store import Kept, settings
from ..results.snapshot import rebuild
from .drift import LOOK, Drift, Drifting
from .watch import Watch


class Batch(NamedTuple):
    """Rows of many series, as an intake takes them; ``codes`` count keys in the order they first came."""

    names: list
    codes: np.ndarray
    time: np.ndarray
    ys: np.ndarray
    us: np.ndarray
    bad: np.ndarray
    first: int


class Shown(NamedTuple):
    """What samples showed: those taken, columns of the fleet, their numbers, and the events among them."""

    taken: Taken
    outs: np.ndarray
    sample: np.ndarray
    starts: np.ndarray
    events_at: np.ndarray
    events: Seen
    signs: np.ndarray  # of each sample, what `Watch` tells
    drifts: list[tuple[int, Drifting]]  # and at which of them a parameter was told to drift


class Rows:
    """The series of one model. The numbers are those of a `Fleet` on the same samples, bit for bit."""

    def __init__(self, estimator: Any, dt: float = 0.0, first: int = 32, stuck: int = 100, fleet: Fleet | None = None):
        self.fleet = Fleet(estimator, threads=1) if fleet is None else fleet
        self.intake = Intake(self.fleet, dt or None, first)
        self.tally, self.events = self.intake.tally, FleetEvents(self.fleet, most=None)
        self.watch, self.drift = Watch(stuck), Drift(list(self.fleet.estimators[0].names))
        self.names: list[str] = []
        self.taken = 0
        self._described = 0

    def add(self, key: str) -> int:
        """Return the code of a new key."""
        self.names.append(key)
        return len(self.names) - 1

    def take(self, codes: Sequence[int], time: Sequence[float], y: Sequence[float], u: Sequence) -> Iterator[Shown]:
        """Take rows in the order they stand in; yield what the samples among them showed."""
        k = self.fleet.crew.inputs
        at, ys = np.array(codes, np.int64), np.array(y, float).reshape(-1, 1)
        us = np.array(u, float).reshape(len(at), k)
        is_bad = np.isinf(ys).any(axis=1) | np.isinf(us).any(axis=1)
        batch = Batch(self.names, at, np.array(time, float), ys, us, is_bad, self.taken)
        self.taken += len(at)
        for taken in self.intake.take(batch):
            self.tally.grow(len(self.fleet))
            starts = starts_of(taken.at)
            before = self.tally["samples"][taken.at[starts[:-1]]].astype(np.int64)
            sample = rank_of(starts) + np.repeat(before + 1, np.diff(starts))
            part = (sample - 1) // LOOK - np.repeat(before // LOOK, np.diff(starts))
            for number in range(int(part.max(initial=0)) + 1):  # a look is between samples, however they come
                yield self._shown(Taken(*(column[part == number] for column in taken)), sample[part == number])

    def _shown(self, taken: Taken, sample: np.ndarray) -> Shown:
        """Advance the fleet by a stretch; return what it showed."""
        starts = starts_of(taken.at)
        outs = self.fleet.advance(taken.at, taken.ys, taken.us, self.fleet.estimators[0].n_columns)
        found = self.events.take(taken, outs, sample)
        self.tally.add(taken, outs)
        signs = self.watch.take(taken.at, taken.ys[:, 0])
        return Shown(taken, outs, sample, starts, *found, signs, self._drifts(taken, sample, starts[1:] - 1))

    def _drifts(self, taken: Taken, sample: np.ndarray, ends: np.ndarray) -> list[tuple[int, Drifting]]:
        """Look at the estimates of series that have come to a look with one of the samples ``ends``."""
        found = []
        for i in ends[sample[ends] % LOOK == 0].tolist():
            row = int(taken.at[i])
            key = self.names[row]
            theta, P = self.fleet.estimator_of(key).parameters_of(self.fleet.state(key))
            std = np.sqrt(np.diag(np.atleast_2d(P)).clip(0))
            found += [(i, one) for one in self.drift.look(row, int(sample[i]), float(taken.time[i]), theta, std)]
        return found

    # --- keeping -------------------------------------------------------------------------------------------

    @property
    def widths(self) -> tuple[int, ...]:
        """How many numbers of a row are state, counts, runs of trouble, and intake."""
        return (
            self.fleet.crew.width, len(self.tally.names), self.events.table.shape[1], len(self.intake.columns.names),
            len(self.watch.names), len(self.drift.names),
        )  # fmt: skip

    @property
    def fields(self) -> str:
        """What the numbers of a row are, as JSON: rows of another version are known by it."""
        est = self.fleet.estimators[0]
        sizes = [[name, int(np.prod(est.dtype[name].shape))] for name in est.dtype.names]
        return json.dumps(
            [sizes, self.tally.names, self.widths, self.intake.columns.names, self.watch.names, self.drift.names]
        )

    def rows(self, at: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Return series (n,) as rows of numbers, the number of their settings last, and what is held back of some."""
        self.tally.grow(len(self.fleet))
        self.events.grow()
        self.watch.grow(len(self.fleet))
        self.drift.grow(len(self.fleet))
        found = [
            self.fleet._rows[at], self.tally.table[at], self.events.table[at], self.intake.columns.table[at],
            self.watch.table[at], self.drift.table[at], self.fleet._group[at, None].astype(float),
        ]  # fmt: skip
        held = self.intake.held(at)
        numbers, starts = np.column_stack(held[1:]).astype(float), starts_of(held.at)
        return np.concatenate(found, axis=1), dict(zip(held.at[starts[:-1]].tolist(), np.split(numbers, starts[1:-1])))

    def new_settings(self) -> list[tuple[int, str]]:
        """Return settings that were not asked for yet, with their numbers."""
        found = [(i, json.dumps(settings(est))) for i, est in enumerate(self.fleet.estimators)][self._described :]
        self._described = len(self.fleet.estimators)
        return found

    @classmethod
    def restored(
        cls, described: list[str], keys: list[str], numbers: np.ndarray, held: dict[int, np.ndarray], **options
    ) -> Rows:
        """Return what was kept, with the settings of its series, so that it goes on as if nothing had been."""
        estimators = [rebuild(text) for text in described]
        width = Crew(estimators[0], None, None).width
        group = numbers[:, -1].astype(np.int64)
        states = numbers[:, :width].copy()
        fleet = Fleet._of(Kept(estimators, keys, states, group, {}, {}), threads=1)
        rows = cls(estimators[0], fleet=fleet, **options)
        rows._described, rows.names = len(estimators), list(keys)
        if not len(keys):
            return rows
        if numbers.shape[1] != sum(rows.widths) + 1:
            raise InputError("the states that were kept are laid out otherwise: were they written by another version?")
        _, tally, events, columns, watch, drift, _ = np.split(numbers, np.cumsum(rows.widths), axis=1)
        rows.tally.restore(tally)
        rows.events.table = events.copy()
        rows.watch.restore(watch)
        rows.drift.restore(drift)
        p, k = fleet.crew.outputs, fleet.crew.inputs
        wide = 1 + p + k + 3
        at = np.repeat(np.array(list(held), np.int64), [len(one) // wide for one in held.values()])
        flat = np.concatenate([*held.values(), np.zeros(0)]).reshape(-1, wide)
        rows.intake.restore({
            "columns": columns, "keyless": np.zeros(1), "held_at": at, "held_time": flat[:, 0],
            "held_ys": flat[:, 1 : 1 + p], "held_us": flat[:, 1 + p : 1 + p + k], "held_bad": flat[:, -3].astype(bool),
            "held_source": flat[:, -2].astype(np.int64), "held_gap": flat[:, -1].astype(np.int32),
        })  # fmt: skip
        return rows
