"""Structured Text (IEC 61131-3), the part that driftwise writes, run by Python: strict about types, indices and words.

It shares nothing with what writes the text. LREAL is a double; integers divide towards zero; AND and OR evaluate both
sides; the bounds of FOR are evaluated once, and its variable is lost behind it; identifiers have no case; what is
neither RETAIN nor initialised holds rubbish at every call.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from st_values import FORBIDDEN, FUNCTIONS, KEYWORDS, RUBBISH, TOKEN, ZERO, Items, Unit, quotient, rest, whole


class Parser:
    """The text of a file, as units."""

    def __init__(self, text: str):
        self.tokens: list[tuple[str, str]] = []
        at = 0
        while at < len(text):
            found = TOKEN.match(text, at)
            assert found, f"not understood: {text[at : at + 40]!r}"
            at = found.end()
            if found.lastgroup:
                self.tokens.append((found.lastgroup, found[0]))
        self.at, self.units = 0, {}
        while self.at < len(self.tokens):
            self.unit_text()

    # --- tokens --------------------------------------------------------------------------------------------

    @property
    def next(self) -> str:
        return self.tokens[self.at][1].upper() if self.at < len(self.tokens) else ""

    def take(self, *wanted: str) -> str:
        text = self.tokens[self.at][1]
        assert not wanted or text.upper() in wanted, (
            f"{text!r} where {wanted} is due: {self.tokens[self.at - 8 : self.at]}"
        )
        self.at += 1
        return text

    def identifier(self) -> str:
        kind, text = self.tokens[self.at]
        lower = text.lower()
        assert kind == "word" and lower not in KEYWORDS | FORBIDDEN, f"{text!r} is no identifier"
        assert "__" not in text and text[-1] != "_", text
        self.at += 1
        return text

    # --- declarations --------------------------------------------------------------------------------------

    def unit_text(self) -> None:
        head = self.take("FUNCTION", "FUNCTION_BLOCK").upper()
        name = self.identifier()
        result = None
        if head == "FUNCTION":
            self.take(":")
            result = self.take("LREAL", "DINT", "BOOL")
        self.unit = Unit(name, result)
        if result:
            self.declare(name, (result, 0, ZERO[result], "RESULT"))
        while self.next in ("VAR", "VAR_INPUT", "VAR_OUTPUT"):
            section = self.take().upper()
            if self.next == "RETAIN":
                section = self.take().upper()
            while self.next != "END_VAR":
                self.declaration(section)
            self.take()
        lines = self.statements("    ")
        self.take(f"END_{head}")
        scalars = [v.lower() for v, (_, size, _, _) in self.unit.variables.items() if size == 0]
        load = [f"    {v.lower()}_ = s['{v.lower()}']" for v in self.unit.variables]
        save = [f"        s['{v}'] = {v}_" for v in scalars]
        text = "\n".join(["def run(s):", *load, "    try:", *("    " + line for line in lines), "        pass",
                          "    except StopIteration:", "        pass", "    finally:", *save])  # fmt: skip
        scope = {
            "quotient": quotient,
            "whole": whole,
            "rest": rest,
            "call": self.call,
            "nan": math.nan,
            "inf": math.inf,
        }
        scope |= {k.lower(): f for k, (_, _, f) in FUNCTIONS.items()}
        exec(compile(text, name, "exec"), scope)
        self.unit.python = scope["run"]
        self.units[name.lower()] = self.unit

    def declare(self, name: str, what) -> None:
        assert name.lower() not in self.unit.spelt, f"{name} twice"
        self.unit.spelt[name.lower()] = name
        self.unit.variables[name] = what

    def declaration(self, section: str) -> None:
        names = [self.identifier()]
        while self.next == ",":
            self.take()
            names.append(self.identifier())
        self.take(":")
        size = 0
        if self.next == "ARRAY":
            for word in ("ARRAY", "[", "0", ".."):
                self.take(word)
            size = int(self.take()) + 1
            self.take("]"), self.take("OF")
        kind, initial = self.take().upper(), None
        if kind.lower() in self.units:  # an instance of a block
            self.take(";")
            for name in names:
                self.declare(name, (kind, 0, Instance(self.units[kind.lower()]), "INSTANCE"))
            return
        assert kind in ZERO, kind
        if self.next == ":=":
            self.take()
            initial = self.values(kind) if size else self.constant(kind)
            assert not size or len(initial) == size
        self.take(";")
        for name in names:
            self.declare(name, (kind, size, initial, section))

    def values(self, kind: str) -> list[Any]:
        self.take("[")
        found = [self.constant(kind)]
        while self.next == ",":
            self.take()
            found.append(self.constant(kind))
        self.take("]")
        return found

    def constant(self, kind: str) -> Any:
        text, found = self.expression()
        assert found == kind
        return eval(text, {"nan": math.nan, "inf": math.inf})

    # --- statements ----------------------------------------------------------------------------------------

    def statements(self, indent: str) -> list[str]:
        lines: list[str] = []
        while self.next not in (
            "END_IF",
            "ELSE",
            "ELSIF",
            "END_FOR",
            "END_WHILE",
            "END_FUNCTION",
            "END_FUNCTION_BLOCK",
        ):
            lines += [indent + line for line in self.statement()]
        return lines or [indent + "pass"]

    def statement(self) -> list[str]:
        word = self.next
        if word == "IF":
            return self.choice()
        if word == "FOR":
            return self.count()
        if word == "WHILE":
            self.take()
            test = self.typed("BOOL")
            self.take("DO")
            body = self.statements("    ")
            self.take("END_WHILE"), self.take(";")
            return [f"while {test}:", *body]
        if word in ("EXIT", "RETURN"):
            self.take(), self.take(";")
            return ["break" if word == "EXIT" else "raise StopIteration"]
        target, kind = self.variable()
        if self.next == "(":
            given = self.arguments(self.units[kind.lower()])
            self.take(";")
            return [f"{target}({', '.join(given)})"]
        self.take(":=")
        value = self.typed(kind)
        self.take(";")
        return [f"{target} = {value}"]

    def choice(self) -> list[str]:
        lines, word = [], "if"
        while True:
            self.take("IF", "ELSIF")
            test = self.typed("BOOL")
            self.take("THEN")
            lines += [f"{word} {test}:", *self.statements("    ")]
            word = "elif"
            if self.next != "ELSIF":
                break
        if self.next == "ELSE":
            self.take()
            lines += ["else:", *self.statements("    ")]
        self.take("END_IF"), self.take(";")
        return lines

    def count(self) -> list[str]:
        self.take("FOR")
        name, kind = self.variable()
        assert kind == "DINT"
        self.take(":=")
        first = self.typed("DINT")
        self.take("TO")
        last, step = self.typed("DINT"), "1"
        if self.next == "BY":
            self.take()
            step = self.typed("DINT")
        self.take("DO")
        body = self.statements("    ")
        self.take("END_FOR"), self.take(";")
        ahead = f"range({first}, ({last}) + (1 if ({step}) > 0 else -1), {step})"
        return [f"for {name} in {ahead}:", *body, f"{name} = {RUBBISH['DINT']}"]

    # --- expressions: Python's text, and a type --------------------------------------------------------------

    def typed(self, kind: str) -> str:
        text, found = self.expression()
        assert found == kind, f"{text} is {found}, not {kind}"
        return text

    def variable(self) -> tuple[str, str]:
        name = self.identifier()
        lower = name.lower()
        assert lower in self.unit.spelt, f"{name} is not declared"
        assert self.unit.spelt[lower] == name, f"{name} is declared as {self.unit.spelt[lower]}"
        kind, size, _, _ = self.unit.variables[name]
        if kind.lower() in self.units and self.next == ".":
            self.take()
            field = self.identifier()
            shown, size, _, section = self.units[kind.lower()].variables[field]
            assert section == "VAR_OUTPUT", f"{field} is no output"
            lower, kind = f"{lower}_['{field.lower()}']", shown
        else:
            lower += "_"
        if not size:
            return lower, kind
        self.take("[")
        index = self.typed("DINT")
        self.take("]")
        return f"{lower}[{index}]", kind

    def binary(self, inner, signs: dict[str, str]) -> tuple[str, str]:
        text, kind = inner()
        while self.next in signs:
            sign = self.take().upper()
            other, found = inner()
            assert kind == found, f"{text} {sign} {other}: {kind} and {found}"
            text, kind = self.joined(sign, signs[sign], text, other, kind)
        return text, kind

    def joined(self, sign: str, python: str, a: str, b: str, kind: str) -> tuple[str, str]:
        if sign in ("AND", "OR"):
            assert kind in ("BOOL", "DWORD")
        elif sign in ("=", "<>", "<", ">", "<=", ">="):
            assert kind in ("LREAL", "DINT")
            return f"({a} {python} {b})", "BOOL"
        else:
            assert kind in (("DINT",) if sign == "MOD" else ("LREAL", "DINT"))
        if sign in ("/", "MOD"):
            python = "rest" if sign == "MOD" else "quotient" if kind == "LREAL" else "whole"
            return f"{python}({a}, {b})", kind
        return f"({a} {python} {b})", kind

    def expression(self) -> tuple[str, str]:
        return self.binary(self.conjunction, {"OR": "|"})

    def conjunction(self) -> tuple[str, str]:
        return self.binary(self.equality, {"AND": "&"})

    def equality(self) -> tuple[str, str]:
        return self.binary(self.order, {"=": "==", "<>": "!="})

    def order(self) -> tuple[str, str]:
        return self.binary(self.sum, {"<": "<", ">": ">", "<=": "<=", ">=": ">="})

    def sum(self) -> tuple[str, str]:
        return self.binary(self.product, {"+": "+", "-": "-"})

    def product(self) -> tuple[str, str]:
        return self.binary(self.signed, {"*": "*", "/": "/", "MOD": "MOD"})

    def signed(self) -> tuple[str, str]:
        if self.next == "-":
            self.take()
            text, kind = self.primary()
            assert kind in ("LREAL", "DINT")
            return f"(-{text})", kind
        if self.next == "NOT":
            self.take()
            text, kind = self.primary()
            assert kind == "BOOL"
            return f"(not {text})", kind
        return self.primary()

    def primary(self) -> tuple[str, str]:
        kind, text = self.tokens[self.at]
        if text == "(":
            self.take()
            inner = self.expression()
            self.take(")")
            return f"({inner[0]})", inner[1]
        if kind == "number":
            self.take()
            if text.startswith("DWORD#16#"):
                return f"0x{text[9:]}", "DWORD"
            bare = text.removeprefix("LREAL#")
            if "." in bare:
                wide = bare != text or float(np.float32(bare)) == float(bare)
                assert wide, f"{text} may be taken for a REAL, which it is not"
                return repr(float(bare)), "LREAL"
            return bare, "DINT"
        if text.upper() in ("TRUE", "FALSE"):
            self.take()
            return text.capitalize(), "BOOL"
        if text.upper() in FUNCTIONS:
            return self.standard(self.take().upper())
        if self.at + 1 < len(self.tokens) and self.tokens[self.at + 1][1] == "(":
            return self.own(self.take().lower())
        return self.variable()

    def standard(self, name: str) -> tuple[str, str]:
        self.take("(")
        text, found = self.expression()
        self.take(")")
        kind, result, _ = FUNCTIONS[name]
        assert found == kind or name == "ABS", f"{name} of {found}"
        return f"{name.lower()}({text})", found if name == "ABS" else result

    def own(self, name: str) -> tuple[str, str]:
        unit = self.units[name]  # declared before
        given = self.arguments(unit)
        assert len(given) == sum(v[3] == "VAR_INPUT" for v in unit.variables.values())
        return f"call('{name}', {', '.join(given)})", unit.result

    def arguments(self, unit: Unit) -> list[str]:
        given = []
        self.take("(")
        while self.next != ")":
            parameter = self.identifier()
            kind, size, _, section = unit.variables[parameter]
            assert section == "VAR_INPUT"
            self.take(":=")
            text, found = self.whole_array(size) if size else self.expression()
            assert found == kind, parameter
            given.append(f"{parameter.lower()}={text}")
            if self.next == ",":
                self.take()
        self.take(")")
        return given

    def whole_array(self, size: int) -> tuple[str, str]:
        name = self.identifier()
        assert self.unit.variables[name][1] == size
        return f"{name.lower()}_", self.unit.variables[name][0]

    def call(self, name: str, **given) -> Any:
        unit = self.units[name]
        own = {v.lower(): RUBBISH[kind] for v, (kind, *_) in unit.variables.items()} | given
        unit.python(own)
        return own[name]


class Instance:
    """A block with its variables: `memory` by name, and calls."""

    def __init__(self, unit: Unit):
        self.unit = unit
        self.memory: dict[str, Any] = {}
        for name, (kind, size, initial, _) in unit.variables.items():
            value = ZERO.get(kind) if initial is None else initial
            self.memory[name.lower()] = Items(value if isinstance(value, list) else [value] * size) if size else value

    def __getitem__(self, name: str) -> Any:
        return self.memory[name.lower()]

    def __call__(self, **inputs) -> None:
        """Take one sample."""
        for name, (kind, size, initial, section) in self.unit.variables.items():
            if section == "VAR" and initial is None:
                self.memory[name.lower()] = Items([RUBBISH[kind]] * size) if size else RUBBISH[kind]
        for name, value in inputs.items():
            _, size, _, section = self.unit.variables[self.unit.spelt[name]]
            assert section == "VAR_INPUT"
            self.memory[name] = Items(value) if size else value
        with np.errstate(all="ignore"):
            self.unit.python(self.memory)

    def numbers(self, names) -> np.ndarray:
        """Return variables as one row of numbers."""
        return np.concatenate([np.atleast_1d(np.array(self[name], float)) for name in names])


def instance(*texts: str, name: str) -> Instance:
    """Return an instance of a block that files declare."""
    return Instance(Parser("\n".join(texts)).units[name.lower()])
