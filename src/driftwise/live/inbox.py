"""Where sources put parcels and the service takes them: bounded, and open to other threads."""

from __future__ import annotations

import asyncio
from collections import deque

from .sources.base import Parcel

MOST = 100_000  # samples that wait, after which sources that can wait do


class ServiceInbox:
    """Parcels on their way from sources to the core, in the order they came."""

    def __init__(self, loop: asyncio.AbstractEventLoop):
        self.loop = loop
        self.notes: dict[str, str] = {}
        self.waiting = 0  # samples
        self._parcels: deque[Parcel] = deque()
        self._wake, self._room = asyncio.Event(), asyncio.Event()
        self._room.set()
        self._is_woken = False

    @property
    def is_full(self) -> bool:
        """Whether sources are made to wait."""
        return not self._room.is_set()

    def __len__(self) -> int:
        return len(self._parcels)

    async def put(self, parcel: Parcel) -> None:
        """Hand over a parcel; a full inbox makes the source wait."""
        await self._room.wait()
        self.waiting += _size(parcel)
        if self.waiting >= MOST:
            self._room.clear()
        self._parcels.append(parcel)
        self._wake.set()

    def push(self, parcel: Parcel) -> None:
        """The same from another thread, without waiting."""
        self._parcels.append(parcel)
        if not self._is_woken:
            self._is_woken = True
            self.loop.call_soon_threadsafe(self._wake.set)

    def note(self, source: str, words: str) -> None:
        """Say how a source is, "" for well."""
        self.notes[source] = words

    async def wait(self) -> None:
        """Return when there may be parcels."""
        await self._wake.wait()
        self._wake.clear()

    def wake(self) -> None:
        """Let `wait` return."""
        self._wake.set()

    def drain(self, most: int) -> list[Parcel]:
        """Return parcels that wait, up to so many samples, in the order they came."""
        self._is_woken = False  # before the look: what is pushed from now on wakes again
        found, size = [], 0
        while self._parcels and size < most:
            parcel = self._parcels.popleft()
            size += _size(parcel)
            found.append(parcel)
        self.waiting = max(self.waiting - size, 0) if self._parcels else 0
        if self.waiting < MOST:
            self._room.set()
        if self._parcels:
            self._wake.set()
        return found


def _size(parcel: Parcel) -> int:
    """Return how many samples a parcel has, at least 1."""
    return max(sum(len(chunk.time) for chunk in parcel.chunks), 1)
