"""A plant in formulas as kernels: what it does and how that depends on everything, compiled, plain Python alike."""

from __future__ import annotations

import hashlib
from collections import namedtuple
from functools import cache
from typing import Any

import numpy as np

from ..engine import compile, elementary
from ..engine.dispatch import Vector, choice, kernel, pass_over, written
from . import primitives
from .formulas import Formulas


@choice
def move(plant, x, u, theta, dx, slopes):
    """Fill dx/dt (discrete: the next x), and its slopes (n, n + k + m) by x, u and theta."""


@choice
def show(plant, x, u, theta, y, slopes):
    """Fill the outputs y, and their slopes (p, n + k + m) by x, u and theta."""


@kernel
def evaluate_rows(plant, rows, q, kept, out, numbers):
    """Evaluate each row [x, u, theta] into [dx, y, slopes of dx, slopes of y]; all are of one plant."""
    n, k, p = int(plant.n), int(plant.k), int(plant.p)
    width = rows.shape[1]
    for t in range(rows.shape[0]):
        x, u, theta = rows[t, :n], rows[t, n : n + k], rows[t, n + k :]
        at, end = n + p, n + p + n * width
        move(plant, x, u, theta, out[t, :n], out[t, at:end].reshape(n, width))
        show(plant, x, u, theta, out[t, n:at], out[t, end : end + p * width].reshape(p, width))


def kernels_of(plant: Formulas) -> Any:
    """Return a plant as kernels know it: a named tuple of its sizes and numbers, whose type has its formulas."""
    kind = _kind(plant.text, *(_source(plant, which) for which in ("states", "outputs")))
    return kind(plant.n, plant.inputs, plant.p, np.array(plant.constants), np.array(plant.points))


def evaluate(plant: Formulas, x, u, theta) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return dx (n,), y (p,) and their exact slopes (n, n + k + m) and (p, n + k + m) by x, u and the parameters.

    Examples
    --------
    >>> from driftwise.models.formulas import read
    >>> dx, y, of_dx, of_y = evaluate(read("battery"), x=[0.02, 3.7], u=[1.0], theta=[0.01, 0.01, 2000.0])
    >>> dx.tolist(), y.round(6).tolist()
    ([-0.0005, 0.0], [3.73])
    """
    row = np.concatenate([np.ravel(v).astype(float) for v in (x, u, theta)])[None]
    n, p, width = plant.n, plant.p, row.shape[1]
    task: Any = kernels_of(plant)
    kind: Any = type(task)
    if width != plant.n + plant.inputs + len(plant.names):
        raise ValueError(f"{plant.name} has {plant.n} states, {plant.inputs} inputs and {len(plant.names)} parameters")
    out, nothing = np.zeros((1, (n + p) * (1 + width))), np.zeros((1, 0))
    spec = compile.dispatch.flatten([task])
    compile.passage(kind)(row, nothing, nothing, out, np.zeros(0), spec)
    values, slopes = out[0, : n + p], out[0, n + p :].reshape(n + p, width)
    return values[:n], values[n:], slopes[:n], slopes[n:]


def _source(plant: Formulas, which: str) -> str:
    """Return the text of a kernel."""
    lines, values = plant.written(which, True)
    width = plant.N + plant.inputs
    name = "move" if which == "states" else "show"
    body = [*lines]
    for i, value in enumerate(values):
        body.append(f"values[{i}] = {value.text}")
        body += [f"slopes[{i}, {j}] = {value.slopes.get(str(j), '0.0')}" for j in range(width)]
    return "\n".join([f"def {name}(plant, x, u, theta, values, slopes):", *(f"    {line}" for line in body)])


@cache
def _kind(text: str, states: str, outputs: str) -> type:
    """Return the type of a plant's policy, its kernels registered; named by what it says, so that no two are alike."""
    digest = hashlib.sha256("\n".join((text, states, outputs)).encode()).hexdigest()[:16]
    fields = {"n": float, "k": float, "p": float, "constants": Vector, "points": Vector}
    kind: Any = namedtuple(f"Plant_{digest}", list(fields), module=__name__)  # type: ignore[misc]  # one of many
    kind.__annotations__ = fields
    scope = {name: getattr(elementary, name) for name in elementary.__all__} | {
        name: getattr(primitives, name)
        for name in ("root", "signum", "hyperbolic_tangent", "divided", "table_value", "table_slope")
    }
    for question, source in ((move, states), (show, outputs)):
        function = written(source, question.__name__, {**scope, "__name__": __name__})
        function.__qualname__ += f"_{digest}"
        question.on(kind)(function)
    pass_over.on(kind)(evaluate_rows)
    return kind
