"""Read the calls of a kernel: arithmetic, named tuples, other kernels."""

from __future__ import annotations

import ast
import builtins
import math
from types import ModuleType
from typing import Any

from .. import elementary, simd, views
from ..elementary.pairs import about_one
from .refusal import Refusal
from .tree import Call, Constant, Differ, Do, Extent, Fetch, Fold, Let, Make, Move, Name, Operation
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
    is_number,
    is_wide,
    unify,
    widen,
)

BUILTINS = (builtins.int, builtins.float, builtins.bool, builtins.abs, builtins.len, builtins.max, builtins.min)
MATH: dict[Any, tuple[str, Type, tuple[Type, ...]]] = {
    math.sqrt: ("sqrt", FLOAT, (FLOAT,)), math.isfinite: ("isfinite", BOOL, (FLOAT,)),
    math.isnan: ("isnan", BOOL, (FLOAT,)), math.copysign: ("copysign", FLOAT, (FLOAT, FLOAT)),
    math.ldexp: ("ldexp", FLOAT, (FLOAT, INT)), math.frexp: ("frexp", Several((FLOAT, INT)), (FLOAT,)),
    math.floor: ("floor", INT, (FLOAT,)), about_one: ("about_one", Several((FLOAT, INT)), (FLOAT,)),
}  # fmt: skip
ON_LANES = {"sqrt", "isfinite", "isnan", "copysign", "ldexp", "frexp"}
WIDE: dict[Type, Type] = {FLOAT: LANES, INT: LANES, BOOL: MASK}  # of lanes, whole numbers are floats too


class Calls:
    """Calls: arithmetic, a class, another kernel, the words of `simd` and `views`."""

    # given by the reader and by `Expressions`
    program: Any
    variables: dict[str, Type]
    block: list[Any]
    count: int
    is_own: bool
    error: Any
    expression: Any
    ordered: Any
    keep: Any
    convert: Any
    number: Any
    truth: Any
    part: Any
    folded: Any

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
