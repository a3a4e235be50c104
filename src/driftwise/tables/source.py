"""What every reader of a table has, and which of its columns a name means."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from driftwise.engine.errors import InputError
from driftwise.tables.growing import MOST, refuse_long

DEVICE = 1 << 26  # bytes of a file of settings, and of what may be a device without end
STREAM = 1 << 28  # bytes of a stream that is held whole, and may be without end, too


class Source:
    """Rows of a table, batch by batch, read once.

    Attributes
    ----------
    title : what to call the place it comes from
    names, units : its columns, and the unit per name where the table gives one
    decimal, day_first : how cells of text are written: the decimal mark, and whether 1/2/2024 is in February
    rows : how many, None where only reading to the end can tell
    size, position : how much there is, None for a pipe, and how much of it was read; bytes or rows
    ragged : rows so far with too many or too few cells
    interval : seconds between rows, where what stands above them gives it
    closing : what lines below the rows begin with that are averages and the like, and no samples
    notes : how it is read, where that is not as it stands; a sentence each
    """

    title = "the table"
    names: tuple[str, ...] = ()
    decimal, day_first = ".", True
    rows: int | None = None
    size: int | None = None
    position = ragged = 0
    closing: tuple[str, ...] = ()
    interval: float | None = None
    notes: tuple[str, ...] = ()

    def __init__(self):
        self.units: dict[str, str] = {}
        self._ahead: list[tuple[list, Any]] = []

    @property
    def fraction(self) -> float | None:
        """Share of the table read so far; None for a pipe."""
        return self.position / self.size if self.size else None

    def said_of(self, name: str) -> str:
        """Return what the table says of a column: its name and unit."""
        return f"{name} {self.units.get(name, '')}"

    def look(self, rows: int) -> list[tuple[list, Any]]:
        """Return the first batches of all columns, of so many rows or more; `batches` hands them out once more."""
        seen = 0
        for arrays, ragged in self._rest_of(list(self.names)):
            self._ahead.append((arrays, ragged))
            seen += len(ragged)
            if seen >= rows:
                break
        return list(self._ahead)

    def batches(self, columns: list[str]) -> Iterator[tuple[list, Any]]:
        """Yield (pyarrow arrays in the order of `columns`, mask of the ragged rows): these hold nulls.

        Called again, it goes on where the last batch ended: the columns may change on the way.
        """
        at = [self.names.index(name) for name in columns] if self._ahead else []
        while self._ahead:
            arrays, ragged = self._ahead.pop(0)
            yield [arrays[j] for j in at], ragged
        yield from self._rest_of(columns)

    def _rest_of(self, columns: list[str]) -> Iterator[tuple[list, Any]]:
        """Read on; a file that breaks off on the way is refused by its name."""
        import pyarrow as pa

        try:
            yield from self._read(columns)
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{self.title}: {damaged(error)}") from None
        except InputError as error:
            raise InputError(f"{self.title}: {error}") from None

    def _read(self, columns: list[str]) -> Iterator[tuple[list, Any]]:
        raise NotImplementedError


def title_of(path) -> str:
    """Return what to call the place a table comes from."""
    return "standard input" if str(path) == "-" else str(path)


def damaged(error) -> str:
    """Return what to say of a table that begins well and breaks off."""
    return f"it cannot be read to its end ({error}). Was the copy cut short, or is the disk failing?"


def is_stream(path) -> bool:
    """Say whether a place can be read only once: standard input, a pipe, what a shell puts for <(command)."""
    return str(path) == "-" or (os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path))


def refuse_missing(path) -> None:
    """Raise `InputError` where there is no file to be read, with the likely cause."""
    if not os.path.exists(path):
        raise InputError(f"{path}: no such file.{_similar_file(Path(path))}")
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise InputError(f"{path}: the name of this file is not text that can be read; give it another") from None
    if os.path.isdir(path):
        raise InputError(f"{path} is a folder; give one file in it.")
    if not os.access(path, os.R_OK):
        raise InputError(f"{path} may not be read: check the permissions of the file.")


def bounded(file, title: str, most: int = DEVICE) -> bytes:
    """Return all that is in a binary file, of which there may be so much; of a device or stream, without end, less.

    A stream may not go on without the end of a line, either.
    """
    try:
        mode = os.fstat(file.fileno()).st_mode
    except OSError:  # it is no file of the system
        mode = stat.S_IFREG
    if stat.S_ISREG(mode):
        data = file.read(most + 1)
    else:
        most = min(most, DEVICE if stat.S_ISCHR(mode) else STREAM)
        data, since = bytearray(), 0  # the last line end
        while len(data) <= most and (part := file.read(min(MOST, most + 1 - len(data)))):
            end = part.rfind(b"\n")
            since = since + len(part) if end < 0 else len(part) - end - 1
            data += part
            refuse_long(since if len(data) <= most else 0, title)
    if len(data) > most == STREAM:
        raise InputError(
            f"{title} goes on after {most >> 20} MB, and all of it is held: save it in a file first, or follow it line "
            "by line (--follow)"
        )
    if len(data) > most:
        raise InputError(f"{title} holds more than {most >> 20} MB, as nothing of its kind does; is it the right file?")
    return bytes(data)


def _similar_file(path: Path) -> str:
    from difflib import get_close_matches

    folder = path.parent
    if not folder.is_dir():
        return f" There is no folder {folder} either."
    close = get_close_matches(path.name, [p.name for p in folder.iterdir()], 1)
    return f" Did you mean {folder / close[0]}?" if close else ""


def resolve(names, wanted: str, role: str) -> str:
    """Return the column called `wanted`, or say which columns there are."""
    from difflib import get_close_matches

    if wanted in names:
        return wanted
    if not isinstance(wanted, str):
        raise InputError(f"the {role} must be the name of a column, got {wanted!r}")
    if wanted.isdigit() and 1 <= int(wanted) <= len(names):
        return names[int(wanted) - 1]
    folded = {name.casefold(): name for name in names}
    close = get_close_matches(wanted.casefold(), folded, 3, 0.5)
    hint = f" Did you mean {' or '.join(repr(folded[c]) for c in close)}?" if close else ""
    shown = ", ".join(names[:30]) + (f" and {len(names) - 30} more" if len(names) > 30 else "")
    raise InputError(f"no column {wanted!r} for the {role}.{hint} The columns are: {shown}.")


def resolve_all(names, outputs, inputs, time: str | None, by: str | None = None) -> list[str]:
    """Return the columns of (key,) outputs, inputs (and time), each another one."""
    asked = [(by, "key")] if by is not None else []
    asked += [*((name, "output") for name in outputs), *((name, "input") for name in inputs)]
    asked += [(time, "time")] if time is not None else []
    found = [resolve(names, *one) for one in asked]
    twice = next((name for name in found if found.count(name) > 1), None)
    if twice is not None:
        roles = "output, inputs and time" if by is None else "key, output, inputs and time"
        raise InputError(f"column {twice!r} is given two parts to play; {roles} must be different columns.")
    return found
