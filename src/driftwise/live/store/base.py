"""What a store keeps, and what it is handed in one commit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from ..board import EventView


class Group(NamedTuple):
    """A model with its series: its words, how its rows are laid out, and the settings its series have."""

    number: int
    words: str
    fields: str
    options: dict[str, Any]  # dt, first, stuck
    settings: list[Any]  # JSON of each; in a change, (number, JSON) of those that are new


class Member(NamedTuple):
    """A series: numbers count them as they come; ``group`` is None until its model is chosen."""

    number: int
    key: str
    group: int | None


class RowBytes(NamedTuple):
    """A series as it is: its row of numbers, and what is held back of it."""

    number: int
    row: bytes
    held: bytes


@dataclass
class Change:
    """What one commit writes: all of it, or nothing."""

    groups: list[Group] = field(default_factory=list)  # with the settings that are new
    members: list[Member] = field(default_factory=list)  # new, or in a group now
    rows: list[RowBytes] = field(default_factory=list)
    waiting: list[tuple[int, str]] = field(default_factory=list)
    samples: list[tuple[int, bytes]] = field(default_factory=list)  # more, of series whose model is not chosen
    chosen: list[int] = field(default_factory=list)  # series whose samples are not needed any more
    events: list[EventView] = field(default_factory=list)
    history: bytes = b""  # samples
    past: bytes = b""  # parameters
    places: dict[str, Any] = field(default_factory=dict)
    resting: list[int] = field(default_factory=list)  # series that are on the disk alone from now on
    woken: list[int] = field(default_factory=list)  # and those that are not any more


@dataclass
class Found:
    """What was kept; of series at rest, how many there are."""

    groups: list[Group]
    members: list[Member]
    rows: dict[int, RowBytes]
    waiting: dict[int, str]
    samples: dict[int, bytes]
    places: dict[str, Any]
    last_event: int
    open_events: list[EventView]  # the last of each series, and those that nobody acknowledged
    resting: int
    last_series: int  # the highest number of a series, -1 for none


class Asleep(NamedTuple):
    """A series that is at rest."""

    member: Member
    row: RowBytes | None
    waiting: str | None
    samples: bytes
    open_events: list[EventView]


class Store(Protocol):
    """Keeps states, events and places; what `commit` has returned from survives a process that is killed."""

    def load(self) -> Found:
        """Return what was kept."""

    def asleep(self, key: str) -> Asleep | None:
        """Return a series that is not in memory, None where there is none; `StoreFull` where it cannot be known now."""

    def keys(self, numbers: Sequence[int]) -> dict[int, str]:
        """Return keys of series by number."""

    def commit(self, change: Change) -> tuple[int, int]:
        """Write a change; return the numbers of its history and of its past, 0 for none.

        `StoreFull` where nothing could be written.
        """

    def sync(self) -> None:
        """Return when all commits are on the disk."""

    def events(self, since: int, key: str | None, most: int | None = None, latest: bool = False) -> list[EventView]:
        """Return events above a number, oldest first; at most so many: the first, or the ``latest``."""

    def acknowledge(self, number: int) -> EventView:
        """Note that an event was seen; `KeyError` where there is none."""

    def recent(self, table: str = "recent") -> list[tuple[int, bytes]]:
        """Return history ("past": parameters) that is not in Parquet yet, with numbers that count up."""

    def forget(self, upto: int, table: str = "recent") -> None:
        """Forget what is so up to a number: it is in Parquet."""

    def close(self) -> None:
        """End."""


class StoreFull(Exception):
    """Nothing could be written, for now: the disk is full, or the database is gone."""


EVENT = "number", "key", "time", "kind", "sentence", "odds", "acknowledged"


def event_of(row: Sequence[Any]) -> EventView:
    """Return an event as a table has it."""
    number, key, time, kind, sentence, odds, acknowledged = row
    return EventView(number, key, time, kind, sentence, odds, bool(acknowledged))
