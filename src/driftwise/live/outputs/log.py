"""Events as lines of a log: text, or JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, ClassVar

from ...engine.errors import InputError
from ..board import EventView
from .base import message


@dataclass(frozen=True)
class LogOutput:
    """Lines on standard output, or at the end of a file; ``format`` is text or json."""

    format: str = "text"
    path: str = ""
    events: bool = True
    estimates: ClassVar[bool] = False

    def __post_init__(self):
        if self.format not in ("text", "json"):
            raise InputError(f"format is text or json, got {self.format!r}")

    @property
    def name(self) -> str:
        return f"log {self.path or 'standard output'}"

    def plan(self) -> str:
        return f"write events as {self.format} to {self.path or 'standard output'}"

    async def run(self, queue: Any, note: Callable[[str, str], None], delivered: Callable[[str, int], None]) -> None:
        while True:
            events = [item for item in await queue.get() if isinstance(item, EventView)]
            try:
                self._write("".join(map(self._line, events)))
                note(self.name, "")
            except OSError as error:
                note(self.name, f"cannot be written: {error.strerror or error}")
            if events:
                delivered(self.name, events[-1].number)

    def _write(self, text: str) -> None:
        if not self.path:
            sys.stdout.write(text)
            sys.stdout.flush()
            return
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(text)

    def _line(self, event: EventView) -> str:
        if self.format == "json":
            return json.dumps(message(event)) + "\n"
        return f"{stamp(event.time)} {event.key}: {event.kind}: {event.sentence}\n"


def stamp(time: float) -> str:
    """Return an instant as text; what is no date of this age stays a number."""
    if not 1e8 < time < 1e11:
        return f"{time:g}"
    return datetime.fromtimestamp(time, UTC).isoformat(timespec="milliseconds")
