"""A web site of simulated pumps in a process of its own: `python simulated_site.py PORT SERIES SECONDS_A_TICK`."""

import asyncio
import sys
import threading

from live.simulated_board import Simulated

from driftwise.live.web.app import application
from driftwise.live.web.limits import Limits
from driftwise.live.web.serve import Site


class Running:
    """A site that runs in a thread of this process; `restart` ends it and begins a new one at the same port."""

    def __init__(self, board, access=None, tick=None, **site):
        self.board, self.access, self.tick, self.site = board, access, tick, site
        self.port = 0
        self.start()

    def start(self):
        self.ready, self.over = threading.Event(), None
        self.thread = threading.Thread(target=lambda: asyncio.run(self._run()), daemon=True)
        self.thread.start()
        assert self.ready.wait(30)

    async def _run(self):
        self.loop, self.over = asyncio.get_running_loop(), asyncio.Event()
        app = self.app = application(self.board, self.access, Limits(rate=1000, burst=2000))
        site = Site(app, port=self.port, **self.site)
        await site.start()
        self.port, self.address = site.port, site.address
        self.ticking = asyncio.create_task(self._tick())
        self.ready.set()
        await self.over.wait()
        self.ticking.cancel()
        await site.stop()

    async def _tick(self):
        while True:
            if self.tick:
                self.board.tick(census_too=len(self.board.keys) < 100)
            await asyncio.sleep(self.tick or 0.05)

    def do(self, act, *given):
        """Run a function in the loop of the site and return what it returned."""

        async def acted():
            return act(*given)

        return asyncio.run_coroutine_threadsafe(acted(), self.loop).result(30)

    def stop(self):
        self.loop.call_soon_threadsafe(self.over.set)
        self.thread.join(30)


if __name__ == "__main__":
    port, series, tick = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    names = [f"hall {k % 7}/pump {k:03d}" for k in range(series)]
    shown = Simulated(names, broken=names[3:4])
    shown.time -= 300
    for _ in range(300):
        shown.tick(census_too=False)
    site = Running(shown, tick=tick, **{})
    print(site.address, flush=True)
    threading.Event().wait()
