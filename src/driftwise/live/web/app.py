"""`application`: page, API, stream and metrics of a board as one ASGI application."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from driftwise.live.board import Board

from . import encode, pages
from .access import Access
from .guard import Guard
from .limits import Limits
from .rest import Api
from .routes import openapi, routes


def application(board: Board, access: Access | None = None, limits: Limits | None = None) -> Starlette:
    """Return the application that shows `board` to people and programs.

    Parameters
    ----------
    board : the running service
    access : who may ask; everybody on this machine if omitted
    limits : how much may be asked for
    """
    access, limits = access or Access(), limits or Limits()
    api, files, table = Api(board, access, limits), pages.read(), encode.dumps(openapi())

    async def page(request: Request) -> Response:
        return pages.answer(request, files, "index.html")

    async def described(request: Request) -> Response:
        return pages.answer(request, files, "api.html")

    async def static(request: Request) -> Response:
        return pages.answer(request, files, request.path_params["name"])

    async def document(request: Request) -> Response:
        return Response(table, media_type="application/json")

    @contextlib.asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        looking = asyncio.create_task(api.hub.run())
        try:
            yield
        finally:
            looking.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await looking

    ours = [
        Route("/", page),
        Route("/api", described),
        Route("/static/{name}", static),
        Route("/openapi.json", document),
    ]
    said = {HTTPException: told, Exception: told}
    app = Starlette(routes=ours + routes(api), lifespan=lifespan, exception_handlers=said)
    app.router.redirect_slashes = False
    app.state.hub = api.hub
    app.add_middleware(Guard, access=access, limits=limits)
    return app


async def told(request: Request, error: Exception) -> Response:
    """Say why in JSON; of an error of ours nothing but that: it is in the log."""
    status = error.status_code if isinstance(error, HTTPException) else 500
    detail = error.detail if isinstance(error, HTTPException) else "an error of the service; its log says more"
    return Response(encode.dumps({"detail": detail}), status, media_type="application/json")
