"""One sample of an estimator as C: its step translated with sizes, policies and settings known."""

from __future__ import annotations

from collections import Counter
from typing import Any, get_type_hints

import numpy as np

from ..engine.dispatch import PerParameter, Vector, advance, open_row, open_scratch, written
from ..engine.recovery import is_sound, settle
from ..engine.translate import prelude
from ..engine.translate.bodies import reachable
from ..engine.translate.c99 import Printer
from ..engine.translate.program import Program
from ..engine.translate.tree import Constant, Function, statements
from ..engine.translate.types import FLOAT, INT, Several, View
from . import single

LONG = 20  # statements that may be written out once more to save a call
TYPES = """\
typedef {number} F;
typedef int32_t I;
typedef uint{bits}_t U;
#if defined(__cplusplus)
typedef bool B;
#else
typedef _Bool B;
#endif"""


def settled(policies) -> tuple[dict[str, Any], list[str], np.ndarray]:
    """Return names and values of all numbers of the policies, the lines that make them, and the vectors in one row.

    A number is a constant of the code, so that sizes, branches and what follows from settings are worked out here; a
    vector is a stretch of a constant table.
    """
    used = dict(open_row=open_row, open_scratch=open_scratch, advance=advance, is_sound=is_sound, settle=settle)
    names: dict[str, Any] = {"__name__": __name__, **used}
    lines: list[str] = []
    table: list[float] = []
    for i, policy in enumerate(policies):
        kind, fields = type(policy), []
        names[f"kind_{i}"] = kind
        for field, hint in zip(kind._fields, get_type_hints(kind, include_extras=True).values()):
            value = getattr(policy, field)
            if hint in (Vector, PerParameter):
                values = np.ravel(value).astype(float).tolist()
                fields.append(f"settings[{len(table)}:{len(table) + len(values)}]")
                table += values
            else:
                names[f"{field}_{i}"] = float(value)
                fields.append(f"{field}_{i}")
        lines.append(f"policy_{i} = kind_{i}({', '.join(fields)})")
    return names, lines, np.array(table)


def step(policies, outputs: int) -> tuple[Function, np.ndarray]:
    """Return the step of an estimator with these policies as a typed tree, and its table of settings.

    As in the loops of this machine a state that is poisoned begins afresh, and takes the sample again (`recovery`).
    """
    names, lines, table = settled(policies)
    given = ", ".join(f"policy_{i}" for i in range(1, len(policies)))
    text = [
        "def one_sample(row, work, settings, fresh, y, u, out):",
        '    """Take one sample."""',
        *(f"    {line}" for line in lines),
        "    scratch = open_scratch(policy_0, work)",
        "    state = open_row(policy_0, row)",
        "    count, clock, is_taken = -1.0, 0.0, False",
        "    while not is_taken:",
        f"        advance(policy_0, {given}, state, scratch, y, u, out, 0)",
        "        is_taken = True",
        f"        if count >= 0.0 or not is_sound(out[0], {outputs}):",
        f"            count, clock = settle(row, fresh, out[0], {outputs}, count, clock)",
        "            is_taken = count < 0.0",
    ]
    function = written("\n".join(text), "one_sample", names)
    row, table_of = View(1), View(2)
    return Program().function(function, [row, row, row, row, table_of, table_of, table_of]), table


class ControllerPrinter(Printer):
    """C for a controller: integers of 32 bits, numbers of 64 or 32, and only the help that is needed."""

    shifts = False  # nothing that has a sign (MISRA C:2012, 10.1)

    def __init__(self, is_single: bool = False):
        super().__init__()
        self.is_single = is_single
        self.texts = prelude.TEXTS | OWN | (single.TEXTS if is_single else {})

    def print_Constant(self, value: Constant) -> tuple[str, int]:
        """A number; in single precision a threshold beyond its range is the one that stands for it there."""
        if not self.is_single or not (value.type == FLOAT or isinstance(value.value, float)):
            return super().print_Constant(value)
        number = single.rounded(float(value.value))
        text, binds = super().print_Constant(Constant(FLOAT, number))
        return (f"{text}F" if text[-1].isdigit() else text), binds

    def zero(self, kind) -> str:
        """Return what a variable holds before it has a value."""
        return "0.0F" if self.is_single and kind == FLOAT else super().zero(kind)

    def number(self, value: float) -> str:
        """Return a number as it stands in a table."""
        return self.print_Constant(Constant(FLOAT, value))[0]

    def numbers(self, values) -> str:
        """Return the lines of a table."""
        texts = [self.number(float(value)) for value in values]
        return ",\n".join("    " + ", ".join(texts[i : i + 4]) for i in range(0, len(texts), 4))

    def text(self, entry: Function) -> str:
        """Return everything that a step needs, and the step; what is long and called often is not written out often."""
        functions = reachable(entry)
        calls = Counter(called.name for function in functions for called in function.calls)
        bodies = []
        for function in functions:
            text, often = self.function(function), calls[function.name] - 1
            if often * len(statements(function.body)) > LONG:
                text = text.replace("static DW_INLINE ", "static ", 1)
            bodies.append(text)
        pairs = [name for kind, name in self.types.items() if kind == Several((FLOAT, INT))]
        helps = {name: self.texts[name] for name in self.texts if name in self.needs}
        after = [helps.pop(name).replace("PAIR", pairs[0]) for name in prelude.AFTER_TYPES if name in helps]
        tables = [
            f"static const {self.type(kind)} {name}[{len(table)}] = {{\n{self.numbers(table)}\n}};"
            for (kind, table), name in self.tables.items()
        ]
        types = TYPES.format(number="float", bits=32) if self.is_single else TYPES.format(number="double", bits=64)
        return "\n\n".join([types, *helps.values(), *self.type_texts, *after, *tables, *bodies])


# Nothing is included; what is not finite is a constant, so that tables may hold it too.
OWN = {
    "dw_at": "#define dw_at(i, n) (i)",
    "dw_sqrt": """\
#if defined(__GNUC__) || defined(__clang__)
#define dw_sqrt(x) __builtin_sqrt(x)
#else
double sqrt(double x);
#define dw_sqrt(x) sqrt(x)
#endif""",
    "DW_NAN": """\
#if defined(__GNUC__) || defined(__clang__)
#define DW_NAN ((F)__builtin_nan(""))
#define DW_INF ((F)__builtin_inf())
#else
#define DW_INF ((F)(1e300 * 1e300))
#define DW_NAN (DW_INF - DW_INF)
#endif""",
    "DW_INF": "",
}
