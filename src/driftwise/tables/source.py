"""Which reader a file takes, and which of its columns a name means."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from driftwise.engine.errors import InputError

__all__ = ["missing", "resolve", "source_of", "title"]


def title(path) -> str:
    """Return what to call the place a table comes from."""
    return "standard input" if str(path) == "-" else str(path)


def source_of(path):
    """Return the columns of a file, or of standard input, batch by batch."""
    import pyarrow as pa

    from driftwise.tables.csvfile import CsvSource
    from driftwise.tables.parquetfile import ParquetSource

    if str(path) == "-":
        return _named(path, lambda: CsvSource(sys.stdin.buffer))
    missing(path)
    with open(path, "rb") as file:
        magic = file.read(4)
    if magic == b"PAR1":
        return _named(path, lambda: ParquetSource(path))
    stream = pa.input_stream(str(path))
    packed = type(stream).__name__ == "CompressedInputStream"
    return _named(path, lambda: CsvSource(stream, None if packed else os.path.getsize(path)))


def missing(path) -> None:
    """Raise `InputError` where there is no file to be read, with the likely cause."""
    if not os.path.exists(path):
        raise InputError(f"{path}: no such file.{_similar_file(Path(path))}")
    if os.path.isdir(path):
        raise InputError(f"{path} is a folder; give one file in it.")
    if not os.access(path, os.R_OK):
        raise InputError(f"{path} may not be read: check the permissions of the file.")


def _named(path, opened):
    try:
        return opened()
    except InputError as error:
        raise InputError(f"{title(path)}: {error}") from None


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
