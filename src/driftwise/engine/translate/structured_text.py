"""Print an unfolded kernel as Structured Text (IEC 61131-3): one FUNCTION_BLOCK, and FUNCTIONs of numbers.

What is written keeps to what the dialects share: LREAL, DINT, BOOL, arrays, IF, FOR, WHILE, EXIT, RETURN; AND and OR
that evaluate both sides; no pointers, no methods, no CONTINUE, no constants that are infinite or not a number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .st_statements import Set, about_something, comment, folded, lines
from .st_tidy import reads, tidy, writes
from .st_values import INFINITY, NAN, Array, literal
from .types import BOOL, FLOAT, INT, Scalar
from .unfold import Unfold

TYPES = {FLOAT: "LREAL", INT: "DINT", BOOL: "BOOL"}
RESERVED = set(
    """abs acos action add and any array asin at atan bool by byte cal calc case char concat constant continue cos d
    date delete dint div do dt dword else elsif end eq exit exp expt
    f_edge false find for from function gcd ge goto gt if in
    index initial_step insert int interval jmp l ld le left len limit lint ln log lower_bound lreal lt lword max method
    mid min mod move mul mux n name namespace ne neg not null of on or override p pi program public private r r_edge
    read_only read_write real ref ref_to repeat replace resource restart retain return right rol ror s sel shl shr sin
    single sint sizeof sl sqrt st step string struct sub super task tan then this time to tod transition true trunc type
    udint uint ulint union until upper_bound usint using var while with word wstring xor c i q m t""".split()
) - {"i", "m"}  # fmt: skip
HELPERS = {
    "ldexp": """\
(* x times 2 to the power e; rounded once. *)
FUNCTION {name} : LREAL
VAR_INPUT
    x : LREAL;
    e : DINT;
END_VAR
VAR
    y, power, factor : LREAL;
    k : DINT;
END_VAR
y := x;
k := e;
IF k > 1023 THEN
    y := y * LREAL#8.98846567431158E307;
    k := k - 1023;
    IF k > 1023 THEN
        y := y * LREAL#8.98846567431158E307;
        k := k - 1023;
        IF k > 1023 THEN
            k := 1023;
        END_IF;
    END_IF;
ELSIF k < -1022 THEN
    y := y * LREAL#2.004168360008973E-292;
    k := k + 969;
    IF k < -1022 THEN
        y := y * LREAL#2.004168360008973E-292;
        k := k + 969;
        IF k < -1022 THEN
            k := -1022;
        END_IF;
    END_IF;
END_IF;
factor := 2.0;
IF k < 0 THEN
    factor := 0.5;
    k := -k;
END_IF;
power := 1.0;
WHILE k > 0 DO
    IF k MOD 2 = 1 THEN
        power := power * factor;
    END_IF;
    k := k / 2;
    IF k > 0 THEN
        factor := factor * factor;
    END_IF;
END_WHILE;
{name} := y * power;
END_FUNCTION
""",
    "exponent": """\
(* The exponent e of x = f 2^e, f from 0.5 to below 1; 0 where x is zero or no finite number. *)
FUNCTION {name} : DINT
VAR_INPUT
    x : LREAL;
END_VAR
VAR
    a, factor : LREAL;
    e, k : DINT;
END_VAR
a := ABS(x);
e := 0;
IF (a > 0.0) AND (a <= LREAL#1.7976931348623157E308) THEN
    IF a < LREAL#1.0E-300 THEN
        a := a * 1.8014398509481984E16;
        e := -54;
    END_IF;
    k := 512;
    factor := LREAL#1.3407807929942597E154;
    WHILE k > 0 DO
        IF a >= factor THEN
            a := a / factor;
            e := e + k;
        ELSIF a * factor < 1.0 THEN
            a := a * factor;
            e := e - k;
        END_IF;
        factor := SQRT(factor);
        k := k / 2;
    END_WHILE;
    IF a >= 1.0 THEN
        e := e + 1;
    END_IF;
END_IF;
{name} := e;
END_FUNCTION
""",
}


class Names:
    """Names that the language allows: upper and lower case are one, none begins or ends with an underscore."""

    def __init__(self, unit: str, taken=(), prefix: str = ""):
        self.unit, self.prefix = unit, prefix or unit
        self.fixed = {name.lower() for name in (*taken, unit, NAN, INFINITY)}

    def local(self, title: str, count: int = 1) -> str:
        """Return a name for a variable; the ``count``-th of this title."""
        name = "_".join(filter(None, title.split("_")))
        name = f"t{name}" if name[0].isdigit() else name
        name = f"v_{name}" if name.lower() in RESERVED else name
        return name if count == 1 else f"{name}_{count}"

    def is_taken(self, name: str, variables) -> bool:
        """Say whether something else has this name; a variable of another spelling does."""
        lower = name.lower()
        return lower in self.fixed or (name not in variables and lower in {v.lower() for v in variables})

    def array(self, title: str) -> str:
        """Return a name for an array: nothing else gets it."""
        name = "_".join(filter(None, title.split("_")))
        name = f"a_{name}" if name.lower() in RESERVED or len(name) == 1 else name
        found = name
        while found.lower() in self.fixed:
            found = f"own_{found}"
        self.fixed.add(found.lower())
        return found

    def helper(self, title: str) -> str:
        """Return the name of a function."""
        return f"{self.prefix}_{title}"

    def unit_of(self, title: str) -> Names:
        """Return the names inside a function."""
        return Names(self.helper("_".join(filter(None, title.split("_")))), prefix=self.prefix)


@dataclass
class Section:
    """A list of declarations: VAR_INPUT and the like, and (name, type with initial value, what it is)."""

    head: str
    items: list[tuple[str, str, str]] = field(default_factory=list)

    def __iter__(self) -> Iterator[str]:
        if not self.items:
            return
        yield self.head
        for name, kind, about in self.items:
            yield from folded(f"    {name} : {kind};" + f" (* {comment(about)} *)" * bool(about))
        yield "END_VAR"


def array_type(size: int, element: str = "LREAL", values=()) -> str:
    """Return the type of an array, or of a single number; with its initial values."""
    numbers = ", ".join(literal(FLOAT, value) for value in values)
    if size == 1:
        return element + f" := {numbers}" * bool(numbers)
    return f"ARRAY[0..{size - 1}] OF {element}" + f" := [{numbers}]" * bool(numbers)


def variables(kinds: dict[str, Scalar], used: set[str]) -> Iterator[tuple[str, str, str]]:
    """Yield declarations of the variables that are used, one of each kind."""
    for kind, name in TYPES.items():
        names = [variable for variable, own in kinds.items() if own == kind and variable in used]
        if names:
            yield ", ".join(names), name, ""


def non_finite(used: set[str]) -> list[Any]:
    """Return the statements that make what has no literal."""
    if not used & {NAN, INFINITY}:
        return []
    return [
        Set(INFINITY, literal(FLOAT, 1e308), INFINITY),
        Set(INFINITY, f"{INFINITY} * 10.0", INFINITY),
        Set(NAN, f"{INFINITY} - {INFINITY}", NAN),
    ]


def functions_of(unit: Unfold) -> Iterator[str]:
    """Yield the functions that a unit calls, those called first."""
    for title in ("ldexp", "exponent"):
        if title in unit.functions:
            yield HELPERS[title].format(name=unit.names.helper(title))
    for found in unit.functions.values():
        if found is not None:
            yield "\n".join(function_text(*found)) + "\n"


def function_text(unit: Unfold, inputs: list[str], function: Any) -> Iterator[str]:
    """Yield the lines of a function of numbers."""
    name = unit.names.unit
    block = unit.block[:-1] if getattr(unit.block[-1], "text", "") == "RETURN" else unit.block
    block = tidy(block, {name})
    block = about_something(tidy([*non_finite(reads(block)), *block], {name}))
    used = reads(block) | writes(block)
    yield f"(* {comment(function.title)} *)"
    yield f"FUNCTION {name} : {TYPES[function.result]}"
    yield from Section("VAR_INPUT", [(v, TYPES[unit.kinds[v]], "") for v in inputs])
    own = {v: kind for v, kind in unit.kinds.items() if v not in inputs}
    own |= dict.fromkeys(sorted(used & {NAN, INFINITY}), FLOAT)
    yield from Section("VAR", list(variables(own, used)))
    yield from lines(block)
    yield "END_FUNCTION"


def arrays_of(region, head: str, kept: bool = False) -> Section:
    """Return the declarations of a region's arrays; those that nobody uses are left out unless ``kept``."""
    section = Section(head)
    for array in region.arrays:
        if array.is_used or kept:
            section.items += list(array_items(array, region.values))
    return section


def array_items(array: Array, values) -> Iterator[tuple[str, str, str]]:
    """Yield the declaration of an array, or of the numbers that have names of their own."""
    if array.labels:
        yield from ((label, "LREAL", "") for label in array.labels)
        return
    known = values[array.start : array.start + array.size] if values is not None else ()
    yield array.name, array_type(array.size, values=[v if np.isfinite(v) else 0.0 for v in known]), ""


def infinite_settings(region) -> Iterator[Set]:
    """Yield statements that set what of known numbers has no literal."""
    for array in region.arrays:
        for i, value in enumerate(region.values[array.start : array.start + array.size]):
            if array.is_used and not np.isfinite(value):
                yield Set(f"{array.name}[{i}]" if array.size > 1 else array.name, literal(FLOAT, value))
