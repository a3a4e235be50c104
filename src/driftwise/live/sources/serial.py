"""Lines of a serial port."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Any

from ...engine.errors import InputError
from .base import Inbox, Parcel
from .files import LineOptions

AGAIN = 2.0  # s until a port that is gone is opened again
LONGEST = 1 << 16  # bytes of a line


@dataclass(frozen=True)
class SerialSource(LineOptions):
    """A serial port that sends lines. Nothing can be asked for again: what comes while nobody reads is lost."""

    port: str = ""
    baud: int = 9600

    def __post_init__(self):
        super().__post_init__()
        if not self.port:
            raise InputError("port is a device such as /dev/ttyUSB0, got none")

    @property
    def name(self) -> str:
        return f"serial {self.port}"

    def plan(self) -> str:
        return f"read lines from {self.port} at {self.baud} baud"

    async def run(self, inbox: Inbox, place: Any) -> None:
        try:
            import serial
        except ImportError:
            raise InputError("a serial port needs pyserial: pip install 'driftwise[live]'") from None
        lines = self.lines("serial")
        while True:
            try:
                with serial.Serial(self.port, self.baud, timeout=0.1) as port:
                    inbox.note(self.name, "")
                    await self._read(inbox, lines, port)
            except (serial.SerialException, OSError) as error:
                inbox.note(self.name, f"gone ({error}); trying again")
                await asyncio.sleep(AGAIN)

    async def _read(self, inbox: Inbox, lines: Any, port: Any) -> None:
        partial = b""
        while True:
            data = await asyncio.to_thread(lambda: port.read(port.in_waiting or 1))
            whole, end, partial = (partial + data).rpartition(b"\n")
            if end:
                chunks, refused = lines.read(whole + end)
                await inbox.put(Parcel(chunks, None, None, refused, len(whole) + 1))
            if len(partial) > LONGEST:
                partial = b""
                await inbox.put(Parcel([], None, None, (f"a line above {LONGEST} bytes",), LONGEST))
