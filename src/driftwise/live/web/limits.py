"""How much the network may ask for: bytes of a body, requests a second, streams at a time."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from typing import NamedTuple

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request


class Limits(NamedTuple):
    """What one service takes from the network; beyond it a request is refused, with 413, 429 or 503."""

    body: int = 8 << 20  # bytes of one request
    seconds: float = 30.0  # until the body of a request is here
    rate: float = 200.0  # requests a second of one address
    burst: float = 400.0  # that may come at once
    trials: float = 10.0  # wrong tokens a minute of one address
    addresses: int = 4096  # that are counted apart
    streams: int = 64  # pages that are open at a time
    points: int = 2000  # of a history in one answer
    events: int = 500  # in one answer
    metrics: int = 1000  # series with numbers of their own in /metrics


class Buckets:
    """Token buckets, one for each address: `rate` a second, `burst` at once (Turner, 1986).

    The address that was quiet longest is forgotten first when there are too many.
    """

    def __init__(self, rate: float, burst: float, addresses: int):
        self.rate, self.burst, self.addresses = rate, burst, addresses
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def left(self, address: str, now: float | None = None) -> float:
        """Return how many requests of `address` may pass now."""
        now = time.monotonic() if now is None else now
        had, at = self._left.get(address, (self.burst, now))
        return min(self.burst, had + (now - at) * self.rate)

    def take(self, address: str, now: float | None = None) -> bool:
        """Count one request; return whether it may pass."""
        now = time.monotonic() if now is None else now
        left = self.left(address, now)
        passes = left >= 1.0
        self._left[address] = (left - 1.0 if passes else left, now)
        self._left.move_to_end(address)
        if len(self._left) > self.addresses:
            self._left.popitem(last=False)
        return passes


async def body_of(request: Request, limits: Limits) -> bytes:
    """Return the body, refused as soon as it is too long or too slow; nothing is unpacked."""
    if request.headers.get("content-encoding", "identity") != "identity":
        raise HTTPException(415, "a packed body is not taken; send it plain")
    declared = request.headers.get("content-length", "")
    if declared.isdigit() and int(declared) > limits.body:
        raise HTTPException(413, f"more than {limits.body} bytes in one request")
    parts, size = [], 0
    try:
        async with asyncio.timeout(limits.seconds):
            async for part in request.stream():
                size += len(part)
                if size > limits.body:
                    raise HTTPException(413, f"more than {limits.body} bytes in one request")
                parts.append(part)
    except TimeoutError:
        raise HTTPException(408, "the body did not come in time") from None
    except ClientDisconnect:  # nobody hears the answer
        raise HTTPException(400, "the body broke off") from None
    return b"".join(parts)
