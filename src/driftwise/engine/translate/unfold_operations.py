"""Unfold operations of one number: signs, conversions, roots, exponents."""

from __future__ import annotations

import math
from typing import Any

from ..elementary.pairs import ROOT_HALF, about_one
from .st_statements import Set, Test
from .st_values import ATOM, EQUAL, ORDER, SIGN, SUM, Number, Table, add, known, literal
from .types import BOOL, FLOAT, INT


class Operations:
    """What an operation of one number is. `Values` has those of two, and what they are of."""

    block: list[Any]
    names: Any
    spare: Any
    set: Any
    kept: Any
    functions: dict[str, Any]
    target: Any
    way: Any
    binary: Any
    refuse: Any

    def op_neg(self, a: Number, node, into) -> Number:
        """``-a``."""
        if a.is_known:
            return Number(a.kind, value=-a.value)
        if a.kind == INT:
            return add(known(0), a, -1)
        return Number(a.kind, f"-{a.within(ATOM)}", 0, SUM, a.is_safe)

    def op_not(self, a: Number, node, into) -> Number:
        """``not a``."""
        return known(not a.value) if a.is_known else Number(BOOL, f"NOT {a.within(ATOM)}", 0, SIGN, a.is_safe)

    def op_float(self, a: Number, node, into) -> Number:
        """A number as a float."""
        if a.is_known:
            return known(float(a.value))
        if a.kind == INT:
            return Number(FLOAT, f"DINT_TO_LREAL({a.within()})", is_safe=a.is_safe)
        return self.either(a, known(1.0), known(0.0), into)

    def op_int(self, a: Number, node, into) -> Number:
        """A number as an integer, towards zero."""
        if a.is_known:
            return known(int(a.value))
        if a.kind == FLOAT:
            return Number(INT, f"TRUNC({a.within()})", is_safe=False)
        return self.either(a, known(1), known(0), into)

    def either(self, test: Number, a: Number, b: Number, into) -> Number:
        """One of two numbers."""
        target = self.target(a.kind, into)
        self.block.append(Test(test.within(), self.way(target, None, a), self.way(target, None, b)))
        return target

    def op_bool(self, a: Number, node, into) -> Number:
        """Whether it is not zero."""
        return known(bool(a.value)) if a.is_known else self.binary("!=", a, known(0 if a.kind == INT else 0.0), BOOL)

    def op_abs(self, a: Number, node, into) -> Number:
        """The size of a number."""
        return known(abs(a.value)) if a.is_known else Number(a.kind, f"ABS({a.within()})", is_safe=a.is_safe)

    def op_sqrt(self, a: Number, node, into) -> Number:
        """A root."""
        return known(math.sqrt(a.value)) if a.is_known else Number(FLOAT, f"SQRT({a.within()})", is_safe=False)

    def op_isfinite(self, a: Number, node, into) -> Number:
        """Whether it is neither infinite nor not a number."""
        a = a if a.is_plain else self.kept(a)
        return known(math.isfinite(a.value)) if a.is_known else Number(BOOL, f"{a.text} - {a.text} = 0.0", 0, EQUAL)

    def op_isnan(self, a: Number, node, into) -> Number:
        """Whether it is not a number."""
        a = a if a.is_plain else self.kept(a)
        return known(math.isnan(a.value)) if a.is_known else Number(BOOL, f"{a.text} <> {a.text}", 0, EQUAL)

    def op_copysign(self, a: Number, b: Number, node, into) -> Number:
        """A constant with the sign of a number (zero has none)."""
        if not a.is_known:
            self.refuse("the sign of one number on another")
        return self.either(
            Number(BOOL, f"{b.within(SUM)} < 0.0", 0, ORDER), known(-abs(a.value)), known(abs(a.value)), into
        )

    def op_strided(self, a: Table, node, into) -> Table:
        """A stretch as if it were a column."""
        return Table(a.region, a.at, a.sizes, known(1), a.array)

    def op_ldexp(self, a: Number, n: Number, node, into) -> Number:
        """``a 2^n``."""
        if a.is_known and n.is_known:
            return known(math.ldexp(a.value, n.value))
        self.functions["ldexp"] = None
        return Number(FLOAT, f"{self.names.helper('ldexp')}(x := {a.within()}, e := {n.within()})", is_safe=False)

    def op_frexp(self, a: Number, node, into) -> tuple[Number, Number]:
        """The fraction and the exponent of a number."""
        if a.is_known:
            return known(math.frexp(a.value))
        self.functions["exponent"] = self.functions["ldexp"] = None
        a = a if a.is_plain else self.kept(a)
        e = self.kept(Number(INT, f"{self.names.helper('exponent')}(x := {a.within()})"))
        return Number(FLOAT, f"{self.names.helper('ldexp')}(x := {a.within()}, e := -{e.text})"), e

    def op_about_one(self, a: Number, node, into) -> tuple[Number, Number]:
        """The same, the fraction between the roots of 1/2 and of 2."""
        if a.is_known:
            return known(about_one(a.value))
        fraction, exponent = self.op_frexp(a, node, into)
        m, k = self.spare(FLOAT), self.spare(INT)
        self.set(m, fraction)
        self.set(k, exponent)
        low = [Set(m.text, f"{m.text} + {m.text}", m.text), Set(k.text, f"{k.text} - 1", k.text)]
        self.block.append(Test(f"{m.text} < {literal(FLOAT, ROOT_HALF)}", low))
        return m, k

    def op_floor(self, a: Number, node, into) -> Number:
        """The largest integer below."""
        a, found = self.kept(a), self.spare(INT)
        self.set(found, Number(INT, f"TRUNC({a.text})"))
        self.block.append(
            Test(f"DINT_TO_LREAL({found.text}) > {a.text}", [Set(found.text, f"{found.text} - 1", found.text)])
        )
        return found
