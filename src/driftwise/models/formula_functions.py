"""A plant in formulas from a Python function: its lines are read, never run, and become the same thing as a TOML's."""

from __future__ import annotations

import ast
import inspect
import json
import math
import textwrap
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from ..engine.errors import InputError
from .formulas import Formulas, read

GROUPS = ("x", "u", "p")  # whose members are the names of states, inputs and parameters


def from_function(
    function: Callable,
    *,
    states: Mapping[str, Mapping[str, Any]] | None = None,
    inputs: Mapping[str, Mapping[str, Any]] | None = None,
    outputs: Mapping[str, Mapping[str, Any]],
    parameters: Mapping[str, Mapping[str, Any]],
    tables: Mapping[str, Mapping[str, Any]] | None = None,
    time: str = "continuous",
) -> Formulas:
    """Return the plant that a Python function describes, as `read` does of the same lines in TOML.

    Parameters
    ----------
    function : lines ``name = formula``: ``dv1`` for the derivative of v1 by time, outputs, and steps on the way. Its
        arguments are names of states, inputs and parameters, in any order, or ``x, u, p``, whose members they are
        (``x.v1``, ``p.R0``, ``p["R0"]``). It is read, never run: formulas are what TOML has, with ``math.`` or ``np.``
        before functions, and what it returns is not looked at.
    states, inputs, outputs, parameters, tables : by name, as the sections of the TOML
    time : "continuous", or "discrete"

    Raises
    ------
    InputError
        Where a line does not fit; the message has it.

    Examples
    --------
    >>> def cell(x, u, p):
    ...     dv1 = (u.i - x.v1 / p.R1) / p.C1
    ...     v = p.R0 * u.i + x.v1
    ...     return dv1, v
    >>> plant = from_function(
    ...     cell, states={"v1": {"std": 0.1}}, inputs={"i": {}}, outputs={"v": {"noise": 1e-3}},
    ...     parameters={"R0": {"start": 0.01}, "R1": {"start": 0.01}, "C1": {"start": 1000}},
    ... )
    >>> plant.lines
    (('dv1', '(i - v1 / R1) / C1'), ('v', 'R0 * i + v1'))
    """
    name = getattr(function, "__name__", "plant")
    sections = {
        "states": states, "inputs": inputs, "outputs": outputs, "parameters": parameters, "tables": tables,
        "formulas": dict(_lines(function, name)),
    }  # fmt: skip
    parts = [f"name = {_toml(name)}", f"time = {_toml(time)}"]
    if function.__doc__:
        parts.append(f"about = {_toml(inspect.cleandoc(function.__doc__).splitlines()[0])}")
    for section, found in sections.items():
        if found:
            parts += [f"[{section}]", *(f"{key} = {_toml(value)}" for key, value in found.items())]
    return read("\n".join(parts) + "\n")


def _lines(function: Callable, name: str):
    """Yield left and right of each line."""
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError):
        raise InputError(
            f"{name}: its source is not to be had, and formulas are read from it: define it in a file or a notebook, "
            "or write the formulas as TOML"
        ) from None
    tree = ast.parse(source).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise InputError(f"{name} must be a function with lines name = formula, not a {type(tree).__name__}")
    for line in tree.body:
        if isinstance(line, ast.Return) or (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)):
            continue
        if not (isinstance(line, ast.Assign) and len(line.targets) == 1 and isinstance(line.targets[0], ast.Name)):
            _refuse(name, line)
        yield line.targets[0].id, ast.unparse(_Names().visit(line.value))


def _refuse(name: str, line: ast.stmt) -> NoReturn:
    first = ast.unparse(line).splitlines()[0]
    meant = {ast.If: "; a choice is a if condition else b", ast.For: "; loops are written out"}.get(type(line), "")
    raise InputError(f"{name}, line {line.lineno}: {first}: a plant has lines name = formula, and return{meant}")


class _Names(ast.NodeTransformer):
    """Members of x, u and p, and functions of math and NumPy, by their own names."""

    def visit_Attribute(self, node):
        return (
            ast.Name(node.attr) if isinstance(node.value, ast.Name) and node.value.id in (*GROUPS, *MODULES) else node
        )

    def visit_Subscript(self, node):
        is_own = isinstance(node.value, ast.Name) and node.value.id in GROUPS
        key = getattr(node.slice, "value", None)
        return ast.Name(key) if is_own and isinstance(key, str) else node


MODULES = ("math", "np", "numpy")


def _toml(value: Any) -> str:
    """Return a value as TOML writes it."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, str | bool):
        return json.dumps(value)
    if isinstance(value, list | tuple) or hasattr(value, "tolist"):
        return f"[{', '.join(_toml(float(one)) for one in value)}]"
    number = float(value)
    return repr(number) if math.isfinite(number) else str(number)
