"""Server-sent events: all series at first, then those that changed, made once for all pages that are open."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from typing import Any

from sse_starlette import ServerSentEvent

from driftwise.live.board import Board, SeriesView

from .encode import LAST, dumps, full, row

PACE = 0.25  # s between two messages
BEAT = 10.0  # s after which silence is broken
WHOLE = 10  # series whose parameters are asked for at one look
BACKLOG = 40  # messages a page may be behind; then it begins anew


class Hub:
    """One look at the board every `PACE` seconds while somebody watches, every two seconds while nobody does."""

    def __init__(self, board: Board, limit: int):
        self.board, self.limit = board, limit
        self._queues: set[asyncio.Queue[tuple[str, set[str]]]] = set()
        self._revision = 0
        self._woken = asyncio.Event()
        self._is_closed = False

    @property
    def is_full(self) -> bool:
        return len(self._queues) >= self.limit

    async def run(self) -> None:
        """Look at the board until cancelled."""
        while True:
            self.look()
            self._woken.clear()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._woken.wait(), PACE if self._queues else 2.0)
            if self._queues:
                await asyncio.sleep(PACE / 5)  # whoever has just come does not hurry the others

    def look(self) -> None:
        """Tell what has changed since the last look."""
        self._revision, keys = self.board.changes(self._revision)
        if keys:
            self._tell(keys)

    def _views(self, keys: list[str]) -> list[SeriesView]:
        """Return series as they are now; a series alone is told with its forecast, which takes longer."""
        if len(keys) > WHOLE:
            changed = set(keys)
            return [view for view in self.board.series() if view.key in changed]
        views = []
        for key in keys:
            with contextlib.suppress(KeyError):
                views.append(self.board.view(key))
        return views

    def close(self) -> None:
        """End every stream."""
        self._is_closed = True
        for queue in self._queues:
            self._put(queue, "", set())

    @staticmethod
    def _put(queue: asyncio.Queue[tuple[str, set[str]]], text: str, keys: set[str]) -> None:
        """Hand over a message; a page that is too far behind begins anew, with an empty one."""
        if queue.full():
            text, keys = "", set()
            while not queue.empty():
                queue.get_nowait()
        queue.put_nowait((text, keys))

    def _tell(self, keys: list[str]) -> None:
        rows = [row(view) for view in self._views(keys)]
        text = dumps({"now": time.time(), "rows": rows}).decode()
        for queue in self._queues:
            self._put(queue, text, set(keys))

    async def messages(self, key: str | None) -> AsyncIterator[ServerSentEvent]:
        """Yield what one page is sent; with `key`, everything of that series, too."""
        queue: asyncio.Queue[tuple[str, set[str]]] = asyncio.Queue(BACKLOG)
        self._queues.add(queue)
        self._woken.set()
        try:
            yield self._all()
            if key is not None:
                yield self._one(key)
            while not self._is_closed:
                try:
                    text, keys = await asyncio.wait_for(queue.get(), BEAT)
                except TimeoutError:
                    yield ServerSentEvent(event="beat", data="{}")
                    continue
                if self._is_closed:
                    return
                yield ServerSentEvent(event="changed", data=text) if text else self._all()
                if key is not None and (key in keys or not text):
                    yield self._one(key)
        finally:
            self._queues.discard(queue)

    def _all(self) -> ServerSentEvent:
        rows = [row(view) for view in self.board.series()]
        return _event("all", {"now": time.time(), "columns": LAST, "rows": rows})

    def _one(self, key: str) -> ServerSentEvent:
        try:
            return _event("series", full(self.board.view(key)))
        except KeyError:
            return _event("series", {"key": key, "missing": True})


def _event(name: str, value: dict[str, Any]) -> ServerSentEvent:
    return ServerSentEvent(event=name, data=dumps(value).decode())
