"""Formulas differentiated forwards: from expressions to the source of kernels of their values and exact slopes.

Each operation becomes a line of its own, and behind it a line for each variable that its value depends on: the chain
rule, step by step (Wengert 1964). What is zero or one is left out. Piecewise functions (``abs``, ``sign``, ``min``,
``max``, tables, ``a if c else b``) have the slope of the piece that they are on.
"""

from __future__ import annotations

import ast
import math
import sys
import warnings
from collections.abc import Callable
from typing import NamedTuple, NoReturn

from ..engine import bounds
from ..engine.errors import InputError

FUNCTIONS = ("sqrt", "exp", "log", "sin", "cos", "tanh", "abs", "sign", "min", "max")
CONSTANTS = {"pi": math.pi}
COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}


def parsed(text: str, where: str) -> ast.expr:
    """Return a formula as a tree."""
    most = bounds.FORMULA
    if len(text) > most["characters"]:
        raise InputError(f"{where}: a formula has at most {most['characters']} characters, got {len(text)}")
    try:
        with warnings.catch_warnings(action="ignore"):  # of Python, at numbers and names run together
            tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError) as error:
        raise InputError(f"{where}: this is no formula ({getattr(error, 'msg', error)})") from None
    except (RecursionError, MemoryError):
        tree = None
    if tree is None or _is_deep(tree, most["depth"]):
        raise InputError(f"{where}: a formula nests at most {most['depth']} deep; write it in several lines")
    return tree


def _is_deep(tree: ast.expr, most: int) -> bool:
    """Say whether expressions stand in one another more often than that; counted without recursion."""
    level: list[ast.AST] = [tree]
    for _ in range(most):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
    return bool(level)


class Value(NamedTuple):
    """A value in the source: its text, its slopes by variable as texts, and the variables that it depends on.

    ``bent`` are the variables in which it is not linear, or may not be.
    """

    text: str
    slopes: dict[str, str]
    uses: frozenset[str] = frozenset()
    bent: frozenset[str] = frozenset()

    @property
    def number(self) -> float | None:
        """The number that it is, if it is one."""
        try:
            return float(self.text)
        except ValueError:
            return None


class Tape:
    """The lines of one function, as they are written."""

    def __init__(self, known: dict[str, Value], tables: dict[str, tuple[int, int]], where: str = ""):
        self.known, self.tables, self.where = known, tables, where
        self.lines: list[str] = []
        self.count = 0

    def refuse(self, message: str) -> NoReturn:
        """Say what is wrong with the line."""
        raise InputError(f"{self.where}: {message}")

    # --- lines ---------------------------------------------------------------------------------------------

    def keep(self, text: str) -> str:
        """Give a text a name; numbers and names have one."""
        if text.replace("_", "").isalnum() or _is_number(text):
            return text
        self.count += 1
        if self.count > bounds.FORMULA["operations"]:
            self.refuse(f"the plant comes to more than {bounds.FORMULA['operations']} operations; is it one plant?")
        self.lines.append(f"t{self.count} = {text}")
        return f"t{self.count}"

    def made(self, text: str, slopes: dict[str, str], *parts: Value, bent: frozenset[str] = frozenset()) -> Value:
        """Return a value with its lines written."""
        text = self.keep(text)
        slopes = {z: self.keep(s) for z, s in slopes.items() if s != "0.0"}
        uses = frozenset().union(*(p.uses for p in parts))
        return Value(text, slopes, uses, bent.union(*(p.bent for p in parts)))

    # --- expressions ---------------------------------------------------------------------------------------

    def value(self, node) -> Value:
        """Return the value of an expression."""
        read: Callable[[ast.expr], Value] | None = getattr(self, f"of_{type(node).__name__}", None)
        if read is None:
            self.refuse(f"a formula has no {type(node).__name__}: numbers, names, + - * / **, comparisons and calls do")
        return read(node)

    def of_Constant(self, node) -> Value:
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            self.refuse(f"{node.value!r} is no number")
        if not abs(node.value) <= sys.float_info.max:
            self.refuse("a number is beyond every number")
        return Value(repr(float(node.value)), {})

    def of_Name(self, node) -> Value:
        if node.id in CONSTANTS:
            return Value(repr(CONSTANTS[node.id]), {})
        if node.id not in self.known:
            self.refuse(f"unknown name {node.id!r}: known here are {', '.join(self.known)}")
        return self.known[node.id]

    def of_UnaryOp(self, node) -> Value:
        a = self.value(node.operand)
        if isinstance(node.op, ast.UAdd):
            return a
        if not isinstance(node.op, ast.USub):
            self.refuse(f"{ast.unparse(node)}: only + and - stand before a value")
        return self.made(_negative(a.text), {z: _negative(s) for z, s in a.slopes.items()}, a)

    def of_BinOp(self, node) -> Value:
        if isinstance(node.op, ast.BitXor):
            self.refuse(f"{ast.unparse(node)}: ^ is no power here; write **")
        if isinstance(node.op, ast.Pow):
            return self.power(node)
        a, b = self.value(node.left), self.value(node.right)
        names = list(dict.fromkeys([*a.slopes, *b.slopes]))
        if isinstance(node.op, ast.Add):
            slopes = {z: _sum(a.slopes.get(z, "0.0"), b.slopes.get(z, "0.0")) for z in names}
            return self.made(_sum(a.text, b.text), slopes, a, b)
        if isinstance(node.op, ast.Sub):
            slopes = {z: _difference(a.slopes.get(z, "0.0"), b.slopes.get(z, "0.0")) for z in names}
            return self.made(_difference(a.text, b.text), slopes, a, b)
        if isinstance(node.op, ast.Mult):
            slopes = {
                z: _sum(
                    self.keep(_product(a.slopes.get(z, "0.0"), b.text)),
                    self.keep(_product(a.text, b.slopes.get(z, "0.0"))),
                )
                for z in names
            }
            bent = (a.uses | b.uses) if a.uses & b.uses else frozenset()
            return self.made(_product(a.text, b.text), slopes, a, b, bent=bent)
        if isinstance(node.op, ast.Div):
            return self.quotient(node, a, b, names)
        self.refuse(f"{ast.unparse(node)}: the operations are + - * / **")

    def quotient(self, node, a: Value, b: Value, names) -> Value:
        """Return a/b; its slope is (a' - (a/b) b')/b."""
        if b.number == 0.0:
            self.refuse(f"{ast.unparse(node)} divides by zero")
        whole = self.keep(f"divided({a.text}, {b.text})" if b.number is None else f"{a.text} / {b.text}")
        slopes = {}
        for z in names:
            above = _difference(a.slopes.get(z, "0.0"), self.keep(_product(whole, b.slopes.get(z, "0.0"))))
            slopes[z] = (
                f"divided({self.keep(above)}, {b.text})" if b.number is None else f"{self.keep(above)} / {b.text}"
            )
        return self.made(whole, slopes, a, b, bent=b.uses)

    def power(self, node) -> Value:
        """Return a**b, b a number: whole ones by multiplication, others by exp and log, of positive a."""
        a, b = self.value(node.left), self.value(node.right)
        if b.number is None:
            return self.call("exp", [self.times(b, self.call("log", [a], node))], node)
        n = b.number
        if n == int(n) and abs(n) <= 16:
            whole, below = self.whole_power(a.text, abs(int(n))), self.whole_power(a.text, max(abs(int(n)) - 1, 0))
            found = self.made(
                whole, {z: _product(self.keep(_product(repr(abs(n)), below)), s) for z, s in a.slopes.items() if n}, a,
                bent=a.uses if abs(n) > 1 else frozenset(),
            )  # fmt: skip
            return found if n >= 0 else self.quotient(node, Value("1.0", {}), found, list(found.slopes))
        if n == 0.5:
            return self.call("sqrt", [a], node)
        slope = self.keep(f"{n!r} * pow({a.text}, {n - 1.0!r})")
        return self.made(f"pow({a.text}, {n!r})", {z: _product(slope, s) for z, s in a.slopes.items()}, a, bent=a.uses)

    def whole_power(self, text: str, n: int) -> str:
        """Return text to the n, in a row of products."""
        found = "1.0"
        for _ in range(n):
            found = self.keep(_product(found, text))
        return found

    def times(self, a: Value, b: Value) -> Value:
        """Return the product of two values."""
        names = dict.fromkeys([*a.slopes, *b.slopes])
        slopes = {
            z: _sum(
                self.keep(_product(a.slopes.get(z, "0.0"), b.text)), self.keep(_product(a.text, b.slopes.get(z, "0.0")))
            )
            for z in names
        }
        return self.made(_product(a.text, b.text), slopes, a, b, bent=a.uses | b.uses)

    def of_IfExp(self, node) -> Value:
        test, parts = self.condition(node.test)
        a, b = self.value(node.body), self.value(node.orelse)
        names = dict.fromkeys([*a.slopes, *b.slopes])
        slopes = {
            z: f"{self.keep(a.slopes.get(z, '0.0'))} if {test} else {self.keep(b.slopes.get(z, '0.0'))}" for z in names
        }
        bent = frozenset().union(*(p.uses for p in parts), a.bent, b.bent)
        return self.made(f"{a.text} if {test} else {b.text}", slopes, a, b, *parts, bent=bent)

    def condition(self, node) -> tuple[str, list[Value]]:
        """Return a comparison as text, and what is compared."""
        if not isinstance(node, ast.Compare) or len(node.ops) != 1 or type(node.ops[0]) not in COMPARE:
            self.refuse(f"{ast.unparse(node)}: a condition is one comparison, by < <= > or >=")
        a, b = self.value(node.left), self.value(node.comparators[0])
        return f"{a.text} {COMPARE[type(node.ops[0])]} {b.text}", [a, b]

    def of_Call(self, node) -> Value:
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        name = name.removeprefix("math.").removeprefix("np.").removeprefix("numpy.")
        if name not in FUNCTIONS and name not in self.tables:
            tables = f", and its tables {', '.join(self.tables)}" if self.tables else ""
            self.refuse(f"unknown function {name!r}: formulas have {', '.join(FUNCTIONS)}{tables}")
        if node.keywords:
            self.refuse(f"{ast.unparse(node)}: arguments have no names here")
        wanted = 2 if name in ("min", "max") else 1
        if len(node.args) != wanted:
            self.refuse(
                f"{ast.unparse(node)}: {name} takes {wanted} argument{'s' * (wanted > 1)}, got {len(node.args)}"
            )
        return self.call(name, [self.value(a) for a in node.args], node)

    def call(self, name: str, args: list[Value], node) -> Value:
        """Return the value of a function: its own slope times that of its argument."""
        a = args[0]
        if name in ("min", "max"):
            return self.extreme(name, *args)
        if name in self.tables:
            first, count = self.tables[name]
            place = f"plant.points, {first}, {count}, {a.text}"
            whole, slope = f"table_value({place})", f"table_slope({place})"
        else:
            whole, slope = _RULES[name](a.text)
        whole = self.keep(whole)
        slope = self.keep(slope.replace("_whole_", whole)) if a.slopes else "0.0"
        return self.made(whole, {z: _product(slope, s) for z, s in a.slopes.items()}, a, bent=a.uses)

    def extreme(self, name: str, a: Value, b: Value) -> Value:
        """Return the larger or smaller of two."""
        test = f"{a.text} {'>' if name == 'max' else '<'} {b.text}"
        names = dict.fromkeys([*a.slopes, *b.slopes])
        slopes = {z: f"{a.slopes.get(z, '0.0')} if {test} else {b.slopes.get(z, '0.0')}" for z in names}
        return self.made(f"{a.text} if {test} else {b.text}", slopes, a, b, bent=a.uses | b.uses)


_RULES: dict[str, Callable[[str], tuple[str, str]]] = {
    "sqrt": lambda a: (f"root({a})", "divided(0.5, _whole_)"),
    "exp": lambda a: (f"exp({a})", "_whole_"),
    "log": lambda a: (f"log({a})", f"divided(1.0, {a})"),
    "sin": lambda a: (f"sin({a})", f"cos({a})"),
    "cos": lambda a: (f"cos({a})", f"-sin({a})"),
    "tanh": lambda a: (f"hyperbolic_tangent({a})", "1.0 - _whole_ * _whole_"),
    "abs": lambda a: (f"abs({a})", f"signum({a})"),
    "sign": lambda a: (f"signum({a})", "0.0"),
}


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _negative(a: str) -> str:
    return repr(-float(a)) if _is_number(a) else f"-{a}"


def _sum(a: str, b: str) -> str:
    if a in ("0.0", "-0.0"):
        return b
    return a if b in ("0.0", "-0.0") else f"{a} + {b}"


def _difference(a: str, b: str) -> str:
    if b in ("0.0", "-0.0"):
        return a
    return _negative(b) if a in ("0.0", "-0.0") else f"{a} - {b}"


def _product(a: str, b: str) -> str:
    if "0.0" in (a, b) or "-0.0" in (a, b):
        return "0.0"
    if a == "1.0":
        return b
    return a if b == "1.0" else f"{a} * {b}"
