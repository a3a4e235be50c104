"""Quantities that follow from parameters - a reproduction number, a time constant, a cost - and how sure they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from .roots import drawn

Quantity = Callable[[dict[str, float]], float]
NORMAL_95 = 1.959963984540054  # deviations either side of the mean that hold 95 % of a normal distribution
STEP = 1e-3  # deviations by which slopes are taken
BENT = 0.1  # of the half-width, by which a quantity may bend within it and still count as straight
KNOWN = 0.95  # of the draws that must have a value


class Derived(NamedTuple):
    """A quantity, its standard deviation and 95 % interval, and whether these are of draws, where it bends."""

    value: float
    std: float
    interval: tuple[float, float]
    is_sampled: bool


def derive(names: Sequence[str], values, covariance, quantities: Mapping[str, Quantity]) -> dict[str, Derived]:
    """Return quantities of parameters that are known by their joint normal law.

    First order (delta method: the slopes g give the variance g' P g) where the quantity is straight within the
    interval, along the direction that moves it most and along each parameter; else 8192 draws from a fixed seed, by the
    quantiles of which the interval is told, and NaN where more than one in twenty has no value. ``value`` is that of
    the estimate, not the mean of the draws.

    Examples
    --------
    >>> found = derive(["a", "b"], [0.5, 2.0], 1e-4 * np.eye(2), {"gain": lambda p: p["b"] / (1 - p["a"])})
    >>> found["gain"].value, round(found["gain"].std, 3), found["gain"].is_sampled
    (4.0, 0.082, False)
    """
    theta, P = np.asarray(values, float), np.asarray(covariance, float)
    return {name: _derive(name, f, list(names), theta, P) for name, f in quantities.items()}


def _derive(name: str, f: Quantity, names: list[str], theta, P) -> Derived:
    def of(row) -> float:
        try:
            return float(f(dict(zip(names, row.tolist()))))
        except KeyError as error:
            raise InputError(f"{name!r} asks for a parameter {error}; there are {', '.join(names)}.") from None
        except (ArithmeticError, ValueError):  # a division by zero, the logarithm of a negative number
            return math.nan

    value, size = of(theta), np.sqrt(np.maximum(np.diag(P), 0.0))
    if not np.isfinite(P).all():
        return Derived(value, math.inf, (-math.inf, math.inf), False)
    h = np.where(size > 0, STEP * size, 1.0)
    moves = np.diag(h) * (size > 0)
    g = np.array([of(theta + move) - of(theta - move) for move in moves]) / (2 * h)
    std = math.sqrt(max(float(g @ P @ g), 0.0))
    ways = [*(NORMAL_95 * np.diag(size)), *([NORMAL_95 * (P @ g) / std] if std > 0 else [])]
    bends = [abs(of(theta + side * way) - value - side * float(g @ way)) for way in ways for side in (-1, 1)]
    if all(bend <= BENT * NORMAL_95 * std for bend in bends):
        return Derived(value, std, (value - NORMAL_95 * std, value + NORMAL_95 * std), False)
    found = np.array([of(row) for row in drawn(theta, P, np.random.default_rng(0))])
    known = found[np.isfinite(found)]
    if len(known) < KNOWN * len(found):
        return Derived(value, math.nan, (math.nan, math.nan), True)
    low, high = np.quantile(known, [0.025, 0.975]).tolist()
    return Derived(value, float(np.sqrt(np.mean((known - value) ** 2))), (low, high), True)


def derived_columns(found: Sequence[Mapping[str, Derived]]) -> dict[str, Any]:
    """Return quantities of sample after sample as columns: name, name_std, name_low, name_high, (T,) each."""
    columns: dict[str, Any] = {}
    for name in found[0] if found else ():
        each = [one[name] for one in found]
        columns[name] = np.array([one.value for one in each])
        columns[f"{name}_std"] = np.array([one.std for one in each])
        columns[f"{name}_low"], columns[f"{name}_high"] = np.array([one.interval for one in each]).T
    return columns
