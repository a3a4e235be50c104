"""One process at a time in a folder."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from .errors import InputError


@contextmanager
def alone(folder: str | os.PathLike, refusal: str) -> Iterator[None]:
    """Refuse, in these words, a folder that another process holds; systems without locks of files trust their users."""
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(number)
        raise InputError(refusal) from None
    try:
        yield
    finally:
        fcntl.flock(number, fcntl.LOCK_UN)  # a process that was started meanwhile may still hold a copy
        os.close(number)
