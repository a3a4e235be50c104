"""`Rows`: series of one model, advanced together as a `Fleet`, and each of them as one row of numbers to be kept."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from ..fleet.columns import Columns
from ..fleet.counters import JUMP
from ..fleet.events import FleetEvents, Seen
from ..fleet.fleet import Fleet, check_learns
from ..fleet.intake import Intake, Taken
from ..fleet.samples import Samples, rank_of, starts_of
from ..fleet.store import settings
from ..results.sentences import SOMETHING, alarm_words
from ..results.snapshot import rebuild
from .drift import LOOK, Drift, Drifting
from .fit import Fit
from .watch import Watch, words

MINUTE = 60.0  # s after which the parameters of a series are noted again


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
    fits: np.ndarray  # of each sample, what `Fit` tells
    drifts: list[tuple[int, Drifting]]  # and at which of them a parameter was told to drift
    points: list[tuple[int, np.ndarray, np.ndarray]]  # parameters and their deviations after some of them


class Rows:
    """The series of one model. The numbers are those of a `Fleet` on the same samples, bit for bit.

    ``window`` is that of `Fit`: samples by which a model that was chosen is judged; 0 for one that was named.
    """

    def __init__(self, estimator: Any, dt: float = 0.0, first: int = 32, stuck: int = 100, window: int = 0):
        self.fleet = Fleet(estimator, threads=1)
        check_learns(estimator)
        self.intake = Intake(self.fleet, dt or None, first)
        self.tally, self.events = self.intake.tally, FleetEvents(self.fleet, most=None)
        self.watch, self.drift = Watch(stuck), Drift(list(self.fleet.estimators[0].names))
        self.fit = Fit(window)
        self.noted = Columns(dict(time=-np.inf))  # when parameters were noted last, by the clock here
        self.names: list[str] = []
        self.taken = 0
        self._described = 0

    def add(self, key: str) -> int:
        """Return the code of a new key."""
        self.names.append(key)
        return len(self.names) - 1

    def take(self, codes: Sequence[int], time: Any, y: Any, u: Any, now: float = 0.0) -> Iterator[Shown]:
        """Take rows (n,), (n,), (n, k) in the order they stand in; yield what the samples among them showed."""
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
                yield self._shown(Taken(*(column[part == number] for column in taken)), sample[part == number], now)

    def _shown(self, taken: Taken, sample: np.ndarray, now: float) -> Shown:
        """Advance the fleet by a stretch; return what it showed."""
        starts = starts_of(taken.at)
        outs = self.fleet.advance(taken.at, taken.ys, taken.us, self.fleet.estimators[0].n_columns)
        found = self.events.take(taken, outs, sample)
        self.tally.add(taken, outs)
        signs = self.watch.take(taken.at, taken.ys[:, 0])
        fits = self.fit.take(taken.at, outs)
        return Shown(taken, outs, sample, starts, *found, signs, fits, *self._looks(taken, outs, sample, starts, now))

    def _looks(self, taken: Taken, outs: np.ndarray, sample: np.ndarray, starts: np.ndarray, now: float):
        """Return drifts and points: parameters every 100 samples of a series, after a jump, and once a minute."""
        drifts: list[tuple[int, Drifting]] = []
        points: list[tuple[int, np.ndarray, np.ndarray]] = []
        self.noted.grow(len(self.fleet))
        ends, noted = starts[1:] - 1, self.noted["time"]
        has_jumped = np.maximum.reduceat(outs[:, 3].astype(np.int64) & JUMP, starts[:-1]) > 0
        is_look = sample[ends] % LOOK == 0
        for k in np.flatnonzero(is_look | has_jumped | (now - noted[taken.at[ends]] >= MINUTE)).tolist():
            i = int(ends[k])
            row = int(taken.at[i])
            key = self.names[row]
            theta, P = self.fleet.estimator_of(key).parameters_of(self.fleet.state(key))
            std = np.sqrt(np.diag(np.atleast_2d(P)).clip(0))
            points.append((i, theta, std))
            noted[row] = now
            if is_look[k]:
                looked = self.drift.look(row, int(sample[i]), float(taken.time[i]), theta, std)
                drifts += [(i, one) for one in looked]
        return drifts, points

    def alarms(self, shown: Shown) -> list[tuple[int, float, str, str, float | None]]:
        """Return what detectors, `Watch` and `Drift` tell of it: code of the series, time, kind, sentence, log odds."""
        seen, at, found = shown.events, shown.taken.at, []
        for i, code in enumerate(shown.events_at):
            odds, text, name = float(seen.statistic[i]), seen.text[i], seen.parameter[i]
            if name and len(self.drift.parameters) > 1:  # so soon the detector can only guess which it was
                text = alarm_words(f"{SOMETHING}, perhaps {name}", odds, float(seen.since[i]))
            known = None if math.isnan(odds) else odds
            found.append((code, float(seen.time[i]), seen.kind[i].lower(), text, known))
        told = words(self.watch.least)
        for i in np.flatnonzero(shown.signs).tolist():
            found.append((int(at[i]), float(shown.taken.time[i]), *told[float(shown.signs[i])], None))
        return found + [(int(at[i]), one.time, "drift", one.text, None) for i, one in shown.drifts]

    # --- keeping -------------------------------------------------------------------------------------------

    @property
    def _tables(self) -> tuple[Columns, ...]:
        """What is remembered of each series in columns, besides its state and its runs of trouble."""
        return self.tally, self.intake.columns, self.watch, self.drift, self.fit

    @property
    def widths(self) -> tuple[int, ...]:
        """How many numbers of a row are state, counts, runs of trouble, intake, watch, drift, settings, and fit."""
        tally, intake, watch, drift, fit = (len(table.names) for table in self._tables)
        return self.fleet.crew.width, tally, self.events.table.shape[1], intake, watch, drift, 1, fit

    @property
    def fields(self) -> str:
        """What the numbers of a row are, as JSON: rows of another version are known by it."""
        est, (tally, *others, fit) = self.fleet.estimators[0], (table.names for table in self._tables)
        sizes = [[name, int(np.prod(est.dtype[name].shape))] for name in est.dtype.names]
        return json.dumps([sizes, tally, self.widths[:6], *others, *([fit] if fit else [])])

    def rows(self, at: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Return series (n,) as rows of numbers, and what is held back of some."""
        self._grow()
        tally, *others, fit = (table.table[at] for table in self._tables)
        group = self.fleet._group[at, None].astype(float)
        found = [self.fleet._rows[at], tally, self.events.table[at], *others, group, fit]
        held = self.intake.held(at)
        numbers, starts = np.column_stack(held[1:]).astype(float), starts_of(held.at)
        return np.concatenate(found, axis=1), dict(zip(held.at[starts[:-1]].tolist(), np.split(numbers, starts[1:-1])))

    def _grow(self) -> None:
        """Make room for the series that the fleet has now."""
        self.events.grow()
        for table in (*self._tables, self.noted):
            table.grow(len(self.fleet))

    def put(self, keys: list[str], numbers: np.ndarray, held: dict[int, np.ndarray]) -> None:
        """Take series as `rows` gave them, with what is held back of those (by their place here) that have some."""
        if numbers.shape[1] != sum(self.widths):
            raise InputError("the states that were kept are laid out otherwise: were they written by another version?")
        self.intake._rows_of(self.names)  # those that wait for their first sample have their places before
        at = np.arange(len(self.fleet), len(self.fleet) + len(keys))
        self.names += keys
        self.fleet.add(keys)
        self._grow()
        parts = np.split(numbers, np.cumsum(self.widths)[:-1], axis=1)
        state, tally, events, columns, watch, drift, group, fit = parts
        self.fleet._rows[at], self.fleet._group[at] = state, group[:, 0].astype(np.int64)
        self.events.table[at] = events
        for table, found in zip((self.tally, self.watch, self.drift, self.fit), (tally, watch, drift, fit)):
            table.table[at] = found
        p, k = self.fleet.crew.outputs, self.fleet.crew.inputs
        rows = np.repeat(at[list(held)], [len(one) // (1 + p + k + 3) for one in held.values()])
        flat = np.concatenate([*held.values(), np.zeros(0)]).reshape(-1, 1 + p + k + 3)
        self.intake.put(at, columns, Samples(
            rows, flat[:, 0], flat[:, 1 : 1 + p], flat[:, 1 + p : 1 + p + k], flat[:, -3].astype(bool),
            flat[:, -2].astype(np.int64), flat[:, -1].astype(np.int32),
        ))  # fmt: skip

    def drop(self, codes: Iterable[int]) -> np.ndarray:
        """Forget series; return which stay, (S,) bool: their codes close up."""
        self.intake._rows_of(self.names)
        self._grow()
        is_kept = np.ones(len(self.names), bool)
        is_kept[list(codes)] = False
        self.fleet.drop(name for name, is_left in zip(self.names, is_kept) if not is_left)
        self.events.table = self.events.table[is_kept]
        self.intake.keep(is_kept)
        for table in (self.tally, self.watch, self.drift, self.fit, self.noted):
            table.keep(is_kept)
        self.names = [name for name, is_left in zip(self.names, is_kept) if is_left]
        return is_kept

    def new_settings(self) -> list[tuple[int, str]]:
        """Return settings that were not asked for yet, with their numbers."""
        first, self._described = self._described, len(self.fleet.estimators)
        return [(i, json.dumps(settings(self.fleet.estimators[i]))) for i in range(first, self._described)]

    @classmethod
    def restored(cls, described: list[str], **options) -> Rows:
        """Return rows of these settings, without a series."""
        first, *others = [rebuild(text) for text in described]
        rows = cls(first, **options)
        for other in others:
            rows.fleet._settings(other)
        rows._described = len(described)
        return rows
