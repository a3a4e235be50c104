"""A file that grows, through rotations and restarts; and standard input."""

from __future__ import annotations

import asyncio
import os
from dataclasses import dataclass
from typing import Any

from ...engine.errors import InputError
from ...tables.growing import Growing
from ..decode import PER_SECOND, Shape
from .base import Inbox, Parcel
from .lines import FORMATS, Lines

PAUSE = 0.05  # s between two looks at a file


@dataclass(frozen=True)
class LineOptions:
    """What sources of lines have in common.

    key : of lines that name none; key_field, time_field : fields or columns that hold them; time_unit : of times that
    are numbers (s, ms, us, ns); format : auto, csv, json, influx
    """

    key: str = ""
    key_field: str = "key"
    time_field: str = "time"
    time_unit: str = "s"
    format: str = "auto"

    def __post_init__(self):
        if self.format not in FORMATS:
            raise InputError(f"format is one of {', '.join(FORMATS)}, got {self.format!r}")
        if self.time_unit not in PER_SECOND:
            raise InputError(f"time_unit is one of {', '.join(PER_SECOND)}, got {self.time_unit!r}")

    def lines(self, fallback: str, header: list[str] | None = None) -> Lines:
        """Return the reader of the lines."""
        shape = Shape(self.key_field, self.time_field, self.time_unit)
        return Lines(self.format, self.key or fallback, shape, header)


@dataclass(frozen=True)
class FileSource(LineOptions):
    """A CSV or JSON-lines file that grows. Rotated by renaming or by cutting, also while nobody looks."""

    path: str = ""

    def __post_init__(self):
        super().__post_init__()
        if not self.path:
            raise InputError("path is the file to follow, got none")

    @property
    def name(self) -> str:
        return f"file {self.path}"

    def plan(self) -> str:
        return f"follow {self.path}" + ("" if os.path.exists(self.path) else ", which is not there yet")

    async def run(self, inbox: Inbox, place: Any) -> None:
        place = place or {}
        stem = os.path.splitext(os.path.basename(self.path))[0]
        lines = self.lines(stem, place.get("header"))
        lines.form = place.get("format", lines.form)
        old = _moved(self.path, place)
        if old is not None:  # rotated while nobody looked: its end first
            await self._read(inbox, lines, Growing(old, 0.0, place["offset"]), is_last=True)
            lines.header, place = None, {}
        while not os.path.exists(self.path):
            inbox.note(self.name, "not there yet")
            await asyncio.sleep(1.0)
        inbox.note(self.name, "")
        begin = place.get("offset", 0) if place.get("inode") == os.stat(self.path).st_ino else 0
        if begin > os.path.getsize(self.path):
            begin, lines.header = 0, None  # cut short meanwhile
        await self._read(inbox, lines, Growing(self.path, PAUSE, begin))

    async def _read(self, inbox: Inbox, lines: Lines, growing: Growing, is_last: bool = False) -> None:
        try:
            while True:
                try:
                    data, begins = await asyncio.to_thread(growing.read)
                except InputError as error:  # a line without end
                    await inbox.put(Parcel([], None, None, (str(error),), 0))
                    continue
                if data:
                    chunks, refused = lines.read(data, begins)
                    inode, offset = growing.place
                    place = {"inode": inode, "offset": offset, "header": lines.header, "format": lines.form}
                    await inbox.put(Parcel(chunks, None, (self.name, place), refused, len(data)))
                elif is_last:
                    return
        finally:
            growing.close()


def _moved(path: str, place: dict[str, Any]) -> str | None:
    """Return where the file that was being read stands now, if it was moved within its folder."""
    inode = place.get("inode")
    if inode is None or (os.path.exists(path) and os.stat(path).st_ino == inode):
        return None
    folder = os.path.dirname(os.path.abspath(path))
    with os.scandir(folder) as entries:
        return next((entry.path for entry in entries if entry.is_file() and entry.inode() == inode), None)


@dataclass(frozen=True)
class StdinSource(LineOptions):
    """Lines of standard input, until it is closed."""

    name = "stdin"

    def plan(self) -> str:
        return "read standard input until it is closed"

    async def run(self, inbox: Inbox, place: Any) -> None:
        growing, lines = Growing("-", PAUSE), self.lines("stdin")
        while not growing.has_ended:
            try:
                data, _ = await asyncio.to_thread(growing.read)
            except InputError as error:  # a line without end
                await inbox.put(Parcel([], None, None, (str(error),), 0))
                continue
            if growing.has_ended:
                data += growing.rest()
            if data:
                chunks, refused = lines.read(data)
                await inbox.put(Parcel(chunks, None, None, refused, len(data)))
