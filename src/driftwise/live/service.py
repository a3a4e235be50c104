"""`Service`: one process; asyncio outside, the compiled step inside, a commit after each handful of samples."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from ..engine.errors import InputError
from .board import EventView
from .config import Config
from .core import Core
from .history import LARGE
from .inbox import ServiceInbox
from .outputs.base import Estimate
from .store import opened
from .store.base import StoreFull
from .view import LiveBoard

AT_ONCE = 20_000  # samples between two commits
PAUSE = 0.002, 0.01  # s between two commits, at least and at most
UNCOMMITTED = 1_000_000  # samples that may wait for a store that is full
AGAIN = 1.0  # s until a store that was full is tried again
LAST_WORDS = 3.0  # s that outputs have at the end
LONGEST = 10_000  # handfuls that wait for an output, after which the oldest are left out
TURN = 1.0  # s between two looks at what is slow: files of history, silence, the day
OLD = 600.0  # s after which history becomes a file though it is small


class Service:
    """Runs a configuration until `stop` is called, or until all sources have ended and nothing else can bring samples.

    Parameters
    ----------
    config : Config
    estimator_of : how the command line reads words of models
    site : returns a server of the board with ``start`` and ``stop``, None for none
    """

    def __init__(
        self, config: Config, estimator_of: Callable[[Any], Any], site: Callable[[LiveBoard], Any] | None = None
    ):
        self.config, self.site = config, site
        self.core = Core(config, opened(config.store), estimator_of)
        self.board: LiveBoard | None = None
        self._end = asyncio.Event()
        self._events: list[EventView] = []  # not committed yet
        self._done: list[Callable[[], None]] = []  # to be called after the commit
        self._queues: dict[str, tuple[Any, asyncio.Queue]] = {}

    def stop(self) -> None:
        """Ask it to end: what has come is committed first."""
        self._end.set()

    async def run(self) -> None:
        """Run until the end."""
        inbox = ServiceInbox(asyncio.get_running_loop())
        self.inbox, self.board = inbox, LiveBoard(self.core, inbox)
        outputs = [asyncio.create_task(self._output(output)) for output in self.config.outputs]
        site = self.site(self.board) if self.site else None
        if site is not None:
            await site.start()
        work = asyncio.create_task(self._work())
        turns = [asyncio.create_task(turn()) for turn in (self._slow, self._choose, self._sync)]
        sources = [asyncio.create_task(source.run(inbox, self.core.places.get(source.name)), name=source.name)
                   for source in self.config.sources]  # fmt: skip
        try:
            await self._until_end(sources, [work, *turns, *outputs], has_site=site is not None)
        finally:
            await _ended([*sources, *turns])
            if site is not None:
                await site.stop()
            await _ended([work])
            await self._last()
            await _ended(outputs)
            self.core.store.close()

    async def _until_end(self, sources: list, others: list, has_site: bool) -> None:
        """Return when it is to end; raise what a part of it raised."""
        asked = asyncio.create_task(self._end.wait())
        waiting = {asked, *sources, *others}
        while not asked.done():
            done, waiting = await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                if task is not asked and task.exception() is not None:
                    asked.cancel()
                    raise task.exception()
            if sources and all(task.done() for task in sources) and not has_site:
                asked.cancel()
                while len(self.inbox):
                    await asyncio.sleep(PAUSE[0])
                while self.core.choosing.is_busy:
                    await asyncio.sleep(PAUSE[1])
                return

    # --- samples -------------------------------------------------------------------------------------------

    async def _work(self) -> None:
        """Take what comes, commit it, and tell."""
        while True:
            await self.inbox.wait()
            began = time.perf_counter()
            await self._handful()
            took = time.perf_counter() - began
            await asyncio.sleep(min(max(took, PAUSE[0]), PAUSE[1]))

    async def _handful(self) -> None:
        """Take a handful of samples, commit them, and tell.

        While the store is full nothing is acknowledged or told, and estimating goes on, up to a bound.
        """
        parcels = self.inbox.drain(AT_ONCE) if self.core.uncommitted < UNCOMMITTED else []
        self._events += self.core.take(parcels, time.time())
        self._done += [parcel.done for parcel in parcels if parcel.done is not None]
        self._commit()

    def _commit(self) -> bool:
        """Commit, acknowledge and tell; where the store is full, say so and return False."""
        assert self.board is not None
        if self.core.is_dirty:
            try:
                self.core.commit()
            except StoreFull as error:
                self.board.store_trouble = f"nothing can be written ({error}); estimating goes on"
                self.board.stir()
                self.inbox.loop.call_later(AGAIN, self.inbox.wake)
                return False
        self.board.store_trouble = ""
        done, self._done = self._done, []
        events, self._events = self._events, []
        for one in done:
            one()
        self._publish(events)
        return True

    def _publish(self, events: list[EventView]) -> None:
        """Hand what was committed to the outputs, and wake those who look."""
        assert self.board is not None
        self.board.stir()
        estimates = [Estimate(*one) for one in self.core.shown()] if self._wants_estimates else []
        for output, queue in self._queues.values():
            items = [*(events if output.events else []), *(estimates if output.estimates else [])]
            if items:
                if queue.full():
                    queue.get_nowait()
                queue.put_nowait(items)

    @property
    def _wants_estimates(self) -> bool:
        return any(output.estimates for output in self.config.outputs)

    async def _last(self) -> None:
        """Take and commit what is left, and let the outputs have it."""
        while self._events or self._done or self.core.is_dirty or len(self.inbox):
            await self._handful()
            if not self._commit():
                break
        until = time.monotonic() + LAST_WORDS
        while any(not queue.empty() for _, queue in self._queues.values()) and time.monotonic() < until:
            await asyncio.sleep(0.02)
        await asyncio.sleep(0.05 if self._queues else 0.0)
        with suppress(StoreFull):
            self.core.commit()
        await asyncio.to_thread(self.core.store.sync)

    # --- beside it -----------------------------------------------------------------------------------------

    async def _output(self, output: Any) -> None:
        """Run an output; what it has not delivered before comes first."""
        queue: asyncio.Queue = asyncio.Queue(LONGEST)
        self._queues[output.name] = output, queue
        place = f"out {output.name}"
        before = self.core.places.get(place)
        missed = [] if before is None or not output.events else self.core.store.events(before, None)
        if missed:
            queue.put_nowait(missed)

        def delivered(name: str, number: int) -> None:
            self.core.place(place, number)

        if before is None:
            delivered(place, self.core.last_event)
        await output.run(queue, self.inbox.note, delivered)

    async def _choose(self) -> None:
        """Choose models, one series after the other, beside the work."""
        while True:
            series = self.core.choosing.asking()
            if series is None:
                await asyncio.sleep(0.1)
                continue
            choice = await asyncio.to_thread(self.core.choosing.choose, series)
            self._events += self.core.chosen(series, choice)
            self._commit()

    async def _slow(self) -> None:
        """Look after silence and history now and then."""
        assert self.board is not None
        last, today = time.monotonic(), datetime.now(UTC).date()
        while True:
            await asyncio.sleep(TURN)
            events = self.core.silent(time.time())
            if events:
                self._events += events
                self._commit()
            now, day = time.monotonic(), datetime.now(UTC).date()
            if self.core.history.samples < LARGE and now - last < OLD and day == today:
                continue
            last, today = now, day
            try:
                await self._roll()
                self.core.history.sweep(day)
                self.core.past.sweep(day)
            except (OSError, StoreFull) as error:
                self.board.store_trouble = f"history cannot be written: {error}"

    async def _roll(self) -> None:
        """Write the recent history to files."""
        names = [rows.drift.parameters for rows in self.core.roster.groups]
        for past, table, more in ((self.core.history, "recent", []), (self.core.past, "past", names)):
            part = past.part()
            if part is not None:
                await asyncio.to_thread(past.write, part, self.core.keys(part.numbers), more)
                self.core.store.forget(part.last, table)
                past.written(part)

    async def _sync(self) -> None:
        """Bring commits to the disk at the declared interval."""
        seen = 0
        while self.config.store.fsync > 0:
            await asyncio.sleep(self.config.store.fsync)
            if self.core.commits != seen:
                seen = self.core.commits
                await asyncio.to_thread(self.core.store.sync)


async def _ended(tasks: list[asyncio.Task]) -> None:
    """Cancel tasks and wait for their end."""
    for task in tasks:
        task.cancel()
    for task in tasks:
        with suppress(asyncio.CancelledError, InputError):
            await task
