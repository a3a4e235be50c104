"""Where compiled loops are kept, and for which machine they are."""

from __future__ import annotations

import atexit
import errno
import hashlib
import os
import platform
import shutil
import stat
import sys
import tempfile
import time
import warnings
from functools import cache
from pathlib import Path

STOCK = Path(__file__).with_name("objects")  # what came with the wheel
OURS = ("*.fast.*.so", "*.quick.*.so", "*.cuda", "*.pending", "driftwise-*")  # all that is ever in the folder
DAY = 86400.0  # seconds


def folder() -> Path:
    """Return where compiled loops are kept: ``DRIFTWISE_CACHE``, else the user's cache; one that can be written to."""
    return _writable(os.environ.get("DRIFTWISE_CACHE", ""))


@cache
def _writable(wanted: str) -> Path:
    """Return the folder, or one for this process alone where it cannot be written to."""
    try:
        path = Path(wanted) if wanted else _usual()
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.name == "posix" and path.stat().st_mode & stat.S_IWOTH:
            raise OSError(errno.EACCES, "everybody may write to it, and what is there would be run")
        with tempfile.TemporaryFile(dir=path):
            return path
    except (OSError, RuntimeError) as trouble:  # RuntimeError: nobody's home
        own = Path(tempfile.mkdtemp(prefix="driftwise-"))
        atexit.register(shutil.rmtree, own, ignore_errors=True)
        warnings.warn(
            f"compiled code cannot be kept in {wanted or 'the cache of this user'} "
            f"({getattr(trouble, 'strerror', None) or trouble}), so it is made again in every "
            f"process; DRIFTWISE_CACHE names another folder (this time: {own})",
            RuntimeWarning,
            stacklevel=2,
        )
        return own


def _usual() -> Path:
    """Return the folder that the system means for such things."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "driftwise" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "driftwise"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "driftwise"


def touch(path: Path) -> None:
    """Mark a file as used, once a day."""
    if time.time() - path.stat().st_mtime > DAY:
        path.touch()


@cache
def prune(place: Path, days: float = 60.0) -> None:
    """Delete what nobody has used for long, and what nobody came to finish; once a process, and nothing but ours."""
    for path in (found for pattern in OURS for found in place.glob(pattern)):
        try:
            if time.time() - path.stat().st_mtime > days * DAY:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        except OSError:
            continue


@cache
def machine() -> str:
    """Return the kind of machine that code is for, as part of a file's name: one home may serve several."""
    bits = "" if sys.maxsize > 2**32 else "-32"
    return f"{sys.platform}-{platform.machine().lower()}{bits}"


@cache
def processor() -> str:
    """Return a mark of what this very processor can do."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        told = next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        told = platform.processor() + platform.machine()
    return hashlib.sha256(told.encode()).hexdigest()[:8]
