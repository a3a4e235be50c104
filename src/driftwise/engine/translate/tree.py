"""A kernel for given types, as a tree: every expression has a type, every call is a statement, in Python's order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from .types import Type


@dataclass
class Constant:
    """Something known; ``type`` is `Known`, or a scalar where it is written down as a number."""

    type: Type
    value: Any


@dataclass
class Name:
    """A variable."""

    type: Type
    name: str


@dataclass
class Operation:
    """Arithmetic, a comparison, a choice ("select") or a conversion; ``op`` is Python's sign or name for it."""

    type: Type
    op: str
    args: list[Any]


@dataclass
class Load:
    """One number of a view."""

    type: Type
    view: Any
    indices: list[Any]


@dataclass
class Cut:
    """A view of part of a view: rows by number, then perhaps a stretch (start, stop; None: to the end)."""

    type: Type
    view: Any
    indices: list[Any]
    stretch: tuple[Any, Any] | None
    clips: bool = True  # whether a stretch may reach beyond the view, and ends there


@dataclass
class Column:
    """A column of a table."""

    type: Type
    view: Any
    index: Any


@dataclass
class Fold:
    """The same numbers, as a table."""

    type: Type
    view: Any
    shape: list[Any]


@dataclass
class Extent:
    """How long a view is along an axis; axis -1: how many numbers it has."""

    type: Type
    view: Any
    axis: int


@dataclass
class Part:
    """A field of a named tuple, an item of a tuple."""

    type: Type
    value: Any
    index: int


@dataclass
class Make:
    """A named tuple or a tuple."""

    type: Type
    parts: list[Any]


@dataclass
class Look:
    """An entry of a table of constants."""

    type: Type
    table: tuple[Any, ...]
    index: Any


@dataclass
class Call:
    """A call of another kernel; only as the whole of `Let` or `Do`."""

    type: Type
    function: Function
    args: list[Any]


@dataclass
class Let:
    """Give a variable a value."""

    name: str
    value: Any


@dataclass
class Store:
    """Write one number into a view."""

    view: Any
    indices: list[Any]
    value: Any


@dataclass
class Fetch:
    """Bring a row of a table into the processor's cache; changes nothing."""

    view: Any
    index: Any


@dataclass
class Do:
    """A call for what it does."""

    call: Call


@dataclass
class Move:
    """Rows of a table to lanes ("collect"), or back ("scatter")."""

    word: str
    args: list[Any]


@dataclass
class Differ:
    """Count a disagreement: eight series at a time do not go this way."""


@dataclass
class For:
    """Count from start to before stop; ``step`` is a number that is known."""

    name: str
    start: Any
    stop: Any
    step: int
    body: list[Any]
    is_abreast: bool = False


@dataclass
class Loop:
    """For ever."""

    body: list[Any]


@dataclass
class If:
    """One of two ways."""

    test: Any
    then: list[Any]
    other: list[Any]


@dataclass
class Return:
    """Leave, perhaps with a value."""

    value: Any | None


@dataclass
class Leave:
    """``break`` or ``continue``."""

    word: str


@dataclass
class Function:
    """One kernel for the types of its arguments."""

    name: str
    title: str  # first line of its documentation
    params: list[tuple[str, Type]]  # those it uses
    used: list[int]  # their places among the arguments
    result: Type
    body: list[Any]
    variables: dict[str, Type]
    is_rare: bool
    has_effects: bool
    calls: list[Function] = field(default_factory=list)


def children(node) -> Iterator[Any]:
    """Yield the expressions that an expression or statement is made of, not those of statements inside it."""
    for name in PARTS[type(node)]:
        value = getattr(node, name)
        if type(value) in (list, tuple):
            yield from (one for one in value if one is not None)
        elif value is not None:
            yield value


def walk(node) -> list[Any]:
    """Return an expression and all that is in it."""
    left, found = [node], []
    while left:
        node = left.pop()
        found.append(node)
        for name in PARTS[type(node)]:
            value = getattr(node, name)
            if type(value) in (list, tuple):
                left += [one for one in value if one is not None]
            elif value is not None:
                left.append(value)
    return found


def statements(body: list[Any]) -> list[Any]:
    """Return all statements, those inside others too."""
    found = []
    for one in body:
        found.append(one)
        for inner in blocks(one):
            found += statements(inner)
    return found


def blocks(statement) -> tuple[list[Any], ...]:
    """Return the blocks of a statement."""
    kind = type(statement)
    if kind is If:
        return statement.then, statement.other
    return (statement.body,) if kind is For or kind is Loop else ()


# where each keeps its expressions
PARTS: dict[type, tuple[str, ...]] = {
    Constant: (), Name: (), Operation: ("args",), Load: ("view", "indices"), Cut: ("view", "indices", "stretch"),
    Column: ("view", "index"), Fold: ("view", "shape"), Extent: ("view",), Part: ("value",), Make: ("parts",),
    Look: ("index",), Call: ("args",), Let: ("value",), Store: ("view", "indices", "value"), Do: ("call",),
    Fetch: ("view", "index"), Move: ("args",), Differ: (), For: ("start", "stop"), Loop: (), If: ("test",),
    Return: ("value",), Leave: (),
}  # fmt: skip
