"""Structured Text: its words and signs, its functions, its arithmetic, arrays and units, for the interpreter."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

TOKEN = re.compile(
    r"\s+|\(\*.*?\*\)|(?P<number>(?:LREAL#-?)?\d+\.\d+(?:E-?\d+)?|DWORD#16#[0-9A-F]+|\d+(?!\.\d))|(?P<word>[A-Za-z][A-Za-z_0-9]*)"
    r"|(?P<sign>:=|<=|>=|<>|\.\.|\.|[-+*/()\[\],;:<>=])",
    re.DOTALL,
)
KEYWORDS = set(
    """function end_function function_block end_function_block var var_input var_output end_var retain array of if then
    elsif else end_if for to by do end_for while end_while exit return and or not mod true false lreal dint bool
    dword""".split()
)
# words that a dialect may take for its own: no identifier may be one
FORBIDDEN = set("at step r_edge f_edge n r s l d p t q c len left right mid find min max log ln exp sqrt".split())
FUNCTIONS = {
    "ABS": ("LREAL", "LREAL", abs), "SQRT": ("LREAL", "LREAL", lambda x: math.sqrt(x) if x >= 0 else math.nan),
    "TRUNC": ("LREAL", "DINT", int), "DINT_TO_LREAL": ("DINT", "LREAL", float),
    "DINT_TO_DWORD": ("DINT", "DWORD", lambda n: n & 0xFFFFFFFF),
    "DWORD_TO_DINT": ("DWORD", "DINT", lambda n: n - 2**32 if n >= 2**31 else n),
}  # fmt: skip
RUBBISH = {"LREAL": -7.0e77, "DINT": -987654321, "BOOL": True}
ZERO = {"LREAL": 0.0, "DINT": 0, "BOOL": False}


def quotient(a, b):
    """Return a / b of doubles."""
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def whole(a, b):
    """Return a / b of integers."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def rest(a, b):
    """Return a MOD b."""
    return a - whole(a, b) * b


class Items(list):
    """An array; an index outside of it is an error, also a negative one."""

    def __getitem__(self, i):
        assert 0 <= i < len(self), f"index {i} of {len(self)}"
        return list.__getitem__(self, i)

    def __setitem__(self, i, value):
        assert 0 <= i < len(self), f"index {i} of {len(self)}"
        list.__setitem__(self, i, value)


class Unit:
    """A FUNCTION or FUNCTION_BLOCK: declarations, and its body as Python."""

    def __init__(self, name: str, result: str | None):
        self.name, self.result = name, result
        self.variables: dict[str, tuple[str, int, Any, str]] = {}  # type, size (0: no array), initial value, section
        self.spelt: dict[str, str] = {}
        self.python: Any = None
