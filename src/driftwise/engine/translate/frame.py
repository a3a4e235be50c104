"""What is known of a kernel while it is unfolded: its variables, and where those live that are no constants."""

from __future__ import annotations

from collections import Counter
from typing import Any

from .tree import Function, Let, Return, statements


class Frame:
    """A kernel that is being unfolded: what its variables are, and where those live that are not known."""

    def __init__(self, function: Function, into: tuple[Frame, str] | None = None):
        self.function, self.into = function, into
        self.values: dict[str, Any] = {}
        self.stored: dict[str, str] = {}
        self.pinned: set[str] = set()  # always a variable, never known: they change while a loop runs
        self.loops, self.returns_inside = 0, False
        self.results: list[Any] = []
        body = function.body
        self.lets = Counter(s.name for s in statements(body) if isinstance(s, Let))
        ends = sum(isinstance(s, Return) for s in statements(body))
        self.is_straight = ends == 0 or (ends == 1 and isinstance(body[-1], Return))
