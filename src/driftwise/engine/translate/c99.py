"""Print kernels as C99 that needs no header and no library."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from . import prelude
from .bodies import reachable
from .c99_values import ATOM, DISAGREE, SCALARS, ValuePrinter, local
from .places import Places
from .tree import (
    Call,
    Constant,
    Differ,
    Do,
    Fetch,
    For,
    Function,
    If,
    Leave,
    Let,
    Load,
    Loop,
    Move,
    Name,
    Operation,
    Return,
    Store,
    children,
    statements,
    walk,
)
from .types import FLOAT, LANES, MASK, Several, Struct, Type, View, is_ghost, is_wide

APART = "_apart"  # how the name of a function ends that is not inlined


class Printer(ValuePrinter):
    """The text of a program; ``checked`` looks at every index, and ends the process at one that is out of bounds."""

    shifts = True  # whole numbers that have a sign, to halve them

    def __init__(self, prefix: str = "k", checked: bool = False):
        self.prefix, self.checked = prefix, checked
        self.needs: dict[str, None] = {}
        self.types: dict[Type, str] = {}
        self.type_texts: list[str] = []
        self.tables: dict[Any, str] = {}
        self.taken: set[str] = set()
        self.disagree: dict[str, bool] = {}
        self.outermost: Function | None = None

    # --- types ---------------------------------------------------------------------------------------------

    def type(self, kind: Type) -> str:
        """Return the name of a type in C."""
        if kind in SCALARS:
            return SCALARS[kind][0] if kind not in (LANES, MASK) else self.need(SCALARS[kind][0])
        if kind not in self.types:
            if isinstance(kind, View):
                self.types[kind] = self.view_type(kind)
            elif isinstance(kind, Struct | Several):
                self.types[kind] = self.struct_type(kind)
        return self.types[kind]

    def view_type(self, kind: View) -> str:
        """Return the name of a view: a pointer, and its sizes."""
        name = ("S" if kind.is_strided else "V") + str(kind.dims) + SCALARS[kind.element][1]
        self.need(name)
        return name

    def struct_type(self, kind: Struct | Several) -> str:
        """Return the name of a named tuple or tuple, and write it down."""
        title = kind.instance_class.__name__.lstrip("_") if isinstance(kind, Struct) else f"Tuple{len(kind)}"
        name = self.fresh(title if len(title) > 2 else f"{title}_type")
        lines = [
            f"    {self.type(item)} {self.field(kind, i)};" for i, item in enumerate(kind.items) if not is_ghost(item)
        ]
        self.type_texts.append("\n".join(["typedef struct {", *lines, f"}} {name};"]))
        return name

    def fresh(self, title: str) -> str:
        """Return a name of the file that nothing else has."""
        name, count = title, 1
        while name in self.taken:
            count += 1
            name = f"{title}_{count}"
        self.taken.add(name)
        return name

    def field(self, kind: Struct | Several, index: int) -> str:
        """Return the name of a field."""
        return local(kind.names[index]) if isinstance(kind, Struct) else f"i{index}"

    def need(self, *names: str) -> str:
        """Note that some help of the prelude is used; return its name."""
        for name in names:
            for other in prelude.NEEDS.get(name, ()):
                self.need(other)
            self.needs[name] = None
        return names[-1]

    # --- functions -----------------------------------------------------------------------------------------

    def function(self, function: Function, named: str = "") -> str:
        """Return the text of a function."""
        self.current = function
        self.unrolls = function is not self.outermost and any(map(is_wide, function.variables.values()))
        self.places = Places(function)
        lines = [f"/* {comment(function.title)} */"] if function.title else []
        is_handed = function.is_rare and any(isinstance(kind, Struct) for _, kind in function.params)
        how = "static DW_APART" if function.is_rare else "static DW_INLINE"
        self.need("DW_APART" if function.is_rare else "DW_INLINE")
        lines.append(f"{how} {self.signature(function, APART if is_handed else '')}")
        lines.append("{")
        for name in self.places.top:
            kind = function.variables[name]
            if not is_ghost(kind):
                lines.append(f"    {self.type(kind)} {local(name)} = {self.zero(kind)};")
        lines += self.body(function.body, "    ")
        lines.append("}")
        return "\n".join([*lines, *(self.handed(function) if is_handed else ())])

    def handed(self, function: Function) -> list[str]:
        """Return a function that hands copies to one that stays apart.

        A structure that is itself an argument of such a function is kept in memory by gcc, not in registers, and
        written there at every sample.
        """
        self.need("DW_INLINE")
        words = [local(name) for name, kind in function.params if not is_ghost(kind)]
        words += ["odd"] * self.may_disagree(function)
        call = f"{self.called(function)}{APART}({', '.join(words)});"
        result = "" if is_ghost(function.result) else "return "
        return ["", f"static DW_INLINE {self.signature(function)}", "{", f"    {result}{call}", "}"]

    def signature(self, function: Function, ending: str = "") -> str:
        """Return what stands before the body."""
        result = "void" if is_ghost(function.result) else self.type(function.result)
        params = [f"{self.type(kind)} {local(name)}" for name, kind in function.params if not is_ghost(kind)]
        params += ["I *odd"] * self.may_disagree(function)
        return f"{result} {self.called(function)}{ending}({', '.join(params) or 'void'})"

    def called(self, function: Function) -> str:
        """Return the name of a function."""
        return f"{self.prefix}_{function.name}"

    def may_disagree(self, function: Function) -> bool:
        """Say whether a function, or one it calls, asks lanes to agree: it gets the address of the count."""
        if function.name not in self.disagree:
            body = statements(function.body)
            own = (e for s in body for c in children(s) for e in walk(c))
            is_asked = any(isinstance(e, Operation) and e.op in DISAGREE for e in own)
            is_asked = is_asked or any(isinstance(s, Differ) for s in body)
            self.disagree[function.name] = is_asked or any(map(self.may_disagree, function.calls))
        return self.disagree[function.name]

    def zero(self, kind: Type) -> str:
        """Return what a variable holds before it has a value."""
        if isinstance(kind, View | Struct | Several):
            return "{" + self.zero_of_first(kind) + "}"
        return "{0}" if kind in (LANES, MASK) else "0.0" if kind == FLOAT else "0"

    def zero_of_first(self, kind: Any) -> str:
        """Return the zero that a struct begins with."""
        if isinstance(kind, View):
            return "0, " + ", ".join(["0"] * (kind.dims + kind.is_strided))
        return ", ".join(self.zero(item) for item in kind.items if not is_ghost(item))

    # --- statements ----------------------------------------------------------------------------------------

    def body(self, body: list[Any], indent: str) -> list[str]:
        """Return the lines of a block."""
        lines: list[str] = []
        for one in body:
            lines += [indent + line for line in getattr(self, f"write_{type(one).__name__}")(one)]
        return lines

    def write_Let(self, one: Let) -> Iterator[str]:
        """A variable gets a value."""
        kind = self.current.variables.get(one.name)
        if kind is None or is_ghost(kind):
            if isinstance(one.value, Call):
                yield f"{self.value(one.value)};"
            return
        name = local(one.name)
        if isinstance(one.value, Name) and one.value.name == one.name:
            return
        if id(one) in self.places.here:
            yield f"{self.type(kind)} {name} = {self.value(one.value)};"
        else:
            value = one.value
            if isinstance(value, Operation) and len(value.args) == 2 and value.op in "+-*/":
                first = value.args[0]
                if isinstance(first, Name) and first.name == one.name:
                    yield f"{name} {value.op}= {self.value(value.args[1])};"
                    return
            yield f"{name} = {self.value(value)};"

    def write_Store(self, one: Store) -> Iterator[str]:
        """A number is written."""
        target = self.element(one.view, one.indices)
        value = one.value
        if isinstance(value, Operation) and len(value.args) == 2 and value.op in "+-*/":
            first = value.args[0]
            if isinstance(first, Load) and self.element(first.view, first.indices) == target:
                yield f"{target} {value.op}= {self.value(value.args[1])};"
                return
        yield f"{target} = {self.value(value)};"

    def write_Do(self, one: Do) -> Iterator[str]:
        """A call."""
        yield f"{self.value(one.call)};"

    def write_Fetch(self, one: Fetch) -> Iterator[str]:
        """A hint."""
        view = self.value(one.view, ATOM)
        yield f"{self.need('dw_fetch')}({view}.p + {self.value(one.index, 6)} * {view}.m);"

    def write_Move(self, one: Move) -> Iterator[str]:
        """Lanes, and rows of a table."""
        yield f"{self.need(f'dw_{one.word}')}({', '.join(map(self.value, one.args))});"

    def write_Differ(self, one: Differ) -> Iterator[str]:
        """A way that lanes leave to the loop of one series."""
        yield "*odd += 1;"

    def write_For(self, one: For) -> Iterator[str]:
        """A count."""
        name, start = local(one.name), self.value(one.start)
        stop = self.value(one.stop, 5)
        if id(one) in self.places.kept_stop:
            held = self.places.kept_stop[id(one)]
            yield f"const I {held} = {self.value(one.stop)};"
            stop = held
        counter = name
        if id(one) in self.places.apart:
            counter = self.places.apart[id(one)]
        sign, turn = ("<", "++") if one.step == 1 else (">", "--") if one.step == -1 else ("", "")
        if not sign:
            sign, turn = (">", f" -= {-one.step}") if one.step < 0 else ("<", f" += {one.step}")
        if self.unrolls:
            yield self.need("DW_UNROLL")
        elif one.is_abreast:
            yield self.need("DW_ABREAST")
        yield f"for (I {counter} = {start}; {counter} {sign} {stop}; {counter}{turn}) {{"
        if counter != name:
            yield f"    {name} = {counter};"
        yield from self.body(one.body, "    ")
        yield "}"

    def write_Loop(self, one: Loop) -> Iterator[str]:
        """For ever."""
        yield "for (;;) {"
        yield from self.body(one.body, "    ")
        yield "}"

    def write_If(self, one: If) -> Iterator[str]:
        """One of two ways."""
        yield f"if ({self.value(one.test)}) {{"
        yield from self.body(one.then, "    ")
        other = one.other
        while len(other) == 1 and isinstance(other[0], If):
            yield f"}} else if ({self.value(other[0].test)}) {{"
            yield from self.body(other[0].then, "    ")
            other = other[0].other
        if other:
            yield "} else {"
            yield from self.body(other, "    ")
        yield "}"

    def write_Return(self, one: Return) -> Iterator[str]:
        """The end."""
        if one.value is None or is_ghost(self.current.result):
            yield "return;"
        else:
            yield f"return {self.value(one.value)};"

    def write_Leave(self, one: Leave) -> Iterator[str]:
        """``break``, ``continue``."""
        yield f"{one.word};"

    # --- the whole -----------------------------------------------------------------------------------------

    def program(self, entry: Function, exported: str, shapes: tuple[Any, ...]) -> str:
        """Return the file: everything that ``entry`` needs, and the function that a host calls."""
        self.outermost = entry
        texts = [self.function(function) for function in reachable(entry)]
        last = self.entry(entry, exported, shapes)
        return "\n\n".join([*self.head(), *texts, last]) + "\n"

    def head(self) -> Iterator[str]:
        """Yield what stands before the functions."""
        yield prelude.HEAD
        before = [name for name in prelude.TEXTS if name in self.needs and name not in prelude.AFTER_TYPES]
        texts = {**prelude.TEXTS, **prelude.CHECKED} if self.checked else prelude.TEXTS
        yield from (texts[name] for name in before)
        yield from self.type_texts
        for name, pair in prelude.AFTER_TYPES.items():
            if name in self.needs:
                yield prelude.TEXTS[name].replace("PAIR", self.types[pair])
        for (kind, table), name in self.tables.items():
            numbers = ", ".join(self.print_Constant(Constant(kind, number))[0] for number in table)
            yield f"static const {self.type(kind)} {name}[{len(table)}] = {{{numbers}}};"

    def entry(self, entry: Function, exported: str, shapes: tuple[Any, ...]) -> str:
        """Return the function that a host calls: arrays by their addresses, sizes and integers in one row."""
        lines = [f"{self.need('DW_EXPORT')} I {exported}(void *const *arrays_, const I *sizes_)", "{"]
        at, given = 0, {}
        for i, shape in enumerate(shapes):
            if i in entry.used:
                name, kind = entry.params[entry.used.index(i)]
                if isinstance(kind, View):
                    sizes = "".join(f", sizes_[{at + axis}]" for axis in range(kind.dims))
                    lines.append(
                        f"    {self.type(kind)} {local(name)} = {{({self.type(kind.element)} *)arrays_[{i}]{sizes}}};"
                    )
                elif kind == FLOAT:
                    lines.append(f"    F {local(name)} = *(F *)arrays_[{i}];")
                else:
                    lines.append(f"    I {local(name)} = sizes_[{at}];")
                given[i] = local(name)
            at += {"index": 1, int: 1, float: 0}.get(shape, shape)
        words = [given[i] for i in entry.used]
        if self.may_disagree(entry):
            lines.append("    I odd = 0;")
            words.append("&odd")
        call = f"{self.called(entry)}({', '.join(words)})"
        if is_ghost(entry.result):
            known = getattr(entry.result, "value", None)  # a number that it returns whatever happens
            lines += [f"    {call};", f"    return {int(known) if isinstance(known, int | float) else 0};"]
        else:
            lines.append(f"    return {call};")
        lines[2:2] = [f"    (void){name};" for name in ("arrays_", "sizes_") if f"{name}[" not in "".join(lines)]
        return "\n".join([*lines, "}"])


def comment(text: str) -> str:
    """Return a text as it may stand in a comment."""
    return text.replace("*/", "* /").encode("ascii", "replace").decode()
