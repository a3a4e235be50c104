"""`TrackMap`: a page on this machine on which the tracks of a running tracker are drawn as they move."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from time import monotonic

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from driftwise.engine.errors import InputError
from driftwise.live.track_picture import Picture, encoded, picture

from . import pages
from .access import Access
from .app import told
from .guard import Guard
from .limits import Limits
from .serve import Site

REFRESH = 0.5  # s between two pictures
SHARE = 0.05  # of the tracker's time that may go into them
WAIT = 10.0  # s that the server may take to begin, or to end


class TrackMap:
    """A web server in a thread of its own; `show` hands it what a tracker knows. The tracker waits for nobody.

    Parameters
    ----------
    port : of 127.0.0.1; 0 takes a free one

    Raises
    ------
    InputError
        Where the port is taken.
    """

    def __init__(self, port: int = 0):
        self._lock = threading.Lock()
        self._seen: Picture | None = None
        self._came, self._heard, self._next = 0, monotonic(), 0.0
        self._encoded: tuple[Picture | None, bytes] = None, b'{"time":null,"plots":0,"total":0,"ahead":0,"tracks":[]'
        self._ready = threading.Event()
        self._error: InputError | None = None
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run(port)), name="track map", daemon=True)
        self._thread.start()
        if not self._ready.wait(WAIT):
            raise InputError("the server of the page does not begin")
        if self._error is not None:
            raise self._error

    def show(self, tracker) -> None:
        """Take a picture of a tracker, no more often than it is worth; to be called whenever it was fed, or waits."""
        now = monotonic()
        if tracker.inbox.arrivals != self._came:
            self._came, self._heard = tracker.inbox.arrivals, now
        if now < self._next:
            return
        seen = picture(tracker)
        with self._lock:
            self._seen = seen
        self._next = monotonic() + max(REFRESH, (monotonic() - now) / SHARE)

    def close(self) -> None:
        """End the server."""
        with contextlib.suppress(RuntimeError):  # it has ended
            self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join(WAIT)

    # --- in the thread of the server -----------------------------------------------------------------------

    async def _run(self, port: int) -> None:
        self._loop, self._over = asyncio.get_running_loop(), asyncio.Event()
        site = Site(self._application(), port=port)
        try:
            await site.start()
            self.address = site.address
        except InputError as error:
            self._error = error
            return
        finally:
            self._ready.set()
        await self._over.wait()
        await site.stop()

    def _application(self) -> Starlette:
        files = pages.read()

        async def page(request: Request) -> Response:
            return pages.answer(request, files, "map.html")

        async def static(request: Request) -> Response:
            return pages.answer(request, files, request.path_params["name"])

        async def tracks(request: Request) -> Response:
            return Response(self._answer(), media_type="application/json")

        routes = [Route("/", page), Route("/static/{name}", static), Route("/tracks", tracks)]
        app = Starlette(routes=routes, exception_handlers={HTTPException: told, Exception: told})
        app.add_middleware(Guard, access=Access(), limits=Limits())
        return app

    def _answer(self) -> bytes:
        """Return the last picture, made into JSON once for all pages, and for how long no plot has come."""
        with self._lock:
            seen, silent = self._seen, monotonic() - self._heard
        if seen is not self._encoded[0] and seen is not None:
            self._encoded = seen, encoded(seen)[:-1]
        return self._encoded[1] + b',"silent":%.1f}' % silent
