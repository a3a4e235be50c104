"""`Intake`: rows of long tables become samples of a fleet, each series in its own units and in order of time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from .columns import Columns
from .counters import Tally
from .row_buffer import RowBuffer
from .samples import Samples, joined, rank_of, starts_of
from .ticks import LONGEST, Ticks
from .units import Settings, levels, sizes

SEGMENT = 1 << 16  # samples handed out at once, or little more
PATIENCE = 8  # times ``first`` rows are held back at most, however few of them are complete
SETTLED, WAITING, NEW = 0.0, 1.0, 2.0  # its units are known; its first rows are held back; nothing was measured yet


class Taken(NamedTuple):
    """Samples ready to advance: those of a series stand together, in order of time; series in the order of the fleet.

    at : (n,) int64 row of the fleet, ascending
    ys, us : (n, p) outputs and (n, k) inputs less their levels (`Intake.levels`), NaN where missing
    time : (n,) seconds; number of the sample in its series (times dt) where the table has no clock
    source : (n,) int64 row of the table; of a filled sample the row that showed the gap
    filled : (n,) bool: no row of the table, a tick without one
    bad : (n,) bool: a cell of the row could not be read
    """

    at: np.ndarray
    ys: np.ndarray
    us: np.ndarray
    time: np.ndarray
    source: np.ndarray
    filled: np.ndarray
    bad: np.ndarray


class Intake:
    """Takes batches of a long table, and hands out samples that a fleet can advance.

    What a series gets does not depend, bit for bit, on how the table is cut into batches or its series are mixed: its
    samples in order of time, less the mean of the first of them, with its estimator ``scaled_to`` those.

    Parameters
    ----------
    fleet : Fleet
        Keys that are new are added to it, in order of appearance. Series it has already keep their settings. Where some
        are dropped, tell the intake (`keep`).
    dt : float, optional
        Step of the clock, in the units of the time column. A sample belongs to the tick nearest to it, counted from the
        first of its series; ticks without a row become samples without values. If omitted, samples are taken one after
        the other whatever time lies between.
    first : int
        Complete rows of a series (all outputs and inputs measured) that tell its units: its rows are held back until
        there are so many, or until there are eight times as many with those that are not complete. 0: the estimator's
        own units, nothing is subtracted.
    center : bool
        Subtract the mean of the first rows.
    longest : int
        Missing ticks in a row that are filled, those just before the next sample; more are counted as jumped.
    tally : Tally, optional
        Where rows that are not used are counted; ``intake.tally``.

    Notes
    -----
    A row whose time is not after that of the last sample taken of its key is late or a duplicate; a second row in one
    tick is a duplicate; a row without a time is timeless: they are counted and not used. Without a clock the order of
    the table is trusted. A series begins with its first measured output; rows before are counted as early. Units of a
    constant are those of the constant itself, of zeros 1.

    Bad at: one stamp far in the future, after which all others of its key are late; a mean that the first rows do not
    tell (give larger ``first``).

    Examples
    --------
    >>> import numpy as np, driftwise as dw
    >>> from driftwise.tables.dataset import open_dataset
    >>> y, _ = dw.simulate([-0.8], [0.0], samples=500, noise_std=1.0, seed=1)
    >>> table = open_dataset({"pump": np.tile([7, 8], 500), "y": np.repeat(y, 2) + 20.0}, by="pump", output="y")
    >>> fleet = dw.Fleet(dw.AR(1))
    >>> intake = Intake(fleet)
    >>> for batch in table.batches(rows=100):
    ...     for taken in intake.take(batch):
    ...         outs = fleet.advance(taken.at, taken.ys, taken.us)
    ...         intake.tally.add(taken, outs)
    >>> fleet.keys, fleet.mean(7).round(1), intake.tally["samples"]
    ([7, 8], array([-0.8]), array([500., 500.]))
    """

    def __init__(self, fleet, dt=None, first: int = 32, center: bool = True, longest: int = LONGEST, tally=None):
        self.fleet = fleet
        self.first, self.center = validation.count("first", first), validation.yes("center", center)
        self.tally = Tally(fleet) if tally is None else tally
        self.keyless = 0  # rows without a key: not used
        p, k = fleet.crew.outputs, fleet.crew.inputs
        self._y_levels, self._u_levels = [f"y{j}" for j in range(p)], [f"u{j}" for j in range(k)]
        self.columns = Columns(
            dict(stage=SETTLED, number=0.0, origin=np.nan, last=-np.inf, slot=-1.0)
            | dict.fromkeys([*self._y_levels, *self._u_levels, "complete"], 0.0),
            len(fleet),
        )
        self.ticks = Ticks(self.columns, self.tally, dt, longest)
        self._buffer = RowBuffer(first, p, k)
        self._names: list = []
        self._map = np.array([-1])  # row of the fleet by code; the last for -1
        self._settings = Settings(fleet)

    @property
    def levels(self) -> tuple[np.ndarray, np.ndarray]:
        """What is subtracted from outputs (S, p) and inputs (S, k) of each series of the fleet: views."""
        table, (p, k) = self.columns.table, (len(self._y_levels), len(self._u_levels))
        at = self.columns.names.index(self._y_levels[0])
        return table[:, at : at + p], table[:, at + p : at + p + k]

    # --- a batch -------------------------------------------------------------------------------------------

    def take(self, batch) -> Iterator[Taken]:
        """Yield the samples of a batch, in stretches of bounded length: advance each before the next, to the end.

        Rows held back come with the one that frees them. ``batch`` is a `driftwise.tables.dataset.Batch`, or what has
        its fields.
        """
        samples = self._samples(batch)
        samples = self.ticks.in_time(samples) if batch.time is not None else self.ticks.in_order(samples)
        yield from self._released(samples)

    def rest(self) -> Iterator[Taken]:
        """Yield the samples still held back, of series shorter than ``first``: all of them tell their units."""
        waiting = np.flatnonzero(self.columns["stage"] == WAITING)
        size = max(SEGMENT // max(PATIENCE * self.first, 1), 1)
        for start in range(0, len(waiting), size):
            some = waiting[start : start + size]
            yield from self._centred(self._settled(some, self.columns["number"][some].astype(np.int64)))

    def _samples(self, batch) -> Samples:
        """Return the rows of a batch that have a key, a time and a beginning, grouped by series."""
        n = len(batch.codes)
        at = self._rows_of(batch.names).take(batch.codes, mode="wrap")  # -1 is the last
        time = np.zeros(n) if batch.time is None else batch.time
        source = getattr(batch, "source", None)
        source = np.arange(batch.first, batch.first + n) if source is None else source
        samples = Samples(at, time, batch.ys, batch.us, batch.bad, source, np.zeros(n, np.int32))
        if n and at.min() < 0:
            self.keyless += int(np.count_nonzero(at < 0))
            samples = samples.pick(at >= 0)
        samples = samples.grouped(len(self.fleet))
        samples = self._kept("timeless", samples, np.isfinite(samples.time))
        starts = starts_of(samples.at)
        begins, lengths = starts[:-1], np.diff(starts)
        is_new = self.columns["stage"][samples.at[begins]] == NEW
        if not is_new.any():
            return samples
        is_measured = np.isfinite(samples.ys).any(axis=1)
        seen = np.cumsum(is_measured)
        has_begun = seen > np.repeat(seen[begins] - is_measured[begins], lengths)
        return self._kept("early", samples, has_begun | ~np.repeat(is_new, lengths))

    def _rows_of(self, names) -> np.ndarray:
        """Return the row of the fleet for each code, -1 for -1; keys that are new are added."""
        if names is not self._names:
            self._names, self._map = names, np.array([-1])
        fresh = names[len(self._map) - 1 :]
        if len(self.fleet) < len(self.columns):
            raise InputError("series were dropped from the fleet while an intake was adding to it: make another Intake")
        if fresh:
            self.columns.grow(len(self.fleet))  # series that others have added go on as they are
            self.fleet.add(name for name in fresh if name not in self.fleet)
            before = len(self.columns)
            self.columns.grow(len(self.fleet))
            self.columns["stage"][before:] = NEW if self.first else SETTLED
            self.tally.grow(len(self.fleet))
            self._map = np.concatenate([self._map[:-1], self.fleet.rows_of(fresh), [-1]])
        return self._map

    def _kept(self, reason: str, samples: Samples, is_kept) -> Samples:
        """Return the samples that are kept; count the others under a reason."""
        if is_kept.all():
            return samples
        self.tally.count(reason, samples.at[~is_kept])
        return samples.pick(is_kept)

    # --- units ---------------------------------------------------------------------------------------------

    def _released(self, samples: Samples) -> Iterator[Taken]:
        """Hold back rows of series whose units are not known, release those of series that have enough of them."""
        starts = starts_of(samples.at)
        series, lengths = samples.at[starts[:-1]], np.diff(starts)
        is_open = self.columns["stage"][series] != SETTLED
        if not is_open.any():
            yield from self._centred(samples)
            return
        weight = lengths + np.where(is_open, self.columns["number"][series] - lengths, 0)
        block = np.cumsum(weight) // SEGMENT
        cuts = [0, *(np.flatnonzero(np.diff(block)) + 1), len(series)]
        for first, last in pairwise(cuts):
            part = Samples(*(column[starts[first] : starts[last]] for column in samples))
            yield from self._centred(self._freed(part))

    def _freed(self, samples: Samples) -> Samples:
        """Return what can go on of these samples, with those held back that they free."""
        columns, starts = self.columns, starts_of(samples.at)
        series, lengths = samples.at[starts[:-1]], np.diff(starts)
        new = series[columns["stage"][series] == NEW]
        columns["slot"][new], columns["stage"][new] = self._buffer.blocks(len(new)), WAITING
        held_before = columns["number"][series].astype(np.int64) - lengths
        place = rank_of(starts) + np.repeat(held_before, lengths)
        is_complete = _are_complete(samples)
        seen = np.cumsum(is_complete)  # among these samples; of a series, with those held already:
        complete = seen + np.repeat(columns["complete"][series] - seen[starts[:-1]] + is_complete[starts[:-1]], lengths)
        is_waiting = columns["stage"][samples.at] == WAITING
        is_held = is_waiting & (complete - is_complete < self.first) & (place < PATIENCE * self.first)
        self._buffer.put(columns["slot"][samples.at[is_held]].astype(int), place[is_held], samples.pick(is_held))
        number = held_before + np.add.reduceat(is_held, starts[:-1])
        columns["complete"][series] = complete[starts[1:] - 1]
        is_full = (columns["complete"][series] >= self.first) | (columns["number"][series] >= PATIENCE * self.first)
        is_full &= columns["stage"][series] == WAITING
        rest = samples.pick(~is_held)
        if not is_full.any():
            return rest
        return joined([self._settled(series[is_full], number[is_full]), rest]).grouped(len(self.fleet))

    def _settled(self, series, counts) -> Samples:
        """Give series (ascending) the units of their held rows, so many of each, and return those."""
        columns, slots = self.columns, self.columns["slot"][series].astype(int)
        samples = self._buffer.read(series, slots, counts)
        starts = np.append(0, np.cumsum(counts))
        ys, us = _side_by_side(samples.ys, starts), _side_by_side(samples.us, starts)
        y_levels, u_levels = levels(ys, self.center), levels(us, self.center)
        for names, found in ((self._y_levels, y_levels), (self._u_levels, u_levels)):
            for name, level in zip(names, found.T):
                columns[name][series] = level
        scales = np.concatenate([sizes(ys, y_levels), sizes(us, u_levels)], axis=1)
        kinds, which = np.unique(scales, axis=0, return_inverse=True)
        for i, kind in enumerate(kinds):
            self.fleet.begin(series[which.ravel() == i], self._settings.of(kind))
        self._buffer.empty(slots)
        columns["stage"][series], columns["slot"][series] = SETTLED, -1
        return samples

    # --- what comes out ------------------------------------------------------------------------------------

    def _centred(self, samples: Samples) -> Iterator[Taken]:
        """Yield samples less their levels, with those that fill gaps, in stretches of bounded length."""
        if not len(samples.at):
            return
        ys, us = self._less(samples.ys, self._y_levels, samples.at), self._less(samples.us, self._u_levels, samples.at)
        samples = samples._replace(ys=ys, us=us)
        if not samples.gap.any():
            at, time, ys, us, bad, source, _ = samples
            yield Taken(at, ys, us, time, source, np.zeros(len(at), bool), bad)
            return
        ends = np.cumsum(samples.gap + 1, dtype=np.int64)
        cuts = [0, *(np.flatnonzero(np.diff(ends // SEGMENT)) + 1), len(ends)]
        for first, last in pairwise(cuts):
            yield self._filled(Samples(*(column[first:last] for column in samples)))

    def _less(self, values, names, at):
        """Return values (n, c) less the levels of their series."""
        found = np.empty(values.shape)
        for j, name in enumerate(names):
            np.subtract(values[:, j], self.columns[name].take(at), out=found[:, j])
        return found

    def _filled(self, samples: Samples) -> Taken:
        """Return samples with one without values for each tick missed before them."""
        ends = np.cumsum(samples.gap + 1, dtype=np.int64)
        which = np.repeat(np.arange(len(ends)), samples.gap + 1)
        back = ends[which] - 1 - np.arange(len(which))  # ticks from here to the sample
        filled = back > 0
        at, time, ys, us, bad, source, _ = samples.pick(which)
        time[filled] = self.ticks.earlier(time[filled], at[filled], back[filled])
        ys[filled], us[filled], bad[filled] = np.nan, np.nan, False
        return Taken(at, ys, us, time, source, filled, bad)

    # --- keeping -------------------------------------------------------------------------------------------

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return all it remembers between two batches, the tally left out: arrays of numbers."""
        held = self.held(np.arange(len(self.columns)))
        kept = {f"held_{name}": column for name, column in held._asdict().items()}
        return {"columns": self.columns.table.copy(), "keyless": np.array([self.keyless]), **kept}

    def held(self, at) -> Samples:
        """Return the samples held back of these rows of the fleet, in this order."""
        waiting = at[self.columns["stage"][at] == WAITING]
        slots, counts = (self.columns[name][waiting].astype(np.int64) for name in ("slot", "number"))
        return self._buffer.read(waiting, slots, counts)

    def restore(self, found: dict[str, np.ndarray]) -> None:
        """Go on from a `snapshot`, with the fleet as it was then."""
        if len(found["columns"]) > len(self.fleet):
            raise InputError(f"the snapshot has {len(found['columns'])} series, the fleet {len(self.fleet)}")
        self.keyless = int(found["keyless"][0])
        self._buffer = RowBuffer(self.first, len(self._y_levels), len(self._u_levels))
        self._names, self._map = [], np.array([-1])
        self.columns.restore(found["columns"])
        self._hold(Samples(*(np.asarray(found[f"held_{name}"]) for name in Samples._fields)))

    def put(self, at, columns, held: Samples) -> None:
        """Go on with series that were kept elsewhere: new rows ``at`` of the fleet, their columns, and what is held."""
        self.columns.grow(len(self.fleet))
        self.columns.table[at] = columns
        self._hold(held)

    def keep(self, is_kept) -> None:
        """Forget the series that the fleet has dropped: (S,) True for those that it has."""
        waiting = np.flatnonzero((self.columns["stage"] == WAITING) & ~is_kept)
        self._buffer.empty(self.columns["slot"][waiting].astype(np.int64))
        self.columns.keep(is_kept)
        self._names, self._map = [], np.array([-1])

    def _hold(self, held: Samples) -> None:
        """Hold samples back, of series that hold none."""
        starts = starts_of(held.at)
        series = held.at[starts[:-1]]
        is_complete = _are_complete(held)
        self.columns["complete"][series] = [is_complete[a:b].sum() for a, b in pairwise(starts)]
        slots = self._buffer.blocks(len(series))
        self.columns["slot"][series] = slots
        self._buffer.put(np.repeat(slots, np.diff(starts)), rank_of(starts), held)


def _are_complete(samples) -> np.ndarray:
    """Say which samples have all outputs and inputs."""
    return np.isfinite(samples.ys).all(axis=1) & np.isfinite(samples.us).all(axis=1)


def _side_by_side(values, starts) -> np.ndarray:
    """Return the entries (n, c) of R groups as (R, longest, c), NaN behind the shorter ones."""
    counts = np.diff(starts)
    found = np.full((len(counts), counts.max(initial=0), values.shape[1]), np.nan)
    found[np.repeat(np.arange(len(counts)), counts), rank_of(starts)] = values
    return found
