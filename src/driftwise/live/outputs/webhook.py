"""Events to a web address: signed, and tried again until it takes them."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import json
import os
import random
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit

from ...engine.errors import InputError
from ..board import EventView
from .base import message

SIGNATURE = "X-Driftwise-Signature"  # sha256= and the HMAC of the body
FIRST, LAST = 0.5, 300.0  # s between two attempts
PATIENCE = 10.0  # s for one attempt
AT_ONCE = 100  # events in one body


@dataclass(frozen=True)
class WebhookOutput:
    """POSTs ``{"events": [..]}``; ``secret_env`` names the variable with the secret that signs it.

    An answer of 2xx takes the events; 4xx other than 408 and 429 refuses them for good, and is told; all else is tried
    again, later and later. Events keep their order. Bad at: being the only thing that wakes somebody.
    """

    url: str
    secret_env: str = "DRIFTWISE_WEBHOOK_SECRET"
    events: bool = True
    estimates: ClassVar[bool] = False

    def __post_init__(self):
        if urlsplit(self.url).scheme not in ("http", "https"):
            raise InputError(f"url is http:// or https://, got {self.url!r}")

    @property
    def name(self) -> str:
        parts = urlsplit(self.url)  # without a query, where tokens are, and without a user
        return f"webhook {parts.scheme}://{parts.hostname}{parts.path}"

    def plan(self) -> str:
        signed = "signed" if os.environ.get(self.secret_env) else f"not signed ({self.secret_env} is not set)"
        return f"post events to {self.name.removeprefix('webhook ')}, {signed}"

    async def run(self, queue: Any, note: Callable[[str, str], None], delivered: Callable[[str, int], None]) -> None:
        waiting: list[EventView] = []
        while True:
            waiting += [item for item in await queue.get() if isinstance(item, EventView)]
            while not queue.empty():
                waiting += [item for item in queue.get_nowait() if isinstance(item, EventView)]
            while waiting:
                some = waiting[:AT_ONCE]
                await self._deliver(some, note)
                delivered(self.name, some[-1].number)
                del waiting[:AT_ONCE]

    async def _deliver(self, events: list[EventView], note: Callable[[str, str], None]) -> None:
        body = json.dumps({"events": [message(event) for event in events]}).encode()
        pause = FIRST
        while True:
            refused = await asyncio.to_thread(self._post, body)
            if refused is None:
                note(self.name, "")
                return
            words, is_final = refused
            note(self.name, words)
            if is_final:
                return
            await asyncio.sleep(pause * random.uniform(0.5, 1.0))
            pause = min(2 * pause, LAST)

    def _post(self, body: bytes) -> tuple[str, bool] | None:
        """Send a body; return None where it was taken, else why not, and whether that is final."""
        request = urllib.request.Request(self.url, body, {"Content-Type": "application/json"}, method="POST")
        if secret := os.environ.get(self.secret_env):
            request.add_header(SIGNATURE, f"sha256={hmac.new(secret.encode(), body, hashlib.sha256).hexdigest()}")
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE):
                return None
        except HTTPError as error:
            is_final = 400 <= error.code < 500 and error.code not in (408, 429)
            return f"answers {error.code}", is_final
        except (URLError, OSError, ValueError) as error:
            return f"cannot be reached: {getattr(error, 'reason', error)}", False
