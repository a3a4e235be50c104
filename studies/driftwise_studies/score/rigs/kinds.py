"""The kinds of rigs by name: functions that draw a record."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

KINDS: dict[str, Callable[..., Any]] = {}


def kind(draw):
    """Write a kind down under the name of the function that draws it."""
    KINDS[draw.__name__] = draw
    return draw
