"""Settings that several estimators have: kept as they came, and checked."""

from __future__ import annotations

from typing import Any

from ...engine.errors import InputError


def arguments(found: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of a constructor by name, in their order; ``found`` is ``locals()`` in its first line."""
    return {name: value for name, value in found.items() if name not in ("self", "__class__")}


def floor_of(value) -> float:
    """Return the relative round-off that y carries."""
    if not 0.0 <= value < 1.0:
        raise InputError(f"floor is a relative error, at least 0 and below 1, got {value!r}")
    return float(value)
