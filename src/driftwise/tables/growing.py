"""The lines of a file that is being written, or of standard input, as they are completed."""

from __future__ import annotations

import os
import select
import sys
from time import sleep

from driftwise.engine.errors import InputError

MOST = 1 << 22  # bytes taken at a time
LONGEST_LINE = 1 << 26  # bytes that a line may have


def refuse_long(size: int, title: str = "") -> None:
    """Raise `InputError` where so many bytes came without the end of a line; ``title`` says of what."""
    if size > LONGEST_LINE:
        where = f"{title}: " if title else ""
        raise InputError(
            f"{where}a line is longer than {LONGEST_LINE >> 20} MiB, which no row of a table is. Are line ends "
            "missing, or does a quote open that never closes?"
        )


class Growing:
    """Hands out complete lines; a file may be truncated and begun anew, or moved away and another put in its place.

    A line beyond 64 MiB is told as an `InputError` and left out: the next call goes on behind it.

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
        self._partial: list[bytes] = []  # of the line that is not complete yet
        self._is_left_out = False  # whether that line is too long
        self._begins = False  # the next line is the first of another file
        if path == "-":
            self._file = sys.stdin.buffer.raw  # type: ignore[union-attr]  # a pipe's buffer has one
        else:
            self._file = open(path, "rb", buffering=0)
        if begin:
            self._file.seek(begin)

    @property
    def place(self) -> tuple[int, int]:
        """Which file is read (its inode), and the bytes of it that were handed out."""
        return os.fstat(self._file.fileno()).st_ino, self._file.tell() - sum(map(len, self._partial))

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
        rest, self._partial = b"".join(self._partial), []
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
        lines, end, rest = data.rpartition(b"\n")
        if end:
            whole = b"".join([*self._partial, lines, end])
            whole = whole.partition(b"\n")[2] if self._is_left_out else whole
            self._partial, self._is_left_out = [rest], False
            return whole
        if rest and not self._is_left_out:
            self._partial.append(rest)
            size = sum(map(len, self._partial))
            self._is_left_out = size > LONGEST_LINE
            self._partial = [] if self._is_left_out else self._partial
            refuse_long(size, "standard input" if self.path == "-" else self.path)
        return b""

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
        if any(self._partial) and not was_cut:
            return b"\n"  # nobody will complete the last line
        self._file.close()
        self._file, self._partial, self._begins = open(self.path, "rb", buffering=0), [], True
        self._is_left_out = False
        return b""
