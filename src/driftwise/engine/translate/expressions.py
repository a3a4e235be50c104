"""Read the expressions of a kernel: names, arithmetic, tests, tuples; `calls` and `subscripts` have the rest."""

from __future__ import annotations

import ast
from typing import Any

from .bodies import has_effects
from .calls import Calls
from .refusal import Refusal, refused
from .subscripts import Subscripts
from .tree import Constant, Cut, Extent, If, Let, Load, Make, Name, Operation, Part, walk
from .types import (
    BOOL,
    FLOAT,
    INT,
    LANES,
    MASK,
    Known,
    Several,
    Struct,
    Type,
    View,
    describe,
    is_number,
    loose,
    unify,
    widen,
)

MAKES: dict[Type, Any] = {BOOL: bool, INT: int, FLOAT: float, LANES: float, MASK: bool}  # a constant of each type

SIGNS = {
    "Add": "+", "Sub": "-", "Mult": "*", "Div": "/", "FloorDiv": "//", "Mod": "%", "Pow": "**", "BitOr": "|",
    "BitAnd": "&", "BitXor": "^", "LShift": "<<", "RShift": ">>",
    "Lt": "<", "LtE": "<=", "Gt": ">", "GtE": ">=", "Eq": "==", "NotEq": "!=",
}  # fmt: skip
PYTHON: dict[str, Any] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "//": lambda a, b: a // b, "%": lambda a, b: a % b, "**": lambda a, b: a**b, "|": lambda a, b: a | b,
    "&": lambda a, b: a & b, "^": lambda a, b: a ^ b, "<<": lambda a, b: a << b, ">>": lambda a, b: a >> b,
    "<": lambda a, b: a < b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b, "!=": lambda a, b: a != b,
}  # fmt: skip
COMPARISONS = {"<", "<=", ">", ">=", "==", "!="}
SHORT = 8  # statements of a way that lanes go whatever the test, rather than to ask whether they agree
CONVERSIONS: dict[Any, str] = {FLOAT: "float", INT: "int", BOOL: "bool", LANES: "spread", MASK: "mask"}


class Expressions(Calls, Subscripts):
    """What has a value. The reader of statements adds the block that calls are written into."""

    # given by the reader
    program: Any
    scope: dict[str, Any]
    variables: dict[str, Type]
    block: list[Any]
    count: int
    current: Any
    error: Any
    refuse: Any
    assigned: frozenset[str]
    calls: list[Any]
    is_own: bool

    def expression(self, node) -> Any:
        """Return an expression as a tree; what must come before it is written into the block."""
        read = getattr(self, f"value_{type(node).__name__}", None)
        if read is None:
            raise self.error(node, refused(type(node).__name__))
        return read(node)

    def ordered(self, nodes) -> list[Any]:
        """Return several, in Python's order: what was read before a later call is kept."""
        found: list[Any] = []
        for node in nodes:
            before = len(self.block)
            value = self.expression(node)
            if len(self.block) > before and has_effects(self.block[before:]):
                late, self.block = self.block[before:], self.block[:before]
                found = [self.keep(f) if any(isinstance(e, Load) for e in walk(f)) else f for f in found]
                self.block += late
            found.append(value)
        return found

    def keep(self, value) -> Any:
        """Give a value a name of its own."""
        if isinstance(value, Constant | Name):
            if not isinstance(value, Name) or value.name[0] == "_":
                return value
        self.count += 1
        name = f"_{self.count}"
        self.variables[name] = widen(value.type)
        self.block.append(Let(name, self.convert(value, self.variables[name])))
        return Name(self.variables[name], name)

    def convert(self, value, kind: Type) -> Any:
        """Return a value as one of another type that holds it."""
        if value.type == kind:
            return value
        if isinstance(value, Constant) and is_number(kind) and is_number(value.type):
            return Constant(widen(kind), MAKES[widen(kind)](value.value))
        if value.type == LANES and kind != MASK and is_number(kind):
            raise Refusal(f"what differs from lane to lane is no {describe(kind)}")
        if value.type == MASK and is_number(kind):
            if kind == LANES:
                return Operation(LANES, "select", [value, Constant(LANES, 1.0), Constant(LANES, 0.0)])
            return self.convert(Operation(BOOL, "agree", [value]), kind)
        if is_number(kind) and is_number(value.type):
            return Operation(kind, CONVERSIONS[kind], [value])
        if isinstance(kind, Struct | Several):
            if not isinstance(value, Constant | Make):
                value = self.keep(value)
            return Make(kind, [self.convert(self.part(value, i), k) for i, k in enumerate(kind.items)])
        if isinstance(kind, View) and isinstance(value.type, View):
            return Operation(kind, "strided", [value])
        raise Refusal(f"a {describe(value.type)} stands where a {describe(kind)} is wanted")

    def number(self, value, kind: Type, node) -> Any:
        """Return a value as a number of this type, or one of more."""
        if not is_number(value.type):
            raise self.error(node, "a number is wanted")
        if kind == INT and widen(value.type) in (FLOAT, LANES):
            raise self.error(node, "an integer is wanted; write int(..)")
        return self.convert(value, kind)

    def truth(self, value, node) -> Any:
        """Return a test as a truth value, of lanes as one of each."""
        if isinstance(value, Constant):
            return Constant(BOOL, bool(value.value))
        if value.type in (BOOL, MASK):
            return value
        if is_number(value.type):
            kind = MASK if value.type == LANES else BOOL
            return Operation(kind, "!=", [value, self.convert(Constant(INT, 0), widen(value.type))])
        raise self.error(node, "a truth value is wanted")

    # --- names and constants -------------------------------------------------------------------------------

    def value_Constant(self, node) -> Any:
        """A number."""
        return Constant(Known(node.value), node.value)

    def value_Name(self, node) -> Any:
        """A variable, or what the name means outside."""
        kind = self.variables.get(node.id)
        if kind is None and node.id in self.assigned:
            raise self.error(node, f"{node.id} is read above the line that gives it a value; give it one before")
        if kind is None:
            if node.id not in self.scope:
                raise self.error(node, f"{node.id} is not known")
            value = self.scope[node.id]
            return Constant(Known(value), value)
        return Constant(kind, kind.value) if isinstance(kind, Known) else Name(kind, node.id)

    def value_Attribute(self, node) -> Any:
        """A field of a named tuple, something of a module, the size or shape of a view."""
        value = self.expression(node.value)
        kind = value.type
        if isinstance(kind, Struct):
            if node.attr not in kind.names:
                raise self.error(node, f"a {kind.instance_class.__name__} has no {node.attr}")
            return self.part(value, kind.names.index(node.attr))
        if isinstance(kind, View):
            if node.attr == "size":
                return Extent(INT, value, -1)
            if node.attr == "shape":
                return Make(Several((INT,) * kind.dims), [Extent(INT, value, i) for i in range(kind.dims)])
        if isinstance(kind, Known) and hasattr(kind.value, node.attr):
            found = getattr(kind.value, node.attr)
            return Constant(Known(found), found)
        if isinstance(kind, View):
            raise self.error(node, f"a view has a size and a shape, but no {node.attr}; write a loop")
        raise self.error(node, f"this has no {node.attr}")

    def part(self, value, index: int) -> Any:
        """Return an item of a tuple."""
        if isinstance(value, Constant):
            return Constant(Known(value.value[index]), value.value[index])
        if isinstance(value.type, View):
            return Cut(View(value.type.dims - 1, value.type.element), value, [Constant(INT, index)], None)
        kind = value.type.items[index]
        if isinstance(kind, Known):
            return Constant(kind, kind.value)
        return value.parts[index] if isinstance(value, Make) else Part(kind, value, index)

    # --- arithmetic ----------------------------------------------------------------------------------------

    def value_BinOp(self, node) -> Any:
        """``a + b``."""
        left, right = self.ordered([node.left, node.right])
        return self.operate(type(node.op).__name__, left, right, node)

    def operate(self, sign: str, a, b, node) -> Any:
        """Return an operation of two numbers."""
        if sign not in SIGNS:
            raise self.error(node, refused(sign))
        op = SIGNS[sign]
        if not is_number(a.type) or not is_number(b.type):
            raise self.error(node, f"{op} is for numbers; what holds several is gone through in a loop")
        if isinstance(a, Constant) and isinstance(b, Constant):
            return self.folded(PYTHON[op], [a.value, b.value], node)
        kinds = [widen(a.type), widen(b.type)]
        if op in COMPARISONS:
            common: Any = unify(*kinds)
            common = BOOL if common == MASK else common
            kind: Type = MASK if common == LANES else BOOL
            return Operation(kind, op, [self.convert(a, common), self.convert(b, common)])
        if op in ("|", "&", "^", "<<", ">>"):
            if FLOAT in kinds or LANES in kinds:
                raise self.error(node, f"{op} is for integers")
            kind = BOOL if kinds == [BOOL, BOOL] else INT
            return Operation(kind, op, [self.convert(a, kind), self.convert(b, kind)])
        if op in ("//", "%") and (FLOAT in kinds or LANES in kinds):
            raise self.error(node, f"{op} is for integers; write int(..)")
        if op == "**":
            return self.power(a, b, node)
        kind = LANES if LANES in kinds else FLOAT if op == "/" or FLOAT in kinds else INT
        return Operation(kind, op, [self.convert(a, kind), self.convert(b, kind)])

    def power(self, a, b, node) -> Any:
        """Powers: by repeated squaring where the exponent is an integer."""
        if widen(b.type) == FLOAT:
            raise self.error(node, "a power with an exponent of many digits is `pow` of engine.elementary")
        if not isinstance(b, Constant):
            return Operation(FLOAT, "power", [self.convert(a, FLOAT), self.convert(b, INT)])
        if b.value < 1 or b.value > 64:
            raise self.error(node, "a power that is known is from 1 to 64")
        if not isinstance(a, Constant | Name):
            a = self.keep(a)
        result, exponent = None, int(b.value)
        kind = widen(a.type)
        while exponent:
            if exponent & 1:
                result = a if result is None else self.keep(Operation(kind, "*", [result, a]))
            exponent >>= 1
            if exponent:
                a = self.keep(Operation(kind, "*", [a, a]))
        return result

    def folded(self, operation, values, node) -> Any:
        """Return the result of an operation on what is known."""
        try:
            value = operation(*values)
        except (ArithmeticError, ValueError, TypeError) as trouble:
            raise self.error(node, str(trouble)) from None
        return Constant(Known(value), value)

    def value_UnaryOp(self, node) -> Any:
        """``-a``, ``not a``."""
        if isinstance(node.op, ast.Not):
            test = self.test(node.operand)
            if isinstance(test, Constant):
                return Constant(Known(not test.value), not test.value)
            return Operation(test.type, "not", [test])
        value = self.expression(node.operand)
        if not is_number(value.type):
            raise self.error(node, "a sign is for numbers")
        if isinstance(node.op, ast.USub):
            if isinstance(value, Constant):
                return Constant(Known(-value.value), -value.value)
            kind = widen(value.type) if widen(value.type) not in (BOOL, MASK) else INT
            return Operation(kind, "neg", [self.convert(value, kind)])
        raise self.error(node, refused(type(node.op).__name__))

    def value_Compare(self, node) -> Any:
        """``a < b``, ``a < b < c``: c is only looked at where a < b."""
        middle: list[Any] = []

        def compare(i: int) -> Any:
            a, b = (
                [middle[-1], self.expression(node.comparators[i])]
                if i
                else self.ordered([node.left, *node.comparators[:1]])
            )
            if i + 1 < len(node.ops):
                middle.append(self.keep(b))
                b = middle[-1]
            return self.operate(type(node.ops[i]).__name__, a, b, node)

        return self.one_by_one("and", [lambda i=i: compare(i) for i in range(len(node.ops))])

    def joined(self, op: str, tests) -> Any:
        """Return truth values joined by ``and`` or ``or``."""
        left: list[Any] = []
        for test in tests:
            if isinstance(test, Constant):
                if bool(test.value) == (op == "or"):
                    if not left:
                        return test
                    left.append(Constant(BOOL, bool(test.value)))
                    break
                continue
            left.append(test)
        if not left:
            return Constant(Known(op == "and"), op == "and")
        if all(test.type == BOOL for test in left):
            return left[0] if len(left) == 1 else Operation(BOOL, op, left)
        joint = self.convert(left[0], MASK)
        for test in left[1:]:
            joint = Operation(MASK, op, [joint, self.convert(test, MASK)])
        return joint

    def test(self, node) -> Any:
        """Return what a test says; numbers count as true unless they are zero."""
        if isinstance(node, ast.BoolOp):
            return self.truth(self.value_BoolOp(node, self.test), node)
        return self.truth(self.expression(node), node)

    def operand(self, node) -> Any:
        """Return an operand of ``and`` or ``or`` whose result is used: Python gives the operand itself."""
        value = self.expression(node)
        if widen(value.type) not in (BOOL, MASK):
            raise self.error(node, "`and` and `or` give back an operand: compare it, so that it is a truth value")
        return value

    def value_BoolOp(self, node, read=None) -> Any:
        """``a and b``."""
        read = read or self.operand
        op = "and" if isinstance(node.op, ast.And) else "or"
        return self.one_by_one(op, [lambda one=one: read(one) for one in node.values])

    def one_by_one(self, op: str, asks) -> Any:
        """Return truth values joined: what stands behind is only looked at where it counts."""
        tests: list[Any] = []
        for i, ask in enumerate(asks):
            outer, self.block = self.block, []
            test = ask()
            inner, self.block = self.block, outer
            if inner and i > 0:
                first = self.joined(op, tests)
                if isinstance(first, Constant) and bool(first.value) == (op == "or"):
                    return first
                name = self.fresh(BOOL)
                self.block.append(Let(name.name, self.convert(first, BOOL)))
                inner.append(Let(name.name, self.convert(test, BOOL)))
                self.block.append(If(name if op == "and" else Operation(BOOL, "not", [name]), inner, []))
                tests = [name]
            else:
                self.block += inner
                tests.append(test)
        return self.joined(op, tests)

    def fresh(self, kind: Type) -> Name:
        """Return a new variable."""
        self.count += 1
        name = f"_{self.count}"
        self.variables[name] = kind
        return Name(kind, name)

    def value_IfExp(self, node) -> Any:
        """``a if test else b``."""
        test = self.test(node.test)
        if isinstance(test, Constant):
            return self.expression(node.body if test.value else node.orelse)
        outer, found = self.block, []
        for way in (node.body, node.orelse):
            self.block = []
            found.append((self.expression(way), self.block))
        self.block = outer
        (a, before_a), (b, before_b) = found
        kind = loose(unify(widen(a.type), widen(b.type)))
        if kind is None:
            raise self.error(node, f"one way gives a {describe(a.type)}, the other a {describe(b.type)}")
        if test.type == MASK and kind in (FLOAT, LANES, MASK, BOOL) and are_short(before_a, before_b):
            self.block += before_a + before_b
            kind = LANES if kind in (FLOAT, LANES) else MASK
            return Operation(kind, "select", [test, self.convert(a, kind), self.convert(b, kind)])
        test = self.convert(test, BOOL)
        if not before_a and not before_b and is_number(kind):
            return Operation(kind, "select", [test, self.convert(a, kind), self.convert(b, kind)])
        name = self.fresh(kind)
        for value, before in ((a, before_a), (b, before_b)):
            outer, self.block = self.block, before
            value = self.convert(value, kind)
            self.block.append(Let(name.name, value))
            self.block = outer
        self.block.append(If(test, before_a, before_b))
        return name

    # --- tuples and views ----------------------------------------------------------------------------------

    def value_Tuple(self, node) -> Any:
        """``(a, b)``."""
        values = self.ordered(node.elts)
        if all(isinstance(v, Constant) for v in values):
            known = tuple(v.value for v in values)
            return Constant(Known(known), known)
        return Make(Several(tuple(v.type for v in values)), values)


def are_short(*ways) -> bool:
    """Say whether both ways may be gone, whatever the test: they call nothing that writes, and are a few statements."""
    found = [one for way in ways for one in way]
    return len(found) <= SHORT and not has_effects(found) and all(isinstance(one, Let) for one in found)
