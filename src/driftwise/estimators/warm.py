"""Compile ahead, so that the first estimate of a process starts at once."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

from ..detect.gate import Gate
from ..memory.drift import Never, Walk
from ..models.noise import EquationError, NoisePolynomial, OutputError
from .joint import Joint


def combinations() -> list[dict[str, Any]]:
    """Return the settings that select different code: noise, memory, gate, and known or learnt scale."""
    kinds: tuple[Any, ...] = (OutputError, EquationError, lambda v: NoisePolynomial((0.0,), v))
    return [
        dict(noise=noise(variance), memory=memory, gate=gate)
        for noise, variance, memory, gate in product(
            kinds,
            (None, 1.0),
            (Never(), Walk(1e-6)),
            (None, Gate()),
        )
    ]


def warm() -> Iterator[str]:
    """Compile one combination after the other and yield its name."""
    for settings in combinations():
        est = Joint(1, **settings)
        est.update(est.start(), 0.0)
        yield repr(est)
