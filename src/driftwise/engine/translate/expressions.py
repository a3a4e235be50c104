"""Read the expressions of a kernel: names, arithmetic, views, tuples and calls."""

from __future__ import annotations

import ast
import builtins
import math
from types import ModuleType
from typing import Any

import numpy as np

from .. import elementary, simd, views
from ..elementary.pairs import about_one
from .bodies import has_effects
from .refusal import Refusal, refused
from .tree import (
    Call,
    Column,
    Constant,
    Cut,
    Differ,
    Do,
    Extent,
    Fetch,
    Fold,
    If,
    Let,
    Load,
    Look,
    Make,
    Move,
    Name,
    Operation,
    Part,
    walk,
)
from .types import (
    BOOL,
    FLOAT,
    INT,
    LANES,
    MASK,
    NOTHING,
    Known,
    Several,
    Struct,
    Type,
    View,
    describe,
    is_number,
    is_wide,
    loose,
    unify,
    widen,
)

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
BUILTINS = (builtins.int, builtins.float, builtins.bool, builtins.abs, builtins.len, builtins.max, builtins.min)
COMPARISONS = {"<", "<=", ">", ">=", "==", "!="}
MATH: dict[Any, tuple[str, Type, tuple[Type, ...]]] = {
    math.sqrt: ("sqrt", FLOAT, (FLOAT,)), math.isfinite: ("isfinite", BOOL, (FLOAT,)),
    math.isnan: ("isnan", BOOL, (FLOAT,)), math.copysign: ("copysign", FLOAT, (FLOAT, FLOAT)),
    math.ldexp: ("ldexp", FLOAT, (FLOAT, INT)), math.frexp: ("frexp", Several((FLOAT, INT)), (FLOAT,)),
    math.floor: ("floor", INT, (FLOAT,)), about_one: ("about_one", Several((FLOAT, INT)), (FLOAT,)),
}  # fmt: skip
ON_LANES = {"sqrt", "isfinite", "isnan", "copysign", "ldexp", "frexp"}
WIDE: dict[Type, Type] = {FLOAT: LANES, INT: LANES, BOOL: MASK}  # of lanes, whole numbers are floats too
SHORT = 8  # statements of a way that lanes go whatever the test, rather than to ask whether they agree
CONVERSIONS: dict[Any, str] = {FLOAT: "float", INT: "int", BOOL: "bool", LANES: "spread", MASK: "mask"}


class Expressions:
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
            make = {BOOL: bool, INT: int, FLOAT: float, LANES: float, MASK: bool}[widen(kind)]  # type: ignore[index]
            return Constant(widen(kind), make(value.value))
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

    def place(self, node) -> tuple[Any, list[Any]]:
        """Return the view and the indices of an element that is written."""
        view, indices = self.indexed(node)
        if not isinstance(view.type, View) or len(indices) != view.type.dims:
            raise self.error(node, "one number of a view is written, nothing else")
        return view, indices

    def indexed(self, node) -> tuple[Any, list[Any]]:
        """Return what is indexed, and integer indices."""
        nodes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        view, *indices = self.ordered([node.value, *nodes])
        if isinstance(view.type, View):
            indices = [self.index(view, axis, value, node) for axis, value in enumerate(indices)]
            if not isinstance(view, Name) and not _is_path(view):
                view = self.keep(view)
        return view, indices

    def index(self, view, axis: int, value, node) -> Any:
        """Return an index; one that is known and negative counts from the end."""
        value = self.number(value, INT, node)
        if isinstance(value, Constant) and value.value < 0:
            return Operation(INT, "+", [Extent(INT, view, axis), value])
        return value

    def bound(self, view, axis: int, value, node) -> Any:
        """Return where a slice begins or ends; a known negative one counts from the end, as far as it goes."""
        bound = self.index(view, axis, value, node)
        is_negative = isinstance(bound, Operation) and isinstance(value, Constant)
        return Operation(INT, "max", [bound, Constant(INT, 0)]) if is_negative else bound

    def value_Subscript(self, node) -> Any:
        """An element, a row, a stretch, an item."""
        nodes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if any(isinstance(one, ast.Slice) for one in nodes):
            return self.cut(node, nodes)
        value, indices = self.indexed(node)
        kind = value.type
        if isinstance(kind, View):
            if len(indices) > kind.dims:
                raise self.error(node, f"a view of {kind.dims} dimensions")
            if len(indices) == kind.dims:
                return Load(kind.element, value, indices)
            return Cut(View(kind.dims - len(indices), kind.element), value, indices, None)
        index = indices[0]
        items = getattr(kind, "items", None)
        if items is not None or (isinstance(value, Constant) and isinstance(index, Constant) and len(indices) == 1):
            if not isinstance(index, Constant):
                raise self.error(node, "an item of a tuple is chosen by a number that is known")
            count = len(items) if items is not None else len(value.value)
            return self.part(value, index.value % count if -count <= index.value < count else index.value)
        if isinstance(value, Constant):
            return self.looked_up(value.value, indices, node)
        raise self.error(node, "this has no elements")

    def looked_up(self, table, indices, node) -> Any:
        """Return an entry of a table of constants."""
        table = np.asarray(table)
        if table.dtype.kind not in "fib" or table.ndim not in (len(indices), len(indices) + 1):
            raise self.error(node, "a table of constants holds numbers, and is indexed to the last")
        at: Any = self.number(indices[0], INT, node)
        for axis in range(1, len(indices)):
            at = self.operate("Mult", at, Constant(Known(table.shape[axis]), table.shape[axis]), node)
            at = self.operate("Add", at, self.number(indices[axis], INT, node), node)
        kind = {"f": FLOAT, "i": INT, "b": BOOL}[table.dtype.kind]
        if table.ndim == len(indices):
            return Look(kind, tuple(table.ravel().tolist()), at)
        at = self.keep(at)
        columns = table.reshape(-1, table.shape[-1]).T.tolist()
        return Make(Several((kind,) * len(columns)), [Look(kind, tuple(column), at) for column in columns])

    def cut(self, node, nodes) -> Any:
        """Part of a view: ``a[i:j]``, ``a[i, j:k]``, ``a[:, j]``."""
        where = nodes[-1] if isinstance(nodes[-1], ast.Slice) else nodes[0]
        bounds = [b for b in (where.lower, where.upper) if b is not None] if isinstance(where, ast.Slice) else []
        if where.step is not None:
            raise self.error(node, "a slice has no step here")
        others = [one for one in nodes if one is not where]
        view, *found = self.ordered([node.value, *others, *bounds])
        if not isinstance(view.type, View):
            if isinstance(view, Constant) and all(isinstance(f, Constant) for f in found) and not others:
                low = found.pop(0).value if where.lower is not None else None
                known = view.value[low : found[0].value if found else None]
                return Constant(Known(known), known)
            raise self.error(node, "a slice is cut from a view")
        if not isinstance(view, Name) and not _is_path(view):
            view = self.keep(view)
        kind = view.type
        if len(nodes) == 2 and where is nodes[0]:
            column = found[0]
            if kind.dims != 2 or bounds:
                raise self.error(node, "a column is cut whole, from a table")
            return Column(View(1, kind.element, True), view, self.index(view, 1, column, node))
        if len(others) + 1 > kind.dims:
            raise self.error(node, f"a view of {kind.dims} dimensions")
        indices = [self.index(view, axis, f, node) for axis, f in enumerate(found[: len(others)])]
        axis, found = len(others), found[len(others) :]
        low = self.bound(view, axis, found.pop(0), node) if where.lower is not None else Constant(INT, 0)
        high = self.bound(view, axis, found.pop(0), node) if where.upper is not None else None
        clips = not self.is_own  # what driftwise cuts is within bounds: the checked build proves it, of every loop
        return Cut(View(kind.dims - len(others), kind.element, kind.is_strided), view, indices, (low, high), clips)

    # --- calls ---------------------------------------------------------------------------------------------

    def value_Call(self, node) -> Any:
        """A call: arithmetic, a class, or another kernel."""
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise self.error(node, "arguments are given by place, without names and stars")
        if isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
            view, *shape = self.ordered([node.func.value, *node.args])
            if isinstance(view.type, View):
                return self.fold(view, shape, node)
        function = self.expression(node.func)
        if not isinstance(function, Constant):
            raise self.error(node, "what is called is known at translation")
        return self.call(function.value, self.ordered(node.args), node)

    def fold(self, view, shape, node) -> Any:
        """Numbers as a table."""
        if view.type.is_strided:
            raise self.error(node, "a column is not folded")
        if len(shape) == 1 and isinstance(shape[0].type, Several):
            shape = [self.part(shape[0], i) for i in range(len(shape[0].type))]
        sizes = [self.number(one, INT, node) for one in shape]
        if any(isinstance(one, Constant) and one.value < 0 for one in sizes):
            raise self.error(node, "a size is not negative: -1 is not worked out here, write the size itself")
        return Fold(View(len(sizes), view.type.element), view, sizes)

    def call(self, known, args, node) -> Any:
        """Return what a call gives."""
        if known is views.matrix:
            return self.fold(args[0], args[1:], node)
        if known is views.fetch:
            self.block.append(Fetch(args[0], self.number(args[1], INT, node)))
            return Constant(NOTHING, None)
        if known in simd.WORDS:
            return self.of_lanes(known, args, node)
        if isinstance(known, type) and hasattr(known, "_fields"):
            if len(args) != len(known._fields):
                raise self.error(node, f"a {known.__name__} has {len(known._fields)} fields")
            return Make(Struct(known, tuple(a.type for a in args)), args)
        if known in BUILTINS and len(args) != 1 and (known not in (builtins.max, builtins.min) or not args):
            raise self.error(node, f"{known.__name__} takes one argument here")
        if known in (builtins.max, builtins.min):
            return self.extreme("max" if known is builtins.max else "min", args, node)
        if known in BUILTINS:
            return self.plain(known, args[0], node)
        if known in MATH and not (known is about_one and widen(args[0].type) == LANES):  # as it stands, of lanes
            return self.mathematics(known, args, node)
        if getattr(known, "__module__", "") == "math":  # of a user's own kernel: nearly the same
            if self.is_own or not hasattr(elementary, known.__name__):
                raise self.error(node, f"math.{known.__name__} has other bits elsewhere: take engine.elementary's")
            known = getattr(elementary, known.__name__)
        if isinstance(known, ModuleType) or not callable(known):
            raise self.error(node, "this is not a function")
        try:
            function = self.program.call(known, [a.type for a in args])
        except Refusal as refusal:
            raise refusal if ", line " in str(refusal) else self.error(node, str(refusal)) from None
        if function.is_rare and any(is_wide(kind) and kind != LANES for _, kind in function.params):
            self.block.append(Differ())  # few samples get here: those are taken one series at a time
            return self.nothing_of(function.result)
        given = [self.convert(args[i], function.params[k][1]) for k, i in enumerate(function.used)]
        call = Call(function.result, function, given)
        if isinstance(function.result, Known):
            if function.has_effects:
                self.block.append(Do(call))
            return Constant(function.result, function.result.value)
        self.count += 1
        name = f"_{self.count}"
        self.variables[name] = function.result
        self.block.append(Let(name, call))
        return Name(function.result, name)

    def nothing_of(self, kind: Type) -> Any:
        """Return something of a type, where what it says does not matter."""
        if isinstance(kind, Several | Struct):
            return Make(kind, [self.nothing_of(item) for item in kind.items])
        if isinstance(kind, View):
            raise Refusal("what lanes leave to the loop of one series gives no views back")
        return Constant(kind, kind.value if isinstance(kind, Known) else 0)

    def extreme(self, op: str, args, node) -> Any:
        """The largest or smallest, the first of equals."""
        if len(args) == 1 and isinstance(args[0].type, Several | Struct):
            args = [self.part(args[0], i) for i in range(len(args[0].type.items))]
        if all(isinstance(a, Constant) for a in args):
            return self.folded(max if op == "max" else min, [a.value for a in args], node)
        if not all(is_number(a.type) for a in args):
            raise self.error(node, f"{op} is for numbers; what holds several is gone through in a loop")
        kind: Any = widen(args[0].type)
        for one in args[1:]:
            kind = unify(kind, widen(one.type))
        value = self.convert(args[0], kind)
        for one in args[1:]:
            value = Operation(kind, op, [value, self.convert(one, kind)])
        return value

    def plain(self, known, value, node) -> Any:
        """``int``, ``float``, ``bool``, ``abs``, ``len``."""
        if isinstance(value, Constant):
            return self.folded(known, [value.value], node)
        kind = value.type
        if known is len:
            if isinstance(kind, View):
                return Extent(INT, value, 0)
            if not isinstance(kind, Struct | Several):
                raise self.error(node, "len is for views and tuples")
            return Constant(Known(len(kind.items)), len(kind.items))
        if not is_number(kind):
            raise self.error(node, f"{known.__name__} is for numbers")
        if known is bool:
            return self.truth(value, node)
        if known is abs:
            return Operation(kind, "abs", [value])
        if kind == LANES:
            return Operation(LANES, "trunc", [value]) if known is int else value
        return self.convert(value, INT if known is int else FLOAT)

    def mathematics(self, known, args, node) -> Any:
        """A function of ``math``."""
        name, result, kinds = MATH[known]
        if len(args) != len(kinds):
            raise self.error(node, f"math.{name} takes {len(kinds)} arguments here")
        if all(isinstance(a, Constant) for a in args) and name in ("sqrt", "isfinite", "isnan", "copysign", "ldexp"):
            return self.folded(known, [a.value for a in args], node)
        if any(widen(a.type) == LANES for a in args):
            if name not in ON_LANES:
                raise self.error(node, f"math.{name} is not for lanes")
            kinds = (LANES,) * len(kinds)
            result = WIDE[result] if is_number(result) else Several((LANES, LANES))
        value = Operation(result, name, [self.convert(a, k) for a, k in zip(args, kinds)])
        return self.keep(value) if isinstance(result, Several) else value

    def of_lanes(self, word, args, node) -> Any:
        """The words of `simd`."""
        name = word.__name__
        if word is simd.interleave:
            return Operation(View(1, LANES), name, args)
        if word is simd.own:
            if not isinstance(args[0], Constant):
                raise self.error(node, "how many lanes it has of its own is known at translation")
            return Operation(View(1, LANES), name, args)
        if word is simd.gather:
            return Operation(LANES, name, [args[0], args[1], self.number(args[2], INT, node)])
        if word in (simd.collect, simd.scatter):
            self.block.append(Move(name, args))
            return Constant(NOTHING, None)
        if word is simd.disagreements:
            return self.keep(Operation(INT, name, []))
        return Operation(BOOL, name, [self.convert(args[0], LANES)])


def are_short(*ways) -> bool:
    """Say whether both ways may be gone, whatever the test: they call nothing that writes, and are a few statements."""
    found = [one for way in ways for one in way]
    return len(found) <= SHORT and not has_effects(found) and all(isinstance(one, Let) for one in found)


def _is_path(value) -> bool:
    """Say whether it is a variable, or a field of one."""
    while isinstance(value, Part):
        value = value.value
    return isinstance(value, Name)
