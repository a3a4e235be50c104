"""Compose small functions into one compiled loop, chosen by types, kept on disk, never stale.

* ``driver(kinds)`` is the loop over series and samples for one combination of policy types;
  ``crew(kinds, sizes)`` the one of a fleet, whose sizes are constants of the code;
  ``recorder(kinds)`` and ``smoother(form)`` the two loops that a smoother needs, ``watcher(kind)`` the one of a
  detector on its own, ``passage(kind)`` whatever else goes once over a record, ``function(f)`` a loop as it stands.

`loops` has them in Python. They are translated to C (`translate`) and compiled, or found compiled (`objects`). What
cannot be translated, or compiled, runs as it is. ``DRIFTWISE_ENGINE`` chooses: ``c``, ``numba`` or ``python``.
(``docs/decisions/engine.md`` tells the story.)
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from . import dispatch, loops, objects
from .compilers import compilers
from .dispatch import Size
from .errors import CommandError
from .translate.refusal import Refusal

ENGINES = "c", "numba", "python"


@functools.cache
def _package_hash() -> str:
    root = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for folder in ("engine", "models", "memory", "detect", "estimators"):
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def fingerprint(kinds) -> int:
    """Return an integer that changes whenever a source behind the driver of ``kinds`` changes."""
    digest = hashlib.sha256(_package_hash().encode())
    foreign = set(dispatch.kernels) | {f for c in dispatch.choices for k, f in c.table.items() if k in kinds}
    for thing in sorted((*foreign, *kinds), key=lambda f: (f.__module__, f.__qualname__)):
        if not thing.__module__.startswith("driftwise."):  # a user's own policy
            digest.update(_text(thing).encode())
    return int.from_bytes(digest.digest()[:7], "big")


def _text(thing) -> str:
    """Return what changes with a user's own policy or function; in a notebook, where classes have no source."""
    if isinstance(thing, type):
        return repr(get_type_hints(thing, include_extras=True))
    try:
        return inspect.getsource(thing)
    except OSError:
        code = thing.__code__
        return repr((code.co_code, code.co_names, [c for c in code.co_consts if not inspect.iscode(c)]))


@functools.cache
def driver(*kinds: type) -> Callable:
    """Return the compiled ``drive(rows, ys, us, outs, spec, scratch)`` for one combination of policy types.

    ``rows`` (S, W) are the states and are advanced in place, ``ys`` (S, T, p) and ``us`` (S, T, k) the
    samples, ``outs`` (S, T, C) receives one row per sample, ``spec`` are the flattened policies and
    ``scratch`` is any memory of the size the form asks for. All are C-contiguous float64. The global interpreter
    lock is released while it runs.
    """
    return _load(loops.make_driver, (kinds,), kinds, DRIVER)


DRIVER = (2, 3, 3, 3, 1, 1)  # dimensions of what the loops of a series and of a fleet take
CREW = (2, "index", "index", "index", 2, 2, 2, 2, "index", 1)


@functools.cache
def crew(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> Callable:
    """Return the compiled ``go(rows, members, starts, order, ys, us, outs, specs, group, scratch)`` of a fleet.

    ``members`` (m,) are the indices of the ``rows`` (S, W) to advance in place; ``order[starts[i]:starts[i + 1]]`` are
    those of the samples of the i-th, in ``ys`` (n, p), ``us`` (n, k) and ``outs`` (n, C); an empty ``order`` is
    0, 1, .. n - 1. The settings of a row are those of ``specs`` (G, Q) that ``group`` (S,) names. ``sizes`` are those
    of the form, ``shapes`` is (W, p, k, C, Q, size of the scratch). Loops of known length are unrolled: half the time
    of `driver`, the same bits.
    """
    return _load(loops.make_crew, (kinds, sizes, shapes), kinds, CREW)


def has_crew(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> bool:
    """Say whether that loop was compiled before."""
    return objects.is_there(crew_key(kinds, sizes, shapes))


def crew_key(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> str:
    """Return the name of a fleet's loop: what it is made of."""
    return _key(loops.make_crew, fingerprint(kinds), (kinds, sizes, shapes), CREW)


def has_driver(kinds: tuple[type, ...]) -> bool:
    """Say whether there is a driver, by an optimising compiler: then a fleet of few samples does with that."""
    return _engine() == "c" and objects.is_there(_key(loops.make_driver, fingerprint(kinds), (kinds,), DRIVER), "fast")


def sizes(policy) -> tuple[float, ...]:
    """Return the numbers of a policy that are marked as sizes."""
    hints = get_type_hints(type(policy), include_extras=True)
    return tuple(float(value) for value, hint in zip(policy, hints.values()) if hint is Size)


@functools.cache
def recorder(*kinds: type) -> Callable:
    """Return the compiled ``record(row, history, y, u, out, spec, scratch)``: one series, every step kept."""
    return _load(loops.make_recorder, (kinds,), kinds, (1, 2, 2, 2, 2, 1, 1))


@functools.cache
def smoother(form: type) -> Callable:
    """Return the compiled ``smooth(history, width, count, lag, s2, outs, spec, scratch, unknown, space)``."""
    return _load(loops.make_smoother, (form,), (form,), (2, int, int, int, float, 2, 1, 1, 2, 2))


@functools.cache
def watcher(kind: type) -> Callable:
    """Return the compiled ``look(detector_state, zs, slopes, outs, spec)`` of one detector: S series of T samples.

    ``detector_state`` (S, M) are advanced in place, ``zs`` (S, T) the innovations and ``slopes`` (S, T, m) their slopes
    (m may be 0); ``outs`` (S, T, C) receives the alarm and, as far as it is wide, what ``detector_state`` begins with.
    """
    return _load(loops.make_watcher, (kind,), (kind,), (2, 2, 3, 3, 1))


@functools.cache
def passage(task: type) -> Callable:
    """Return the compiled ``go(rows, q, kept, out, numbers, spec)`` of one task; ``numbers`` and ``spec`` are (n,)."""
    return _load(loops.make_passage, (task,), (task,), (2, 2, 2, 2, 1, 1))


@functools.cache
def function(loop: Callable, *dimensions) -> Callable:
    """Return a loop compiled for arguments of these dimensions (of an array of int64: "index")."""
    return _load(lambda version: loop, (), (), dimensions, loop)


def _load(make, sizes, kinds, dimensions, loop: Callable | None = None) -> Callable:
    """Return ``make(*sizes, version)`` compiled for C-contiguous float64 arrays of these dimensions, and numbers."""
    if _engine() == "numba":
        from . import jit

        return jit.compiled(make(*sizes, fingerprint(kinds)), dimensions)
    found = None
    if _engine() == "c":
        try:
            found = _object(make, sizes, kinds, dimensions, loop)
        except Refusal as refusal:
            warnings.warn(f"{refusal}; it runs as plain Python, some 500 times slower", RuntimeWarning, stacklevel=4)
    return found or _quiet(make(*sizes, 0))


def native(make, sizes, kinds, dimensions) -> Callable | None:
    """Return ``make(*sizes, version)`` compiled for this very processor; None where no compiler here can."""
    if _engine() != "c" or all(compiler.is_quick for compiler in compilers()):
        return None
    return _object(make, sizes, kinds, dimensions, None, native=True)


def _engine() -> str:
    asked = os.environ.get("DRIFTWISE_ENGINE") or "c"
    if asked not in ENGINES:
        raise CommandError(f"DRIFTWISE_ENGINE is {', '.join(ENGINES[:-1])} or {ENGINES[-1]}, got {asked!r}")
    return asked


def _object(make, sizes, kinds, dimensions, loop, native: bool = False) -> Callable | None:
    """Return a loop by way of C, or None where nothing compiles it."""
    key = _key(loop or make, fingerprint(kinds), sizes, dimensions, "" if loop is None else _text(loop))
    python = make(*sizes, 0)
    reads = [name in loops.READ for name in python.__code__.co_varnames[: len(dimensions)]]
    is_sized = make is not loops.make_driver
    return objects.load(key, lambda: translated(python, dimensions, is_sized=is_sized), dimensions, reads, native)


def _key(what: Callable, version: int, sizes, dimensions, text: str = "") -> str:
    """Return the name of an object: what it was made of."""
    told = repr((what.__qualname__, version, [_spelt(size) for size in sizes], dimensions)) + text
    return f"{what.__name__.removeprefix('make_')}-{hashlib.sha256(told.encode()).hexdigest()[:24]}"


def translated(loop: Callable, dimensions, checked: bool = False, is_sized: bool = True) -> str:
    """Return a loop in C, for arguments of these dimensions; ``is_sized``: it has its sizes in."""
    from .translate.c99 import Printer
    from .translate.program import Program
    from .translate.types import FLOAT, INT, View

    known: dict[Any, Any] = {int: INT, float: FLOAT, "index": View(1, INT)}
    entry = Program(is_sized).function(loop, [known.get(d) or View(d) for d in dimensions])
    return Printer(checked=checked).program(entry, "driftwise_run", dimensions)


def _spelt(size) -> Any:
    """Return what a loop is made with, in a way that is the same in every process."""
    if isinstance(size, tuple):
        return [_spelt(one) for one in size]
    return f"{size.__module__}.{size.__qualname__}" if isinstance(size, type) else size


def _quiet(loop: Callable) -> Callable:
    """Return a loop of plain Python that passes over infinities and NaN as compiled ones do."""

    @functools.wraps(loop)
    def run(*args):
        with np.errstate(all="ignore"):
            return loop(*args)

    return run


def plain_driver(*kinds: type) -> Callable:
    """Return the same driver uncompiled: slow, but every line can be stepped through."""
    return loops.make_driver(kinds, 0)


def plain_crew(kinds, sizes, shapes) -> Callable:
    """Return the loop of a fleet uncompiled."""
    return loops.make_crew(kinds, sizes, shapes, 0)


def plain_passage(task: type) -> Callable:
    """Return the same uncompiled."""
    return loops.make_passage(task, 0)


def plain_watcher(kind: type) -> Callable:
    """Return the same loop of a detector uncompiled."""
    return loops.make_watcher(kind, 0)
