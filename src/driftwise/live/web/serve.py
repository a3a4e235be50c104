"""`serve`: the application at an address of this machine, inside a loop that runs already."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Iterator
from pathlib import Path

import h11
import uvicorn
from starlette.applications import Starlette
from uvicorn.protocols.http.h11_impl import H11Protocol

from driftwise.engine.errors import InputError
from driftwise.live.board import Board
from driftwise.live.config import WebConfig

from .access import Access, check_binding
from .app import application

CONNECTIONS = 512  # at a time
GRACE = 3  # s that open requests have at the end


class Site:
    """A running web server; ``address`` is what to type into a browser.

    Parameters
    ----------
    app : what `application` returned
    host, port : where to listen; port 0 takes a free one
    token_hash : that of the token `app` asks for; beyond this machine there must be one
    certificate, private_key : files for TLS, both or neither
    say : told the address once it listens
    """

    def __init__(
        self,
        app: Starlette,
        host: str = "127.0.0.1",
        port: int = 8765,
        token_hash: str | None = None,
        certificate: Path | None = None,
        private_key: Path | None = None,
        say: Callable[[str], object] | None = None,
    ):
        check_binding(host, token_hash)
        if (certificate is None) != (private_key is None):
            raise InputError("TLS needs a certificate and its private key: give both files or neither.")
        self.host, self.port, self.is_tls, self.say = host, port, certificate is not None, say
        config = uvicorn.Config(
            app,
            host=host,
            port=port,
            ssl_certfile=certificate,
            ssl_keyfile=private_key,
            log_level=logging.ERROR,  # a stranger who sends what is no HTTP fills no log
            access_log=False,
            server_header=False,
            proxy_headers=False,
            limit_concurrency=CONNECTIONS,
            timeout_keep_alive=15,
            timeout_graceful_shutdown=GRACE,
            h11_max_incomplete_event_size=64 << 10,
            ws="none",
            http=_Protocol,
        )
        self._app, self._server = app, _Server(config)
        self._task: asyncio.Task[None] | None = None

    @property
    def address(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.is_tls else 'http'}://{host}:{self.port}"

    async def start(self) -> None:
        """Listen; `InputError` where the port is taken."""
        self._task = asyncio.create_task(_quietly(self._server))
        while not self._server.started:
            if self._task.done():
                raise InputError(f"nothing can listen at {self.host}:{self.port}; is something else there?")
            await asyncio.sleep(0.01)
        self.port = self._server.servers[0].sockets[0].getsockname()[1]
        if self.say is not None:
            self.say(self.address)

    async def stop(self) -> None:
        """Close open pages and end."""
        if (hub := getattr(self._app.state, "hub", None)) is not None:
            hub.close()
        self._server.should_exit = True
        if self._task is not None:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._task, 2 * GRACE)


def site_of(board: Board, config: WebConfig, say: Callable[[str], object] | None = None) -> Site:
    """Return the site of a board, as the settings want it; it says its address once it listens."""
    token_hash = config.token_hash or None
    files = {"certificate": Path(config.tls_cert), "private_key": Path(config.tls_key)} if config.tls_cert else {}
    return Site(application(board, Access(token_hash)), config.host, config.port, token_hash, say=say, **files)


class _Protocol(H11Protocol):
    """HTTP that hangs up on what is none while an answer is given, or was: it is too late to say 400 then."""

    def send_400_response(self, msg: str) -> None:
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            with contextlib.suppress(h11.LocalProtocolError):  # an answer to HEAD has no words
                return super().send_400_response(msg)
        self.transport.close()


class _Server(uvicorn.Server):
    """Signals are the service's own to take."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


async def _quietly(server: uvicorn.Server) -> None:
    """Serve until told to end; a port that is taken ends no process."""
    with contextlib.suppress(SystemExit):
        await server.serve()
