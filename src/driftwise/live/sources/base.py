"""What a source hands over: parcels of samples, with what is to be done once they are on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from ..decode import Chunk


class Parcel(NamedTuple):
    """Samples that are committed together.

    done : called after they are; it must be quick
    place : name of the source, and where it goes on from after them (JSON)
    refused : why each message that cannot be used was refused
    size : bytes that came
    told : where reasons are written why samples were refused, of the first ones
    """

    chunks: list[Chunk]
    done: Callable[[], None] | None = None
    place: tuple[str, Any] | None = None
    refused: tuple[str, ...] = ()
    size: int = 0
    told: list[str] | None = None


class Inbox(Protocol):
    """Where parcels go."""

    async def put(self, parcel: Parcel) -> None:
        """Hand over a parcel; a full inbox makes the source wait."""

    def push(self, parcel: Parcel) -> None:
        """The same from another thread, without waiting: such a source bounds what is under way by itself."""

    def note(self, source: str, words: str) -> None:
        """Say how a source is, "" for well; from any thread."""


class Source(Protocol):
    """A source. Its fields are its options in the configuration; nothing is opened before `run`."""

    @property
    def name(self) -> str:
        """What to call it: its places are kept under this name."""

    def plan(self) -> str:
        """Say in a line what it will do."""

    async def run(self, inbox: Inbox, place: Any) -> None:
        """Hand over what comes, from ``place`` on (None: from the beginning), until it ends or is cancelled."""
