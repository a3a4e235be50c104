"""Units of formulas, lightly: sums of unlike things, and units of results, are seen; numbers fit anywhere."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from typing import Any

from ..engine.errors import InputError
from .derivatives import parsed

Kind = tuple[float, ...] | None  # powers of m, kg, s, A, K, mol; None: not known, which fits anywhere
NONE: Kind = (0.0,) * 6
BASE = {
    "m": (1, 0, 0, 0, 0, 0), "kg": (0, 1, 0, 0, 0, 0), "g": (0, 1, 0, 0, 0, 0), "s": (0, 0, 1, 0, 0, 0),
    "A": (0, 0, 0, 1, 0, 0), "K": (0, 0, 0, 0, 1, 0), "mol": (0, 0, 0, 0, 0, 1),
    "N": (1, 1, -2, 0, 0, 0), "J": (2, 1, -2, 0, 0, 0), "W": (2, 1, -3, 0, 0, 0), "Pa": (-1, 1, -2, 0, 0, 0),
    "V": (2, 1, -3, -1, 0, 0), "Ohm": (2, 1, -3, -2, 0, 0), "F": (-2, -1, 4, 2, 0, 0), "H": (2, 1, -2, -2, 0, 0),
    "C": (0, 0, 1, 1, 0, 0), "Hz": (0, 0, -1, 0, 0, 0), "degC": (0, 0, 0, 0, 1, 0), "rad": (0, 0, 0, 0, 0, 0),
    "deg": (0, 0, 0, 0, 0, 0), "1": (0, 0, 0, 0, 0, 0), "%": (0, 0, 0, 0, 0, 0), "l": (3, 0, 0, 0, 0, 0),
}  # fmt: skip
SCALED = {"min": "s", "h": "s", "d": "s", "Ah": "C", "Wh": "J", "bar": "Pa"}  # of the same kind, another size
PREFIX = "numkMGc"


def kind_of(unit: str) -> Kind:
    """Return the kind of a unit such as "N m/rad" or "m^2 s^-1"; None where it is not understood, or not in SI."""
    if not unit.strip():
        return None
    total, sign = [0.0] * 6, 1.0
    for part in re.findall(r"/|[^\s/*]+", unit.replace("·", " ").replace("(", " ").replace(")", " ")):
        if part == "/":
            sign = -1.0
            continue
        match = re.fullmatch(r"([A-Za-z%]+|1)(?:\^?(-?\d+(?:\.\d+)?))?", part)
        found = _base(match[1]) if match else None
        if match is None or found is None:
            return None
        power = sign * float(match[2] or 1)
        total = [a + power * b for a, b in zip(total, found)]
    return tuple(total)


def _base(word: str):
    if word in BASE:
        return BASE[word]
    word = SCALED.get(word, word)
    if word in BASE:
        return BASE[word]
    return BASE.get(word[1:]) if word[:1] in PREFIX else None


def check_units(plant: Any) -> None:
    """Raise InputError where a formula adds what cannot be added, or comes to another unit than it says."""
    kinds: dict[str, Kind] = {name: kind_of(unit) for name, unit in plant.units.items()}
    for left, right in plant.lines:
        where = f"{plant.name}: {left} = {right}"
        found = _Reader(kinds, where)(parsed(right, where))
        wanted = kinds.get(left)
        if left[:1] == "d" and left[1:] in plant.state_names:
            wanted = kinds[left[1:]]
            if wanted is not None and plant.is_continuous:
                wanted = (*wanted[:2], wanted[2] - 1, *wanted[3:])
        if found is not None and wanted is not None and found != wanted:
            raise InputError(f"{where}: the formula comes to {_said(found)}, and {left} is in {_said(wanted)}")
        if left not in kinds:
            kinds[left] = found


class _Reader:
    def __init__(self, kinds: dict[str, Kind], where: str):
        self.kinds, self.where = kinds, where

    def __call__(self, node) -> Kind:
        read: Callable | None = getattr(self, f"of_{type(node).__name__}", None)
        return read(node) if read else None

    def of_Name(self, node) -> Kind:
        return self.kinds.get(node.id)

    def of_UnaryOp(self, node) -> Kind:
        return self(node.operand)

    def of_BinOp(self, node) -> Kind:
        if isinstance(node.op, ast.Pow):
            base = self(node.left)
            power = getattr(node.right, "value", None)
            if base is None or not isinstance(power, int | float):
                return NONE if base == NONE else None
            return tuple(p * power for p in base)
        a, b = self(node.left), self(node.right)
        if isinstance(node.op, ast.Add | ast.Sub):
            return self.alike(node, a, b)
        sign = 1 if isinstance(node.op, ast.Mult) else -1
        a = NONE if isinstance(node.left, ast.Constant) else a
        b = NONE if isinstance(node.right, ast.Constant) else b
        return None if a is None or b is None else tuple(x + sign * y for x, y in zip(a, b))

    def alike(self, node, a: Kind, b: Kind) -> Kind:
        if a is not None and b is not None and a != b:
            raise InputError(f"{self.where}: {ast.unparse(node)} puts {_said(a)} and {_said(b)} together")
        return a if b is None else b

    def of_IfExp(self, node) -> Kind:
        self.of_Compare(node.test)
        return self.alike(node, self(node.body), self(node.orelse))

    def of_Compare(self, node) -> Kind:
        if isinstance(node, ast.Compare):
            self.alike(node, self(node.left), self(node.comparators[0]))
        return None

    def of_Call(self, node) -> Kind:
        name = getattr(node.func, "id", "")
        kinds = [self(a) for a in node.args]
        if name in ("exp", "log", "sin", "cos", "tanh") and kinds and kinds[0] not in (None, NONE):
            raise InputError(f"{self.where}: {ast.unparse(node)} of {_said(kinds[0])}, which needs a pure number")
        if name in ("min", "max") and len(kinds) == 2:
            return self.alike(node, *kinds)
        if name == "sqrt" and kinds[0] is not None:
            return tuple(p / 2 for p in kinds[0])
        return {"abs": kinds[0] if kinds else None, "sign": NONE}.get(name, NONE if name in ("exp", "sin") else None)


def _said(kind: Kind) -> str:
    if kind is None or kind == NONE:
        return "a pure number"
    names = ("m", "kg", "s", "A", "K", "mol")
    return " ".join(n if p == 1 else f"{n}^{p:g}" for n, p in zip(names, kind) if p)
