"""Unfold expressions: numbers known or written down, views as places in arrays."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from .refusal import Refusal
from .st_statements import Set, Test
from .st_values import (
    AND,
    ATOM,
    EQUAL,
    OR,
    ORDER,
    PRODUCT,
    SIGN,
    SUM,
    Number,
    Table,
    add,
    known,
    times,
)  # fmt: skip
from .tree import Column, Constant, Cut, Extent, Fold, Load, Look, Make, Name, Operation, Part
from .types import BOOL, FLOAT, INT, Scalar, Struct
from .unfold_operations import Operations

SIGNS = {
    "+": ("+", SUM), "-": ("-", SUM), "*": ("*", PRODUCT), "/": ("/", PRODUCT), "==": ("=", EQUAL), "!=": ("<>", EQUAL),
    "<": ("<", ORDER), "<=": ("<=", ORDER), ">": (">", ORDER), ">=": (">=", ORDER),
}  # fmt: skip
PYTHON: dict[str, Any] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "<": lambda a, b: a < b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b, "!=": lambda a, b: a != b, "//": lambda a, b: a // b, "%": lambda a, b: a % b,
    "|": lambda a, b: a | b, "&": lambda a, b: a & b, "max": lambda a, b: b if b > a else a,
    "min": lambda a, b: b if b < a else a,
}  # fmt: skip


class Values(Operations):
    """What has a value. `Unfold` has the rest."""

    block: list[Any]
    names: Any
    spare: Any
    storage: Any
    set: Any
    kept: Any
    array: Any
    functions: dict[str, Any]

    def refuse(self, what: str) -> None:
        """Say what there is no way to write down."""
        raise Refusal(f"Structured Text is not written for {what}")

    def value(self, frame, node, into=None) -> Any:
        """Return an expression; one that takes a choice is left in the variable ``into``, or in one of its own."""
        if isinstance(node, Operation):
            return self.operation(frame, node, into)
        return getattr(self, f"value_{type(node).__name__}")(frame, node)

    def value_Constant(self, frame, node: Constant) -> Any:
        """What is known."""
        found = known(node.value)
        if isinstance(found, Number) and isinstance(node.type, Scalar) and found.kind != node.type:
            return Number(node.type, value={FLOAT: float, INT: int, BOOL: bool}[node.type](node.value))
        return found

    def value_Name(self, frame, node: Name) -> Any:
        """A variable."""
        return frame.values[node.name]

    def value_Part(self, frame, node: Part) -> Any:
        """An item."""
        return self.value(frame, node.value)[node.index]

    def value_Make(self, frame, node: Make) -> tuple[Any, ...]:
        """A tuple; views of memory that has no name yet get the names of their fields."""
        parts = tuple(self.value(frame, part) for part in node.parts)
        titles = node.type.names if isinstance(node.type, Struct) else ()
        return tuple(self.named(part, title) for part, title in zip(parts, titles)) or parts

    def named(self, part, title: str) -> Any:
        """Return a view, in an array of this name if it was in none."""
        if not isinstance(part, Table) or part.array is not None or part.extent is None or part.extent[1] == 0:
            return part
        start, size = part.extent
        labels = getattr(part.region, "labels", {}).get((start, size))
        array = part.region.find(start, size) or self.array(part.region, title, start, size, labels)
        return Table(part.region, part.at, part.sizes, part.step, array)

    # --- views ---------------------------------------------------------------------------------------------

    def element(self, frame, view, indices) -> Number:
        """Return a number of a view: to read, or what is written."""
        table = self.value(frame, view)
        at = table.at
        for axis, index in enumerate(indices):
            at = add(at, times(self.value(frame, index), self.stride(table, axis)))
        return self.at(table, at, view.type.element)

    def stride(self, table: Table, axis: int) -> Number:
        """Return how far apart neighbours along an axis are."""
        if table.step is not None:
            return table.step
        found = known(1)
        for size in table.sizes[axis + 1 :]:
            found = times(found, self.sure(size))
        return found

    def sure(self, size: Number | None) -> Number:
        """Return a size, if it is told."""
        if size is None:
            self.refuse("a stretch whose length only running numbers tell")
        assert size is not None
        return size

    def at(self, table: Table, at: Number, kind=FLOAT) -> Number:
        """Return the number at a place of a table's memory."""
        region = table.region
        if region.values is not None and at.is_known:
            return Number(kind, value={FLOAT: float, INT: int, BOOL: bool}[kind](region.values[at.value]))
        array = table.array or region.find(at.value, 1)
        if array is None:
            start, size = table.extent or (0, region.size)
            array = self.array(region, region.name, start, size)
        array.is_used = True
        index = add(at, known(-array.start))
        if array.labels and index.is_known:
            return Number(kind, array.labels[index.value])
        if array.labels:
            self.refuse(f"numbers of {region.name} chosen by running numbers")
        if array.size == 1:
            return Number(kind, array.name)
        return Number(kind, f"{array.name}[{index.within()}]", is_safe=index.is_known)

    def value_Load(self, frame, node: Load) -> Number:
        """A number of a view."""
        return self.element(frame, node.view, node.indices)

    def value_Look(self, frame, node: Look) -> Number:
        """An entry of a table of constants."""
        index = self.value(frame, node.index)
        if index.is_known:
            return known(node.table[index.value])
        self.refuse("a table of constants")
        raise AssertionError

    def value_Extent(self, frame, node: Extent) -> Number:
        """A size."""
        table = self.value(frame, node.view)
        found = known(1)
        for size in table.sizes if node.axis < 0 else (table.sizes[node.axis],):
            found = times(found, self.sure(size))
        return found

    def value_Column(self, frame, node: Column) -> Table:
        """A column."""
        table = self.value(frame, node.view)
        at = add(table.at, self.value(frame, node.index))
        return Table(table.region, at, (table.sizes[0],), table.sizes[1], table.array)

    def value_Fold(self, frame, node: Fold) -> Table:
        """The same numbers as a table."""
        table = self.value(frame, node.view)
        return Table(table.region, table.at, tuple(self.value(frame, size) for size in node.shape), None, table.array)

    def value_Cut(self, frame, node: Cut) -> Table:
        """Part of a view; clipped as Python does where that is known."""
        table = self.value(frame, node.view)
        at, sizes = table.at, list(table.sizes)
        for axis, index in enumerate(node.indices):
            at = add(at, times(self.value(frame, index), self.stride(table, axis)))
            sizes.pop(0)
        if node.stretch is not None:
            axis = len(node.indices)
            start, size = self.value(frame, node.stretch[0]), sizes[0]
            stop = size if node.stretch[1] is None else self.value(frame, node.stretch[1])
            if size is not None and size.is_known and start.is_known:
                start = known(min(start.value, size.value))
            if stop is not None and stop.is_known and size is not None and size.is_known:
                stop = known(min(stop.value, size.value))
            if start.is_known and stop is not None and stop.is_known:
                sizes[0] = known(max(stop.value - start.value, 0))
            else:
                sizes[0] = None
            at = add(at, times(start, self.stride(table, axis)))
        found = Table(table.region, at, tuple(sizes), table.step, table.array)
        if found.array is None and found.extent is not None and found.extent[1]:
            found = Table(found.region, at, found.sizes, found.step, found.region.find(*found.extent))
        return found

    # --- arithmetic ----------------------------------------------------------------------------------------

    def operation(self, frame, node: Operation, into) -> Any:
        """Arithmetic, a comparison, a choice, a conversion."""
        op, kind = node.op, node.type
        if op in ("and", "or"):
            return self.chain(frame, node, into)
        if op == "select":
            return self.select(frame, node, into)
        args = [self.value(frame, a) for a in node.args]
        if op in SIGNS or op in ("|", "&", "//", "%", "max", "min"):
            assert isinstance(kind, Scalar)
            a, b = args
            if a.is_known and b.is_known:
                with np.errstate(all="ignore"):
                    wide = [np.float64(n.value) if n.kind == FLOAT else n.value for n in args]
                    found = PYTHON[op](*wide)
                return Number(kind, value={FLOAT: float, INT: int, BOOL: bool}[kind](found))
            if op in ("max", "min"):
                return self.extreme(op, a, b, kind, into)
            return self.binary(op, a, b, kind)
        return getattr(self, f"op_{op}")(*args, node, into)

    def binary(self, op: str, a: Number, b: Number, kind: Scalar) -> Number:
        """An operation of two numbers."""
        if kind == INT and op in "+-":
            return add(a, b, 1 if op == "+" else -1)
        if kind == INT and op == "*":
            return times(a, b)
        if op in ("|", "&"):
            return self.bits(op, a, b, kind)
        if op in ("//", "%"):
            return self.whole(op, a, b)
        if kind == FLOAT and op in "*/" and b.is_known and b.value == 1.0:
            return a
        if kind == FLOAT and op == "*" and a.is_known and a.value == 1.0:
            return b
        if (op == ">" and b.is_known and b.value == math.inf) or (op == "<" and a.is_known and a.value == math.inf):
            return known(False)
        sign, binds = SIGNS[op]
        left = ORDER + 1 if binds in (ORDER, EQUAL) else binds
        text = f"{a.within(left)} {sign} {b.within(max(left, binds + 1))}"
        return Number(kind, text, 0, binds, a.is_safe and b.is_safe and op != "/")

    def bits(self, op: str, a: Number, b: Number, kind: Scalar) -> Number:
        """Bits of status; truth values."""
        for one, other in ((a, b), (b, a)):
            if one.is_known and not one.value:
                return other if op == "|" else one
        word = "OR" if op == "|" else "AND"
        if kind == BOOL:
            binds = OR if op == "|" else AND
            return Number(BOOL, f"{a.within(ATOM)} {word} {b.within(ATOM)}", 0, binds, a.is_safe and b.is_safe)
        texts = [f"DWORD#16#{n.value:X}" if n.is_known else f"DINT_TO_DWORD({n.within()})" for n in (a, b)]
        return Number(INT, f"DWORD_TO_DINT({texts[0]} {word} {texts[1]})", is_safe=a.is_safe and b.is_safe)

    def whole(self, op: str, a: Number, b: Number) -> Number:
        """Python's // and %, which go down: as the machine's, which go to zero, plus a correction."""
        if not b.is_known or b.value <= 0:
            self.refuse("integers divided by what is not known")
        sign = "/" if op == "//" else "MOD"
        quotient = Number(INT, f"{a.within(PRODUCT)} {sign} {b.within(SIGN)}", 0, PRODUCT)
        if is_triangle(a.text, a.value):
            return quotient
        found, a = self.spare(INT), self.kept(a)
        self.set(found, Number(INT, f"{a.text} {sign} {b.value}", 0, PRODUCT))
        down = Set(found.text, f"{found.text} - 1" if op == "//" else f"{found.text} + {b.value}", found.text)
        self.block.append(Test(f"({a.text} < 0) AND ({a.text} MOD {b.value} <> 0)", [down]))
        return found

    def target(self, kind: Scalar, into) -> Number:
        """Return the variable that takes a choice."""
        return self.spare(kind) if into is None else self.storage(*into, kind)

    def way(self, target: Number, frame, node) -> list[Any]:
        """Return the block that gives a variable a value."""
        outer, self.block = self.block, []
        self.set(target, node if isinstance(node, Number) else self.value(frame, node))
        block, self.block = self.block, outer
        return block

    def select(self, frame, node: Operation, into) -> Number:
        """``a if test else b``."""
        test = self.value(frame, node.args[0])
        if test.is_known:
            return self.value(frame, node.args[1 if test.value else 2], into)
        target = self.target(node.type, into)  # type: ignore[arg-type]  # numbers alone are chosen
        ways = [self.way(target, frame, one) for one in node.args[1:]]
        self.block.append(Test(test.within(), *ways))
        return target

    def extreme(self, op: str, a: Number, b: Number, kind: Scalar, into) -> Number:
        """The larger or smaller; of equals, and of what is not comparable, the first."""
        a, b = (n if n.is_plain else self.kept(n) for n in (a, b))
        target = self.target(kind, into)
        is_more = op == "max"
        test = f"{b.within(SUM)} {'>' if is_more else '<'} {a.within(SUM)}"
        if b.is_known:
            test = f"{a.within(SUM)} {'<' if is_more else '>'} {b.within(SUM)}"
        self.block.append(Test(test, self.way(target, None, b), self.way(target, None, a)))
        return target

    def chain(self, frame, node: Operation, into) -> Number:
        """``a and b``: both are evaluated where that does no harm, else one after the other."""
        is_and, word, binds = node.op == "and", "AND" if node.op == "and" else "OR", AND if node.op == "and" else OR
        found: Number | None = None
        for one in node.args:
            outer, self.block = self.block, []
            value = self.value(frame, one)
            before, self.block = self.block, outer
            if value.is_known and not before:
                if value.value != is_and:
                    return value
                continue
            if found is None:
                self.block += before
                found = value
            elif not before and value.is_safe:
                texts = [n.within(ATOM if n.binds <= EQUAL or n.binds == ORDER else SIGN) for n in (found, value)]
                if found.binds == binds:
                    texts[0] = found.within(binds)
                found = Number(BOOL, f" {word} ".join(texts), 0, binds, found.is_safe)
            else:
                so = self.spare(BOOL)
                self.set(so, found)
                before.append(Set(so.text, value.within(), so.text))
                self.block.append(Test(so.text if is_and else f"NOT {so.text}", before))
                found = so
        return found if found is not None else known(is_and)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("op_"):
            self.refuse(name[3:])
        raise AttributeError(name)


def is_triangle(text: str, value: int) -> bool:
    """Say whether it is a product of neighbours, j (j - 1) or (j + 1) j, which is never negative."""
    return value == 0 and re.fullmatch(r"(\w+) \* \(\1 [-+] 1\)|\((\w+) [-+] 1\) \* \2", text) is not None
