"""What a value of a kernel can be: a number, a view of numbers, a named tuple, a tuple, or known at translation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Scalar:
    """One number: a float, an integer or a truth value; of lanes, one of each series."""

    name: str
    rank: int  # what two of them become when they meet


BOOL, INT, FLOAT = Scalar("bool", 0), Scalar("int", 2), Scalar("float", 3)
MASK, LANES = Scalar("mask", 1), Scalar("lanes", 4)  # truth values and floats of several series, side by side


@dataclass(frozen=True)
class View:
    """A table of numbers somewhere in memory, in C order; a strided one is a column of such a table."""

    dims: int
    element: Scalar = FLOAT
    is_strided: bool = False


@dataclass(frozen=True)
class Struct:
    """A named tuple of this class."""

    instance_class: Any
    items: tuple[Any, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its fields."""
        return self.instance_class._fields


@dataclass(frozen=True)
class Several:
    """A tuple."""

    items: tuple[Any, ...]

    def __bool__(self) -> bool:
        return True

    def __len__(self) -> int:
        return len(self.items)

    def __iter__(self):
        return iter(self.items)


@dataclass(frozen=True, eq=False)
class Known:
    """What is known at translation: a constant, a table of constants, a class, a function, a module."""

    value: Any

    def _key(self):
        value = self.value
        if isinstance(value, bool | int | float | str | np.generic):
            return type(value), repr(value)
        if isinstance(value, tuple):
            return tuple(Known(item)._key() for item in value)
        return id(value)

    def __eq__(self, other) -> bool:
        return isinstance(other, Known) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    @property
    def instance_class(self) -> Any:
        """The class itself, where it is one."""
        return self.value

    def __bool__(self) -> bool:
        return True

    def __len__(self) -> int:
        return len(self.value)

    def __iter__(self):
        return (Known(item) for item in self.value)


NOTHING = Known(None)
Type = Scalar | View | Struct | Several | Known


def widen(kind: Type) -> Type:
    """Return the type of a variable that holds it: a known number becomes any number."""
    if isinstance(kind, Known):
        value = kind.value
        if isinstance(value, bool | np.bool_):
            return BOOL
        if isinstance(value, int | np.integer):
            return INT
        if isinstance(value, float | np.floating):
            return FLOAT
    return kind


def spelt(kind: Type) -> Type:
    """Return the type of a known tuple item by item."""
    if isinstance(kind, Known) and isinstance(kind.value, tuple):
        return Several(tuple(Known(item) for item in kind.value))
    return kind


def is_number(kind: Type) -> bool:
    """Say whether it is one number."""
    return isinstance(widen(kind), Scalar)


def unify(a: Type, b: Type) -> Type | None:
    """Return what holds both, or None."""
    if a == b:
        return a
    a, b = spelt(a), spelt(b)
    if isinstance(a, Struct | Several) and isinstance(b, Struct | Several) and len(a.items) == len(b.items):
        items = [unify(x, y) for x, y in zip(a.items, b.items)]
        if None in items or type(a) is not type(b):
            return None
        return Several(tuple(items)) if isinstance(a, Several) else Struct(a.instance_class, tuple(items))
    if isinstance(a, View) and isinstance(b, View) and (a.dims, a.element) == (b.dims, b.element):
        return View(a.dims, a.element, True)
    a, b = widen(a), widen(b)
    if isinstance(a, Scalar) and isinstance(b, Scalar):
        return a if a.rank >= b.rank else b
    return None


def is_ghost(kind: Type) -> bool:
    """Say whether nothing of it is left at run time."""
    return isinstance(kind, Known) or (isinstance(kind, Struct | Several) and all(map(is_ghost, kind.items)))


def is_wide(kind: Type) -> bool:
    """Say whether it is, or holds, lanes."""
    if isinstance(kind, Struct | Several):
        return any(map(is_wide, kind.items))
    return LANES in (kind, getattr(kind, "element", None))


def loose(kind: Type | None) -> Type | None:
    """Return the type of what one of two ways gives: known numbers in a tuple become any numbers."""
    if isinstance(kind, Several):
        return Several(tuple(loose(item) for item in kind.items))
    return kind if kind is None else widen(kind)


def describe(kind: Type) -> str:
    """Return a type in words."""
    if isinstance(kind, View):
        return f"view of {kind.dims} dimension{'s' * (kind.dims > 1)}"
    if isinstance(kind, Struct):
        return kind.instance_class.__name__
    if isinstance(kind, Several):
        return f"tuple of {len(kind)}"
    wide = widen(kind)
    return "nothing" if kind == NOTHING else getattr(wide, "name", repr(getattr(kind, "value", kind)))
