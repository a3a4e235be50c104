"""Compile ahead, so that the first estimate of a process starts at once."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

from ..detect.gate import Gate
from ..kernel import compose
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


def prune() -> None:
    """Delete cached code older than the newest engine source: no fingerprint asks for it any more."""
    root = Path(compose.__file__).parent
    newest = max(path.stat().st_mtime for path in root.parent.rglob("*.py"))
    for path in (root / "__pycache__").glob("compose.*.nbc"):
        if path.stat().st_mtime < newest:
            path.unlink(missing_ok=True)


def warm() -> Iterator[str]:
    """Compile one combination after the other and yield its name."""
    prune()
    for settings in combinations():
        est = Joint(1, **settings)
        est.update(est.start(), 0.0)
        yield repr(est)
