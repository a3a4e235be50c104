"""`Core`: what a service does with samples, without a network and without waiting: join, estimate, tell, keep."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..engine.errors import InputError
from ..results.sentences import SOMETHING, alarm_words
from .board import EventView
from .config import Config
from .decode import Chunk
from .history import WIDTH, History
from .models import Models
from .packing import listed, packed, unpacked
from .picture import Picture
from .rows import Rows, Shown
from .series import Series, arrays, keys_of
from .sources.base import Parcel
from .store.base import Change, Group, Store
from .watch import words

AHEAD = 86_400.0  # s that a stamp may be ahead of the clock here
DATES = 1e8  # stamps above are dates
UNWRITABLE = re.compile("[\0\ud800-\udfff]")
REASONS = 20  # last reasons of refusals that are kept


class Core:
    """Series, their models and states. `take` parcels, then `commit`: what is between two commits is lost together.

    The states are those of a `Fleet` on the same samples, bit for bit, wherever it was killed and gone on with,
    provided that the sources hand over again what was not committed.

    Parameters
    ----------
    config : Config
    store : Store
    estimator_of : returns the estimator of (`ModelConfig`): how words of the command line are read
    """

    def __init__(self, config: Config, store: Store, estimator_of: Callable[[Any], Any]):
        self.config, self.store = config, store
        self.models = Models(estimator_of)
        self.series: dict[str, Series] = {}
        self.by_number: list[Series] = []
        self._unchosen: dict[int, Series] = {}
        self.groups: list[Rows] = []
        self.group_words: list[str] = []
        self._members: list[list[int]] = []  # of each group, the numbers of its series by code
        self._kept: list[int] = []  # of each group, how many of its rows are in the store
        self.picture, self.history = Picture(), History(config.store.path, config.store.days)
        self.counters: Counter[str] = Counter()
        self.reasons: dict[str, int] = {}
        self.places: dict[str, Any] = {}
        self.last_event = 0
        self.commits = 0
        self._change, self._dirty, self._waited = Change(), set[int](), set[int]()
        self._history: list[np.ndarray] = []
        self._buffers: dict[int, tuple[list, list, list, list]] = {}
        self._told: list[str] | None = None
        self._now, self._committed = 0.0, list[np.ndarray]()
        self._load()

    # --- samples -------------------------------------------------------------------------------------------

    def take(self, parcels: Iterable[Parcel], now: float) -> list[EventView]:
        """Take parcels that came at an instant; return what happened."""
        self._now = now
        for parcel in parcels:
            self.counters["bytes_in"] += parcel.size
            self.counters["messages"] += 1
            for reason in parcel.refused:
                self.refuse(reason)
            self._told = parcel.told
            for chunk in parcel.chunks:
                self._chunk(chunk, now)
            if parcel.place is not None:
                self.place(*parcel.place)
        self._told = None
        return self._advance()

    def place(self, name: str, place: Any) -> None:
        """Note where a source goes on from, or an output, with the next commit."""
        self.places[name] = self._change.places[name] = place

    def refuse(self, reason: str) -> None:
        """Count what cannot be used, and keep the reason."""
        reason = reason.encode("utf-8", "replace").decode()  # half a character can neither be written nor sent
        self.counters["refused"] += 1
        if self._told is not None:
            self._told.append(reason)
        self.reasons[reason] = self.reasons.pop(reason, 0) + 1
        if len(self.reasons) > REASONS:
            del self.reasons[next(iter(self.reasons))]

    def _chunk(self, chunk: Chunk, now: float) -> None:
        """Read one chunk."""
        times, ahead = chunk.time, now + AHEAD
        for i, time in enumerate(times):
            if time != time:
                times[i] = now
            elif time > ahead > DATES:
                self._ahead(chunk, ahead)
                self._chunk(chunk, now)
                return
        found = self.series.get(chunk.key)
        try:
            for one in [chunk] if found is not None else keys_of(chunk, self.config.of(chunk.key)):
                series = self.series.get(one.key) or self._new(one.key)
                if found is not None and series.config.output not in one.fields:
                    one = keys_of(one, series.config)[0]
                self._rows(series, one)
        except InputError as error:
            self.refuse(str(error))

    def _ahead(self, chunk: Chunk, last: float) -> None:
        """Leave out, and count, the samples of a chunk that are ahead of an instant."""
        good = [i for i, time in enumerate(chunk.time) if not time > last]
        for _ in range(len(chunk.time) - len(good)):
            self.counters["future"] += 1
            self.refuse(f"a stamp of {chunk.key} is more than a day ahead of the clock here")
        for values in (chunk.time, *chunk.fields.values()):
            values[:] = [values[i] for i in good]

    def _new(self, key: str) -> Series:
        """Return a series that comes for the first time."""
        if len(self.series) >= self.config.store.most:
            self.counters["keys_refused"] += 1
            raise InputError(f"there are {len(self.series)} series already (most in [store]); further keys are refused")
        if len(key) > 500 or UNWRITABLE.search(key):
            raise InputError(f"a key of {len(key)} characters: at most 500, none of them 0 or half a character")
        series = Series(len(self.by_number), key, self.config.of(key))
        self.series[key] = series
        self.by_number.append(series)
        self.picture.grow(len(self.by_number))
        self.picture.columns["silence"][series.number] = series.config.silence
        if series.config.model == "auto":
            self._unchosen[series.number] = series
        else:
            self._assign(series, *self.models.named(series.config))
        self._change.members.append(listed(series))
        return series

    def _rows(self, series: Series, chunk: Chunk) -> None:
        """Take the rows that a chunk frees."""
        rows = series.rows(chunk)
        if not series.is_plain:
            self._waited.add(series.number)
        if not rows:
            return
        self.counters["samples"] += len(rows)
        series.held = rows[-1].inputs
        if series.group is None:
            series.samples += [(row.time, row.output, *row.inputs) for row in rows]
            self._dirty.add(series.number)
            self.picture.revision += 1
            self.picture.columns["revision"][series.number] = self.picture.revision
            return
        codes, time, y, u = self._buffers.setdefault(series.group, ([], [], [], []))
        codes.extend([series.code] * len(rows))
        for row in rows:
            time.append(row.time)
            y.append(row.output)
            u.append(row.inputs)

    def _advance(self) -> list[EventView]:
        """Let the fleets take what has come; return what happened."""
        events: list[EventView] = []
        buffers, self._buffers = self._buffers, {}
        for group, buffer in buffers.items():
            self._dirty.update(map(self._members[group].__getitem__, set(buffer[0])))
            for shown in self.groups[group].take(*buffer):
                events += self._shown(group, shown)
        self.counters["events"] += len(events)
        return events

    def _shown(self, group: int, shown: Shown) -> list[EventView]:
        """Put down what samples showed, and return what happened."""
        rows, taken, outs = self.groups[group], shown.taken, shown.outs
        numbers = np.array(self._members[group])[taken.at]
        level = rows.intake.levels[0][taken.at, 0]
        events: list[tuple[float, int, str, str, float | None]] = []
        found = np.empty((len(numbers), WIDTH))
        found[:, 0], found[:, 1], found[:, 2] = numbers, taken.time, taken.ys[:, 0] + level
        found[:, 3], found[:, 4], found[:, 5] = outs[:, 0] + level, np.sqrt(outs[:, 2]), outs[:, 3]
        self._history.append(found)
        self.picture.take(found, shown.starts)
        seen = shown.events
        for i, at in enumerate(shown.events_at):
            odds, text, name = float(seen.statistic[i]), seen.text[i], seen.parameter[i]
            if name and len(rows.drift.parameters) > 1:  # so soon the detector can only guess which it was
                text = alarm_words(f"{SOMETHING}, perhaps {name}", odds, float(seen.since[i]))
            known = None if math.isnan(odds) else odds
            events.append((float(seen.time[i]), self._members[group][at], seen.kind[i].lower(), text, known))
        told = words(rows.watch.least)
        for i in np.flatnonzero(shown.signs).tolist():
            events.append((float(taken.time[i]), int(numbers[i]), *told[float(shown.signs[i])], None))
        events += [(one.time, int(numbers[i]), "drift", one.text, None) for i, one in shown.drifts]
        lost = self.picture.columns["is_lost"]
        for i in shown.starts[:-1][lost[numbers[shown.starts[:-1]]] > 0].tolist():
            events.append((float(taken.time[i]), int(numbers[i]), "back", "it sends again", None))
        lost[numbers] = 0.0
        self.picture.columns["heard"][numbers] = self._now
        events.sort(key=lambda event: event[:3])
        return [self.tell(number, time, kind, text, odds) for time, number, kind, text, odds in events]

    def silent(self, now: float) -> list[EventView]:
        """Return the series of which nothing has come for as long as was said, as events."""
        columns = self.picture.columns
        is_late = (columns["silence"] > 0) & (columns["is_lost"] == 0) & (columns["heard"] > 0)
        is_late &= now - columns["heard"] > columns["silence"]
        events = []
        for number in np.flatnonzero(is_late).tolist():
            columns["is_lost"][number] = 1.0
            events.append(self.tell(number, now, "lost", f"nothing came for {columns['silence'][number]:g} s"))
        return events

    def shown(self) -> list[tuple]:
        """Return the last sample of each series that was in the last commit: key and numbers."""
        found = {int(row[0]): row for rows in self._committed for row in rows}
        return [(self.by_number[number].key, *row[1:5].tolist(), int(row[5])) for number, row in found.items()]

    def tell(self, number: int, time: float, kind: str, text: str, odds: float | None = None) -> EventView:
        """Put down that something happened to a series."""
        self.last_event += 1
        event = EventView(self.last_event, self.by_number[number].key, time, kind, text.removeprefix(f"{kind}: "), odds)
        self._change.events.append(event)
        self.picture.happened(number, event)
        return event

    # --- models --------------------------------------------------------------------------------------------

    def _assign(self, series: Series, words: str, make: Callable[[], Any]) -> None:
        """Give a series to the group of its model."""
        config = series.config
        options: dict[str, Any] = {"dt": config.dt, "first": config.first, "stuck": config.stuck}
        name = json.dumps([words, options, config.inputs])
        if name not in self.group_words:
            self.groups.append(Rows(make(), **options))
            self.group_words.append(name)
            self._members.append([])
            self._kept.append(0)
        series.group = self.group_words.index(name)
        series.code = self.groups[series.group].add(series.key)
        self._members[series.group].append(series.number)

    def asking(self) -> Series | None:
        """Return a series that has samples enough to choose its model, and is not being asked for."""
        found = next((series for series in self._unchosen.values() if series.can_choose), None)
        if found is not None:
            found.is_asked = True
        return found

    @property
    def is_choosing(self) -> bool:
        """Whether a model is being chosen, or is about to be."""
        return any(series.is_asked or series.can_choose for series in self._unchosen.values())

    def choose(self, series: Series) -> tuple[str, Callable[[], Any]]:
        """Return words and maker of the model of a series, from its first samples; it takes seconds: use a thread."""
        return self.models.chosen(series.config, *arrays(series.samples[: series.config.identify]))

    def chosen(self, series: Series, words: str, make: Callable[[], Any]) -> list[EventView]:
        """Go on with a model; the samples so far are its first."""
        del self._unchosen[series.number]
        self._assign(series, words, make)
        self._change.members.append(listed(series))
        self._change.chosen.append(series.number)
        codes, time, y, u = self._buffers.setdefault(series.group or 0, ([], [], [], []))
        codes.extend([series.code] * len(series.samples))
        for t, output, *inputs in series.samples:
            time.append(t)
            y.append(output)
            u.append(tuple(inputs))
        series.samples, series.kept = [], 0
        return self._advance()

    # --- keeping -------------------------------------------------------------------------------------------

    @property
    def uncommitted(self) -> int:
        """How many samples were estimated since the last commit."""
        return sum(map(len, self._history))

    @property
    def is_dirty(self) -> bool:
        """Whether anything is not committed."""
        change = self._change
        return bool(self._dirty or self._waited or self._history or change.events or change.places or change.members)

    def commit(self) -> None:
        """Keep all that has come since the last commit; where that cannot be (`StoreFull`), all of it stays to come."""
        change = self._change
        dirty = [self.by_number[number] for number in sorted(self._dirty)]
        change.rows = []
        for group, (rows, members, size) in enumerate(zip(self.groups, self._members, self._kept)):
            codes = {series.code for series in dirty if series.group == group}
            change.rows += packed(rows, members, codes | set(range(size, len(rows.fleet))))
        self._change.groups = self._new_groups()
        change.waiting = [(number, self.by_number[number].waits()) for number in sorted(self._waited)]
        kept = {one.number: one.kept for one in dirty if one.group is None}
        change.samples = [(one.number, one.more()) for one in dirty if one.group is None]
        change.history = np.concatenate(self._history).tobytes() if self._history else b""
        try:
            number = self.store.commit(change)
        except BaseException:
            for number, before in kept.items():
                self.by_number[number].kept = before
            for rows in self.groups:
                rows._described = 0
            raise
        self.commits += 1
        self._kept = [len(rows.fleet) for rows in self.groups]
        if change.history:
            self.history.add(number, change.history)
        self._committed = self._history
        self._change, self._dirty, self._waited, self._history = Change(), set(), set(), []

    def _new_groups(self) -> list[Group]:
        """Return groups with what is new of their settings."""
        found = []
        for number, rows in enumerate(self.groups):
            settings = rows.new_settings()
            if settings:
                options = json.loads(self.group_words[number])[1]
                found.append(Group(number, self.group_words[number], rows.fields, options, settings))
        return found

    def _load(self) -> None:
        """Go on from what the store has."""
        found = self.store.load()
        inputs = {group.number: tuple(json.loads(group.words)[2]) for group in found.groups}
        for member in found.members:
            config = self.config.of(member.key)
            if member.group is not None and config.inputs != inputs[member.group]:  # a series keeps the model it has
                config = replace(config, inputs=inputs[member.group])
            series = Series(member.number, member.key, config, member.group, member.code)
            self.series[member.key] = series
            self.by_number.append(series)
            if member.group is None:
                self._unchosen[series.number] = series
            series.restore(found.samples.get(member.number, b""), found.waiting.get(member.number))
        self.picture.grow(len(self.by_number))
        self.picture.columns["silence"][:] = [series.config.silence for series in self.by_number]
        for group in found.groups:
            members = sorted((one for one in self.by_number if one.group == group.number), key=lambda one: one.code)
            rows = unpacked(group, members, found.rows)
            self.groups.append(rows)
            self.group_words.append(group.words)
            self._members.append([one.number for one in members])
            self._kept.append(len(rows.fleet))
        self.places, self.last_event = found.places, found.last_event
        for event in found.open_events:
            self.picture.happened(self.series[event.key].number, event)
        for number, blob in self.store.recent():
            self.history.add(number, blob)
        for rows, numbers, size in zip(self.groups, self._members, self._kept):
            kept = numbers[:size]
            self.picture.columns["count"][kept] = rows.tally["samples"][: len(kept)]
        for _, some in self.history.recent:
            np.subtract.at(self.picture.columns["count"], some[:, 0].astype(np.int64), 1.0)
        for _, some in self.history.recent:
            order = np.argsort(some[:, 0], kind="stable")
            edges = np.flatnonzero(np.append(True, np.diff(some[order, 0]) != 0))
            self.picture.take(some[order], np.append(edges, len(some)))
