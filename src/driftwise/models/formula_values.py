"""A plant's formulas taken one after the other in plain Python: which one gives no number, and from what."""

from __future__ import annotations

import ast
import math
from typing import Any

import numpy as np

from .derivatives import CONSTANTS, parsed

_SCALAR: dict[str, Any] = {
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "sin": math.sin, "cos": math.cos, "tanh": math.tanh,
    "abs": abs, "sign": lambda x: math.copysign(1.0, x) if x else 0.0, "min": min, "max": max, **CONSTANTS,
}  # fmt: skip


def undefined(plant: Any, x, u, theta) -> str:
    """Return which formula gives no number at a point, and what it was given; "" where all do.

    Examples
    --------
    >>> from driftwise.models.formulas import read
    >>> undefined(read("battery"), [0.0, 3.7], [1.0], [0.01, 0.0, 2000.0])
    'dv1 = (i - v1 / R1) / C1 gives no number at i = 1, v1 = 0, R1 = 0, C1 = 2000'
    """
    given = [*zip(plant.state_names, x), *zip(plant.input_names, u), *zip(plant.names, theta)]
    known = {name: float(value) for name, value in given} | {one.name: one.start for one in plant.fixed}
    tables = {name: lambda at, xs=xs, ys=ys: float(np.interp(at, xs, ys)) for name, (xs, ys) in plant.tables.items()}
    for left, right in plant.lines:
        tree = parsed(right, left)
        try:
            scope = {"__builtins__": {}, **_SCALAR, **tables}
            value = float(eval(compile(ast.Expression(tree), left, "eval"), scope, known))
        except (ArithmeticError, ValueError, TypeError):
            value = math.nan
        if not math.isfinite(value):
            used = dict.fromkeys(n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id in known)
            order = [n for n in _in_order(right) if n in used]
            said = ", ".join(f"{name} = {known[name]:.6g}" for name in dict.fromkeys(order))
            return f"{left} = {right} gives no number at {said}" if said else f"{left} = {right} gives no number"
        known[left] = value
    return ""


def _in_order(text: str) -> list[str]:
    """Return the names of a formula as one reads them."""
    names = [n for n in ast.walk(ast.parse(text.strip(), mode="eval")) if isinstance(n, ast.Name)]
    return [n.id for n in sorted(names, key=lambda n: (n.lineno, n.col_offset))]
