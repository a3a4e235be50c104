"""Files that are there as a whole, or not at all: written beside, made safe, renamed."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress

SUFFIX = ".writing"  # with a dot in front: what a killed process may leave behind


@contextmanager
def replaced(path) -> Iterator[str]:
    """Yield the name to write to; what was written there takes the place of ``path`` at the end, in one step.

    A process or a machine that dies at any moment leaves the old file or the new one. An error leaves the old one, and
    names ``path``. A link is followed; what is no file (a pipe, a terminal) is written to as it stands.
    """
    path = os.path.realpath(os.fspath(path))
    if os.path.exists(path) and not os.path.isfile(path):
        try:
            yield path
        except OSError as error:
            if error.errno is not None and error.filename is None:
                error.filename = path
            raise
        return
    folder, name = os.path.split(path)
    beside = os.path.join(folder, f".{name}.{secrets.token_hex(4)}{SUFFIX}")
    try:
        yield beside
        _make_safe(beside)
        os.replace(beside, path)
        _make_safe(folder)
    except OSError as error:  # a full disk says no name, and that beside is none of the caller's
        if error.errno is not None and error.filename in (None, beside):
            error.filename = path
        raise
    finally:
        with suppress(FileNotFoundError):
            os.remove(beside)


def write_text(path, text: str) -> None:
    """Write text (UTF-8) in place of what was there, in one step."""
    with replaced(path) as beside, open(beside, "w", encoding="utf-8", newline="") as file:
        file.write(text)


def _make_safe(path: str) -> None:
    """Return when a file or a folder is on the disk; folders of systems that cannot say so are left alone."""
    try:
        number = os.open(path, os.O_RDONLY if os.path.isdir(path) else os.O_RDWR)
    except PermissionError:
        if os.path.isdir(path):  # Windows opens no folders
            return
        raise
    try:
        os.fsync(number)
    finally:
        os.close(number)
