"""What stands for a value while kernels are unfolded: a number known or written down, a table somewhere in an array."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .types import BOOL, FLOAT, INT, Scalar

OR, AND, EQUAL, ORDER, SUM, PRODUCT, SIGN, ATOM = 1, 2, 3, 4, 5, 6, 7, 9  # how strongly an operation binds
NAN, INFINITY = "NOT_A_NUMBER", "INFINITE"


@dataclass(frozen=True)
class Number:
    """A number: known where there is no ``text``; an integer with one is ``text + value``."""

    kind: Scalar
    text: str = ""
    value: Any = 0
    binds: int = ATOM
    is_safe: bool = True  # may be evaluated where it does not count: no index, quotient or root in it

    @property
    def is_known(self) -> bool:
        """Whether its value is."""
        return not self.text

    @property
    def is_plain(self) -> bool:
        """Whether it is a constant or a variable."""
        return self.is_known or (self.text.isidentifier() and not self.value)

    def within(self, least: int = 0) -> str:
        """Return its text; in parentheses if it binds less strongly than ``least``."""
        if self.is_known:
            text = literal(self.kind, self.value)
            binds = SUM if text[0] == "-" else ATOM
        elif self.kind == INT and self.value:
            binds = SUM
            text = f"{self.text} {'+' if self.value > 0 else '-'} {abs(self.value)}"
        else:
            text, binds = self.text, self.binds
        return f"({text})" if binds < least else text


def known(value: Any) -> Any:
    """Return a constant: a number, a tuple of them, or what it is."""
    if isinstance(value, bool | np.bool_):
        return Number(BOOL, value=bool(value))
    if isinstance(value, int | np.integer):
        return Number(INT, value=int(value))
    if isinstance(value, float | np.floating):
        return Number(FLOAT, value=float(value))
    return tuple(map(known, value)) if isinstance(value, tuple) else value


def literal(kind: Scalar, value) -> str:
    """Return a constant as it is written; one that single precision cannot hold says that it is double."""
    if kind == BOOL:
        return "TRUE" if value else "FALSE"
    if kind == INT:
        return str(int(value))
    value = float(value)
    if value != value:
        return NAN
    if abs(value) == np.inf:
        return INFINITY if value > 0 else f"-{INFINITY}"
    mantissa, _, exponent = repr(value).partition("e")
    text = mantissa + ".0" * ("." not in mantissa) + (f"E{int(exponent)}" if exponent else "")
    with np.errstate(over="ignore", under="ignore"):
        is_single = float(np.float32(value)) == value
    return text if is_single else f"LREAL#{text}"


@dataclass
class Array:
    """A stretch of a region that has a name; with ``labels`` each of its numbers has one."""

    name: str
    start: int
    size: int
    labels: list[str] | None = None
    is_used: bool = False


@dataclass
class Region:
    """Memory that kernels are given: ``values`` where they are known; ``labels``: names of stretches."""

    name: str
    size: int
    values: list[float] | None = None
    arrays: list[Array] = field(default_factory=list)

    def find(self, at: int, size: int) -> Array | None:
        """Return the array that holds these numbers."""
        return next((a for a in self.arrays if a.start <= at and at + size <= a.start + a.size), None)


@dataclass(frozen=True)
class Table:
    """A view: numbers of a region from ``at`` on; ``step`` apart where it is a column. A size may be unknown (None)."""

    region: Any
    at: Number
    sizes: tuple[Number | None, ...]
    step: Number | None = None
    array: Any = None

    @property
    def extent(self) -> tuple[int, int] | None:
        """Where it begins and how many numbers it has, if that is known."""
        known = [s.value for s in self.sizes if s is not None and s.is_known]
        if self.step is not None or not self.at.is_known or len(known) < len(self.sizes):
            return None
        return self.at.value, int(np.prod(known))


def add(a: Number, b: Number, sign: int = 1) -> Number:
    """Return the sum of two integers, or their difference."""
    value = a.value + sign * b.value
    if b.is_known:
        return Number(INT, a.text, value, a.binds, a.is_safe)
    if a.is_known and sign > 0:
        return Number(INT, b.text, value, b.binds, b.is_safe)
    bare = [Number(INT, n.text, 0, n.binds) for n in (a, b)]
    if a.is_known:
        return Number(INT, f"{a.value} - {bare[1].within(PRODUCT)}", -b.value, SUM, b.is_safe)
    text = f"{bare[0].within(SUM)} {'+' if sign > 0 else '-'} {bare[1].within(PRODUCT)}"
    return Number(INT, text, value, SUM, a.is_safe and b.is_safe)


def times(a: Number, b: Number) -> Number:
    """Return the product of two integers."""
    if a.is_known:
        a, b = b, a
    if b.is_known and (a.is_known or b.value == 0):
        return Number(INT, value=a.value * b.value)
    if b.is_known and b.value == 1:
        return a
    if b.is_known:
        bare = Number(INT, a.text, 0, a.binds).within(PRODUCT)
        return Number(INT, f"{bare} * {b.within(SIGN)}", a.value * b.value, PRODUCT, a.is_safe)
    return Number(INT, f"{a.within(PRODUCT)} * {b.within(SIGN)}", 0, PRODUCT, a.is_safe and b.is_safe)
