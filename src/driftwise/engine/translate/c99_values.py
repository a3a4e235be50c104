"""Print the values of kernels as C99: how strongly operations bind, names, numbers and elements of views."""

from __future__ import annotations

import math
from typing import Any

from . import prelude
from .tree import Call, Column, Constant, Cut, Extent, Fold, Load, Look, Make, Name, Operation, Part
from .types import BOOL, FLOAT, INT, LANES, MASK, Several, Struct, Type, View, is_ghost

# how strongly an operation binds
BINDS = {"*": 6, "/": 6, "+": 5, "-": 5, "<": 4, "<=": 4, ">": 4, ">=": 4, "==": 3, "!=": 3, "and": 2, "or": 1}
INFIX = {**{op: op for op in BINDS}, "and": "&&", "or": "||"}
ATOM, PREFIX, CHOICE = 9, 8, 0
SCALARS: dict[Type, tuple[str, str]] = {  # their names, and how those of views of them end
    FLOAT: ("F", ""), INT: ("I", "i"), BOOL: ("B", "b"), LANES: ("L", "l"), MASK: ("M", "m"),
}  # fmt: skip
KEYWORDS = set(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while asm bool "
    "catch class delete explicit export false friend mutable namespace new operator private protected public template "
    "this throw true try typename using virtual and or not xor near far small huge interface F I B U L M "
    "log exp log1p expm1 lgamma erfc sin cos hypot pow sqrt".split()
)
DISAGREE = {"agree", "disagreements"}  # operations that count, or tell how often lanes have disagreed


class ValuePrinter:
    """The text of values: numbers, fields, elements and parts of views, arithmetic, calls."""

    # given by the printer
    prefix: str
    checked: bool
    shifts: bool
    taken: set[str]
    type_texts: list[str]
    tables: dict[Any, str]
    type: Any
    fresh: Any
    field: Any
    need: Any
    called: Any
    may_disagree: Any

    def value(self, value, least: int = 0) -> str:
        """Return an expression; in parentheses if it binds less strongly than ``least``."""
        text, binds = getattr(self, f"print_{type(value).__name__}")(value)
        return f"({text})" if binds < least else text

    def print_Constant(self, value: Constant) -> tuple[str, int]:
        """A number."""
        number = value.value
        if value.type == LANES:
            return f"{self.need('dw_spread')}({self.value(Constant(FLOAT, number))})", ATOM
        if value.type == MASK:
            return f"{self.need('dw_mask')}({int(number)})", ATOM
        if value.type == FLOAT or isinstance(number, float):
            number = float(number)
            if math.isnan(number):
                return f"{self.need('DW_NAN')}", ATOM
            if math.isinf(number):
                return ("" if number > 0 else "-") + self.need("DW_INF"), ATOM if number > 0 else PREFIX
            return repr(number), ATOM if math.copysign(1.0, number) > 0 else PREFIX - 7
        number = int(number)
        text = str(number) if abs(number) < 2**31 else f"{number}LL"
        return text, ATOM if number >= 0 else PREFIX - 7

    def print_Name(self, value: Name) -> tuple[str, int]:
        """A variable."""
        return local(value.name), ATOM

    def print_Part(self, value: Part) -> tuple[str, int]:
        """A field."""
        return f"{self.value(value.value, ATOM)}.{self.field(value.value.type, value.index)}", ATOM

    def print_Make(self, value: Make) -> tuple[str, int]:
        """A struct."""
        kind: Any = value.type
        parts = [self.value(p) for p in value.parts if not is_ghost(p.type)]
        name = self.maker(kind)
        return f"{name}({', '.join(parts)})", ATOM

    def maker(self, kind: Struct | Several) -> str:
        """Return the function that makes a struct: C++ has no compound literals."""
        name = f"{self.prefix}_make_{self.type(kind)}"
        if name not in self.taken:
            self.taken.add(name)
            items = [(self.type(k), self.field(kind, i)) for i, k in enumerate(kind.items) if not is_ghost(k)]
            params = ", ".join(f"{t} {n}" for t, n in items)
            lines = [f"static {self.need('DW_INLINE')} {self.type(kind)} {name}({params})", "{"]
            lines += [f"    {self.type(kind)} made_;", *[f"    made_.{n} = {n};" for _, n in items]]
            self.type_texts.append("\n".join([*lines, "    return made_;", "}"]))
        return name

    def print_Extent(self, value: Extent) -> tuple[str, int]:
        """A size."""
        view = self.value(value.view, ATOM)
        kind: View = value.view.type
        if value.axis >= 0:
            return f"{view}.{'nmk'[value.axis]}", ATOM
        return " * ".join(f"{view}.{'nmk'[axis]}" for axis in range(kind.dims)), ATOM if kind.dims == 1 else 6

    def print_Load(self, value: Load) -> tuple[str, int]:
        """A number of a view."""
        return self.element(value.view, value.indices), ATOM

    def element(self, view, indices) -> str:
        """Return an element, to read or to write."""
        kind: View = view.type
        v = self.value(view, ATOM)
        places = [self.at(i, f"{v}.{'nmk'[axis]}") for axis, i in enumerate(indices)]
        if kind.is_strided:
            return f"{v}.p[{self.factor(places[0])} * {v}.s]"
        text = places[0]
        for axis in range(1, kind.dims):
            text = f"{self.factor(text)} * {v}.{'nmk'[axis]} + {places[axis]}"
        return f"{v}.p[{text}]"

    def factor(self, text: str) -> str:
        """Return a text as a factor."""
        return text if text.replace("_", "").replace(".", "").isalnum() else f"({text})"

    def at(self, index, size: str) -> str:
        """Return an index, looked at where that is wanted."""
        text = self.value(index, 5)
        return f"{self.need('dw_at')}({text}, {size})" if self.checked else text

    def print_Cut(self, value: Cut) -> tuple[str, int]:
        """Part of a view."""
        kind: View = value.view.type
        text, dims = self.value(value.view), kind.dims
        suffix = SCALARS[kind.element][1]
        for index in value.indices:
            text = f"{self.need(f'dw_row{dims}{suffix}')}({text}, {self.value(index)})"
            dims -= 1
        if value.stretch is not None:
            start, stop = value.stretch
            last = self.value(stop) if stop is not None else ""
            ending = "cut" if stop is not None else "tail"
            ending += "" if value.clips else "_"
            name = self.need(f"dw_{ending}{dims}{'s' if kind.is_strided else ''}{suffix}")
            text = f"{name}({text}, {self.value(start)}{', ' * bool(last)}{last})"
        return text, ATOM

    def print_Column(self, value: Column) -> tuple[str, int]:
        """A column."""
        name = self.need(f"dw_column{SCALARS[value.view.type.element][1]}")
        return f"{name}({self.value(value.view)}, {self.value(value.index)})", ATOM

    def print_Fold(self, value: Fold) -> tuple[str, int]:
        """A stretch of numbers as a table."""
        sizes = ", ".join(self.value(size) for size in value.shape)
        kind: View = value.view.type
        name = self.need(f"dw_fold{kind.dims}{len(value.shape)}{SCALARS[kind.element][1]}")
        return f"{name}({self.value(value.view)}, {sizes})", ATOM

    def print_Look(self, value: Look) -> tuple[str, int]:
        """An entry of a table of constants."""
        key = value.type, value.table
        if key not in self.tables:
            self.tables[key] = self.fresh(f"{self.prefix}_table_{len(self.tables)}")
        index = self.at(value.index, str(len(value.table)))
        return f"{self.tables[key]}[{index}]", ATOM

    def print_Call(self, value: Call) -> tuple[str, int]:
        """A call."""
        args = [self.value(a) for a in value.args if not is_ghost(a.type)]
        args += ["odd"] * self.may_disagree(value.function)
        return f"{self.called(value.function)}({', '.join(args)})", ATOM

    def print_Operation(self, value: Operation) -> tuple[str, int]:
        """Arithmetic."""
        op, args, kind = value.op, value.args, value.type
        if kind == MASK and op in ("and", "or", "not"):
            texts = [self.value(a, ATOM) for a in args]
            return f" {'&' if op == 'and' else '|'} ".join(texts) if len(texts) > 1 else f"~{texts[0]}", 2
        if kind == MASK and op in prelude.COMPARISONS:
            return f"{self.need(prelude.COMPARISONS[op])}({self.value(args[0])}, {self.value(args[1])})", ATOM
        if op in INFIX:
            binds = BINDS[op]
            left, right = (binds, binds + 1)
            if op in ("and", "or"):
                left = right = 3
            elif binds in (3, 4):  # compilers warn of `a < b == c`
                left = right = 5
            texts = [self.value(a, left if i == 0 else right) for i, a in enumerate(args)]
            return f" {INFIX[op]} ".join(texts), binds
        if op == "select" and args[0].type != MASK:
            return f"{self.value(args[0], 1)} ? {self.value(args[1], 1)} : {self.value(args[2], 1)}", CHOICE
        if op == "neg":
            return f"-{self.value(args[0], PREFIX + 1)}", PREFIX - 7
        if op == "not":
            return f"!{self.value(args[0], PREFIX + 1)}", PREFIX
        if op in ("float", "int", "bool"):
            if op == "bool":
                return f"{self.value(args[0], 4)} != 0", 3
            return f"({self.type(kind)}){self.value(args[0], PREFIX)}", PREFIX
        if op in ("|", "&", "^", "<<", ">>"):
            return f"({self.value(args[0], ATOM)} {op} {self.value(args[1], ATOM)})", ATOM
        if self.shifts and op in ("//", "%") and kind == INT and is_power_of_two(args[1]):  # of negative numbers, too
            by = args[1].value
            sign, number = (">>", by.bit_length() - 1) if op == "//" else ("&", by - 1)
            return f"({self.value(args[0], ATOM)} {sign} {number})", ATOM
        name = prelude.OPERATIONS[op]
        if isinstance(name, dict):
            name = name.get(args[0].type, name[INT])
        elif args and LANES in (args[0].type, getattr(args[0].type, "element", None)):
            name += "l"
        elif op == "select" and kind == MASK:
            name += "m"
        name = name.format(pair=self.type(kind) if isinstance(kind, Several) else "")
        return f"{self.need(name)}({', '.join([self.value(a) for a in args] + ['odd'] * (op in DISAGREE))})", ATOM


def is_power_of_two(value) -> bool:
    """Whether a value is a number by which a whole one is divided by leaving digits away."""
    return isinstance(value, Constant) and isinstance(value.value, int) and value.value.bit_count() == 1 < value.value


def local(name: str) -> str:
    """Return the name of a variable in C."""
    if name[0] == "_" and name[1:].isdigit():
        return f"t{name[1:]}_"
    return f"{name}_" if name in KEYWORDS else name
