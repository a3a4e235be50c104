"""What stands before every request: who asks, how often, from where; and what every answer says to a browser."""

from __future__ import annotations

import asyncio
import re
from http.cookies import CookieError, SimpleCookie

from h11 import LocalProtocolError
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .access import COOKIE, Access, is_named_here, is_ours
from .limits import Buckets, Limits

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
OPEN = re.compile(
    r"/|/api|/openapi\.json|/health|/ready|/sign-in|/static/[A-Za-z.]+"
)  # what needs no token: nothing of it tells data


class Guard:
    """An ASGI application in front of another: rate, host, origin, token, headers. In this order, cheapest first."""

    def __init__(self, app: ASGIApp, access: Access, limits: Limits):
        self.app, self.access = app, access
        self.requests = Buckets(limits.rate, limits.burst, limits.addresses)
        self.trials = Buckets(limits.trials / 60.0, limits.trials, limits.addresses)
        self._checks = asyncio.Semaphore(1)  # scrypt takes 16 MiB: one at a time

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return

        async def sealed(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
                headers.setdefault("Cache-Control", "no-store")
            await send(message)

        scope["guard"] = self
        refused = await self._refuse(scope)
        try:
            await (refused or self.app)(scope, receive, sealed)
        except LocalProtocolError:  # what came after the request's head was no HTTP: the server said so, and hangs up
            while (await receive())["type"] != "http.disconnect":
                pass

    async def _refuse(self, scope: Scope) -> Response | None:
        headers, address = Headers(scope=scope), (scope.get("client") or ("",))[0]
        if not self.requests.take(address):
            return _said(429, "too many requests", {"Retry-After": "1"})
        if self.access.is_open and not is_named_here(headers):
            return _said(421, "this service answers to the names of its own machine only")
        if scope["method"] not in ("GET", "HEAD") and not is_ours(headers):
            return _said(403, "asked by a page of another origin")
        if self.access.is_open or OPEN.fullmatch(scope["path"]) or self.access.has_session(_cookie(headers)):
            return None
        kind, _, token = headers.get("authorization", "").partition(" ")
        if kind.lower() != "bearer":
            return _said(401, "a token is needed: Authorization: Bearer ..", {"WWW-Authenticate": "Bearer"})
        return await self.trial(token.strip(), address)

    async def trial(self, token: str, address: str) -> Response | None:
        """Return None for the right token, else the refusal; wrong ones are counted by address."""
        if self.access.is_remembered(token):
            return None
        if self.trials.left(address) < 1.0:
            return _said(429, "too many wrong tokens", {"Retry-After": "60"})
        async with self._checks:
            if await asyncio.to_thread(self.access.is_right, token):
                return None
        self.trials.take(address)
        return _said(401, "that is not the token", {"WWW-Authenticate": "Bearer"})


def _cookie(headers: Headers) -> str:
    """Return the session of a browser, "" for none."""
    try:
        found = SimpleCookie(headers.get("cookie", "")[:4096]).get(COOKIE)
    except CookieError:
        return ""
    return found.value if found else ""


def _said(status: int, reason: str, headers: dict[str, str] | None = None) -> Response:
    return JSONResponse({"detail": reason}, status, headers)
