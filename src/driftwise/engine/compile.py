"""Compose small functions into one compiled driver, chosen by types, cached on disk, never stale.

* ``driver(kinds)`` compiles the loop over series and samples for one combination of policy types;
  ``crew(kinds, sizes)`` the one of a fleet, whose sizes are constants of the code;
  ``recorder(kinds)`` and ``smoother(form)`` the two loops that a smoother needs, ``watcher(kind)`` the one of a
  detector on its own, ``passage(kind)`` whatever else goes once over a record.

The driver closes over *classes* and an integer fingerprint of the sources, never over compiled functions:
numba pickles what a closure holds into its cache key, so classes keep the key stable between processes and
the fingerprint changes it whenever any source changes. (``docs/decisions/engine.md`` tells the story.)
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_type_hints

from . import dispatch, views
from .dispatch import (
    Size,
    advance,
    look_back,
    open_row,
    open_scratch,
    pass_over,
    read,
    read_all,
    remember,
    retreat,
    watch,
)
from .short_loops import short_loops
from .views import fetch

AHEAD = 4  # samples between fetching one and taking it, where they stand in any order

_bound: set[Callable] = set()
_lock = threading.RLock()


# --- the loops ---------------------------------------------------------------------------------------------


def _make(kinds, fingerprint):
    """Return the driver: a loop over series, and a loop over samples inside it."""

    def drive(rows, ys, us, outs, spec, buffer):
        version = fingerprint  # part of the cache key; the code itself does not need it
        form, noise, memory, gate, scale, detector = read_all(kinds, (), spec)
        scratch = open_scratch(form, buffer)
        for i in range(rows.shape[0]):
            state = open_row(form, rows[i])
            y, u, out = ys[i], us[i], outs[i]
            for t in range(y.shape[0]):
                advance(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t)
        return version

    return drive


def _make_crew(kinds, sizes, shapes, fingerprint):
    """Return the loop of a fleet: over its members, and over the samples of each; ``sizes`` are constants."""
    width, outputs, inputs, columns, numbers, room = shapes

    def advance_members(rows, members, starts, order, ys, us, outs, specs, group, buffer):
        version = fingerprint
        if rows.shape[1] != width or buffer.size != room or buffer.shape[0] != room or specs.shape[1] != numbers:
            return -1  # never; but now the compiler knows these as constants too
        if ys.shape[1] != outputs or us.shape[1] != inputs or outs.shape[1] != columns:
            return -1
        for i in range(members.size):
            spec = specs[group[members[i]]]
            form, noise, memory, gate, scale, detector = read_all(kinds, sizes, spec)
            scratch = open_scratch(form, buffer)
            state = open_row(form, rows[members[i]])
            for j in range(starts[i], starts[i + 1]):
                t = j
                if order.size:
                    t = order[j]
                    ahead = order[min(j + AHEAD, order.size - 1)]
                    fetch(ys, ahead)
                    fetch(us, ahead)
                    fetch(outs, ahead)
                advance(form, noise, memory, gate, scale, detector, state, scratch, ys, us, outs, t)
        return version

    return advance_members


def _make_recorder(kinds, fingerprint):
    """Return the loop that steps through one series and keeps every state and what each step did."""

    def record(row, history, y, u, out, spec, buffer):
        version = fingerprint
        form, noise, memory, gate, scale, detector = read_all(kinds, (), spec)
        scratch = open_scratch(form, buffer)
        state = open_row(form, row)
        for t in range(y.shape[0]):
            for i in range(row.size):
                history[t, i] = row[i]
            advance(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t)
            remember(form, scale, state, scratch, history[t, row.size :])
        for i in range(row.size):
            history[y.shape[0], i] = row[i]
        return version

    return record


def _make_smoother(Form, fingerprint):
    """Return the loop back, over the whole history or ``lag`` samples for each; ``unknown`` is where it starts."""

    def smooth(history, width, count, lag, s2, outs, spec, buffer, unknown, space):
        version = fingerprint
        form, _ = read(Form, spec, 0)
        scratch = open_scratch(form, buffer)
        size = history.shape[0] - 1
        for t in range(count - 1, -1, -1):
            last = t
            if lag >= 0:
                last = min(t + lag, size - 1)
                for i in range(space.shape[0]):
                    for j in range(space.shape[1]):
                        space[i, j] = unknown[i, j]
            for j in range(last, t - 1, -1):
                retreat(form, history[j, :width], history[j + 1, :width], history[j, width:], scratch, space)
            look_back(form, history[t, :width], s2 if lag < 0 else history[last, width], space, outs[t])
        return version

    return smooth


def _make_watcher(Detector, fingerprint):
    """Return the loop of a detector on its own: series, and samples inside; ``outs`` takes alarm and first marks."""

    def look(detector_state, zs, slopes, outs, spec):
        version = fingerprint
        detector, _ = read(Detector, spec, 0)
        for i in range(detector_state.shape[0]):
            for t in range(zs.shape[1]):
                outs[i, t, 0] = watch(detector, detector_state[i], zs[i, t], slopes[i, t])
                for c in range(1, outs.shape[2]):
                    outs[i, t, c] = detector_state[i, c - 1]
        return version

    return look


def _make_passage(Task, fingerprint):
    """Return a task's way over a record."""

    def go(rows, q, kept, out, numbers, spec):
        version = fingerprint
        task, _ = read(Task, spec, 0)
        pass_over(task, rows, q, kept, out, numbers)
        return version

    return go


# --- compiling ---------------------------------------------------------------------------------------------


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


# Nothing is allocated, so nothing needs to be counted: without `_nrt=False` reference counts take most of the time.
OPTIONS: Any = {"error_model": "numpy", "_nrt": False}
# A call hands over each field of each array in registers and on the stack: more than a hundred for a state and its
# scratch. Inlined, a sample takes two thirds of the time. (numba hands the flag down to callees, hence both values.)
INLINE: Any = {**OPTIONS, "forceinline": True}
APART: Any = {**OPTIONS, "forceinline": False}


def _bind() -> None:
    """Teach numba every marked function; implementations are looked up when a driver is compiled."""
    from numba.extending import overload

    for function, resolve in dispatch.resolvers():
        if function not in _bound:
            options = APART if function in dispatch.apart else INLINE
            overload(function, jit_options=options, strict=False)(resolve)
            _bound.add(function)
    views.bind()


@functools.cache
def driver(*kinds: type) -> Callable:
    """Return the compiled ``drive(rows, ys, us, outs, spec, scratch)`` for one combination of policy types.

    ``rows`` (S, W) are the states and are advanced in place, ``ys`` (S, T, p) and ``us`` (S, T, k) the
    samples, ``outs`` (S, T, C) receives one row per sample, ``spec`` are the flattened policies and
    ``scratch`` is any memory of the size the form asks for. All are C-contiguous float64. The global interpreter
    lock is released while it runs.
    """
    return _compile(lambda numbers: _make(kinds, numbers), kinds, (2, 3, 3, 3, 1, 1))


@functools.cache
def crew(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> Callable:
    """Return the compiled ``go(rows, members, starts, order, ys, us, outs, specs, group, scratch)`` of a fleet.

    ``members`` (m,) are the indices of the ``rows`` (S, W) to advance in place; ``order[starts[i]:starts[i + 1]]`` are
    those of the samples of the i-th, in ``ys`` (n, p), ``us`` (n, k) and ``outs`` (n, C); an empty ``order`` is
    0, 1, .. n - 1. The settings of a row are those of ``specs`` (G, Q) that ``group`` (S,) names. ``sizes`` are those
    of the form, ``shapes`` is (W, p, k, C, Q, size of the scratch). Loops of known length are unrolled: half the time
    of `driver`, the same bits.
    """
    dimensions = (2, "index", "index", "index", 2, 2, 2, 2, "index", 1)
    return _compile(lambda version: _make_crew(kinds, sizes, shapes, version), kinds, dimensions)


def sizes(policy) -> tuple[float, ...]:
    """Return the numbers of a policy that are marked as sizes."""
    hints = get_type_hints(type(policy), include_extras=True)
    return tuple(float(value) for value, hint in zip(policy, hints.values()) if hint is Size)


@functools.cache
def recorder(*kinds: type) -> Callable:
    """Return the compiled ``record(row, history, y, u, out, spec, scratch)``: one series, every step kept."""
    return _compile(lambda numbers: _make_recorder(kinds, numbers), kinds, (1, 2, 2, 2, 2, 1, 1))


@functools.cache
def smoother(form: type) -> Callable:
    """Return the compiled ``smooth(history, width, count, lag, s2, outs, spec, scratch, unknown, space)``."""
    return _compile(lambda numbers: _make_smoother(form, numbers), (form,), (2, int, int, int, float, 2, 1, 1, 2, 2))


@functools.cache
def watcher(kind: type) -> Callable:
    """Return the compiled ``look(detector_state, zs, slopes, outs, spec)`` of one detector: S series of T samples.

    ``detector_state`` (S, M) are advanced in place, ``zs`` (S, T) the innovations and ``slopes`` (S, T, m) their slopes
    (m may be 0); ``outs`` (S, T, C) receives the alarm and, as far as it is wide, what ``detector_state`` begins with.
    """
    return _compile(lambda numbers: _make_watcher(kind, numbers), (kind,), (2, 2, 3, 3, 1))


@functools.cache
def passage(task: type) -> Callable:
    """Return the compiled ``go(rows, q, kept, out, numbers, spec)`` of one task; ``numbers`` and ``spec`` are (n,)."""
    return _compile(lambda version: _make_passage(task, version), (task,), (2, 2, 2, 2, 1, 1))


def _compile(make, kinds, dimensions):
    """Compile ``make(fingerprint)`` for C-contiguous float64 arrays of these dimensions, and numbers."""
    with _lock:
        import numba
        import numba.types

        _bind()
        function = numba.njit(cache=True, nogil=True, **OPTIONS)(make(fingerprint(kinds)))
        numbers = {int: numba.int64, float: numba.float64, "index": numba.types.Array(numba.int64, 1, "C")}
        types = tuple(numbers.get(d) or numba.types.Array(numba.float64, d, "C") for d in dimensions)
        with short_loops():
            function.compile(types)
        return function


def plain_driver(*kinds: type) -> Callable:
    """Return the same driver uncompiled: slow, but every line can be stepped through."""
    return _make(kinds, 0)


def plain_crew(kinds, sizes, shapes) -> Callable:
    """Return the loop of a fleet uncompiled."""
    return _make_crew(kinds, sizes, shapes, 0)


def plain_passage(task: type) -> Callable:
    """Return the same uncompiled."""
    return _make_passage(task, 0)


def plain_watcher(kind: type) -> Callable:
    """Return the same loop of a detector uncompiled."""
    return _make_watcher(kind, 0)
