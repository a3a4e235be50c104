"""The parts that `compile` makes a driver of: small functions, chosen by type, and policies as rows of numbers.

* ``@kernel`` marks a function that compiled code may call. It stays an ordinary Python function.
* ``@choice`` marks a function with one implementation per policy type; ``choice.on(Type)`` adds one.
* Policies that answer several choices are a family: who answers one of them gives, to the others, the plain answer,
  which is the body of the prototype.
* A policy is a named tuple; fields that hold several numbers are annotated `Vector` (`PerParameter`: one of each
  parameter), those that decide how long loops are `Size`. Drivers get the policies of an estimator as one row of
  numbers, and read them back.
"""

from __future__ import annotations

import functools
import itertools
import linecache
from collections.abc import Callable, Iterator
from typing import Annotated, Any, get_type_hints

import numpy as np

Vector = Annotated[Any, "several numbers"]  # marks such a field of a policy
PerParameter = Annotated[Any, "one number of each parameter"]  # such a vector: `part` cuts it
Size = Annotated[
    float, "a size"
]  # marks a number that decides the length of loops, or a branch: a fleet has it compiled in

kernels: list[Callable] = []
choices: list[Any] = []
apart: set[Callable] = set()  # kernels that are called, not inlined
large: set[Callable] = set()  # and those that are so where sizes are data


def kernel(function: Callable) -> Callable:
    """Mark a function as callable from compiled code; return it unchanged.

    Examples
    --------
    >>> import driftwise as dw
    >>> @dw.memory.kernel
    ... def half(x):
    ...     return 0.5 * x
    >>> half(3.0)
    1.5
    """
    kernels.append(function)
    return function


def rare(function: Callable) -> Callable:
    """Mark a kernel that few samples reach, or a large one: it is called, not inlined, which compiles faster."""
    apart.add(function)
    return kernel(function)


def bulky(function: Callable) -> Callable:
    """Mark a large kernel that not every sample reaches: where sizes are data it is called, not inlined.

    What every sample takes is nearer together then. A loop that has its sizes in would lose them in a call.
    """
    large.add(function)
    return kernel(function)


@kernel
def abreast(count):
    """Return `range` for a loop whose turns have nothing to do with one another: a compiler may take several at once.

    Its body is written out: no loop inside, no sum that goes on from turn to turn, both ways of an ``if`` a number.
    """
    return range(count)


def choice(prototype: Callable, family: set[type] | None = None) -> Any:
    """Turn a prototype into a function whose first argument's type selects the implementation.

    ``choice.on(Type)`` adds one, ``choice.find(Type)`` returns it, or None. Types of the ``family`` that have none of
    their own get the body of the prototype; `on` makes its types members.
    """
    table: dict[type, Callable] = {}
    members: Any = () if family is None else family

    def find(kind) -> Callable | None:
        return table.get(kind) or (prototype if kind in members else None)

    def refuse(policy, *args):
        raise TypeError(f"a {type(policy).__name__} has no {prototype.__name__}")

    @functools.wraps(prototype)
    def choose(policy, *args):
        return (table.get(type(policy)) or (prototype if type(policy) in members else refuse))(policy, *args)

    def on(*kinds: type) -> Callable:
        def add(function: Callable) -> Callable:
            table.update(dict.fromkeys(kinds, function))
            if family is not None:
                family.update(kinds)
            return function

        return add

    # Uncompiled, who steps in or reads a stack trace meets the question where it is written, not its dispatcher here.
    question: Any = choose
    names = ("co_filename", "co_firstlineno", "co_name", "co_qualname")
    question.__code__ = question.__code__.replace(**{name: getattr(prototype.__code__, name) for name in names})
    question.on, question.table, question.find = on, table, find
    choices.append(question)
    return question


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


@functools.cache
def reader(kinds: tuple[Any, ...], given: str, is_sized: bool = False) -> Callable:
    """Write the function ``read(given)`` that reads policies of these types from the row ``spec``.

    Vectors are views, nothing is copied. It begins at ``at``, if it is given that, and then also returns where the next
    policy begins. ``is_sized``: the first takes its sizes from ``sizes``, which makes them constants where those are.
    """
    end = ", at" if given.endswith(", at") else ""
    lines, made, fixed = [f"def read({given}):", *([] if end else ["    at = 0"])], [], itertools.count()
    for i, kind in enumerate(kinds):
        names = [f"{name}_{i}" for name in kind._fields]
        for name, annotation in zip(names, get_type_hints(kind, include_extras=True).values()):
            if annotation in (Vector, PerParameter):
                lines += ["    size = int(spec[at])", f"    {name} = spec[at + 1 : at + 1 + size]", "    at += size"]
            elif annotation is Size and is_sized and i == 0:
                lines.append(f"    {name} = sizes[{next(fixed)}]")
            else:
                lines.append(f"    {name} = spec[at]")
            lines.append("    at += 1")
        made.append(f"kind_{i}({', '.join(names)})")
    lines.append(f"    return {', '.join(made)}{end}")
    return written("\n".join(lines), "read", {f"kind_{i}": kind for i, kind in enumerate(kinds)})


def written(text: str, name: str, scope: dict[str, Any]) -> Callable:
    """Return the function of this name that a text defines; whoever looks for its source finds it."""
    file = f"<{name} number {next(_count)}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    scope.setdefault("__name__", __name__)
    exec(compile(text, file, "exec"), scope)
    return scope[name]


_count = itertools.count()


@functools.cache
def cutter(kind: Any) -> Callable:
    """Write the function ``cut(policy, first, last)`` that returns the policy of some parameters alone."""
    hints = get_type_hints(kind, include_extras=True)
    fields = [f"policy.{name}" + "[first:last]" * (hints[name] == PerParameter) for name in kind._fields]
    return written(f"def cut(policy, first, last):\n    return kind({', '.join(fields)})", "cut", {"kind": kind})


def part(policy, first, last):
    """Return the policy of the parameters first .. last - 1: of each `PerParameter` only those."""
    return cutter(type(policy))(policy, first, last)  # type: ignore[arg-type]  # a type is hashable


def read(kind, spec, at):
    """Return the policy of type ``kind`` that starts at ``spec[at]``, and where the next one starts."""
    return reader((kind,), "kind, spec, at")(kind, spec, at)


def read_like(like, spec, at):
    """Return the policy of the type of ``like`` that starts at ``spec[at]``, and where the next one starts."""
    return reader((type(like),), "like, spec, at")(like, spec, at)


def read_all(kinds, sizes, spec):
    """Return the policies of these types that a row holds; the first has these sizes, or if there are none its own."""
    return reader(kinds, "kinds, sizes, spec", len(sizes) > 0)(kinds, sizes, spec)


def resolvers() -> Iterator[tuple[Callable, Callable]]:
    """Return every function that compiled code may call, with what finds its implementation, given types (numba's)."""
    for function in kernels:
        yield function, lambda *args, function=function: function
    for function in choices:
        yield function, lambda policy, *args, find=function.find: find(getattr(policy, "instance_class", None))
    yield part, lambda policy, first, last: cutter(policy.instance_class)
    yield read, lambda kind, spec, at: reader((kind.instance_class,), "kind, spec, at")
    yield read_like, lambda like, spec, at: reader((like.instance_class,), "like, spec, at")
    yield (
        read_all,
        lambda kinds, sizes, spec: reader(tuple(k.instance_class for k in kinds), "kinds, sizes, spec", len(sizes) > 0),
    )


# --- the functions an estimator's form provides ------------------------------------------------------------


@choice
def open_row(form, row):
    """Return the named views of one state row."""


@choice
def open_scratch(form, buffer):
    """Return the sizes as integers, and named views of the scratch row."""


@choice
def advance(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t):
    """Take sample ``t`` of ``y`` and ``u`` into ``state`` and write row ``t`` of ``out``."""


@choice
def remember(form, scale, state, scratch, note):
    """Write into ``note`` what the step just taken did, as `retreat` needs it."""


@choice
def retreat(form, row, after, note, scratch, space):
    """Take what later samples teach (in ``space``) from after a sample to before it; row, after are the states."""


@choice
def look_back(form, row, s2, space, out):
    """Write mean and spread of the state before a sample, given what later samples teach."""


DETECTORS: set[type] = set()


@functools.partial(choice, family=DETECTORS)
def listens(detector):
    """Say whether a detector makes anything of samples: nothing is computed for one that does not."""
    return True


@functools.partial(choice, family=DETECTORS)
def watch(detector, detector_state, z, slope):
    """Take one whitened innovation z = e/sqrt(T); return 0, or +1 or -1 where it alarms (the direction).

    ``detector_state`` are the numbers the detector keeps. It leaves in them, at every sample, the largest ``STATISTIC``
    relative to its threshold (1 and more: alarm); at an alarm, ``SINCE``, the number of samples since the change by its
    own estimate (this one included), and ``WHICH``, the index of the parameter that changed (-1: cannot say). It starts
    afresh after an alarm. ``slope`` (m,) says how the mean of z would move per unit of each parameter,
    -dz/dtheta = psi/sqrt(T); it is empty where the estimator cannot tell.
    """


@choice
def pass_over(task, rows, q, kept, out, numbers):
    """Go once over a record, forwards or backwards: what is read and what is written is the task's own business."""
