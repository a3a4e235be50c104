"""`Core`: what a service does with samples, without a network and without waiting: join, estimate, tell, keep."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..engine.errors import InputError, brief
from .board import EventView
from .choosing import Choice, Choosing
from .config import Config
from .decode import Chunk
from .fit import ASKED
from .history import PARAMETERS, WIDTH, History
from .models import Models
from .picture import Picture
from .roster import Roster
from .rows import Shown
from .sender_clock import beyond_words
from .series import Series, keys_of
from .sources.base import Parcel
from .store.base import Change, Member, Store, StoreFull

UNWRITABLE = re.compile("[\0\ud800-\udfff]")
REASONS = 20  # last reasons of refusals that are kept
SPARE = 50_000  # series beyond `most` that may come between two commits
RESERVE = 16  # of the series, one of so many goes to rest at a time
UNHEARD = "nothing came"  # begins the sentence of a series that is lost


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
        self.roster = Roster(lambda key: self.config.of(key))
        self.choosing = Choosing(self.roster, self.models)
        self.series = self.roster.by_key
        self.picture, self.history = Picture(), History(config.store.path, config.store.days)
        self.past = History(config.store.path, config.store.days, PARAMETERS)
        self.counters: Counter[str] = Counter()
        self.reasons: dict[str, int] = {}
        self.places: dict[str, Any] = {}
        self.last_event, self.last_series = 0, -1
        self.resting = 0  # series that are on the disk alone
        self.commits = 0
        self._change, self._dirty, self._waited = Change(), dict[int, Series](), dict[int, Series]()  # by number
        self._history: list[np.ndarray] = []
        self._past: list[np.ndarray] = []
        self._buffers: dict[int, tuple[list, list, list, list]] = {}
        self._later: list[Chunk] = []  # of keys about which the store could not be asked
        self._said: list[EventView] = []  # to be told with the next samples
        self._told: list[str] | None = None
        self._now, self._committed = 0.0, list[np.ndarray]()
        self._load()

    # --- samples -------------------------------------------------------------------------------------------

    def take(self, parcels: Iterable[Parcel], now: float) -> list[EventView]:
        """Take parcels that came at an instant; return what happened."""
        self._now = now
        later, self._later = self._later, []
        for chunk in later:
            self._chunk(chunk, now)
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
        reason = brief(reason).encode("utf-8", "replace").decode()  # half a character can neither be written nor sent
        self.counters["refused"] += 1
        if self._told is not None:
            self._told.append(reason)
        self.reasons[reason] = self.reasons.pop(reason, 0) + 1
        if len(self.reasons) > REASONS:
            del self.reasons[next(iter(self.reasons))]

    def _chunk(self, chunk: Chunk, now: float) -> None:
        """Read one chunk."""
        times = chunk.time
        for i, time in enumerate(times):
            if time != time:
                times[i] = now
        found = self.series.get(chunk.key)
        if self._later and found is None:
            self._later.append(chunk)
            return
        try:
            for one in [chunk] if found is not None else keys_of(chunk, self.config.of(chunk.key)):
                series = self.series.get(one.key) or self._new(one.key)
                if found is not None and series.config.output not in one.fields:
                    one = keys_of(one, series.config)[0]
                self._rows(series, one)
        except InputError as error:
            self.refuse(str(error))
        except StoreFull:
            self._later.append(chunk)

    def _right(self, series: Series, chunk: Chunk) -> None:
        """Put right the stamps of a sender whose clock is ahead, and tell it; leave out those that are of no clock."""
        found = series.waiting.sender.right(chunk.time, self._now)
        if not found.ahead:
            return
        self.counters["future"] += found.ahead
        self._waited[series.number] = series
        self._said += [self.tell(series, time, "clock", text) for time, text in found.said]
        for at in reversed(found.beyond):
            self.refuse(beyond_words(series.key))
            for values in (chunk.time, *chunk.fields.values()):
                del values[at]

    def _new(self, key: str) -> Series:
        """Return a series that is not in memory: it was at rest, or comes for the first time."""
        if len(key) > 500 or UNWRITABLE.search(key):
            raise InputError(f"a key of {len(key)} characters: at most 500, none of them 0 or half a character")
        if len(self.series) >= self.config.store.most + SPARE:
            self.counters["keys_refused"] += 1
            raise InputError(
                f"{len(self.series)} series are in memory ({self.config.store.most} is most in [store]) and none "
                "of them is at rest; further keys are refused"
            )
        found = self.store.asleep(key) if self.resting else None
        if found is not None:
            series = self.roster.wake(found)
            self.resting -= 1
            self._change.woken.append(series.number)
            series.restore(found.samples, found.waiting)
            self._seen(series, found.open_events)
            self.counters["woken"] += 1
            return series
        self.last_series += 1
        series = self.roster.enter(self.last_series, key)
        self.picture.enter(series.slot, series.number, series.config.silence)
        if series.config.model == "auto":
            self.choosing.add(series)
        else:
            self.roster.assign(series, *self.models.named(series.config))
        self._change.members.append(Member(series.number, key, series.group))
        return series

    def find(self, key: str) -> Series:
        """Return a series, also one at rest, which it is no longer then; `KeyError` where there is none."""
        if key not in self.series and self.resting and self.store.asleep(key) is not None:
            return self._new(key)
        return self.series[key]

    def _rows(self, series: Series, chunk: Chunk) -> None:
        """Take the rows that a chunk frees."""
        self._right(series, chunk)
        rows = series.rows(chunk)
        if not series.is_plain:
            self._waited[series.number] = series
        if not rows:
            return
        self.counters["samples"] += len(rows)
        series.held = rows[-1].inputs
        self.picture.columns["heard"][series.slot] = self._now
        self._dirty[series.number] = series
        if series.group is None:
            series.samples += [(row.time, row.output, *row.inputs) for row in rows]
            self.picture.revision += 1
            self.picture.columns["revision"][series.slot] = self.picture.revision
            return
        self._queue(series, rows)

    def _queue(self, series: Series, rows: Iterable[tuple[float, float, Sequence[float]]]) -> None:
        """Let rows wait for `_advance`."""
        assert series.group is not None
        codes, time, y, u = self._buffers.setdefault(series.group, ([], [], [], []))
        for instant, output, inputs in rows:
            codes.append(series.code)
            time.append(instant)
            y.append(output)
            u.append(inputs)

    def _advance(self) -> list[EventView]:
        """Let the fleets take what has come; return what happened."""
        events, self._said = self._said, []
        buffers, self._buffers = self._buffers, {}
        for group, buffer in buffers.items():
            for shown in self.roster.groups[group].take(*buffer, self._now):
                events += self._shown(group, shown)
        self.counters["events"] += len(events)
        return events

    def _shown(self, group: int, shown: Shown) -> list[EventView]:
        """Put down what samples showed, and return what happened."""
        rows, taken, outs = self.roster.groups[group], shown.taken, shown.outs
        members = self.roster.members[group]
        slots = np.array([members[code] for code in taken.at.tolist()], np.int64)
        level = rows.intake.levels[0][taken.at, 0]
        found = np.empty((len(slots), WIDTH))
        found[:, 0], found[:, 1], found[:, 2] = (
            self.picture.columns["number"][slots],
            taken.time,
            taken.ys[:, 0] + level,
        )
        found[:, 3], found[:, 4], found[:, 5] = outs[:, 0] + level, np.sqrt(outs[:, 2]), outs[:, 3]
        self._history.append(found)
        self.picture.take(slots, found, shown.starts)
        for i, theta, std in shown.points:
            one = [np.full(len(theta), value) for value in (found[i, 0], found[i, 1], group)]
            self._past.append(np.column_stack([*one, np.arange(len(theta)), theta, std]))
        events = [(time, members[code], kind, text, odds) for code, time, kind, text, odds in rows.alarms(shown)]
        for i in np.flatnonzero(shown.fits).tolist():
            series, u = self.roster.at(int(slots[i])), taken.us[i] + rows.intake.levels[1][taken.at[i]]
            if shown.fits[i] == ASKED:
                self.choosing.add(series)
                text = f"{self.roster.model(series)}, predicts otherwise than it says ({rows.fit.words(series.code)}): "
                text += f"a model is chosen again by the next {rows.fit.window} samples"
                events.append((float(taken.time[i]), series.slot, "model", text, None))
            else:
                series.samples.append((float(taken.time[i]), float(found[i, 2]), *u.tolist()))
        lost = self.picture.columns["is_lost"]
        for i in shown.starts[:-1][lost[slots[shown.starts[:-1]]] > 0].tolist():
            events.append((float(taken.time[i]), int(slots[i]), "back", "it sends again", None))
        lost[slots] = 0.0
        events.sort(key=lambda event: event[:3])
        return [self.tell(self.roster.at(slot), time, kind, text, odds) for time, slot, kind, text, odds in events]

    def silent(self, now: float) -> list[EventView]:
        """Return the series of which nothing has come for as long as was said, as events."""
        return [
            self.tell(self.roster.at(slot), now, "lost", f"{UNHEARD} for {silence:g} s")
            for slot, silence in self.picture.lose(now)
        ]

    def shown(self) -> list[tuple]:
        """Return the last sample of each series that was in the last commit: key and numbers."""
        rows = np.concatenate(self._committed) if self._committed else np.zeros((0, WIDTH))
        last, known = dict(zip(rows[:, 0].tolist(), range(len(rows)))), self.roster.by_number
        found = rows[[at for number, at in last.items() if number in known]].tolist()
        return [(known[number].key, *numbers, int(status)) for number, *numbers, status in found]

    def tell(self, series: Series, time: float, kind: str, text: str, odds: float | None = None) -> EventView:
        """Put down that something happened to a series."""
        self.last_event += 1
        event = EventView(self.last_event, series.key, time, kind, text.removeprefix(f"{kind}: "), odds)
        self._change.events.append(event)
        self.picture.happened(series.slot, event)
        return event

    # --- models --------------------------------------------------------------------------------------------

    def chosen(self, series: Series, choice: Choice) -> list[EventView]:
        """Go on with a model that was chosen; of the first one, the samples so far are its first."""
        self._change.chosen.append(series.number)
        self._dirty[series.number] = series
        if series.group is None:
            samples = self.choosing.taken(series)
            self.roster.assign(series, choice.words, choice.make)
            self._queue(series, ((time, output, inputs) for time, output, *inputs in samples))
            events = self._advance()
        else:
            last = series.samples[-1][0]
            events = [self.tell(series, last, "model", self.choosing.chosen(series, choice))]
            self.counters["events"] += 1
        self._change.members.append(Member(series.number, series.key, series.group))
        return events

    # --- keeping -------------------------------------------------------------------------------------------

    @property
    def uncommitted(self) -> int:
        """How many samples were estimated since the last commit."""
        return sum(map(len, self._history))

    @property
    def is_dirty(self) -> bool:
        """Whether anything is not committed."""
        change = self._change
        return bool(
            self._dirty or self._waited or self._history or self._later
            or change.events or change.places or change.members or change.woken or change.resting
        )  # fmt: skip

    def commit(self) -> None:
        """Keep all that has come since the last commit; where that cannot be (`StoreFull`), all of it stays to come."""
        if self._later:  # until `take` has asked again
            raise StoreFull("it cannot be asked about keys that came")
        change, dirty = self._change, [self._dirty[number] for number in sorted(self._dirty)]
        change.rows = self.roster.packed(dirty)
        change.groups = self.roster.new_groups()
        change.waiting = [(number, series.waits()) for number, series in sorted(self._waited.items())]
        kept = [(series, series.kept) for series in dirty]
        change.samples = [(series.number, series.more()) for series in dirty if len(series.samples) > series.kept]
        change.history = np.concatenate(self._history).tobytes() if self._history else b""
        change.past = np.concatenate(self._past).tobytes() if self._past else b""
        try:
            numbers = self.store.commit(change)
        except BaseException:
            for series, before in kept:
                series.kept = before
            for rows in self.roster.groups:
                rows._described = 0
            raise
        self.commits += 1
        for past, number, blob in zip((self.history, self.past), numbers, (change.history, change.past)):
            if blob:
                past.add(number, blob)
        self._committed = self._history
        self._change, self._dirty, self._waited, self._history, self._past = Change(), {}, {}, [], []
        self._rest()

    def _rest(self) -> None:
        """Where there are too many series, let those that were silent longest be on the disk alone."""
        most = self.config.store.most
        if len(self.series) <= most:
            return
        heard, silence, is_lost = (self.picture.columns[name] for name in ("heard", "silence", "is_lost"))
        able = [
            series.slot for series in self.series.values()
            if not series.is_asked and (silence[series.slot] == 0 or is_lost[series.slot])
        ]  # fmt: skip
        able.sort(key=heard.__getitem__)
        some = [self.roster.at(slot) for slot in able[: len(self.series) - most + most // RESERVE]]
        for series in some:
            self.choosing.series.pop(series.number, None)
            heard[series.slot] = 0.0
        self.roster.remove(some)
        self._change.resting += [series.number for series in some]
        self.resting += len(some)

    def keys(self, numbers: Iterable[int]) -> dict[int, str]:
        """Return keys of series by number, also of those at rest."""
        known = self.roster.by_number
        found = {number: known[number].key for number in numbers if number in known}
        return found | self.store.keys([number for number in numbers if number not in known])

    def _seen(self, series: Series, open_events: list[EventView]) -> None:
        """Begin the picture of a series that the store had, and go on collecting where it was at that."""
        self.picture.enter(series.slot, series.number, series.config.silence)
        for event in open_events:
            self.picture.happened(series.slot, event)
        last = self.picture.last.get(series.slot)
        self.picture.columns["is_lost"][series.slot] = last is not None and last.sentence.startswith(UNHEARD)
        if series.group is None:
            self.choosing.add(series)
            return
        rows = self.roster.groups[series.group]
        if series.code < len(rows.tally):
            self.picture.columns["count"][series.slot] = rows.tally["samples"][series.code]
        if rows.fit.window and series.code < len(rows.fit) and rows.fit["collected"][series.code] > 0:
            self.choosing.add(series)

    def _load(self) -> None:
        """Go on from what the store has."""
        found = self.store.load()
        self.places, self.last_event = found.places, found.last_event
        self.last_series, self.resting = found.last_series, found.resting
        self.roster.load(found.groups, found.members, found.rows)
        opened: dict[str, list[EventView]] = {}
        for event in found.open_events:
            opened.setdefault(event.key, []).append(event)
        for series in self.series.values():
            series.restore(found.samples.get(series.number, b""), found.waiting.get(series.number))
            self._seen(series, opened.get(series.key, []))
        for past, table in ((self.history, "recent"), (self.past, "past")):
            for number, blob in self.store.recent(table):
                past.add(number, blob)
        slots = {number: series.slot for number, series in self.roster.by_number.items()}
        self.picture.recall([rows for _, rows in self.history.recent], slots)
