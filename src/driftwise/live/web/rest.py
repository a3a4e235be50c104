"""Answers to programs: series, events, samples, health. Each reads the board and returns JSON."""

from __future__ import annotations

import asyncio
from math import isfinite
from typing import Any
from urllib.parse import unquote

from sse_starlette import EventSourceResponse
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from driftwise.engine.errors import InputError
from driftwise.live.board import Board, Receipt

from . import encode, metrics
from .access import COOKIE, SESSION, Access
from .guard import Guard
from .limits import Limits, body_of
from .samples import samples_of
from .stream import Hub

KINDS = {  # of bodies with samples, by media type
    "application/x-ndjson": "json",
    "application/jsonl": "json",
    "application/json": "json",
    "text/plain": "influx",
    "application/octet-stream": "influx",
}
MOST_KEYS = 50  # of one request for sparklines
FULL_PAST = 200  # events that a series is told with


class Api:
    """The handlers, with what they share.

    Parameters
    ----------
    board : the running service
    access, limits : who may ask, and how much
    """

    def __init__(self, board: Board, access: Access, limits: Limits):
        self.board, self.access, self.limits = board, access, limits
        self.hub = Hub(board, limits.streams)

    async def series(self, request: Request) -> Response:
        return _json({"series": [encode.short(view) for view in self.board.series()]})

    async def one(self, request: Request) -> Response:
        """One series, or its history: which is told apart before %2F is unpacked, so a key may have any character."""
        segments = request.scope["raw_path"].split(b"?")[0].decode("ascii", "replace").split("/")[3:]
        if len(segments) not in (1, 2) or segments[1:] not in ([], ["history"]):
            raise HTTPException(404, "no such path; write / in a key as %2F")
        key = unquote(segments[0])
        try:
            if segments[1:]:
                return await self._history(request, key)
            events = self.board.events(0, key, FULL_PAST, latest=True)
            return _json(encode.full(self.board.view(key), events))
        except KeyError:
            raise HTTPException(404, "no such series") from None

    async def _history(self, request: Request, key: str) -> Response:
        start, end = _number(request, "start"), _number(request, "end")
        points = int(_number(request, "points") or self.limits.points)
        self.board.view(key)
        points = min(max(points, 2), self.limits.points)
        rows = await asyncio.to_thread(self.board.history, key, start, end)
        parameters = await asyncio.to_thread(self.board.parameters, key, start, end)
        return _json(encode.history(rows, points) | {"past": encode.past(parameters, points)})

    async def recent(self, request: Request) -> Response:
        """The last outputs of some series, for sparklines."""
        told = {}
        for key in request.query_params.getlist("key")[:MOST_KEYS]:
            try:
                view = self.board.view(key)
            except KeyError:
                continue
            told[key] = {"count": view.count, "output": [encode.finite(value) for value in view.sparkline]}
        return _json(told)

    async def events(self, request: Request) -> Response:
        since, limit = int(_number(request, "since") or 0), int(_number(request, "limit") or self.limits.events)
        most = min(max(limit, 1), self.limits.events)
        found = self.board.events(since, request.query_params.get("key"), most + 1)
        return _json({"events": [encode.event(seen) for seen in found[:most]], "more": len(found) > most})

    async def acknowledge(self, request: Request) -> Response:
        try:
            return _json(encode.event(self.board.acknowledge(request.path_params["number"])))
        except KeyError:
            raise HTTPException(404, "no such event") from None

    async def samples(self, request: Request) -> Response:
        """Take samples; answered when they are on disk."""
        media = request.headers.get("content-type", "application/x-ndjson").partition(";")[0].strip().lower()
        kind = KINDS.get(media)
        if kind is None:
            raise HTTPException(415, f"send one of {', '.join(KINDS)}")
        body = await body_of(request, self.limits)
        try:
            samples, reasons = samples_of(body, kind)
            receipt = await self.board.put(samples) if samples else Receipt(0, 0)
        except InputError as error:
            raise HTTPException(400, str(error)) from None
        reason = receipt.reason or (reasons[0] if reasons else "")
        told = {"taken": receipt.taken, "refused": receipt.refused + len(reasons), "reason": reason}
        return _json(told, 400 if told["refused"] and not receipt.taken else 200)

    async def stream(self, request: Request) -> Response:
        if self.hub.is_full:
            raise HTTPException(503, "too many pages are open")
        messages = self.hub.messages(request.query_params.get("key"))
        return EventSourceResponse(messages, ping=3600, send_timeout=30, headers={"Cache-Control": "no-store"})

    async def service(self, request: Request) -> Response:
        return _json({"health": self.board.health(), "counters": self.board.counters()})

    async def health(self, request: Request) -> Response:
        return self._is("healthy")

    async def ready(self, request: Request) -> Response:
        return self._is("ready")

    def _is(self, what: str) -> Response:
        is_so = bool(self.board.health().get(what))
        return _json({what: is_so}, 200 if is_so else 503)

    async def metrics(self, request: Request) -> Response:
        board = self.board
        picture = metrics.Picture(board.series(), board.health(), board.counters(), self.limits.metrics)
        text, media = await asyncio.to_thread(metrics.exposition, picture, request.headers.get("accept", ""))
        return Response(text, headers={"Content-Type": media})

    async def sign_in(self, request: Request) -> Response:
        """Exchange the token for a cookie that scripts cannot read."""
        token = (await body_of(request, self.limits._replace(body=1024))).decode("utf-8", "replace").strip()
        if not self.access.is_open:
            guard: Guard = request.scope["guard"]
            refused = await guard.trial(token, request.client.host if request.client else "")
            if refused is not None:
                return refused
        response = _json({"signed_in": True})
        if not self.access.is_open:
            is_safe = request.url.scheme == "https"
            response.set_cookie(
                COOKIE, self.access.session(), max_age=SESSION, httponly=True, samesite="strict", secure=is_safe
            )
        return response


def _json(value: Any, status: int = 200) -> Response:
    return Response(encode.dumps(value), status, media_type="application/json")


def _number(request: Request, name: str) -> float | None:
    """Return a number of the query, refused in a sentence where it is none."""
    text = request.query_params.get(name)
    if text is None or text == "":
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise HTTPException(400, f"{name} is to be a number")
    return value
