"""Compose small functions into one compiled driver, chosen by types, cached on disk, never stale.

* ``@kernel`` marks a function that compiled code may call. It stays an ordinary Python function.
* ``@choice`` marks a function with one implementation per policy type; ``choice.on(Type)`` adds one.
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
from typing import Annotated, Any, get_type_hints

import numpy as np

from . import views
from .short_loops import short_loops
from .views import fetch

Vector = Annotated[Any, "several numbers"]  # marks such a field of a policy
Size = Annotated[
    float, "a size"
]  # marks a number that decides the length of loops, or a branch: a fleet has it compiled in

AHEAD = 4  # samples between fetching one and taking it, where they stand in any order

_kernels: list[Callable] = []
_choices: list[Any] = []
_bound: set[Callable] = set()
_apart: set[Callable] = set()
_lock = threading.RLock()


def kernel(function: Callable) -> Callable:
    """Mark a function as callable from compiled code; return it unchanged."""
    _kernels.append(function)
    return function


def rare(function: Callable) -> Callable:
    """Mark a kernel that few samples reach, or a large one: it is called, not inlined, which compiles faster."""
    _apart.add(function)
    return kernel(function)


def choice(prototype: Callable) -> Any:
    """Turn a prototype into a function whose first argument's type selects the implementation."""
    table: dict[type, Callable] = {}

    @functools.wraps(prototype)
    def choose(policy, *args):
        return table[type(policy)](policy, *args)

    def on(*kinds: type) -> Callable:
        def add(function: Callable) -> Callable:
            table.update(dict.fromkeys(kinds, function))
            return function

        return add

    choose.on, choose.table = on, table  # type: ignore[attr-defined]
    _choices.append(choose)
    return choose


# --- policies as rows of numbers ---------------------------------------------------------------------------


def flatten(policies) -> np.ndarray:
    """Return the numbers of several policies as one row; a vector is preceded by its length."""
    numbers: list[float] = []
    for policy in policies:
        for value in policy:
            if np.ndim(value):
                numbers.append(np.size(value))
                numbers.extend(np.ravel(value))
            else:
                numbers.append(value)
    return np.array(numbers, float)


def sizes(policy) -> tuple[float, ...]:
    """Return the numbers of a policy that are marked as sizes."""
    hints = get_type_hints(type(policy), include_extras=True)
    return tuple(float(value) for value, hint in zip(policy, hints.values()) if hint is Size)


@functools.cache
def _reader(kind: type, given: str = "kind") -> Callable:
    """Write the function that reads one policy back from a row (vectors are views, nothing is copied).

    It is given the type itself as ``kind``, or a policy of the type as ``like``, or ``kind, sizes``: then sizes are
    taken from there, which makes them constants where ``sizes`` is one.
    """
    lines, fixed = [f"def read({given}, spec, at):"], 0
    for name, annotation in get_type_hints(kind, include_extras=True).items():
        if annotation is Size and given == "kind, sizes":
            lines += [f"    {name} = sizes[{fixed}]", "    at += 1"]
            fixed += 1
        elif annotation is Vector:
            lines += ["    size = int(spec[at])", f"    {name} = spec[at + 1 : at + 1 + size]", "    at += 1 + size"]
        else:
            lines += [f"    {name} = spec[at]", "    at += 1"]
    lines.append(f"    return kind({', '.join(kind._fields)}), at")  # type: ignore[attr-defined]
    scope: dict[str, Any] = {"kind": kind}
    exec("\n".join(lines), scope)
    return scope["read"]


def read(kind, spec, at):
    """Return the policy of type ``kind`` that starts at ``spec[at]``, and where the next one starts."""
    return _reader(kind)(kind, spec, at)


def read_sized(kind, sizes, spec, at):
    """Return the same, its sizes being these."""
    return _reader(kind, "kind, sizes")(kind, sizes, spec, at)


def read_like(like, spec, at):
    """Return the policy of the type of ``like`` that starts at ``spec[at]``, and where the next one starts."""
    kind: Any = type(like)
    return _reader(kind, "like")(like, spec, at)


# --- the functions an estimator's form provides ------------------------------------------------------------


@choice
def open_row(form, row):
    """Return the named views of one state row."""


@choice
def open_work(form, scratch):
    """Return the sizes as integers, and named views of the scratch row."""


@choice
def advance(form, noise, memory, gate, scale, detector, state, work, y, u, out, t):
    """Take sample ``t`` of ``y`` and ``u`` into ``state`` and write row ``t`` of ``out``."""


@choice
def remember(form, scale, state, work, note):
    """Write into ``note`` what the step just taken did, as `retreat` needs it."""


@choice
def retreat(form, row, after, note, work, space):
    """Take what later samples teach (in ``space``) from after a sample to before it; row, after are the states."""


@choice
def look_back(form, row, s2, space, out):
    """Write mean and spread of the state before a sample, given what later samples teach."""


@choice
def watch(detector, marks, z, slope):
    """Take one whitened innovation z = e/sqrt(T); return 0, or +1 or -1 where it alarms (the direction).

    ``marks`` are the numbers the detector keeps. It leaves in them, at every sample, the largest ``STATISTIC`` relative
    to its threshold (1 and more: alarm); at an alarm, ``SINCE``, the number of samples since the change by its own
    estimate (this one included), and ``WHICH``, the index of the parameter that changed (-1: cannot say). It starts
    afresh after an alarm. ``slope`` (m,) says how the mean of z would move per unit of each parameter,
    -dz/dtheta = psi/sqrt(T); it is empty where the estimator cannot tell.
    """


@choice
def pass_over(task, rows, q, kept, out, numbers):
    """Go once over a record, forwards or backwards: what is read and what is written is the task's own business."""


def _make(kinds, fingerprint):
    """Return the driver: a loop over series, and a loop over samples inside it."""
    Form, Noise, Memory, Gate, Scale, Detector = kinds

    def drive(rows, ys, us, outs, spec, scratch):
        version = fingerprint  # part of the cache key; the code itself does not need it
        form, at = read(Form, spec, 0)
        noise, at = read(Noise, spec, at)
        memory, at = read(Memory, spec, at)
        gate, at = read(Gate, spec, at)
        scale, at = read(Scale, spec, at)
        detector, at = read(Detector, spec, at)
        work = open_work(form, scratch)
        for i in range(rows.shape[0]):
            state = open_row(form, rows[i])
            y, u, out = ys[i], us[i], outs[i]
            for t in range(y.shape[0]):
                advance(form, noise, memory, gate, scale, detector, state, work, y, u, out, t)
        return version

    return drive


def _make_crew(kinds, sizes, shapes, fingerprint):
    """Return the loop of a fleet: over its members, and over the samples of each; ``sizes`` are constants."""
    Form, Noise, Memory, Gate, Scale, Detector = kinds
    width, outputs, inputs, columns, numbers, room = shapes

    def advance_members(rows, members, starts, order, ys, us, outs, specs, group, scratch):
        version = fingerprint
        if rows.shape[1] != width or scratch.size != room or scratch.shape[0] != room or specs.shape[1] != numbers:
            return -1  # never; but now the compiler knows these as constants too
        if ys.shape[1] != outputs or us.shape[1] != inputs or outs.shape[1] != columns:
            return -1
        for i in range(members.size):
            spec = specs[group[members[i]]]
            form, at = read_sized(Form, sizes, spec, 0)
            noise, at = read(Noise, spec, at)
            memory, at = read(Memory, spec, at)
            gate, at = read(Gate, spec, at)
            scale, at = read(Scale, spec, at)
            detector, at = read(Detector, spec, at)
            work = open_work(form, scratch)
            state = open_row(form, rows[members[i]])
            for j in range(starts[i], starts[i + 1]):
                t = j
                if order.size:
                    t = order[j]
                    ahead = order[min(j + AHEAD, order.size - 1)]
                    fetch(ys, ahead)
                    fetch(us, ahead)
                    fetch(outs, ahead)
                advance(form, noise, memory, gate, scale, detector, state, work, ys, us, outs, t)
        return version

    return advance_members


def _make_recorder(kinds, fingerprint):
    """Return the loop that steps through one series and keeps every state and what each step did."""
    Form, Noise, Memory, Gate, Scale, Detector = kinds

    def record(row, history, y, u, out, spec, scratch):
        version = fingerprint
        form, at = read(Form, spec, 0)
        noise, at = read(Noise, spec, at)
        memory, at = read(Memory, spec, at)
        gate, at = read(Gate, spec, at)
        scale, at = read(Scale, spec, at)
        detector, at = read(Detector, spec, at)
        work = open_work(form, scratch)
        state = open_row(form, row)
        for t in range(y.shape[0]):
            for i in range(row.size):
                history[t, i] = row[i]
            advance(form, noise, memory, gate, scale, detector, state, work, y, u, out, t)
            remember(form, scale, state, work, history[t, row.size :])
        for i in range(row.size):
            history[y.shape[0], i] = row[i]
        return version

    return record


def _make_smoother(Form, fingerprint):
    """Return the loop back, over the whole history or ``lag`` samples for each; ``unknown`` is where it starts."""

    def smooth(history, width, count, lag, s2, outs, spec, scratch, unknown, space):
        version = fingerprint
        form, _ = read(Form, spec, 0)
        work = open_work(form, scratch)
        size = history.shape[0] - 1
        for t in range(count - 1, -1, -1):
            last = t
            if lag >= 0:
                last = min(t + lag, size - 1)
                for i in range(space.shape[0]):
                    for j in range(space.shape[1]):
                        space[i, j] = unknown[i, j]
            for j in range(last, t - 1, -1):
                retreat(form, history[j, :width], history[j + 1, :width], history[j, width:], work, space)
            look_back(form, history[t, :width], s2 if lag < 0 else history[last, width], space, outs[t])
        return version

    return smooth


def _make_watcher(Detector, fingerprint):
    """Return the loop of a detector on its own: series, and samples inside; ``outs`` takes alarm and first marks."""

    def look(marks, zs, slopes, outs, spec):
        version = fingerprint
        detector, _ = read(Detector, spec, 0)
        for i in range(marks.shape[0]):
            for t in range(zs.shape[1]):
                outs[i, t, 0] = watch(detector, marks[i], zs[i, t], slopes[i, t])
                for c in range(1, outs.shape[2]):
                    outs[i, t, c] = marks[i, c - 1]
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
    for folder in ("kernel", "models", "memory", "detect", "estimators"):
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def fingerprint(kinds) -> int:
    """Return an integer that changes whenever a source behind the driver of ``kinds`` changes."""
    digest = hashlib.sha256(_package_hash().encode())
    foreign = set(_kernels) | {f for c in _choices for k, f in c.table.items() if k in kinds}
    for thing in sorted((*foreign, *kinds), key=lambda f: (f.__module__, f.__qualname__)):
        if not thing.__module__.startswith("driftwise."):  # a user's own policy
            digest.update(inspect.getsource(thing).encode())
    return int.from_bytes(digest.digest()[:7], "big")


# Nothing is allocated, so nothing needs to be counted: without `_nrt=False` reference counts take most of the time.
OPTIONS: Any = {"error_model": "numpy", "_nrt": False}
# A call hands over each field of each array in registers and on the stack: more than a hundred for a state and its
# scratch. Inlined, a sample takes two thirds of the time. (numba hands the flag down to callees, hence both values.)
INLINE: Any = {**OPTIONS, "forceinline": True}
APART: Any = {**OPTIONS, "forceinline": False}


def _bind() -> None:
    """Teach numba every marked function; implementations are looked up when a driver is compiled."""
    from numba.extending import overload

    def plain(function):
        options = APART if function in _apart else INLINE
        overload(function, jit_options=options, strict=False)(lambda *args: function)

    def chosen(function):
        def resolve(policy, *args):
            return function.table.get(getattr(policy, "instance_class", None))

        overload(function, jit_options=INLINE, strict=False)(resolve)

    for function in _kernels:
        if function not in _bound:
            plain(function)
            _bound.add(function)
    for function in _choices:
        if function not in _bound:
            chosen(function)
            _bound.add(function)
    if read not in _bound:
        overload(read, jit_options=OPTIONS, strict=False)(lambda kind, spec, at: _reader(kind.instance_class))
        overload(read_sized, jit_options=INLINE, strict=False)(
            lambda kind, sizes, spec, at: _reader(kind.instance_class, "kind, sizes")
        )
        overload(read_like, jit_options=OPTIONS, strict=False)(
            lambda like, spec, at: _reader(like.instance_class, "like")
        )
        views.bind()
        _bound.add(read)


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
    """Return the compiled ``look(marks, zs, slopes, outs, spec)`` of one detector: S series of T samples.

    ``marks`` (S, M) are advanced in place, ``zs`` (S, T) the innovations and ``slopes`` (S, T, m) their slopes (m may
    be 0); ``outs`` (S, T, C) receives the alarm and, as far as it is wide, what ``marks`` begins with.
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
