"""The lines of a file that is being written, or of standard input, as they are completed."""

from __future__ import annotations

import os
import select
import sys
from time import sleep

MOST = 1 << 22  # bytes taken at a time


class Growing:
    """Hands out complete lines; a file may be truncated and begun anew, or moved away and another put in its place.

    Bad at: a file that is cut and has grown beyond its old length between two looks; it is then read on from there.

    Parameters
    ----------
    path : file, or "-" for standard input
    pause : s between two looks at a file
    begin : byte of the file to begin with
    """

    def __init__(self, path: str, pause: float = 0.1, begin: int = 0):
        self.path, self.pause = path, pause
        self.has_ended = False  # a pipe was closed: nothing more will come
        self._partial = b""
        self._begins = False  # the next line is the first of another file
        self._file = sys.stdin.buffer.raw if path == "-" else open(path, "rb", buffering=0)  # type: ignore
        if begin:
            self._file.seek(begin)

    @property
    def place(self) -> tuple[int, int]:
        """Which file is read (its inode), and the bytes of it that were handed out."""
        return os.fstat(self._file.fileno()).st_ino, self._file.tell() - len(self._partial)

    def read(self) -> tuple[bytes, bool]:
        """Return complete lines, b"" where none came within the pause, and whether they begin another file."""
        if self.path == "-":
            return self._piped(), False
        data = self._file.read(MOST) or b""
        if not data and self._is_other():
            data = self._replaced()
        elif not data:
            sleep(self.pause)
        lines = self._complete(data)
        begins, self._begins = self._begins, self._begins and not lines
        return lines, begins

    def rest(self) -> bytes:
        """Return the last line if it was never completed."""
        rest, self._partial = self._partial, b""
        return rest

    def close(self) -> None:
        if self.path != "-":
            self._file.close()

    def _piped(self) -> bytes:
        ready, _, _ = select.select([self._file], [], [], self.pause)
        if not ready:
            return b""
        data = self._file.read(MOST)
        self.has_ended = data == b""
        return self._complete(data or b"")

    def _complete(self, data: bytes) -> bytes:
        lines, end, rest = (self._partial + data).rpartition(b"\n")
        self._partial = rest
        return lines + end

    def _is_other(self) -> bool:
        """Say whether the path now names another file, or the same one cut short."""
        try:
            now = os.stat(self.path)
        except FileNotFoundError:
            return False  # moved away: the new one is to come
        old = os.fstat(self._file.fileno())
        return (now.st_dev, now.st_ino) != (old.st_dev, old.st_ino) or now.st_size < self._file.tell()

    def _replaced(self) -> bytes:
        """Return the end of a file that was moved away, then turn to the new one."""
        data = self._file.read(MOST) or b""
        if data:
            return data
        was_cut = os.fstat(self._file.fileno()).st_size < self._file.tell()
        if self._partial and not was_cut:
            return b"\n"  # nobody will complete the last line
        self._file.close()
        self._file, self._partial, self._begins = open(self.path, "rb", buffering=0), b"", True
        return b""
